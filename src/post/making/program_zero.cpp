#include "trunnion/post/program_zero.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/kinematics.hpp"

#include "post/work_shift.hpp"

namespace trunnion::post {
namespace {

// The part's zero is as far as this from the machine's where words that count from the latter are hardly
// meant.
constexpr double kFar_mm = 100.0;

std::string offset_name(const nc::Controller& controller, std::int64_t index) {
  const auto at = static_cast<std::size_t>(index) - 1;
  if (at < controller.work_offsets.size() && controller.work_offsets[at].size() == 1) {
    const std::string& text = controller.work_offsets[at][0];
    if (text.size() <= 10) return text;
  }
  return "work offset " + std::to_string(index);
}

std::string place_text(const ProgramZero::Place& place) {
  std::string out;
  for (std::size_t i = 0; i < place.axes.size(); ++i)
    out += (i > 0 ? " " : "") + place.axes[i] + fixed_text(place.at_mm[i], 3);
  return out;
}

bool same_place(const ProgramZero::Place& a, const ProgramZero::Place& b) {
  constexpr double kSame_mm = 5e-4;
  for (std::size_t i = 0; i < a.at_mm.size(); ++i) {
    if (std::abs(a.at_mm[i] - b.at_mm[i]) > kSame_mm) return false;
  }
  return true;
}

}  // namespace

ProgramZero program_zero(const Machine& machine, const nc::Controller& controller, std::int64_t work_offset,
                         WordsOf words) {
  ProgramZero out;
  out.words = words;
  out.offset_name = offset_name(controller, work_offset);
  JointVector at_part;
  solve_linear(machine, Vec3::Zero(), Vec3::Zero(), at_part);
  const Vec3 value_mm = work_offset_words(machine, words == WordsOf::part);
  for (const char* letter : {"X", "Y", "Z"}) {
    const auto id = machine.axis(letter);
    if (!id) continue;
    const auto component = static_cast<Eigen::Index>(letter[0] - 'X');
    out.offset.axes.emplace_back(letter);
    out.offset.at_mm.push_back(value_mm[component]);
    out.part_zero.axes.emplace_back(letter);
    out.part_zero.at_mm.push_back(at_part[*id]);
  }
  for (const AxisId id : machine.rotary_axes())
    out.rotary_at_zero += (out.rotary_at_zero.empty() ? "" : " ") + machine.axes[id].name + "0";
  return out;
}

std::vector<std::string> zero_lines(const ProgramZero& zero) {
  const std::string with = zero.rotary_at_zero.empty() ? "" : " with " + zero.rotary_at_zero;
  std::vector<std::string> out;
  switch (zero.words) {
    case WordsOf::tip:
      out.emplace_back("X Y Z are the tool tip, the control adds the tool length");
      break;
    case WordsOf::spindle:
      out.emplace_back("X Y Z are the spindle gauge point, no length compensation");
      break;
    case WordsOf::part:
      out.emplace_back("X Y Z are the tool tip in the part, TCP control is on");
      break;
  }
  out.push_back(zero.offset_name + " must be at machine " + place_text(zero.offset) + with);
  if (!same_place(zero.offset, zero.part_zero))
    out.push_back("the part zero must be at machine " + place_text(zero.part_zero) + with);
  return out;
}

void warn_of_zero(const Machine& machine, const ProgramZero& zero, double tool_length_mm,
                  Diagnostics& diagnostics) {
  const auto beyond = [&](const std::string& what, const ProgramZero::Place& place) {
    for (std::size_t i = 0; i < place.axes.size(); ++i) {
      const Axis& axis = machine.axes[*machine.axis(place.axes[i])];
      if (!axis.has_limits()) continue;
      const double at = place.at_mm[i];
      const double by = std::max(axis.min - at, at - axis.max);
      if (by <= tool_length_mm) continue;
      diagnostics.warning(machine.file, {},
                          what + " would be at machine " + axis.name + " " + fixed_text(at, 3) + ", " +
                              fixed_text(by, 3) + " mm beyond the travel of " + fixed_text(axis.min, 3) +
                              " to " + fixed_text(axis.max, 3) + " mm and farther than the tool of " +
                              shortest_text(tool_length_mm) + " mm reaches");
    }
  };
  beyond("the zero of " + zero.offset_name, zero.offset);
  if (!same_place(zero.offset, zero.part_zero)) beyond("the part zero", zero.part_zero);
  const auto far = [](const std::vector<double>& at_mm) {
    return std::any_of(at_mm.begin(), at_mm.end(), [](double v) { return std::abs(v) > kFar_mm; });
  };
  if (zero.words != WordsOf::part && machine.work_offset_mm.isZero(0.0) && far(zero.part_zero.at_mm)) {
    diagnostics.warning(machine.file, {},
                        "the part zero is at machine " + place_text(zero.part_zero) + " and " +
                            zero.offset_name +
                            " must be zero at the control: X Y Z of the program count from machine zero "
                            "([output] work_offset_mm changes that)");
  }
}

}  // namespace trunnion::post
