#include "effects/table_effect.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "trunnion/base/number_text.hpp"

#include "effects/closed_turn.hpp"
#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

constexpr int kAngleDecimals = 4;

std::string position_text(double value, bool rotary) {
  return rotary ? fixed_text(Angle::radians(value).deg(), kAngleDecimals) + " deg"
                : shortest_text(value) + " mm";
}

// Least-squares slope of the values over the argument that is the joint's own axis.
std::optional<double> slope_over(const ErrorTable& table, const Grid& grid, const std::string& joint) {
  const auto own = std::find(table.arguments.begin(), table.arguments.end(), joint);
  if (own == table.arguments.end()) return std::nullopt;
  const bool first = own == table.arguments.begin();
  double n = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
  for (std::size_t i = 0; i < grid.u.size(); ++i) {
    for (std::size_t j = 0; j < grid.columns(); ++j) {
      const double x = first ? grid.u[i] : grid.v[j];
      const double y = grid.at(i, j);
      n += 1.0, sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

// A table around a whole turn closes.
void close_turns(const ErrorTable& table, const Machine& machine, Grid& grid) {
  for (std::size_t k = 0; k < table.arguments.size(); ++k) {
    if (machine.axes[*machine.axis(table.arguments[k])].kind == AxisKind::rotary &&
        lacks_end_of_turn(k == 0 ? grid.u : grid.v))
      close_turn(grid, k);
  }
}

}  // namespace

// A table of C from 0 to 360 deg holds for every turn of C. Beyond a part of a turn the nearer end is meant.
double TableEffect::Argument::in_table(double q) const {
  if (!rotary || (q >= min && q <= max)) return q;
  const double from_min = q - min - kTwoPi * std::floor((q - min) / kTwoPi);
  const double beyond = min + from_min - max;
  return beyond > kTwoPi - from_min ? min - (kTwoPi - from_min) : min + from_min;
}

std::shared_ptr<const TableEffect> TableEffect::with_file(const std::string& file) const {
  const std::shared_ptr<TableEffect> out(new TableEffect(*this));
  out->spec_.file = file;
  return out;
}

Result<std::shared_ptr<const TableEffect>> TableEffect::make(const TableSpec& spec, const ErrorTable& table,
                                                             const Machine& machine) {
  const std::string joint = spec.component.substr(2);
  const auto id = machine.axis(joint);
  if (!id)
    return fail(ErrorCode::wrong_input, "component " + spec.component + ": the machine has no axis " + joint);
  if (table.component(spec.component) == nullptr) {
    std::string have;
    for (const auto& c : table.components) have += (have.empty() ? "" : ", ") + c.name;
    return fail(ErrorCode::wrong_input,
                "table '" + spec.file + "' has no column " + spec.component + "; it has " + have);
  }
  const std::shared_ptr<TableEffect> out(new TableEffect());
  out->spec_ = spec;
  if (!spec.interpolation_given) {
    out->spec_.interpolation.method =
        table.arguments.size() == 1 ? Interpolation::linear : Interpolation::bilinear;
  }
  Grid grid = table.grid(spec.component);
  out->slope_ = slope_over(table, grid, joint);
  out->mean_ =
      std::accumulate(grid.values.begin(), grid.values.end(), 0.0) / static_cast<double>(grid.values.size());
  if (spec.interpolation.weights.empty()) close_turns(table, machine, grid);
  auto function = make_interpolant(grid, out->spec_.interpolation);
  if (!function) return tl::unexpected(function.error());
  out->function_ = *function;
  out->link_ = joint_link(*id);
  out->unit_ = unit_twist(spec.component[1]);
  for (std::size_t k = 0; k < table.arguments.size(); ++k) {
    const AxisId axis = *machine.axis(table.arguments[k]);
    const std::vector<double>& nodes = k == 0 ? grid.u : grid.v;
    out->arguments_.push_back(
        {axis, table.arguments[k], machine.axes[axis].kind == AxisKind::rotary, nodes.front(), nodes.back()});
  }
  out->info_.id = "component:" + spec.component;
  out->info_.what = "Error table of " + spec.component + " over " + table.arguments[0] +
                    (table.arguments.size() > 1 ? " and " + table.arguments[1] : "") + ", " +
                    std::string(text_of(out->spec_.interpolation.method)) + ", file " + spec.file;
  out->info_.cause = "as measured";
  out->info_.remedy = "measure again when the machine has been moved, levelled or has met something hard";
  return std::shared_ptr<const TableEffect>(out);
}

Twist TableEffect::fixed_part(const MachineState& state, std::span<const double>,
                              std::span<const double>) const {
  const double u = arguments_[0].in_table(state.q[arguments_[0].axis]);
  const double v = arguments_.size() > 1 ? arguments_[1].in_table(state.q[arguments_[1].axis]) : 0.0;
  return unit_ * function_->value(u, v);
}

void TableEffect::Argument::add_seams(double q0, double q1, std::vector<double>& out) const {
  if (!rotary || q0 == q1) return;
  const double low = std::min(q0, q1);
  const double high = std::max(q0, q1);
  for (const double end : {min, max}) {
    for (double q = end + kTwoPi * std::ceil((low - end) / kTwoPi); q < high; q += kTwoPi) {
      if (q > low) out.push_back((q - q0) / (q1 - q0));
    }
  }
}

// Cut where the table's turn begins anew: between the cuts the interpolant sees one straight line.
std::optional<TwistBend> TableEffect::bend(const MachineState& from, const MachineState& to,
                                           std::span<const double>) const {
  if (std::none_of(arguments_.begin(), arguments_.end(), [](const Argument& a) { return a.rotary; })) {
    // No seams: the whole motion is one straight line to the interpolant.
    const auto at = [&](const MachineState& state, std::size_t i) {
      return i < arguments_.size() ? state.q[arguments_[i].axis] : 0.0;
    };
    const auto bend = function_->bend(at(from, 0), at(from, 1), at(to, 0), at(to, 1));
    return bend ? std::optional(bend_along(unit_, *bend)) : std::nullopt;
  }
  std::vector<double> cuts{0.0, 1.0};
  for (const Argument& a : arguments_) a.add_seams(from.q[a.axis], to.q[a.axis], cuts);
  std::sort(cuts.begin(), cuts.end());
  struct Ends {
    double at0 = 0.0, at1 = 0.0;
  };
  std::vector<Ends> values;
  std::vector<double> bends;
  for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
    std::array<std::array<double, 2>, 2> x{};  // [end][argument]
    for (std::size_t i = 0; i < arguments_.size(); ++i) {
      const Argument& a = arguments_[i];
      const double q0 = from.q[a.axis];
      const double way = to.q[a.axis] - q0;
      const double middle = q0 + 0.5 * (cuts[k] + cuts[k + 1]) * way;
      const double in = a.in_table(middle);
      // In the part of a turn that the table leaves out an end is held, and which one jumps half way.
      if (a.rotary && (in < a.min || in > a.max)) return std::nullopt;
      x[0][i] = q0 + cuts[k] * way + (in - middle);
      x[1][i] = q0 + cuts[k + 1] * way + (in - middle);
      if (a.rotary) {
        for (auto& end : x) end[i] = std::clamp(end[i], a.min, a.max);
      }
    }
    const auto bend = function_->bend(x[0][0], x[0][1], x[1][0], x[1][1]);
    if (!bend) return std::nullopt;
    bends.push_back(*bend);
    values.push_back({function_->value(x[0][0], x[0][1]), function_->value(x[1][0], x[1][1])});
  }
  const double start = values.front().at0;
  const double finish = values.back().at1;
  double largest = 0.0;
  for (std::size_t k = 0; k < bends.size(); ++k) {
    const auto off = [&](double t, double value) {
      return std::abs(value - ((1.0 - t) * start + t * finish));
    };
    largest =
        std::max(largest, std::max(off(cuts[k], values[k].at0), off(cuts[k + 1], values[k].at1)) + bends[k]);
  }
  return bend_along(unit_, largest);
}

// Over a rotary axis the value may jump where the table's turn begins anew.
std::optional<TwistRange> TableEffect::range(std::span<const double>, std::span<const Axis>) const {
  const auto range = function_->range();
  if (!range || std::any_of(arguments_.begin(), arguments_.end(), [](const Argument& a) { return a.rotary; }))
    return std::nullopt;
  TwistRange out;
  out.largest = bend_along(unit_, range->largest);
  out.per_unit[arguments_[0].axis] = bend_along(unit_, range->slope_u);
  if (arguments_.size() > 1) out.per_unit[arguments_[1].axis] = bend_along(unit_, range->slope_v);
  return out;
}

RangeCheck TableEffect::check_range(const MachineState& state) const {
  constexpr double kSlack = 1e-9;  // mm, rad: rounding of a range written in other units
  for (const Argument& a : arguments_) {
    const double q = a.in_table(state.q[a.axis]);
    if (q >= a.min - kSlack && q <= a.max + kSlack) continue;
    RangeCheck out;
    out.verdict = spec_.refuse_outside ? RangeCheck::Verdict::refused : RangeCheck::Verdict::held;
    out.message = "table '" + spec_.file + "' of " + spec_.component + " ends at " +
                  position_text(q < a.min ? a.min : a.max, a.rotary) + " of " + a.name +
                  "; the machine is at " + position_text(state.q[a.axis], a.rotary) +
                  (spec_.refuse_outside ? "" : ": the value at the end is held");
    return out;
  }
  return {};
}

std::optional<StraightCourse> TableEffect::straight_course() const {
  const Grid* grid = function_->straight();
  if (grid == nullptr || arguments_[0].rotary) return std::nullopt;
  int component = 0;
  const bool rotates = unit_.trans_mm.isZero(0.0);
  (rotates ? unit_.rot_rad : unit_.trans_mm).maxCoeff(&component);
  return StraightCourse{arguments_[0].axis, rotates ? component + 3 : component, grid->u, grid->values};
}

std::vector<std::pair<std::string, std::string>> TableEffect::file_keys() const {
  return {{"table", spec_.file},
          {"interpolation", std::string(text_of(spec_.interpolation.method))},
          {"outside", spec_.refuse_outside ? "error" : "hold"}};
}

}  // namespace trunnion::effects
