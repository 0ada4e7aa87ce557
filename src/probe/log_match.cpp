#include "probe/log_match.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/probe/touch_log.hpp"

namespace trunnion::probe {
namespace {

// A control's log has the place where its axes stood: on the line of the stroke, but for what they lag behind
// each other.
constexpr double kBeside_mm = 0.02;
constexpr double kAngle_rad = 2e-3 * kRadPerDegree;
constexpr std::array kLinear = {"X", "Y", "Z"};

// A line of the log as joints; the rotary axes that it does not name are those of the program.
class Lines {
 public:
  Lines(const Machine& machine, const Strokes& strokes, const TouchLog& log)
      : machine_(machine), strokes_(strokes), log_(log) {}

  // Why line i is none of touch k; empty where it is.
  std::string fault(std::size_t i, std::size_t k) const {
    const LogLine& line = log_.lines[i];
    const Touch& touch = strokes_.touches[k];
    for (const AxisId id : machine_.rotary_axes()) {
      const auto at = line.at[nc::index(*nc::axis_letter(machine_.axes[id].name))];
      if (!at || std::abs(std::remainder(*at - touch.from[id], kTwoPi)) <= kAngle_rad) continue;
      return "axis " + machine_.axes[id].name + " stands at " + fixed_text(*at * kDegreePerRad, 4) +
             " deg, in the program at " + fixed_text(touch.from[id] * kDegreePerRad, 4) + " deg";
    }
    const Vec3 at = place(i, k);
    const Vec3 from = linear_of(machine_, touch.from);
    const Vec3 to = linear_of(machine_, touch.to);
    const double beside = distance_to_segment(at, from, to);
    if (beside > kBeside_mm)
      return "the place is " + fixed_text(beside, 4) + " mm beside the way of the touch";
    if ((at - to).norm() <= kBeside_mm) return "the touch went to its end: nothing was touched";
    return {};
  }
  bool fits(std::size_t i, std::size_t k) const { return fault(i, k).empty(); }

  Vec3 place(std::size_t i, std::size_t k) const {
    JointVector words = words_of(machine_, strokes_.touches[k].from, tool_mm());
    for (AxisId id = 0; id < machine_.axes.size(); ++id) {
      const auto at = log_.lines[i].at[nc::index(*nc::axis_letter(machine_.axes[id].name))];
      if (at && machine_.axes[id].kind == AxisKind::linear) words[id] = *at;
    }
    return linear_of(machine_, joints_of_words(machine_, words, tool_mm()));
  }

  // The first line that is none of its touch, or the number of those that both have.
  std::size_t first_misfit() const {
    const std::size_t both = std::min(log_.lines.size(), strokes_.touches.size());
    std::size_t i = 0;
    while (i < both && fits(i, i)) ++i;
    return i;
  }

  // The first line without which all the others fit; nothing where there is none.
  std::optional<std::size_t> line_too_many() const {
    if (log_.lines.size() != strokes_.touches.size() + 1) return std::nullopt;
    const std::size_t n = strokes_.touches.size();
    std::size_t tail = n;  // touches from here on fit the line one behind theirs
    while (tail > 0 && fits(tail, tail - 1)) --tail;
    const std::size_t head = first_misfit();
    return tail <= head ? std::optional<std::size_t>(tail) : std::nullopt;
  }

 private:
  Vec3 tool_mm() const { return {0.0, 0.0, -strokes_.ball.stylus_length_mm}; }
  const Machine& machine_;
  const Strokes& strokes_;
  const TouchLog& log_;
};

}  // namespace

Vec3 linear_of(const Machine& machine, const JointVector& q) {
  Vec3 out;
  for (std::size_t i = 0; i < kLinear.size(); ++i)
    out[static_cast<Eigen::Index>(i)] = q[*machine.axis(kLinear[i])];
  return out;
}

JointVector with_linear(const Machine& machine, const JointVector& q, const Vec3& xyz_mm) {
  JointVector out = q;
  for (std::size_t i = 0; i < kLinear.size(); ++i)
    out[*machine.axis(kLinear[i])] = xyz_mm[static_cast<Eigen::Index>(i)];
  return out;
}

Result<std::vector<MatchedTouch>> match_log(const Machine& machine, const Strokes& strokes,
                                            std::string_view text, const std::string& file) {
  const TouchLog log = parse_touch_log(text);
  const Lines lines(machine, strokes, log);
  const auto refuse = [&](std::size_t touch, std::uint32_t line, const std::string& what) {
    const std::size_t k = std::min(touch, strokes.touches.size() - 1);
    return fail(ErrorCode::wrong_input,
                strokes.pose_text(machine, strokes.touches[k].pose) + ", touch of line " +
                    std::to_string(strokes.touches[k].line) + " of the program: " + what,
                file, {line, 0});
  };
  const std::size_t n = log.lines.size();
  const std::size_t m = strokes.touches.size();
  const std::size_t misfit = lines.first_misfit();
  if (const auto extra = lines.line_too_many()) {
    return refuse(*extra, log.lines[*extra].line,
                  "a line too many: the log has " + std::to_string(n) + ", the program " + std::to_string(m) +
                      " touches; a line is doubled");
  }
  if (misfit < std::min(n, m)) {
    const std::string counts = n == m ? ""
                                      : "; the log has " + std::to_string(n) + " lines, the program " +
                                            std::to_string(m) + " touches";
    return refuse(misfit, log.lines[misfit].line, lines.fault(misfit, misfit) + counts);
  }
  if (log.broken) return refuse(misfit, log.broken->line, "the line " + log.broken_because);
  if (n < m) {
    return refuse(n, n == 0 ? 0 : log.lines.back().line,
                  "its line is missing: the log ends after " + std::to_string(n) + " of " +
                      std::to_string(m) + " touches");
  }
  if (n > m) {
    return refuse(m - 1, log.lines[m].line,
                  "the log goes on behind the last touch: it has " + std::to_string(n) +
                      " lines, the program " + std::to_string(m) + " touches");
  }
  std::vector<MatchedTouch> out;
  for (std::size_t i = 0; i < m; ++i) {
    const Vec3 at = lines.place(i, i);
    out.push_back({at, (linear_of(machine, strokes.touches[i].to) - at).norm(), log.lines[i].line});
  }
  return out;
}

}  // namespace trunnion::probe
