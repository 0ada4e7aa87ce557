#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <spdlog/spdlog.h>

#include "trunnion/base/number_text.hpp"
#include "trunnion/post/post_file.hpp"
#include "trunnion/post/program_zero.hpp"
#include "trunnion/report/nc_page.hpp"
#include "trunnion/report/post_json.hpp"

#include "app/failed_checks.hpp"
#include "app/post_job.hpp"
#include "app/progress.hpp"

namespace trunnion::app {
namespace {

std::string lengths_text(const std::vector<post::LoadedTool>& tools) {
  std::string out;
  for (const post::LoadedTool& tool : tools) {
    out += (out.empty() ? "" : ", ") +
           (tool.number ? "T" + std::to_string(*tool.number) + " " : std::string()) +
           shortest_text(tool.length_mm) + " mm";
  }
  return out;
}

void print_summary(const post::PostReport& r) {
  spdlog::info("{} CL points, {} inserted in {} segments, {} NC lines, {:.1f} s machining time", r.points_in,
               r.points_inserted, r.segments_with_points, r.nc_lines, r.duration_s);
  spdlog::debug(
      "rotary axes travel {:.1f} deg; axis moves at rapid rate would take {:.1f} s; {} reconfigurations",
      r.choice.rotary_travel_rad * kDegreePerRad, r.choice.axis_time_s, r.choice.reconfigurations);
  spdlog::debug("largest predicted error of the path as programmed {:.6f} mm, corrections of up to {:.6f} mm",
                r.worst_predicted_mm, r.largest_correction_mm);
  if (r.feed_time_lost_s > 0.05)
    spdlog::info("the axes' speeds and accelerations add {:.1f} s to the time at the programmed feed",
                 r.feed_time_lost_s);
  if (r.blocks_held > 0) {
    spdlog::info("in {} blocks only rotary axes move: X Y Z steps that came from rounding are left out",
                 r.blocks_held);
  }
  if (r.choice.branch_changes > 0)
    spdlog::info("changes from one rotary solution to the other: {}", r.choice.branch_changes);
  if (r.rewinds_at_rapids > 0) spdlog::info("{} rewinds at rapids", r.rewinds_at_rapids);
  if (r.choice.reconfigurations > 0)
    spdlog::info("{} retracts from the part to turn rotary axes back", r.choice.reconfigurations);
  if (r.pole_stretches > 0) {
    spdlog::info("tool axis tilted on {} stretches near the pole, by {:.4f} deg at most", r.pole_stretches,
                 r.largest_pole_tilt.deg());
  }
  if (r.arcs + r.holes + r.shapes_as_moves > 0) {
    const std::string as_moves =
        r.shapes_as_moves > 0
            ? fmt::format(", {} as straight moves, since the control cannot run them", r.shapes_as_moves)
            : "";
    spdlog::info("arcs as circles of the control: {}, holes as its cycles: {}{}", r.arcs, r.holes, as_moves);
  }
  if (r.tilted_planes > 0) spdlog::info("tilted planes: {}", r.tilted_planes);
  if (r.choice.pole_points > 0)
    spdlog::info("points with the tool parallel to the inner rotary axis (pole): {}", r.choice.pole_points);
  if (r.largest_error_mm > 0.0) {
    spdlog::info("machine errors of up to {:.4f} mm compensated", r.largest_error_mm);
  }
  if (r.offset_shifts > 0) spdlog::info("offset shifted {} times for thermal drift", r.offset_shifts);
  if (r.run_time_bend_mm > 0.0)
    spdlog::info("drift within the clamp adds at most {:.6f} mm of deviation inside a block",
                 r.run_time_bend_mm);
  if (!r.verification) {
    spdlog::warn("warning: not verified");
    return;
  }
  const post::VerifyReport& v = *r.verification;
  const double tip = v.largest_tip_deviation_mm();
  const bool keeps = tip <= v.tolerance_mm;
  spdlog::info("{}{}: tip {} {:.6f} mm {} ({}; {} {} mm), tool axis within {:.4f} deg",
               keeps ? "verified" : "NOT within tolerance", v.on_truth ? " on the machine with errors" : "",
               keeps ? "within" : "off by up to", tip, keeps ? "of its path" : "from its path",
               v.certified ? "proved" : "sampled", keeps ? "tolerance" : "allowed", v.tolerance_mm,
               v.max_axis_deviation.deg());
  spdlog::info("tool axis off by up to {:.4f} deg from the CL direction at the same point of the path; {}",
               v.max_axis_deviation_at_tip.deg(), post::flute_text(v));
  const double uncertain_mm = 2.0 * r.head.offset_sigma_mm;
  if (uncertain_mm > v.tolerance_mm)
    spdlog::warn(
        "warning: the thermal offsets are uncertain by up to {:.4f} mm (2 sigma): the tolerance holds only "
        "if the machine drifts exactly as they say",
        uncertain_mm);
  spdlog::info("{}", rapid_text(v));
  if (!v.travel.empty()) spdlog::info("{}; tools: {}", travel_text(v), lengths_text(r.tools));
}

std::vector<report::Fact> facts(const post::PostReport& r) {
  const auto count = [](const char* id, const char* label, std::size_t n) {
    return report::Fact{id, label, std::to_string(n), static_cast<double>(n)};
  };
  return {{"worst_predicted_mm", "error without inserted points (predicted)",
           fmt::format("{:.4g} µm", r.worst_predicted_mm / kMmPerUm), r.worst_predicted_mm},
          count("points_inserted", "inserted points", r.points_inserted),
          count("branch_changes", "branch changes", r.choice.branch_changes),
          count("pole_points", "points at the pole", r.choice.pole_points),
          {"duration_s", "machining time", fmt::format("{:.1f} s", r.duration_s), r.duration_s}};
}

// What an operator has to know before the first block.
std::vector<report::Fact> setup_facts(const PostCommand& command, const MachineFiles& files,
                                      const post::PostReport& report) {
  const bool is_tip =
      files.machine.output_point == OutputPoint::tip && (report.tools.empty() || report.tools.front().number);
  const auto words = command.options.rtcp ? post::WordsOf::part
                     : is_tip             ? post::WordsOf::tip
                                          : post::WordsOf::spindle;
  const auto zero = post::program_zero(files.machine, files.controller, report.head.work_offset, words);
  std::string text;
  for (const std::string& line : post::zero_lines(zero)) text += (text.empty() ? "" : "; ") + line;
  std::vector<report::Fact> out = {{"program_zero", "program zero", text, {}}};
  if (!report.tools.empty())
    out.push_back(
        {"gauge_length_mm", "gauge lengths", lengths_text(report.tools), report.tools.front().length_mm});
  return out;
}

// Without a verification there is no deviation to show: what was written, and its text.
report::Page unverified_page(const PostCommand& command, const MachineFiles& files,
                             const post::PostReport& report) {
  constexpr std::size_t kShown = 20'000;  // bytes of the program
  report::Page page;
  page.title = command.output + " of " + command.cl_file + " on " + files.machine.name;
  page.verdict = "Not verified (--no-verify): this program was not compared with its CL file.";
  page.tone = report::Tone::bad;
  page.facts = facts(report);
  for (const report::Fact& fact : setup_facts(command, files, report)) page.facts.push_back(fact);
  page.result_json = report::post_json(report);
  page.made_by = made_by();
  std::string text = text_of_file(command.output);
  const bool cut = text.size() > kShown;
  if (cut) text.resize(text.rfind('\n', kShown) + 1);
  if (!text.empty())
    page.sections.push_back(
        {"Program", {report::Listing{"program", cut ? "The program, its beginning" : "The program", text}}});
  return page;
}

// What a page shows beside the outcome.
struct Shown {
  const Model* model;
  const std::vector<BodyMesh>& bodies;
};

report::Page page_of(const PostCommand& command, const MachineFiles& files, const post::FileOutcome& outcome,
                     const Shown& shown) {
  const post::PostReport& report = *outcome.report;
  if (!report.verification) return unverified_page(command, files, report);
  report::NcPageInput input;
  input.nc_file = command.output;
  input.cl_file = command.cl_file;
  // Drawn with the tool that the program begins with.
  Machine machine = files.machine;
  if (!report.tools.empty()) machine.tool_length_mm = report.tools.front().length_mm;
  input.machine = &machine;
  input.verification = &*report.verification;
  input.more_facts = facts(report);
  for (const report::Fact& fact : setup_facts(command, files, report)) input.more_facts.push_back(fact);
  input.result_json = report::post_json(report);
  input.made_by = made_by();
  if (outcome.written) input.nc_text = text_of_file(command.output);
  input.cl_text = text_of_file(command.cl_file);
  std::optional<ModelEvaluator> errors;
  if (shown.model != nullptr) errors.emplace(*shown.model);
  input.bodies = shown.bodies;
  input.errors = errors ? &*errors : nullptr;
  return report::nc_page(input);
}

ExitCode finish(const PostCommand& command, const MachineFiles& files, const post::FileOutcome& outcome,
                const Shown& shown) {
  print_summary(*outcome.report);
  if (!outcome.passed) {
    for (const std::string& reason : failed_checks(*outcome.report->verification, command.cl_file))
      spdlog::error("error: {}", reason);
    if (outcome.written) {
      spdlog::warn(
          "warning: written although the check failed, marked NOT WITHIN TOLERANCE (--accept-deviation)");
    } else {
      spdlog::error("error: no file written{}",
                    outcome.only_deviates() ? "; to write it anyway: --accept-deviation" : "");
    }
  }
  const auto page = [&] { return page_of(command, files, outcome, shown); };
  if (const auto code = command.result.write(report::post_json(*outcome.report), page); code != kDone)
    return code;
  return outcome.passed ? kDone : kCheckFailed;
}

// A program of an earlier run, at which somebody may look when this one fails.
class OldFile {
 public:
  explicit OldFile(const std::string& path) : path_(path), time_(time_of(path)) {}
  void tell() const {
    if (time_ && time_ == time_of(path_))
      spdlog::warn("warning: {} is of an earlier run and was left as it was", path_);
  }

 private:
  static std::optional<std::filesystem::file_time_type> time_of(const std::string& path) {
    std::error_code ec;
    if (path.empty() || path == "-" || !std::filesystem::is_regular_file(path, ec)) return std::nullopt;
    const auto time = std::filesystem::last_write_time(path, ec);
    return ec ? std::nullopt : std::optional(time);
  }
  std::string path_;
  std::optional<std::filesystem::file_time_type> time_;
};

ExitCode run(const PostCommand& command) {
  if (command.filter) spdlog::set_level(std::max(spdlog::get_level(), spdlog::level::warn));
  Diagnostics diagnostics;
  auto inputs_read = read_post_inputs(command, diagnostics);
  if (!inputs_read) return print_failure(diagnostics, inputs_read.error());
  PostInputs& in = **inputs_read;
  in.options.collect = !command.result.report.empty();
  const auto bodies = command.result.bodies_of(in.files.machine, diagnostics);
  if (!bodies) return print_failure(diagnostics, bodies.error());
  print(diagnostics);
  const auto outcome = [&] {
    std::optional<FilterProgress> progress;
    std::optional<Activity> activity;
    if (command.filter)
      progress.emplace(command.cl_file);
    else
      activity.emplace("posting", command.cl_file);
    return post::post_file(in.job, in.options, command.output, command.options.accept_deviation);
  }();
  if (outcome.error) return print_failure(outcome.diagnostics, *outcome.error);
  print(outcome.diagnostics);
  return finish(command, in.files, outcome, {in.job.model, *bodies});
}

}  // namespace

void add_post_command(CLI::App& root, int& exit) {
  auto command = std::make_shared<PostCommand>();
  CLI::App* c = root.add_subcommand("post", "CL file (or NC program: --from) in, verified NC program out");
  command->add_to(*c);
  c->add_flag_callback(
       "--filter",
       [command, c] {
         c->get_option("--output")->required(false);
         command->output = "-";
         command->filter = true;
       },
       "as a control calls it that opens a CL file: the program on standard output, FILTER_PROGRESS=n on "
       "standard "
       "error, and nothing else there but warnings and errors")
      ->excludes("--output");
  command->result.add_to(*c);
  c->callback([command, &exit] {
    const OldFile old(command->output);
    exit = run(*command);
    if (exit != kDone) old.tell();
  });
}

}  // namespace trunnion::app
