#include "nc/reading/program_frame.hpp"

#include <cmath>

namespace trunnion::nc {
namespace {

constexpr std::array kLinear = {AxisLetter::X, AxisLetter::Y, AxisLetter::Z};
// Halves away from zero.
std::int64_t rounded(double quanta) {
  return std::llround(quanta);
}

}  // namespace

void ProgramFrame::shift_further(const std::array<std::int64_t, 3>& way) {
  AxisWords to;
  for (const AxisLetter letter : kLinear) to.set(letter, way[index(letter)]);
  to = position_of(to);
  for (const AxisLetter letter : kLinear) shift_[index(letter)] = to[letter];
}

void ProgramFrame::turn_about(std::int64_t x, std::int64_t y, double rad) {
  shift_further({x, y, 0});
  angle_rad_ += rad;
  turns_ = angle_rad_ != 0.0;
  cosine_ = std::cos(angle_rad_);
  sine_ = std::sin(angle_rad_);
  shift_further({-x, -y, 0});
}

AxisWords ProgramFrame::position_of(AxisWords program) const {
  if (turns_) {
    if ((program.mask & kPlaneWords) != kPlaneWords) {
      program.forget(kPlaneWords);
    } else {
      const auto x = static_cast<double>(program[AxisLetter::X]);
      const auto y = static_cast<double>(program[AxisLetter::Y]);
      program.set(AxisLetter::X, rounded(cosine_ * x - sine_ * y));
      program.set(AxisLetter::Y, rounded(sine_ * x + cosine_ * y));
    }
  }
  for (const AxisLetter letter : kLinear)
    if (program.has(letter)) program.set(letter, program[letter] + shift_[index(letter)]);
  return program;
}

AxisWords ProgramFrame::program_of(AxisWords position) const {
  for (const AxisLetter letter : kLinear)
    if (position.has(letter)) position.set(letter, position[letter] - shift_[index(letter)]);
  if (!turns_) return position;
  if ((position.mask & kPlaneWords) != kPlaneWords) {
    position.forget(kPlaneWords);
    return position;
  }
  const auto x = static_cast<double>(position[AxisLetter::X]);
  const auto y = static_cast<double>(position[AxisLetter::Y]);
  position.set(AxisLetter::X, rounded(cosine_ * x + sine_ * y));
  position.set(AxisLetter::Y, rounded(-sine_ * x + cosine_ * y));
  return position;
}

}  // namespace trunnion::nc
