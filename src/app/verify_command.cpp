#include <memory>
#include <spdlog/spdlog.h>

#include "trunnion/report/nc_page.hpp"
#include "trunnion/report/post_json.hpp"
#include "trunnion/report/trace_json.hpp"
#include "trunnion/report/trace_page.hpp"

#include "app/failed_checks.hpp"
#include "app/progress.hpp"
#include "app/trace_plan.hpp"
#include "app/verify_job.hpp"

namespace trunnion::app {
namespace {

void print_report(const post::VerifyReport& v) {
  constexpr double kPerCent = 100.0;
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
  spdlog::info("tool axis off by up to {:.4f} deg from the CL direction at the same point of the path; {}",
               v.max_axis_deviation_at_tip.deg(), post::flute_text(v));
  if (v.pole_tolerance > Angle{}) {
    spdlog::info("tool axis deviation near the pole {:.4f} deg, tolerance {:.4f} deg more",
                 v.max_pole_axis_deviation.deg(), v.pole_tolerance.deg());
  }
  spdlog::info("{}", rapid_text(v));
  for (const auto& u : v.unsafe) spdlog::error("error: NC line {}: {}", u.nc_line, u.what);
  for (const auto& b : v.beyond_limits)
    spdlog::error("error: NC line {} is beyond the limits of axis {}", b.nc_line, b.axis);
  spdlog::info("highest axis speed: {:.1f} % of its limit", kPerCent * v.max_speed_ratio);
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

// What the control really did; nothing without a trace.
Result<std::optional<trace::TraceReport>> hold_against(const VerifyCommand& command,
                                                       const TracedProgram& program,
                                                       Diagnostics& diagnostics) {
  const Machine& machine = program.files.machine;
  if (command.of_run.trace.empty()) return std::nullopt;
  const auto trace = load_trace(command.of_run.trace, machine, diagnostics);
  if (!trace) return tl::unexpected(trace.error());
  const auto plan = plan_of(program);
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
  auto inputs_read = read_verify_inputs(command, diagnostics);
  if (!inputs_read) return print_failure(diagnostics, inputs_read.error());
  VerifyInputs& in = **inputs_read;
  in.options.collect = !command.result.report.empty() || !command.of_run.trace.empty();
  const Machine& machine = in.files.machine;
  const post::VerifyOptions& options = in.options;
  const auto bodies = command.result.bodies_of(in.files.machine, diagnostics);
  if (!bodies) return print_failure(diagnostics, bodies.error());
  auto path = command.against.open();
  if (!path) return print_error(path.error());
  auto program = cl::open_source(command.nc_file);
  if (!program) return print_error(program.error());
  const auto report = [&] {
    const Activity activity("verifying", command.nc_file);
    return post::verify(std::move(*path), {std::move(*program), command.nc_file},
                        {machine, in.files.controller, options}, diagnostics);
  }();
  if (!report) return print_failure(diagnostics, report.error());
  const auto traced = hold_against(command, {command.against, in.files, options, *report}, diagnostics);
  if (!traced) return print_failure(diagnostics, traced.error());
  print(diagnostics);
  print_report(*report);
  constexpr double kFar_mm = 1.0;  // no tolerance and no slip of a digit: another machine, zero or part
  if (report->points_missed > 0 && report->largest_tip_deviation_mm() > kFar_mm)
    spdlog::error(
        "error: the program is far from this path: was it made with this machine file, controller file and "
        "CL file? Its first lines name those that it was made with");
  if (*traced) print_trace(**traced, options.tolerance_mm);
  const std::string json = *traced ? report::verify_json(*report, **traced) : report::verify_json(*report);
  const auto page = [&] {
    report::NcPageInput input{command.nc_file, command.against.file, &machine, &*report, {}, json, made_by()};
    input.nc_text = text_of_file(command.nc_file);
    input.cl_text = text_of_file(command.against.file);
    input.bodies = *bodies;
    input.errors = options.truth;
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
  command->add_to(*c);
  command->result.add_to(*c);
  c->callback([command, &exit] { exit = run(*command); });
}

}  // namespace trunnion::app
