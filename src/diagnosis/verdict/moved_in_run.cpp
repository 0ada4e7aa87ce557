#include <algorithm>
#include <cmath>

#include "diagnosis/fit/usual_size.hpp"
#include "diagnosis/verdict/unrecorded.hpp"

// One run that was set up, homed or scaled otherwise than the others: a constant of that run, which a
// temperature that hardly moved in it labels as well.
namespace trunnion::diagnosis {
namespace {

constexpr std::size_t kFewestOfMoved = 8;
constexpr std::size_t kMostRunsMoved = 12;  // more are no longer a few constants
constexpr double kLargestMove_mm = 1.0;     // more is a mistake of the files
constexpr double kLargestScale = 1e-3;      // of a length: a wrong temperature is 1e-4
constexpr double kUnusualSize = 3.0;        // times the usual size of an effect

// A machine that is so much more sensitive to temperature than machines are.
bool is_unusually_thermal(const ModelEffect& effect) {
  return is_thermal(effect) && is_beyond_usual(effect, kUnusualSize);
}

// Three translations of the link, in each of these runs by their own.
MatrixXd place_columns(const Observations& o, std::size_t link, const std::vector<std::size_t>& runs) {
  const MatrixXd& response = o.response(link);
  MatrixXd out = MatrixXd::Zero(o.size(), 3 * static_cast<Eigen::Index>(runs.size()));
  for (std::size_t k = 0; k < runs.size(); ++k)
    for (const Eigen::Index i : o.runs()[runs[k]])
      out.row(i).segment(3 * static_cast<Eigen::Index>(k), 3) = response.row(i).head<3>();
  return out;
}

// The run's own reading of a length along the axis.
MatrixXd scale_columns(const Observations& o, AxisId axis, std::size_t run) {
  MatrixXd out = MatrixXd::Zero(o.size(), 1);
  for (const Eigen::Index i : o.runs()[run])
    out(i, 0) = o.response(axis).row(i).head<3>().dot(o.machine().axes[axis].direction.transpose()) *
                o.state(i).q[axis];
  return out;
}

std::vector<std::size_t> runs_of_some_size(const Observations& o) {
  std::vector<std::size_t> out;
  for (std::size_t run = 0; run < o.runs().size(); ++run)
    if (o.runs()[run].size() >= kFewestOfMoved) out.push_back(run);
  return out;
}

}  // namespace

std::vector<UnrecordedCondition> moved_in_run(const Observations& o) {
  std::vector<UnrecordedCondition> out;
  const std::vector<std::size_t> runs = runs_of_some_size(o);
  if (runs.size() < 2) return out;
  const auto add_place = [&](std::size_t link, const std::vector<std::size_t>& in, const std::string& what,
                             const std::string& remedy) {
    UnrecordedCondition one;
    one.what = what;
    one.remedy = remedy;
    if (in.size() == 1) one.only_in = in.front();
    one.stands_for = is_unusually_thermal;
    one.columns = [&o, link, in](double) { return place_columns(o, link, in); };
    one.largest = VectorXd::Constant(3 * static_cast<Eigen::Index>(in.size()), kLargestMove_mm);
    out.push_back(std::move(one));
  };
  const std::size_t spindle = o.link_count() - 2;
  const std::string of_ball = "Check the length and the run-out of the ball or probe, and measure ";
  for (const std::size_t run : runs) {
    const std::string in = " in run '" + o.data().context.runs[run].id + "' alone";
    const std::string again = "run '" + o.data().context.runs[run].id + "' once more.";
    add_place(spindle, {run},
              "the measured point in the spindle (length, run-out) that stands elsewhere" + in,
              of_ball + again);
    for (AxisId axis = 0; axis < o.machine().axes.size(); ++axis) {
      const std::string& name = o.machine().axes[axis].name;
      if (o.machine().axes[axis].kind == AxisKind::rotary) {
        add_place(axis, {run}, "an axis of " + name + " that stands elsewhere" + in,
                  "Was something homed anew, or hit, between the runs? Measure " + again);
        continue;
      }
      UnrecordedCondition one;
      one.what = "a wrong scale of the lengths along " + name + in;
      one.remedy =
          "Check the instrument of that run (wavelength, temperature, alignment), and measure it once more.";
      one.only_in = run;
      one.stands_for = is_of_axes;
      one.columns = [&o, axis, run](double) { return scale_columns(o, axis, run); };
      one.largest = VectorXd::Constant(1, kLargestScale);
      out.push_back(std::move(one));
    }
  }
  if (runs.size() <= kMostRunsMoved)
    add_place(spindle, {runs.begin() + 1, runs.end()},
              "a measured point in the spindle (length, run-out) that differs from run to run",
              of_ball + "one ball place in all runs without taking it out.");
  return out;
}

std::vector<UnrecordedCondition> scaled_runs(const Observations& o, const Model& fitted) {
  constexpr double kLargestFactor = 30.0;  // more is another unit, a mistake of the files
  std::vector<UnrecordedCondition> out;
  const std::vector<std::size_t> runs = runs_of_some_size(o);
  if (runs.size() < 2 || fitted.effects.empty()) return out;
  const VectorXd says = o.predicted(fitted);
  for (const std::size_t run : runs) {
    MatrixXd column = MatrixXd::Zero(o.size(), 1);
    for (const Eigen::Index i : o.runs()[run]) column(i, 0) = says[i];
    if (column.norm() == 0.0) continue;
    UnrecordedCondition one;
    one.kind = ConditionKind::scale;
    one.what = "a wrong scale of the readings of run '" + o.data().context.runs[run].id + "' alone";
    one.remedy =
        "Check the calibration of that run's probe or instrument and the unit of its readings, and measure "
        "it "
        "once more.";
    one.only_in = run;
    one.stands_for = is_thermal;
    one.columns = [column](double) { return column; };
    one.largest = VectorXd::Constant(1, kLargestFactor);
    out.push_back(std::move(one));
  }
  return out;
}

}  // namespace trunnion::diagnosis
