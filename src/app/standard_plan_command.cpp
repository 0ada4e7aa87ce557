#include "app/standard_plan_command.hpp"

#include <memory>

#include "trunnion/diagnosis/standard_plans.hpp"
#include "trunnion/post/cl_points.hpp"
#include "trunnion/report/command_pages.hpp"
#include "trunnion/report/diagnosis_json.hpp"

#include "app/against_options.hpp"
#include "app/command_tree.hpp"
#include "app/model_inputs.hpp"
#include "app/number_list.hpp"
#include "app/results.hpp"
#include "app/support.hpp"

namespace trunnion::app {
namespace {

struct StandardPlanOptions {
  std::string kind, machine, out, cone;
  std::vector<std::string> balls;
  AgainstOptions path;
  std::size_t poses = 200;
  double feed_mm_min = 1000.0, u_um = 1.0;
  ResultOptions result;
};

// Each cut begins where a rapid has brought the tool.
Result<std::vector<std::vector<ToolPose>>> cuts_of(const AgainstOptions& path, Diagnostics& diagnostics) {
  constexpr post::PathTolerance kChords{0.01, Angle::degrees(0.05)};  // of arcs; a measurement needs no more
  auto text = path.open();
  if (!text) return tl::unexpected(text.error());
  // The tip is led, whatever the length of the tool that the file loads.
  post::ToolOptions tools;
  tools.tool = 1;
  tools.length_mm = 1.0;
  const auto points = post::cl_points(std::move(*text), kChords, tools, diagnostics);
  if (!points) return tl::unexpected(points.error());
  std::vector<std::vector<ToolPose>> out;
  for (const post::ClPoint& p : *points) {
    if (out.empty() || (p.rapid && out.back().size() > 1)) out.emplace_back();
    if (p.rapid) out.back().clear();
    out.back().push_back({p.tip_P, p.axis_P});
  }
  while (!out.empty() && out.back().size() < 2) out.pop_back();
  if (out.empty()) return fail(ErrorCode::wrong_input, "the path has nothing that is cut", path.file);
  return out;
}

Result<diagnosis::StandardSetUp> set_up_of(const StandardPlanOptions& options) {
  diagnosis::StandardSetUp out;
  if ((options.kind == "path") == options.path.file.empty())
    return fail(ErrorCode::wrong_use, "--against names the path of 'path', and of no other plan");
  if (options.kind == "path" && !options.balls.empty())
    return fail(ErrorCode::wrong_use, "--ball-mm: a path has its own places in the part frame");
  if (options.kind != "path" && options.balls.empty())
    return fail(ErrorCode::wrong_use, "--ball-mm is required: X,Y,Z of the ball's centre in the part frame");
  out.poses = options.poses;
  for (const std::string& ball : options.balls) {
    const auto n = numbers_of("--ball-mm", ball, "X,Y,Z");
    if (!n) return tl::unexpected(n.error());
    out.balls_P.emplace_back((*n)[0], (*n)[1], (*n)[2]);
  }
  if (!options.cone.empty()) {
    const auto n = numbers_of("--cone", options.cone, "RADIUS,HALF_APEX,INCLINATION", "mm and deg");
    if (!n) return tl::unexpected(n.error());
    if (!((*n)[0] > 0.0) || !((*n)[1] >= 0.0) || (*n)[1] > 80.0 || !((*n)[2] >= 0.0) || (*n)[2] > 80.0)
      return fail(ErrorCode::wrong_use, "--cone: the radius must be above 0, the angles from 0 to 80 deg");
    out.cone = {(*n)[0], Angle::degrees((*n)[1]), Angle::degrees((*n)[2])};
  }
  out.feed_mm_s = options.feed_mm_min / kSecondsPerMinute;
  out.u_random_mm = options.u_um * kMmPerUm;
  return out;
}

ExitCode run(StandardPlanOptions& options) {
  Diagnostics diagnostics;
  if (const auto loaded = options.path.load({options.machine, ""}, diagnostics); !loaded)
    return print_failure(diagnostics, loaded.error());
  int exit = kDone;
  const auto machine = read_machine(options.machine, exit);
  if (!machine) return static_cast<ExitCode>(exit);
  auto set_up = set_up_of(options);
  if (!set_up) return print_error(set_up.error());
  if (options.kind == "path") {
    auto cuts = cuts_of(options.path, diagnostics);
    if (!cuts) return print_failure(diagnostics, cuts.error());
    set_up->cuts = std::move(*cuts);
  }
  print(diagnostics);
  const auto runs = diagnosis::standard_plan(*machine, options.kind, *set_up);
  if (!runs) return print_error(runs.error());
  config::Array tables;
  std::string said;
  for (const diagnosis::PlanRun& run : *runs) {
    tables.push_back({plan_run_table(run, *machine), {}});
    said += (said.empty() ? "" : ", ") + run.id;
  }
  const std::string text = config::toml_text({config::Table{{"run", {std::move(tables), {}}}}, {}});
  if (const auto code = write_output(options.out, text); code != kDone) return code;
  const report::ResultText page{"A measuring plan: " + options.kind,
                                "Runs: " + said + "; written to " + options.out + ".",
                                report::imported_json(options.kind, text), made_by()};
  return options.result.write(
      page.json, [&] { return report::measuring_plan_page(*machine, *runs, page); }, "");
}

}  // namespace

void add_standard_plan_command(CLI::App& measurements, int& exit) {
  auto* command = measurements.add_subcommand(
      "plan", "measuring plan of a standard's test: for 'simulate', 'probe program --plan' or an R-test");
  auto options = std::make_shared<StandardPlanOptions>();
  command
      ->add_option(
          "kind", options->kind,
          "rtest (poses that stand), bk1, bk2 (ISO 10791-6: one rotary axis and the linear ones move "
          "together), frustum (all five axes, on a cone) or path (along the cuts of a path, --against)")
      ->required()
      ->check(CLI::IsMember(diagnosis::standard_plan_kinds()));
  command
      ->add_option("-m,--machine", options->machine,
                   "machine file, or the name of one in postconfigs/machines")
      ->type_name(kMachineName)
      ->required();
  command
      ->add_option(
          "--ball-mm", options->balls,
          "X,Y,Z of the ball's centre in the part frame; given twice: a set-up of two balls. frustum: the "
          "middle of the circle")
      ->allow_extra_args(false);
  command
      ->add_option("--feed-mm-min", options->feed_mm_min,
                   "feed of what is read while the axes move (all but rtest)")
      ->check(between(1.0, 100000.0))
      ->capture_default_str();
  command->add_option("--u-um", options->u_um, "standard uncertainty of one reading, um")
      ->check(above_zero())
      ->capture_default_str();
  command->add_option("--cone", options->cone,
                      "RADIUS,HALF_APEX,INCLINATION of the frustum's path: mm of the circle, deg, deg "
                      "(40,15,10)");
  options->path.add_to(*command);
  command->add_option("--poses", options->poses, "readings along the path, at equal ways")
      ->check(CLI::Range(2, 100000))
      ->capture_default_str();
  command->add_option("-o,--output", options->out, "plan file to write")->required();
  options->result.add_to(*command);
  command->callback([options, &exit] { exit = run(*options); });
}

}  // namespace trunnion::app
