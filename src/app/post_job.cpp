#include "app/post_job.hpp"

#include <array>
#include <utility>

#include "trunnion/base/number_text.hpp"

namespace trunnion::app {
namespace {

// Who is to write which variable of the control.
void run_time_lines(const PostCliOptions& o, const nc::Controller& controller,
                    const post::RunTimeDrift* drift, std::vector<std::string>& out) {
  const auto& r = controller.run_time;
  // Comments of some controls cannot hold the '#' of a variable.
  const bool can_say = controller.comments.characters.find(r.variable) != std::string::npos;
  const std::string before = can_say ? r.variable : "var ";
  const auto name = [&](std::int64_t number) { return before + std::to_string(number); };
  const auto three = [&](const std::array<std::int64_t, 3>& v) {
    return name(v[0]) + ", " + name(v[1]) + ", " + name(v[2]);
  };
  const std::string what = "deviation of the tool from the part in mm, machine X, Y, Z";
  out.push_back("thermal drift at run time, at most " + shortest_text(o.thermal_output.limits.clamp_um) +
                " um an axis, followed at rapids by at most " +
                shortest_text(o.thermal_output.limits.slew_um_s) + " um/s");
  if (drift == nullptr) {
    out.push_back(three(r.source) + ": " + what + " unless the offsets were those of the part, 0 is off");
    return;
  }
  const auto& t = controller.run_time_temperatures;
  out.push_back("calculated from the rises since this program began, by " + o.thermal_model);
  for (std::size_t i = 0; i < drift->sensors.size(); ++i) {
    out.push_back(name(t.first + static_cast<std::int64_t>(i)) + ": temperature " + drift->sensors[i] +
                  " in degC, settled over 5 min");
  }
  out.push_back("after a measurement: " + three(t.measured) + " get the " + what + ", " +
                name(t.first_reference) + " and on the temperatures of then");
}

std::vector<std::string> header_lines(const PostCommand& command, const Machine& machine,
                                      const nc::Controller& controller, const post::PostJob& job) {
  std::vector<std::string> out;
  out.push_back(std::string("trunnion ") + TRUNNION_VERSION + ", controller " + controller.name);
  out.push_back((command.from.is_asked() ? "NC program " : "CL file ") + command.cl_file);
  out.push_back("machine " + machine.name + ", " + machine.file);
  const PostCliOptions& o = command.options;
  out.push_back(o.errors_line(job.model != nullptr));
  const bool at_run_time = o.thermal_output.form == "variables";
  if (!o.no_thermal && !at_run_time && (!o.offsets.empty() || !o.thermal_model.empty())) {
    out.push_back("thermal offsets " +
                  (o.offsets.empty() ? o.thermal_model + " with " + o.temperatures : o.offsets) +
                  ": valid for that thermal history only, from the first block on");
    if (job.offsets != nullptr && job.offsets->largest_sigma_mm() > 0.0)
      out.push_back("uncertain by up to " + fixed_text(2.0 * job.offsets->largest_sigma_mm(), 4) +
                    " mm (2 sigma), which is not in the tolerance");
    if (o.thermal_output.form == "work-offset" || o.thermal_output.form == "local-shift") {
      const bool sets = o.thermal_output.form == "work-offset" && !controller.offset_shift.set.empty();
      out.push_back(sets ? "one shift for each operation: THIS PROGRAM SETS ITS WORK OFFSET"
                         : "one shift beside the work offset for each operation");
    }
  }
  if (!o.no_thermal && at_run_time && controller.has_run_time_values())
    run_time_lines(o, controller, job.run_time_drift, out);
  out.push_back(o.tolerance_line());
  for (const std::string& line : o.stage_lines()) out.push_back(line);
  return out;
}

template <class T>
Result<void> put(Result<T> found, T& into) {
  if (!found) return tl::unexpected(found.error());
  into = std::move(*found);
  return {};
}

// What is known of the machine's errors, its drift and the tools.
Result<void> read_conditions(const PostCommand& command, PostInputs& in, Diagnostics& diagnostics) {
  const PostCliOptions& o = command.options;
  if (auto r = put(o.load_errors(in.files.machine, diagnostics, &in.temperatures), in.model); !r) return r;
  if (auto r = put(o.tools.load(diagnostics), in.tools); !r) return r;
  if (auto r = put(o.load_run_time_drift(diagnostics), in.drift); !r) return r;
  return put(o.load_offsets(diagnostics, in.drift), in.offsets);
}

template <class T>
const T* pointer_to(const std::optional<T>& value) {
  return value ? &*value : nullptr;
}

}  // namespace

void PostCommand::add_to(CLI::App& c) {
  c.add_option("part", cl_file, "CL file, or NC program with --from (- is standard input)")->required();
  c.add_option("-o,--output", output, "NC file (- is standard output)")->required();
  machine.add_to(c, true);
  from.add_to(c);
  options.add_to(c);
  c.add_option("--threads", threads, "threads for this file; the text is the same for any number")
      ->check(CLI::Range(std::size_t{1}, std::size_t{256}))
      ->capture_default_str();
}

Result<std::unique_ptr<PostInputs>> read_post_inputs(const PostCommand& command, Diagnostics& diagnostics) {
  auto in = std::make_unique<PostInputs>();
  if (auto r = put(command.options.resolve(), in->options); !r) return tl::unexpected(r.error());
  auto files = load_with_controller(command.machine, diagnostics, command.options.rtcp);
  if (auto r = put(std::move(files), in->files); !r) return tl::unexpected(r.error());
  if (auto r = put(command.from.load(command.machine, diagnostics), in->made_for); !r)
    return tl::unexpected(r.error());
  if (auto r = read_conditions(command, *in, diagnostics); !r) return tl::unexpected(r.error());
  in->options.tools = command.options.tools.resolve(in->tools);
  in->options.threads = command.threads;
  post::PostJob& job = in->job;
  job.cl_file = command.cl_file;
  if (in->made_for) {
    in->origin = command.from.resolve(*in->made_for);
    job.from = &in->origin;
  }
  job.machine = &in->files.machine;
  job.controller = &in->files.controller;
  job.model = pointer_to(in->model);
  job.temperatures = pointer_to(in->temperatures);
  job.run_time_drift = pointer_to(in->drift);
  job.offsets = pointer_to(in->offsets);
  command.options.set_offset_output(job);
  job.header = header_lines(command, in->files.machine, in->files.controller, job);
  if (in->made_for) job.header.push_back(command.from.line(*in->made_for));
  return in;
}

}  // namespace trunnion::app
