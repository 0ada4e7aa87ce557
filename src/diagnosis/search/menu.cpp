#include <algorithm>
#include <cmath>

#include "trunnion/base/units.hpp"

#include "diagnosis/fit/variance.hpp"
#include "diagnosis/verdict/next_measurement.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kUnlimited = 300.0;  // mm each way of a linear axis without limits
constexpr double kUseOfTravel = 0.8;  // of a linear axis' range: the rest is overrun and cover
constexpr double kSlow = 1000.0 / kSecondsPerMinute, kFast = 6000.0 / kSecondsPerMinute;  // mm/s
const std::vector<Vec3> kAll = {Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()};

class Menu {
 public:
  Menu(const Machine& machine, double u_mm, double u_rad) : machine_(machine), u_mm_(u_mm), u_rad_(u_rad) {
    for (AxisId a = 0; a < machine.axes.size(); ++a) home_[a] = middle(a);
  }

  std::vector<PlanRun> all() {
    for (AxisId a = 0; a < machine_.axes.size(); ++a)
      (machine_.axes[a].kind == AxisKind::linear ? linear(a) : rotary(a));
    table();
    circles();
    diagonals();
    warm_up();
    return std::move(out_);
  }

 private:
  std::pair<double, double> range(AxisId a) const {
    const Axis& axis = machine_.axes[a];
    if (axis.kind == AxisKind::rotary) {
      if (!axis.has_limits() || axis.cyclic) return {-kPi, kPi};
      return {axis.min, axis.max};
    }
    if (!axis.has_limits()) return {-kUnlimited, kUnlimited};
    const double m = 0.5 * (axis.min + axis.max), half = 0.5 * kUseOfTravel * (axis.max - axis.min);
    return {m - half, m + half};
  }
  double middle(AxisId a) const {
    if (machine_.axes[a].kind == AxisKind::rotary) return 0.0;
    const auto [low, high] = range(a);
    return 0.5 * (low + high);
  }
  /// What a run reads.
  struct Reads {
    std::string id;
    double minutes;
    Quantity quantity;
    std::vector<Vec3> n;
  };
  PlanRun base(Reads reads) const {
    PlanRun run;
    run.id = std::move(reads.id);
    run.minutes = reads.minutes;
    run.quantity = reads.quantity;
    run.n = std::move(reads.n);
    run.tool_mm = machine_.tool_vector();
    run.u_random = run.quantity == Quantity::displacement ? u_mm_ : u_rad_;
    return run;
  }
  PlanRun sweep(Reads reads, AxisId a, std::size_t points, double low, double high) const {
    PlanRun run = base(std::move(reads));
    run.both_directions = true;
    run.path = PlanSweep{a, low, high, points, home_};
    return run;
  }

  void linear(AxisId a) {
    const auto [low, high] = range(a);
    const std::string& name = machine_.axes[a].name;
    const Vec3 along = machine_.axes[a].direction;
    out_.push_back(sweep({"laser " + name, 15, Quantity::displacement, {along}}, a, 21, low, high));
    out_.push_back(
        sweep({"laser and straightness " + name, 30, Quantity::displacement, kAll}, a, 21, low, high));
    out_.push_back(sweep({"angles " + name, 25, Quantity::rotation, kAll}, a, 21, low, high));
    const double centre = 0.5 * (low + high), half = std::min(0.5 * (high - low), 26.0);
    out_.push_back(sweep({"laser " + name + ", fine steps", 20, Quantity::displacement, {along}}, a, 105,
                         centre - half, centre + half));
    for (const auto& [feed, word] : {std::pair{kSlow, "slow"}, std::pair{kFast, "fast"}}) {
      out_.push_back(sweep({"laser " + name + " on the fly, " + word, 5, Quantity::displacement, {along}}, a,
                           41, low, high));
      out_.back().feed_mm_s = feed;
    }
  }

  void rotary(AxisId a) {
    const auto [low, high] = range(a);
    const std::string& name = machine_.axes[a].name;
    out_.push_back(sweep({"angles " + name, 20, Quantity::rotation, kAll}, a, 25, low, high));
    out_.push_back(
        sweep({"angles " + name + ", fine steps", 30, Quantity::rotation, {machine_.axes[a].direction}}, a,
              145, low, high));
  }

  // A ball on the table, followed by the tool over all rotary positions; a second height, a second tool
  // length.
  void table() {
    const auto rotaries = machine_.rotary_axes();
    if (rotaries.empty()) return;
    PlanGrid grid;
    grid.base = home_;
    for (std::size_t k = 0; k < rotaries.size(); ++k) {
      const auto [low, high] = range(rotaries[k]);
      const bool inner = k + 1 == rotaries.size();
      const std::size_t points = inner ? 8 : 5;
      std::vector<double> values;
      for (std::size_t i = 0; i < points; ++i)
        values.push_back(low + (high - low) * static_cast<double>(i) /
                                   static_cast<double>(inner ? points : points - 1));
      grid.values.emplace_back(rotaries[k], values);
    }
    for (const auto& [height, text] : {std::pair{50.0, ""}, std::pair{150.0, ", ball raised by 100 mm"}}) {
      PlanRun run = base({std::string("R-test") + text, 20, Quantity::displacement, kAll});
      grid.ball_P = Vec3(100.0, 0.0, height);
      run.path = grid;
      out_.push_back(run);
      run.id += ", both directions";
      run.minutes = 35;
      run.both_directions = true;
      out_.push_back(run);
    }
    PlanRun run = base({"R-test with a tool 80 mm longer", 20, Quantity::displacement, kAll});
    run.tool_mm.z() -= 80.0;
    run.path = grid;
    out_.push_back(run);
  }

  void circles() {
    std::vector<AxisId> linear;
    for (AxisId a = 0; a < machine_.axes.size(); ++a)
      if (machine_.axes[a].kind == AxisKind::linear) linear.push_back(a);
    for (std::size_t i = 0; i < linear.size(); ++i)
      for (std::size_t k = i + 1; k < linear.size(); ++k)
        for (const auto& [feed, word] : {std::pair{kSlow, "slow"}, std::pair{kFast, "fast"}}) {
          PlanRun run =
              base({"ball-bar " + machine_.axes[linear[i]].name + machine_.axes[linear[k]].name + ", " + word,
                    8,
                    Quantity::displacement,
                    {}});
          run.radial = true;
          run.both_directions = true;
          run.feed_mm_s = feed;
          run.path = PlanCircle{linear[i], linear[k], 100.0, 72, home_};
          out_.push_back(run);
        }
  }

  void diagonals() {
    for (int corner = 0; corner < 4; ++corner) {
      PlanLine line{home_, home_, 21};
      std::size_t axis = 0;
      Vec3 along = Vec3::Zero();
      for (AxisId a = 0; a < machine_.axes.size(); ++a) {
        if (machine_.axes[a].kind != AxisKind::linear) continue;
        auto [low, high] = range(a);
        if ((corner >> axis++ & 1) != 0) std::swap(low, high);
        line.from[a] = low;
        line.to[a] = high;
        along += machine_.axes[a].direction * (high - low) * (machine_.axes[a].carries_part ? -1.0 : 1.0);
      }
      if (!(along.norm() > 0.0)) return;
      PlanRun run =
          base({"diagonal " + std::to_string(corner + 1), 15, Quantity::displacement, {along.normalized()}});
      run.both_directions = true;
      run.path = line;
      out_.push_back(run);
    }
  }

  void warm_up() {
    PlanRun run =
        base({"spindle warm-up, 60 min at 8000 rpm and 60 min at rest", 120, Quantity::displacement, kAll});
    run.path = PlanPoses{{home_}};
    run.repeat = 60;
    run.spindle_rpm = {{0.0, 8000.0}, {60.0 * kSecondsPerMinute, 0.0}};
    out_.push_back(run);
    run.id = "drift at rest, 60 min";
    run.minutes = 60;
    run.spindle_rpm = {};
    out_.push_back(run);
  }

  const Machine& machine_;
  double u_mm_, u_rad_;
  JointVector home_;
  std::vector<PlanRun> out_;
};

}  // namespace

std::vector<PlanRun> menu(const Machine& machine, double u_mm, double u_rad) {
  std::vector<PlanRun> out;
  for (PlanRun& run : Menu(machine, u_mm, u_rad).all())
    if (expand({run}, machine)) out.push_back(std::move(run));  // a pose beyond limits: not on this machine
  return out;
}

std::vector<PlanRun> menu(const Observations& o) {
  constexpr double kDefault_mm = 1e-3, kDefault_rad = 2e-6;  // where the data have no reading of a quantity
  const double u_mm = typical_u(o, Quantity::displacement), u_rad = typical_u(o, Quantity::rotation);
  return menu(o.machine(), u_mm > 0.0 ? u_mm : kDefault_mm, u_rad > 0.0 ? u_rad : kDefault_rad);
}

}  // namespace trunnion::diagnosis
