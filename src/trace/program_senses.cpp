#include "trace/program_senses.hpp"

#include <cmath>
#include <limits>

namespace trunnion::trace {
namespace {

constexpr double kMoves = 1e-3;  // scaled mm: an axis that turns round by less has not

}  // namespace

ProgramSenses::ProgramSenses(const JointPath& path)
    : path_(path),
      sign_(Scaled::Zero()),
      reversed_s_(Scaled::Constant(-std::numeric_limits<double>::infinity())) {}

void ProgramSenses::go_to(double s, double time_s) {
  const std::size_t to = path_.segment_at(s);
  for (; next_ <= to; ++next_) {
    if (!path_.segment(next_).known) {
      sign_.setZero();
      continue;
    }
    const Scaled step = path_.node(next_ + 1) - path_.node(next_);
    for (int c = 0; c < step.size(); ++c) {
      if (std::abs(step[c]) < kMoves) continue;
      const double sign = step[c] > 0.0 ? 1.0 : -1.0;
      if (sign_[c] != 0.0 && sign != sign_[c]) reversed_s_[c] = time_s;
      sign_[c] = sign;
    }
  }
}

}  // namespace trunnion::trace
