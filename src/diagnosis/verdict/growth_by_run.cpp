#include "diagnosis/verdict/unrecorded.hpp"

// Scales and screws that are warmer in one run than in another, where no sensor says so: squarenesses,
// set-ups that tilt and errors that repeat along an axis were found together in their place.
namespace trunnion::diagnosis {
namespace {

constexpr double kLargestGrowth = 4e-4;  // steel at 35 K; and as much in an hour
constexpr double kLargestShift_mm = 0.2;

// Of one run: the axes longer by a share of their position, that share growing with time, and the fixed point
// of each, which nobody knows, displaced in either way.
class Growth {
 public:
  Growth(const Observations& o, std::vector<AxisId> axes) : o_(o), axes_(std::move(axes)) {}

  MatrixXd columns() const {
    const Eigen::Index of_run = columns_of_run();
    MatrixXd out = MatrixXd::Zero(o_.size(), of_run * static_cast<Eigen::Index>(o_.runs().size()));
    for (std::size_t run = 0; run < o_.runs().size(); ++run)
      for (const Eigen::Index i : o_.runs()[run])
        fill(i, out.row(i).segment(static_cast<Eigen::Index>(run) * of_run, of_run));
    return out;
  }
  VectorXd largest() const {
    VectorXd one = VectorXd::Constant(columns_of_run(), kLargestShift_mm);
    one.head<2>().setConstant(kLargestGrowth);
    return one.replicate(static_cast<Eigen::Index>(o_.runs().size()), 1);
  }

 private:
  Eigen::Index columns_of_run() const { return static_cast<Eigen::Index>(2 + 2 * axes_.size()); }
  void fill(Eigen::Index i, Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>> row) const {
    const MachineState& state = o_.state(i);
    const double hours = state.time_s / 3600.0;
    Eigen::Index next = 2;
    for (const AxisId axis : axes_) {
      const double along =
          o_.response(axis).row(i).head<3>().dot(o_.machine().axes[axis].direction.transpose());
      row[0] += along * state.q[axis];
      row[1] += along * state.q[axis] * hours;
      row[next++] = along;
      row[next++] = along * hours;
    }
  }

  const Observations& o_;
  std::vector<AxisId> axes_;
};

}  // namespace

std::vector<UnrecordedCondition> growth_by_run(const Observations& o) {
  std::vector<UnrecordedCondition> out;
  if (o.runs().size() < 2) return out;
  std::vector<AxisId> linear;
  for (AxisId axis = 0; axis < o.machine().axes.size(); ++axis)
    if (o.machine().axes[axis].kind == AxisKind::linear) linear.push_back(axis);
  const auto add = [&](std::vector<AxisId> axes, const std::string& names) {
    UnrecordedCondition one;
    one.what =
        "a length of " + names + " that differs from run to run, as at temperatures that no sensor recorded";
    one.remedy =
        "Measure all runs at one temperature, or record that of the scales or screws (a column "
        "T_<name>_degC) and diagnose again.";
    one.stands_for = may_come_of_order;
    const Growth growth(o, std::move(axes));
    one.largest = growth.largest();
    one.columns = [growth](double) { return growth.columns(); };
    out.push_back(std::move(one));
  };
  std::string all;
  for (const AxisId axis : linear) {
    const std::string& name = o.machine().axes[axis].name;
    add({axis}, name);
    all += (all.empty() ? "" : axis == linear.back() ? " and " : ", ") + name;
  }
  add(linear, all);
  return out;
}

}  // namespace trunnion::diagnosis
