#pragma once
#include <string>

#include "trunnion/diagnosis/plan.hpp"
#include "trunnion/effects/table.hpp"
#include "trunnion/machine/body_meshes.hpp"
#include "trunnion/report/page.hpp"
#include "trunnion/thermal/log.hpp"

/// Pages of single commands: each opens with the answer in one sentence and its picture, and shows nothing
/// that the JSON does not hold.
namespace trunnion::report {

/// What a command has found: a title, the sentence that it has for it (may be empty), `--json`'s text.
struct ResultText {
  std::string title;
  std::string verdict;
  std::string json;
  std::string made_by;
};
using PageOf = Page (*)(const ResultText&);

/// `thermal screen`: which sensors follow the error, by p-value and by held-out runs, and what each choice
/// leaves.
Page thermal_screen_page(const ResultText& result);
/// `thermal split`: what tool and rotary axes have moved, with sigma, and what the poses do not tell apart.
Page thermal_split_page(const ResultText& result);
/// `thermal assess`: blade by blade before and after, against the tolerance.
Page thermal_assess_page(const ResultText& result);

/// `table evaluate`: what each kind of table leaves at points that it never saw, and the independent lines.
Page table_choice_page(const ResultText& result);
/// `table study`: what is left by number of nodes, predicted beside measured on the diagonals.
Page cross_talk_page(const ResultText& result);

/// `batch`: the files that failed first, then how near each program stays to its path.
Page batch_page(const ResultText& result);
/// `machine calibrate`: residual before and after, each parameter from what it was to what it is.
Page calibration_page(const ResultText& result);
/// `model plan`: the runs with their minutes, their poses on the machine, and the chance of a wrong name
/// before and after. `runs` are those of the result.
Page plan_page(const Machine& machine, const std::vector<diagnosis::PlanRun>& runs, const ResultText& result);
/// `probe program`: the poses and how well each axis will be known.
Page probe_program_page(const ResultText& result);
/// `probe read`: where the ball stands against the machine file, pose by pose.
Page probe_reading_page(const ResultText& result);

/// `measurements import` and `template`: the readings in the order of the file, or the poses that are still
/// to be measured, on the machine where there is one. `csv` is what was written.
Page measurements_page(const ResultText& result, const std::string& csv, const Machine* machine);
/// `measurements plan`: the poses of its runs on the machine.
Page measuring_plan_page(const Machine& machine, const std::vector<diagnosis::PlanRun>& runs,
                         const ResultText& result);
/// `thermal import` and `simulate`: deviations and temperatures over time, run by run.
Page log_page(const ResultText& result, const thermal::Log& log);
/// `table import` and `export`: each table over its axis.
Page tables_page(const ResultText& result, const std::vector<ErrorTable>& tables);
/// `machine check` and `new`: what the file's machine reaches, and the machine with a slider for each axis.
Page machine_check_page(const Machine& machine, const std::vector<BodyMesh>& bodies,
                        const ResultText& result);
Page machine_new_page(const Machine& machine, const ResultText& result);
/// `model effects`: the library as one table.
Page effects_page(const ResultText& result);

/// `iso230 2` and `iso230 6`: single readings, means and the band of two standard deviations by target, and
/// all symbols in one table.
Page positioning_page(const ResultText& result);
/// `iso230 4`: polar plots of the circles, and what shapes them in per cent.
Page circles_page(const ResultText& result);
/// `iso230 7`: polar plots of the error motions.
Page rotation_page(const ResultText& result);

}  // namespace trunnion::report
