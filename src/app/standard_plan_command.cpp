#include "app/standard_plan_command.hpp"

#include <memory>

#include "trunnion/diagnosis/standard_plans.hpp"
#include "trunnion/report/command_pages.hpp"
#include "trunnion/report/diagnosis_json.hpp"

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
  double feed_mm_min = 1000.0, u_um = 1.0;
  ResultOptions result;
};

Result<diagnosis::StandardSetUp> set_up_of(const StandardPlanOptions& options) {
  diagnosis::StandardSetUp out;
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

ExitCode run(const StandardPlanOptions& options) {
  if (const auto apart = options.result.apart_from(options.out); !apart) return print_error(apart.error());
  int exit = kDone;
  const auto machine = read_machine(options.machine, exit);
  if (!machine) return static_cast<ExitCode>(exit);
  const auto set_up = set_up_of(options);
  if (!set_up) return print_error(set_up.error());
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
          "together) or frustum (all five axes, on a cone)")
      ->required()
      ->check(CLI::IsMember(diagnosis::standard_plan_kinds()));
  command->add_option("-m,--machine", options->machine, "machine file (TOML)")
      ->type_name(kMachineName)
      ->required();
  command
      ->add_option(
          "--ball-mm", options->balls,
          "X,Y,Z of the ball's centre in the part frame; given twice: a set-up of two balls. frustum: the "
          "middle of the circle")
      ->required()
      ->allow_extra_args(false);
  command
      ->add_option("--feed-mm-min", options->feed_mm_min,
                   "feed of what is read while the axes move (bk1, bk2, frustum)")
      ->check(between(1.0, 100000.0))
      ->capture_default_str();
  command->add_option("--u-um", options->u_um, "standard uncertainty of one reading, um")
      ->check(above_zero())
      ->capture_default_str();
  command->add_option("--cone", options->cone,
                      "RADIUS,HALF_APEX,INCLINATION of the frustum's path: mm of the circle, deg, deg "
                      "(40,15,10)");
  command->add_option("-o,--output", options->out, "plan file to write")->required();
  options->result.add_to(*command);
  command->callback([options, &exit] { exit = run(*options); });
}

}  // namespace trunnion::app
