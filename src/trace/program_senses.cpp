#include "trace/program_senses.hpp"

#include <cmath>
#include <limits>

namespace trunnion::trace {
namespace {

constexpr double kMoves = 1e-3;  // scaled mm: an axis that turns round by less has not
constexpr double kSurelyMoves =
    0.01;  // one that turns round by less may have, since friction gives way a little
constexpr double kStands = 1e-9;
constexpr double kSlow_s =
    0.005;  // that an axis takes to turn round by kMoves: when its friction does, who knows

}  // namespace

ProgramSenses::ProgramSenses(const JointPath& path)
    : path_(path),
      senses_(path.segments(), Scaled::Zero()),
      doubts_(path.segments(), Scaled::Zero()),
      sign_(Scaled::Zero()),
      reversed_s_(Scaled::Constant(-std::numeric_limits<double>::infinity())),
      doubtful_s_(reversed_s_),
      turned_at_(Scaled::Zero()),
      turns_since_s_(Scaled::Constant(std::numeric_limits<double>::infinity())) {
  for (int c = 0; c < sign_.size(); ++c) find_senses(c);
}

// An axis turns round where it is furthest, which is known once it has come back from there.
void ProgramSenses::find_senses(int axis) {
  double sense = 0.0;
  std::size_t furthest = 0;        // node
  std::vector<std::size_t> turns;  // nodes, since the way is known
  const auto doubt = [&] {
    turns.push_back(furthest);
    for (std::size_t k = 1; k < turns.size(); ++k) {
      if (std::abs(path_.node(turns[k])[axis] - path_.node(turns[k - 1])[axis]) > kSurelyMoves) continue;
      doubts_[turns[k - 1]][axis] = 1.0;
      if (turns[k] < doubts_.size()) doubts_[turns[k]][axis] = 1.0;
    }
    turns.clear();
  };
  for (std::size_t i = 0; i < path_.segments(); ++i) {
    if (!path_.segment(i).known) {
      if (!turns.empty()) doubt();
      sense = 0.0;
      furthest = i + 1;
      continue;
    }
    const double step = path_.node(i + 1)[axis] - path_.node(furthest)[axis];
    if (step * sense > 0.0 || std::abs(step) < kStands) {
      furthest = i + 1;
    } else if (std::abs(step) > kMoves) {
      sense = step > 0.0 ? 1.0 : -1.0;
      for (std::size_t k = furthest; k < i; ++k) senses_[k][axis] = sense;
      turns.push_back(furthest);
      furthest = i + 1;
    }
    senses_[i][axis] = sense;
  }
  if (!turns.empty()) doubt();
}

void ProgramSenses::go_to(double s, double time_s) {
  const std::size_t to = path_.segment_at(s);
  for (; next_ <= to; ++next_) {
    const Scaled& sense = senses_[next_];
    for (int c = 0; c < sense.size(); ++c) {
      if (sense[c] * sign_[c] < 0.0) reversed_s_[c] = time_s;
      if (doubts_[next_][c] != 0.0) doubtful_s_[c] = time_s;
      if (sense[c] == sign_[c]) continue;
      turned_at_[c] = path_.node(next_)[c];
      turns_since_s_[c] = time_s;
    }
    sign_ = sense;
  }
  const Scaled away = path_.at(s) - turned_at_;
  for (int c = 0; c < away.size(); ++c) {
    if (std::abs(away[c]) > kMoves) turns_since_s_[c] = std::numeric_limits<double>::infinity();
    if (time_s - turns_since_s_[c] > kSlow_s) doubtful_s_[c] = time_s;
  }
}

bool ProgramSenses::is_turning(int axis) const {
  return turns_since_s_[axis] < std::numeric_limits<double>::infinity();
}

}  // namespace trunnion::trace
