#include "diagnosis/verdict/unrecorded.hpp"

// Lost motion of a rotary axis that grows with its tilt, of a slide that depends on where it is: in a run
// that goes there and back it is a step at the moment at which the axis turns round.
namespace trunnion::diagnosis {
namespace {

MatrixXd with_sense(const Observations& o, std::size_t run, AxisId axis) {
  const MatrixXd& part = o.response(o.link_count() - 1);
  MatrixXd out = MatrixXd::Zero(o.size(), 3);
  for (const Eigen::Index i : o.runs()[run])
    out.row(i) = part.row(i).head<3>() * static_cast<double>(o.state(i).direction[axis]);
  return out;
}

bool turns_round(const Observations& o, std::size_t run, AxisId axis) {
  bool up = false, down = false;
  for (const Eigen::Index i : o.runs()[run]) {
    up = up || o.state(i).direction[axis] > 0;
    down = down || o.state(i).direction[axis] < 0;
  }
  return up && down;
}

}  // namespace

std::vector<UnrecordedCondition> reversals(const Observations& o) {
  constexpr double kLargest_mm = 0.1;
  std::vector<UnrecordedCondition> out;
  for (std::size_t run = 0; run < o.runs().size(); ++run)
    for (AxisId axis = 0; axis < o.machine().axes.size(); ++axis) {
      if (!turns_round(o, run, axis)) continue;
      const std::string& name = o.machine().axes[axis].name;
      UnrecordedCondition one;
      one.what = "something that turns over with the sense in which " + name + " moves in run '" +
                 o.data().context.runs[run].id + "' (lost motion of " + name +
                 " that depends on where it stands)";
      one.remedy =
          "Measure there and back at other tilts and positions, so that it shows on what the lost motion "
          "hangs.";
      one.stands_for = is_step;
      one.columns = [&o, run, axis](double) { return with_sense(o, run, axis); };
      one.largest = VectorXd::Constant(3, kLargest_mm);
      out.push_back(std::move(one));
    }
  return out;
}

}  // namespace trunnion::diagnosis
