#include "post/work_shift.hpp"

#include "trunnion/base/number_text.hpp"

namespace trunnion::post {
namespace {

constexpr std::array kLetters = {nc::AxisLetter::X, nc::AxisLetter::Y, nc::AxisLetter::Z};

// Calls `f(component, axis)` for the axes named X, Y, Z.
template <class F>
void for_linear_axes(const Machine& machine, F f) {
  for (std::size_t i = 0; i < kLetters.size(); ++i) {
    if (const auto id = machine.axis(std::string(1, nc::letter_of(kLetters[i]))))
      f(static_cast<Eigen::Index>(i), *id);
  }
}

}  // namespace

ShiftWords work_offset_words(const Machine& machine, bool tcp) {
  if (tcp) return machine.part_zero_mm;
  Machine without = machine;
  without.work_offset_mm = Vec3::Zero();
  const Vec3 tool = machine.tool_vector();
  const JointVector from = words_of(machine, {}, tool);
  const JointVector to = words_of(without, {}, tool);
  ShiftWords out = ShiftWords::Zero();
  for_linear_axes(machine, [&](Eigen::Index i, AxisId id) { out[i] = to[id] - from[id]; });
  return out;
}

Result<nc::OffsetShift::Kind> WorkShift::kind(bool local) const {
  using Kind = nc::OffsetShift::Kind;
  const auto& shift = controller_.offset_shift;
  if (local || shift.set.empty()) {
    if (!shift.add.empty()) return Kind::add;
    return fail(ErrorCode::wrong_use,
                "the control '" + controller_.name + "' has no words for this shift ([offset_shift])");
  }
  if (machine_.probed_at) {
    return fail(ErrorCode::wrong_use,
                "the work offset was probed ([datum]): its value is not known here and must not be set anew; "
                "use --thermal-output local-shift");
  }
  return Kind::set;
}

Result<void> WorkShift::may_set() const {
  const std::int64_t last = controller_.offset_shift.last_set;
  if (last == 0 || active_ <= last) return {};
  return fail(ErrorCode::wrong_use, "the program calls work offset " + std::to_string(active_) + ", and '" +
                                        controller_.name + "' sets the first " + std::to_string(last) +
                                        " only ([offset_shift] last_set); use --thermal-output local-shift");
}

nc::OffsetShift WorkShift::block(const ShiftWords& words, bool tcp, nc::OffsetShift::Kind kind) const {
  nc::OffsetShift out;
  out.kind = kind;
  const bool sets = kind == nc::OffsetShift::Kind::set;
  out.index = sets ? active_ : 0;
  const ShiftWords value = sets ? ShiftWords(words + work_offset_words(machine_, tcp)) : words;
  for (std::size_t i = 0; i < kLetters.size(); ++i) {
    out.offset[i] = controller_.numbers.axes.quanta(kLetters[i], value[static_cast<Eigen::Index>(i)]);
  }
  return out;
}

ShiftWords WorkShift::words_against(const Vec3& deviation_P, const JointVector& q, bool tcp) const {
  if (tcp) return -deviation_P;
  JointVector shifted = q;
  kinematics_.solve_linear(kinematics_.pose(q).tip_P - deviation_P, kinematics_.sines(q), shifted);
  ShiftWords words = ShiftWords::Zero();
  for_linear_axes(machine_, [&](Eigen::Index i, AxisId id) { words[i] = shifted[id] - q[id]; });
  return words;
}

nc::OffsetShift WorkShift::take_out(const Vec3& deviation_P, const JointVector& q, bool tcp,
                                    nc::OffsetShift::Kind kind) {
  const nc::OffsetShift out = block(words_against(deviation_P, q, tcp), tcp, kind);
  read(out);
  return out;
}

nc::OffsetShift WorkShift::none(bool tcp, nc::OffsetShift::Kind kind) const {
  return block(ShiftWords::Zero(), tcp, kind);
}

// A preset takes back what was added, on controls that have cycles for both.
void WorkShift::read(const nc::WorkOffset& offset) {
  active_ = offset.index;
  if (!controller_.input.places.datum_shift.empty()) added_.setZero();
}

ShiftWords WorkShift::internal(const nc::OffsetShift& shift) const {
  ShiftWords out;
  for (std::size_t i = 0; i < kLetters.size(); ++i)
    out[static_cast<Eigen::Index>(i)] = controller_.numbers.axes.internal(kLetters[i], shift.offset[i]);
  return out;
}

void WorkShift::read(const nc::OffsetShift& shift) {
  if (shift.kind == nc::OffsetShift::Kind::set)
    set_[shift.index] = internal(shift);
  else
    added_ = internal(shift);
}

ShiftWords WorkShift::words(bool tcp) const {
  const auto it = set_.find(active_);
  return it == set_.end() ? added_ : ShiftWords(added_ + it->second - work_offset_words(machine_, tcp));
}

std::string WorkShift::left_behind(bool tcp) const {
  const auto xyz = [](const ShiftWords& words) {
    return "X" + shortest_text(words[0]) + " Y" + shortest_text(words[1]) + " Z" + shortest_text(words[2]);
  };
  if (!added_.isZero(0.0)) return "the shift " + xyz(added_) + " is still in force";
  const nc::OffsetShift before = none(tcp, nc::OffsetShift::Kind::set);
  for (const auto& [index, value] : set_) {
    if (index != active_) return "work offset " + std::to_string(index) + ", which it does not use, was set";
    if (value != internal(before))
      return "work offset " + std::to_string(index) + " holds " + xyz(value) + ", and not " +
             xyz(internal(before)) + " again";
  }
  return {};
}

JointVector WorkShift::moved(const JointVector& q, const ShiftWords& change, bool tcp) const {
  if (change.isZero(0.0)) return q;
  JointVector out = q;
  if (tcp) {
    kinematics_.solve_linear(kinematics_.pose(q).tip_P + change, kinematics_.sines(q), out);
  } else {
    for_linear_axes(machine_, [&](Eigen::Index i, AxisId id) { out[id] += change[i]; });
  }
  return out;
}

JointVector WorkShift::joints(const JointVector& q, bool tcp) const {
  return moved(q, words(tcp), tcp);
}

Vec3 WorkShift::effect_P(const JointVector& q, bool tcp) const {
  if (tcp) return words(true);
  return kinematics_.pose(joints(q, false)).tip_P - kinematics_.pose(q).tip_P;
}

}  // namespace trunnion::post
