#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <memory>
#include <spdlog/spdlog.h>

#include "trunnion/report/nc_page.hpp"
#include "trunnion/report/post_json.hpp"
#include "trunnion/report/trace_json.hpp"
#include "trunnion/report/trace_page.hpp"

#include "app/against_options.hpp"
#include "app/failed_checks.hpp"
#include "app/options.hpp"
#include "app/progress.hpp"
#include "app/trace_plan.hpp"

namespace trunnion::app {
namespace {

// While it runs.
struct OfTheRun {
  std::string offsets;
  std::string trace;
};

struct VerifyCommand {
  std::string nc_file;
  AgainstOptions against;
  std::string truth;
  OfTheRun of_run;
  MachineOptions machine;
  ResultOptions result;
  double tolerance_mm = 0.01;
  double rapid_tolerance_mm = 1.0;
  std::optional<double> axis_tolerance_deg;
  bool no_certify = false;
  std::optional<std::int64_t> work_offset;
  std::string smoothing = "off";
  PoleCliOptions pole;
  ToolCliOptions tools;
};

void print_report(const post::VerifyReport& v) {
  spdlog::info("{} CL points, {} NC motion blocks ({} rapid)", v.points_in, v.points_out, v.rapid_blocks);
  spdlog::info("tip deviation {:.6f} mm ({}), tolerance {} mm", v.largest_tip_deviation_mm(),
               v.certified ? "proved bound" : "sampled", v.tolerance_mm);
  if (v.sampled_blocks > 0) {
    spdlog::info("{} blocks sampled, not proved{}", v.sampled_blocks,
                 v.unproved_effects.empty()
                     ? ""
                     : fmt::format("; no bound is known of {}", fmt::join(v.unproved_effects, ", ")));
  }
  spdlog::info("CL points met within {:.6f} mm, {} missed", v.max_point_deviation_mm, v.points_missed);
  spdlog::info("tool axis deviation {:.4f} deg, tolerance {:.4f} deg", v.max_axis_deviation.deg(),
               v.axis_tolerance.deg());
  spdlog::info("at the tip's own place the tool axis is within {:.4f} deg of the path's; {}",
               v.max_axis_deviation_at_tip.deg(), post::flute_text(v));
  if (v.pole_tolerance > Angle{}) {
    spdlog::info("tool axis deviation near the pole {:.4f} deg, tolerance {:.4f} deg more",
                 v.max_pole_axis_deviation.deg(), v.pole_tolerance.deg());
  }
  spdlog::info("{}", rapid_text(v));
  for (const auto& u : v.unsafe) spdlog::error("error: NC line {}: {}", u.nc_line, u.what);
  for (const auto& b : v.beyond_limits)
    spdlog::error("error: NC line {} is beyond the limits of axis {}", b.nc_line, b.axis);
  spdlog::info("axes at {:.3f} of their largest speed at most", v.max_speed_ratio);
  for (const auto& f : v.too_fast) {
    spdlog::error("error: NC line {} moves axis {} at {:.4f} times its largest speed", f.nc_line, f.axis,
                  f.ratio);
  }
  for (const post::Check& check : v.checks) {
    for (const auto& place : check.places) spdlog::error("error: NC line {}: {}", place.nc_line, place.what);
  }
  for (const std::string& line : check_table(v)) spdlog::info("{}", line);
  for (const auto& use : v.allowed) {
    spdlog::warn(
        "warning: '{}' is allowed by the controller file ([read] allowed): {} times, first at NC line {}; "
        "what it does is not known",
        use.word, use.count, use.nc_line);
  }
  if (v.passed()) {
    spdlog::info("passed");
  } else {
    std::vector<std::string> failed;
    for (std::size_t i = 0; i < post::kChecks; ++i) {
      if (v.checks[i].state == post::Check::State::failed)
        failed.emplace_back(post::name_of(static_cast<post::CheckOf>(i)));
    }
    const bool off_path = !v.worst.empty() && !v.within_tolerance();
    spdlog::error("error: not passed{}{}{}", failed.empty() ? "" : ": ", fmt::join(failed, ", "),
                  off_path ? fmt::format("; the tool is farthest off its path at NC line {}, CL line {}",
                                         v.worst[0].nc_line, v.worst[0].cl_line)
                           : "");
  }
}

void print_trace(const trace::TraceReport& trace, double tolerance_mm) {
  for (const std::string& line : report::trace_lines(trace, tolerance_mm)) spdlog::info("{}", line);
  if (!trace.passed())
    spdlog::error(
        "error: the control left the CL path by more than the tolerance; farthest at NC line {}, CL line {}",
        trace.worst.nc_line, trace.worst.cl_line);
}

// Whether the header says that errors of the machine are compensated: a comment that begins so, as none of
// the CL file does. Of a file only: a pipe is read once.
bool compensates_errors(const std::string& nc_file, const nc::Controller::Comments& comments) {
  std::error_code ec;
  if (!std::filesystem::is_regular_file(nc_file, ec)) return false;
  constexpr std::size_t kHeader = 4096;
  std::string head(kHeader, '\0');
  std::ifstream file(nc_file, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  std::transform(head.begin(), head.end(), head.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const std::string begins = comments.open + (comments.close.empty() ? " " : "");
  return head.find(begins + "errors compensated: ") != std::string::npos;
}

// What the control really did; nothing without a trace.
Result<std::optional<trace::TraceReport>> hold_against(const VerifyCommand& command,
                                                       const TracedProgram& program, const Machine& machine,
                                                       Diagnostics& diagnostics) {
  if (command.of_run.trace.empty()) return std::nullopt;
  const auto trace = load_trace(command.of_run.trace, machine, diagnostics);
  if (!trace) return tl::unexpected(trace.error());
  const auto plan = plan_of(program, machine);
  if (!plan) return tl::unexpected(plan.error());
  trace::CompareOptions options;
  options.course = !command.result.report.empty();
  const auto compared = trace::compare(*trace, machine, *plan, options);
  if (!compared) return tl::unexpected(compared.error());
  return *compared;
}

// What a trace cannot be held against.
Result<void> may_trace(const VerifyCommand& command) {
  if (command.of_run.trace.empty()) return {};
  if (command.against.file == "-" || command.of_run.trace == "-")
    return fail(ErrorCode::wrong_use,
                "--trace reads the file of --against twice: neither it nor the trace may be -");
  if (!command.of_run.offsets.empty())
    return fail(ErrorCode::wrong_use,
                "--trace and --offsets exclude each other: a trace has no time of the drift");
  return {};
}

ExitCode run(VerifyCommand& command) {
  if (const auto may = may_trace(command); !may) return print_error(may.error());
  Diagnostics diagnostics;
  const auto files = load_with_controller(command.machine, diagnostics);
  if (!files) return print_failure(diagnostics, files.error());
  const Machine& machine = files->machine;
  const nc::Controller& controller = files->controller;
  if (command.truth.empty() && compensates_errors(command.nc_file, controller.comments)) {
    diagnostics.warning(
        command.nc_file, {},
        "its header names a model of the machine's errors; without --truth it is evaluated on "
        "the nominal machine");
  }
  if (const auto loaded = command.against.load(command.machine, diagnostics); !loaded)
    return print_failure(diagnostics, loaded.error());
  const auto truth = load_truth(command.truth, machine, diagnostics);
  if (!truth) return print_failure(diagnostics, truth.error());
  const auto tools = command.tools.load(diagnostics);
  if (!tools) return print_failure(diagnostics, tools.error());
  const auto bodies = command.result.bodies_of(machine, diagnostics);
  if (!bodies) return print_failure(diagnostics, bodies.error());
  std::optional<thermal::OffsetTable> offsets;
  if (!command.of_run.offsets.empty()) {
    auto table = thermal::load_offsets(command.of_run.offsets, diagnostics);
    if (!table) return print_failure(diagnostics, table.error());
    offsets = std::move(*table);
  }
  post::VerifyOptions options;
  options.offsets = offsets ? &*offsets : nullptr;
  options.tolerance_mm = command.tolerance_mm;
  options.rapid_tolerance_mm = command.rapid_tolerance_mm;
  options.axis_tolerance =
      command.axis_tolerance_deg ? Angle::degrees(*command.axis_tolerance_deg) : machine.axis_tolerance;
  options.certify = !command.no_certify;
  options.pole = command.pole.resolve();
  options.truth = *truth ? &**truth : nullptr;
  options.work_offset = command.work_offset;
  const auto smoothing = smoothing_of(command.smoothing);
  if (!smoothing) return print_error(smoothing.error());
  options.smoothing_mm = *smoothing;
  options.tools = command.tools.resolve(*tools);
  options.collect = !command.result.report.empty() || !command.of_run.trace.empty();
  auto path = command.against.open();
  if (!path) return print_error(path.error());
  auto program = cl::open_source(command.nc_file);
  if (!program) return print_error(program.error());
  const auto report = [&] {
    const Activity activity("verifying", command.nc_file);
    return post::verify(std::move(*path), {std::move(*program), command.nc_file}, machine, controller,
                        options, diagnostics);
  }();
  if (!report) return print_failure(diagnostics, report.error());
  const auto traced = hold_against(command, {command.against, options, *report}, machine, diagnostics);
  if (!traced) return print_failure(diagnostics, traced.error());
  print(diagnostics);
  print_report(*report);
  if (*traced) print_trace(**traced, options.tolerance_mm);
  const std::string json = *traced ? report::verify_json(*report, **traced) : report::verify_json(*report);
  const auto page = [&] {
    report::NcPageInput input{command.nc_file, command.against.file, &machine, &*report, {}, json, made_by()};
    input.nc_text = text_of_file(command.nc_file);
    input.cl_text = text_of_file(command.against.file);
    input.bodies = *bodies;
    input.errors = *truth ? &**truth : nullptr;
    report::Page out = report::nc_page(input);
    if (*traced) out.sections.push_back(report::trace_section(**traced, options.tolerance_mm));
    return out;
  };
  if (const auto code = command.result.write(json, page); code != kDone) return code;
  return report->passed() && (!*traced || (*traced)->passed()) ? kDone : kCheckFailed;
}

}  // namespace

void add_verify_command(CLI::App& root, int& exit) {
  auto command = std::make_shared<VerifyCommand>();
  CLI::App* c = root.add_subcommand(
      "verify", "evaluate an NC program against its CL file, or another program (--from)");
  c->add_option("program", command->nc_file, "NC file (- is standard input)")->required();
  command->against.add_to(*c)->required();
  command->machine.add_to(*c, true);
  c->add_option("--truth", command->truth,
                "model of the errors of the machine to evaluate on (none: nominal)");
  c->add_option("--offsets", command->of_run.offsets,
                "thermal offsets (CSV) that the machine has while the program runs (none: cold)");
  c->add_option(
      "--trace", command->of_run.trace,
      "positions of the axes over time that the control recorded while it ran the program (CSV: time_s, "
      "X_mm, A_deg, ...): judge what it really did, too");
  c->add_option("--tolerance-mm", command->tolerance_mm, "largest deviation of the tip")
      ->check(above_zero())
      ->capture_default_str();
  c->add_option("--rapid-tolerance-mm", command->rapid_tolerance_mm,
                "largest deviation of the tip from the straight line of a rapid")
      ->check(above_zero())
      ->capture_default_str();
  c->add_option("--axis-tolerance-deg", command->axis_tolerance_deg, "largest angle of the tool axis")
      ->check(above_zero());
  c->add_flag("--no-certify", command->no_certify, "sample deviations instead of proving their bound");
  c->add_option(
      "--work-offset", command->work_offset,
      "work offset that the program is to call: 1 (G54), 2, ... (default: SET/OFSETL of the CL file, else "
      "the machine file's)");
  add_smoothing(*c, command->smoothing);
  command->pole.add_to(*c);
  command->tools.add_to(*c);
  command->result.add_to(*c);
  c->callback([command, &exit] { exit = run(*command); });
}

}  // namespace trunnion::app
