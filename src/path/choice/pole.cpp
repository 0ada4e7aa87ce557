#include "trunnion/path/pole.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/machine/table_kinematics.hpp"

#include "path/choice/rotary_connection.hpp"

namespace trunnion::path {
namespace {

// Rotations of the string: it converges like the square of the number of points, and stretches are short.
constexpr int kMostSweeps = 4000;
constexpr double kStill_rad = 1e-10;
// Of the tolerance: the words are rounded afterwards.
constexpr double kMargin = 0.98;

/// The two rotary axes of a machine and what they make of a tool axis.
class Pole {
 public:
  Pole(const Machine& machine, const Vec3& tool_mm) : kinematics_(machine, tool_mm) {}

  AxisId outer() const { return kinematics_.rotary(0); }
  AxisId inner() const { return kinematics_.rotary(1); }
  const TableKinematics& kinematics() const { return kinematics_; }

  Angle tilt(const Vec3& axis_P) const {
    const Vec3& n = kinematics_.direction(1);
    return std::min(angle_between(axis_P, n), angle_between(axis_P, Vec3(-n)));
  }
  Vec3 nearest(const Vec3& axis_P) const {
    const Vec3& n = kinematics_.direction(1);
    return axis_P.dot(n) >= 0.0 ? n : Vec3(-n);
  }
  // By how much the tool axis misses `axis_P` with C at `inner` and the best outer angle: the turn about n0
  // keeps the angle to n0.
  double misses_by(const Vec3& axis_P, double inner) const {
    return std::abs(angle_between(kinematics_.direction(0), turned(axis_P, inner)).rad() -
                    angle_between(kinematics_.direction(0), kinematics_.spindle()).rad());
  }
  // The best outer angle there, at the turn nearest to `near`.
  double best_outer(const Vec3& axis_P, double inner, double near) const {
    const Vec3& n = kinematics_.direction(0);
    const Vec3 from = turned(axis_P, inner);
    const Vec3& to = kinematics_.spindle();
    const Vec3 a = from - n.dot(from) * n;
    const Vec3 b = to - n.dot(to) * n;
    const double angle = std::atan2(n.dot(a.cross(b)), a.dot(b));
    return near + std::remainder(angle - near, kTwoPi);
  }

 private:
  Vec3 turned(const Vec3& axis_P, double inner) const {
    TableKinematics::Sines s;
    s.sin[1] = std::sin(inner);
    s.cos[1] = std::cos(inner);
    return kinematics_.turn(1, axis_P, s);
  }
  TableKinematics kinematics_;
};

struct Window {
  double low = 0.0;
  double high = 0.0;
};

// How far C may leave `angle` to this side until the tool axis misses by more than the tolerance: half a turn
// at most. `angle` need not be where it misses least. A turn of C moves the axis by no more than the sine of
// its tilt: steps that this allows pass over nothing.
double reach(const Pole& pole, const Vec3& axis_P, double angle, double sense, double tolerance_rad) {
  constexpr double kLeastStep_rad = 1e-3;  // the axis by a ten-thousandth of the cone: far within kMargin
  const auto misses = [&](double by) { return pole.misses_by(axis_P, angle + sense * by); };
  const double tilt = pole.tilt(axis_P).rad();
  if (tilt <= tolerance_rad) return kPi;
  double inside = 0.0;
  double outside = 0.0;
  do {
    inside = outside;
    if (inside >= kPi) return kPi;
    outside = inside + std::max(kLeastStep_rad, (tolerance_rad - misses(inside)) / std::sin(tilt));
  } while (misses(outside) <= tolerance_rad);
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (inside + outside);
    (misses(middle) <= tolerance_rad ? inside : outside) = middle;
  }
  return std::min(inside, kPi);
}

// The straightest way through the windows: each place goes to the straight line between its neighbours.
void pull_tight(const std::vector<double>& along, const std::vector<Window>& windows,
                std::vector<double>& angle) {
  const std::size_t n = angle.size();
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    double moved = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      double wanted = 0.0;
      if (i == 0 || i + 1 == n) {
        wanted = i == 0 ? angle[std::min<std::size_t>(1, n - 1)] : angle[i - 1];
      } else {
        const double whole = along[i + 1] - along[i - 1];
        const double part = whole > 0.0 ? (along[i] - along[i - 1]) / whole : 0.5;
        wanted = angle[i - 1] + part * (angle[i + 1] - angle[i - 1]);
      }
      wanted = std::clamp(wanted, windows[i].low, windows[i].high);
      moved = std::max(moved, std::abs(wanted - angle[i]));
      angle[i] = wanted;
    }
    if (moved < kStill_rad) return;
  }
}

struct Span {
  std::size_t first = 0;
  std::size_t last = 0;
  bool anchored_before = false;  // the point before is cut from
  bool anchored_behind = false;
};

// Points first..last inside the cone that are one cut.
std::vector<Span> spans(const Pole& pole, const PoleOptions& options, std::span<const ChoicePoint> points,
                        std::span<const ChosenPoint> chosen, bool goes_on) {
  std::vector<Span> out;
  const auto inside = [&](std::size_t i) { return pole.tilt(points[i].pose.axis_P) <= options.cone; };
  const auto cut_to = [&](std::size_t i) { return !points[i].rapid && !chosen[i].reconfigure; };
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!inside(i)) continue;
    Span span{i, i, (i > 0 || goes_on) && cut_to(i), false};
    while (span.last + 1 < points.size() && inside(span.last + 1) && cut_to(span.last + 1)) ++span.last;
    span.anchored_behind = span.last + 1 < points.size() && cut_to(span.last + 1);
    out.push_back(span);
    i = span.last;
  }
  return out;
}

// Largest turn of C between two neighbours of the span, its anchors included. `from`: before point 0.
double largest_turn(const Span& span, AxisId inner, std::span<const ChosenPoint> chosen,
                    const std::optional<PoleStart>& from) {
  double largest = 0.0;
  const std::size_t first = span.anchored_before ? span.first : span.first + 1;
  const std::size_t last = span.anchored_behind ? span.last + 1 : span.last;
  for (std::size_t i = first; i <= last; ++i) {
    const JointVector& before = i > 0 ? chosen[i - 1].q_leave : from->q;
    largest = std::max(largest, std::abs(chosen[i].q[inner] - before[inner]));
  }
  for (std::size_t i = span.first; i <= span.last; ++i)
    largest = std::max(largest, std::abs(chosen[i].q_leave[inner] - chosen[i].q[inner]));
  return largest;
}

// Points first..last in the cone, of which `nearest` is nearest to the pole.
struct Passage {
  std::size_t first, last, nearest;
};

// The axes of a passage: straight through the pole, as far as they are within the tolerance of that line.
void lead_through(const Pole& pole, double tolerance_rad, std::span<const ChoicePoint> points,
                  const Passage& passage, std::vector<ChoicePoint>& out) {
  const auto [first, last, nearest] = passage;
  const Vec3 n = pole.nearest(points[nearest].pose.axis_P);
  const auto across = [&](std::size_t i) {
    const Vec3& u = points[i].pose.axis_P;
    return Vec3(u - n.dot(u) * n);
  };
  const Vec3 way = across(std::min(nearest + 1, last)) - across(std::max(nearest, first + 1) - 1);
  const Vec3 along = way.norm() > 1e-9 ? Vec3(way.normalized()) : Vec3(Vec3::Zero());
  const auto put = [&](std::size_t i) {
    const Vec3 on_line = along.dot(across(i)) * along;
    if ((across(i) - on_line).norm() > std::sin(tolerance_rad)) return false;
    out[i].pose.axis_P = on_line + std::sqrt(1.0 - on_line.squaredNorm()) * n;
    return true;
  };
  for (std::size_t i = nearest; i <= last && put(i); ++i) continue;
  for (std::size_t i = nearest; i > first && put(i - 1); --i) continue;
}

class Tightener {
 public:
  Tightener(const Machine& machine, const Pole& pole, const PoleOptions& options, Angle axis_tolerance,
            const PoleRun& run)
      : machine_(machine),
        pole_(pole),
        tolerance_(kMargin * options.tolerance.rad()),
        connection_(pole.kinematics(), axis_tolerance),
        programmed_(run.programmed),
        points_(run.points),
        chosen_(run.chosen),
        from_(run.from) {}

  PoleStretch run(const Span& span) {
    const auto first = static_cast<std::ptrdiff_t>(span.first);
    const auto last = static_cast<std::ptrdiff_t>(span.last + 1);
    const std::vector<ChoicePoint> planned_points(points_.begin() + first, points_.begin() + last);
    const std::vector<ChosenPoint> planned(chosen_.begin() + first, chosen_.begin() + last);
    held_.assign(planned.size(), false);
    tighten(span);
    while (hold_parted(span)) {
      std::copy(planned_points.begin(), planned_points.end(), points_.begin() + first);
      std::copy(planned.begin(), planned.end(), chosen_.begin() + first);
      tighten(span);
    }
    PoleStretch out;
    out.first = span.first;
    out.last = span.last;
    for (std::size_t i = span.first; i <= span.last; ++i)
      out.tilted_by =
          std::max(out.tilted_by, angle_between(points_[i].pose.axis_P, programmed_[i].pose.axis_P));
    out.turn_after = Angle::radians(largest_turn(span, pole_.inner(), chosen_, from_));
    out.early = !span.anchored_before && points_[span.first].rapid;
    return out;
  }

 private:
  void tighten(const Span& span) {
    gather(span);
    pull_tight(along_, windows_, angle_);
    const std::size_t offset = span.anchored_before ? 1 : 0;
    for (std::size_t i = span.first; i <= span.last; ++i) {
      if (!held_[i - span.first]) apply(i, angle_[i - span.first + offset]);
    }
  }
  // The choice goes on to the other branch at the pole. Tilted, the axes of two points may pass beside it,
  // where no axes can follow: both keep what was chosen then. True where any does that did not.
  bool hold_parted(const Span& span) {
    bool any = false;
    const auto hold = [&](std::size_t i) {
      if (i < span.first || i > span.last || held_[i - span.first]) return;
      held_[i - span.first] = any = true;
    };
    const std::size_t first = span.anchored_before ? span.first : span.first + 1;
    const std::size_t last = span.anchored_behind ? span.last + 1 : span.last;
    for (std::size_t i = first; i <= last; ++i) {
      const PoleStart before = i > 0 ? PoleStart{chosen_[i - 1].q_leave, points_[i - 1].pose} : *from_;
      if (connection_.connects(before.q, before.pose.axis_P, chosen_[i].q, points_[i].pose.axis_P)) continue;
      if (i > 0) hold(i - 1);
      hold(i);
    }
    return any;
  }
  // C, its windows and the length of the path, from the point before to the point behind.
  void gather(const Span& span) {
    along_.clear();
    windows_.clear();
    angle_.clear();
    double way = 0.0;
    const auto add = [&](const Vec3& tip_P, double at, const Window& window) {
      if (!along_.empty()) way += (tip_P - tip_before_P_).norm();
      tip_before_P_ = tip_P;
      along_.push_back(way);
      angle_.push_back(at);
      windows_.push_back(window);
    };
    const AxisId inner = pole_.inner();
    if (span.anchored_before) {
      const bool is_start = span.first == 0;
      const double at = (is_start ? from_->q : chosen_[span.first - 1].q_leave)[inner];
      add(is_start ? from_->pose.tip_P : points_[span.first - 1].pose.tip_P, at, {at, at});
    }
    for (std::size_t i = span.first; i <= span.last + (span.anchored_behind ? 1 : 0); ++i) {
      const double at = chosen_[i].q[inner];
      const bool stays = i > span.last || held_[i - span.first];
      add(points_[i].pose.tip_P, at, stays ? Window{at, at} : window(i, at));
    }
  }

  Window window(std::size_t i, double chosen_at) const {
    const Vec3& axis_P = programmed_[i].pose.axis_P;
    // Where the choice put the axis onto the pole, C stands anywhere, and may.
    const double misses = pole_.misses_by(axis_P, chosen_at);
    if (misses > tolerance_) return {chosen_at, chosen_at};
    Window out{chosen_at - reach(pole_, axis_P, chosen_at, -1.0, tolerance_),
               chosen_at + reach(pole_, axis_P, chosen_at, 1.0, tolerance_)};
    const Axis& axis = machine_.axes[pole_.inner()];
    if (axis.has_limits()) {
      out.low = std::max(out.low, axis.min);
      out.high = std::min(out.high, axis.max);
    }
    return out;
  }

  void apply(std::size_t i, double inner) {
    const Vec3& wanted = programmed_[i].pose.axis_P;
    JointVector q = chosen_[i].q;
    q[pole_.inner()] = inner;
    const Axis& outer = machine_.axes[pole_.outer()];
    q[pole_.outer()] = pole_.best_outer(wanted, inner, chosen_[i].q[pole_.outer()]);
    if (outer.has_limits()) q[pole_.outer()] = std::clamp(q[pole_.outer()], outer.min, outer.max);
    const auto sines = pole_.kinematics().sines(q);
    const Vec3 axis_P = pole_.kinematics().axis_P(sines);
    pole_.kinematics().solve_linear(points_[i].pose.tip_P, sines, q);
    points_[i].pose.axis_P = axis_P;
    chosen_[i].q = q;
    chosen_[i].q_leave = q;
  }

  const Machine& machine_;
  const Pole& pole_;
  double tolerance_;
  RotaryConnection connection_;
  std::span<const ChoicePoint> programmed_;
  std::span<ChoicePoint> points_;
  std::span<ChosenPoint> chosen_;
  const std::optional<PoleStart>& from_;
  Vec3 tip_before_P_ = Vec3::Zero();
  std::vector<double> along_;
  std::vector<Window> windows_;
  std::vector<double> angle_;
  std::vector<bool> held_;  // points of the span that keep what was chosen
};

}  // namespace

Angle tilt_from_pole(const Machine& machine, const Vec3& axis_P) {
  if (machine.rotary_axes().size() < 2) return Angle::radians(kPi);
  return Pole(machine, Vec3::Zero()).tilt(axis_P);
}

bool turns_near_pole(const Machine& machine, const PoleOptions& options, std::span<const ChoicePoint> points,
                     std::span<const ChosenPoint> chosen, const std::optional<PoleStart>& from) {
  if (machine.rotary_axes().size() < 2) return false;
  const Pole pole(machine, Vec3::Zero());
  const auto all = spans(pole, options, points, chosen, from.has_value());
  return std::any_of(all.begin(), all.end(), [&](const Span& span) {
    return largest_turn(span, pole.inner(), chosen, from) > options.min_turn.rad();
  });
}

std::vector<ChoicePoint> put_on_pole(const Machine& machine, const PoleOptions& options,
                                     std::span<const ChoicePoint> points) {
  std::vector<ChoicePoint> out(points.begin(), points.end());
  if (machine.rotary_axes().size() < 2) return out;
  const Pole pole(machine, Vec3::Zero());
  const double tolerance = kMargin * options.tolerance.rad();
  const auto tilt = [&](std::size_t i) { return pole.tilt(points[i].pose.axis_P); };
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (tilt(i) > options.cone) continue;
    std::size_t last = i;
    std::size_t nearest = i;
    while (last + 1 < points.size() && !points[last + 1].rapid && tilt(last + 1) <= options.cone) {
      ++last;
      if (tilt(last) < tilt(nearest)) nearest = last;
    }
    if (tilt(nearest).rad() <= tolerance) lead_through(pole, tolerance, points, {i, last, nearest}, out);
    i = last;
  }
  return out;
}

std::vector<PoleStretch> tilt_near_pole(const Machine& machine, const Vec3& tool_mm,
                                        const PoleOptions& options, Angle axis_tolerance,
                                        const PoleRun& run) {
  std::vector<PoleStretch> out;
  if (machine.rotary_axes().size() < 2) return out;
  const Pole pole(machine, tool_mm);
  Tightener tightener(machine, pole, options, axis_tolerance, run);
  for (const Span& span : spans(pole, options, run.points, run.chosen, run.from.has_value())) {
    bool led_through = false;
    for (std::size_t i = span.first; i <= span.last; ++i)
      led_through = led_through || run.points[i].pose.axis_P != run.programmed[i].pose.axis_P;
    if (!led_through && largest_turn(span, pole.inner(), run.chosen, run.from) <= options.min_turn.rad())
      continue;
    PoleStretch stretch = tightener.run(span);
    stretch.turn_before = Angle::radians(largest_turn(span, pole.inner(), run.before, run.from));
    out.push_back(stretch);
  }
  return out;
}

}  // namespace trunnion::path
