#include "machine/smooth_ahead.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trunnion {
namespace {

constexpr std::size_t kMostAtOnce = 2048;  // blocks that are settled at once
constexpr std::size_t kLeastBehind = 64;
constexpr double kStops = 4.0;

std::array<double, kMaxAxes> per_jerk_of(const Machine& machine) {
  std::array<double, kMaxAxes> out{};
  for (AxisId id = 0; id < machine.axes.size(); ++id)
    out[id] = *machine.axes[id].acceleration / *machine.axes[id].jerk;
  return out;
}

double longest(const std::array<double, kMaxAxes>& ramps_s) {
  return *std::max_element(ramps_s.begin(), ramps_s.end());
}

// Curvature between two corners that have all of the way between them: their mean, 0 where they turn
// different ways, and no more than either can have at its end without turning back.
double between(double a, double b) {
  if (!(a * b > 0.0)) return 0.0;
  const double most = std::min({0.5 * std::abs(a + b), 2.0 * std::abs(a), 2.0 * std::abs(b)});
  return std::copysign(most, a);
}

}  // namespace

SmoothAhead::SmoothAhead(const Machine& machine, std::optional<double> blend_mm, const JointVector& digits)
    : ways_(machine, digits),
      blend_mm_(blend_mm),
      longest_ramp_s_(longest(per_jerk_of(machine))),
      path_(per_jerk_of(machine)),
      speeds_(2.0 * longest_ramp_s_) {}

void SmoothAhead::add(const JointVector& from, const JointVector& to, double seconds) {
  SmoothLeg& leg = legs_.emplace_back();
  static_cast<AxisWay&>(leg) = ways_.of(from, to, seconds);
  leg.begins = begins_;
  if (leg.begins == BlockBegin::at_corner) {
    const SmoothLeg& last = before(legs_.size() - 1);
    if (leg.length > 0.0 && last.length > 0.0)
      begin_at_corner(last, leg);
    else
      leg.begins = BlockBegin::at_rest;  // a block that goes nowhere
  }
  begins_ = BlockBegin::at_corner;
}

void SmoothAhead::begin_at_corner(const SmoothLeg& before, SmoothLeg& leg) const {
  // A curvature that stays the same over z on either side passes the corner at turn * z / 4, one that rises
  // from 0 and falls to 0 at turn * z / 6.
  double joined = std::numeric_limits<double>::infinity();
  if (blend_mm_) {
    const double turn_mm = ways_.linear_turn(before, leg);
    if (turn_mm > 0.0) joined = 4.0 * *blend_mm_ / turn_mm;
  }
  leg.joins_before = 0.5 * before.length <= joined;
  leg.joins_behind = 0.5 * leg.length <= joined;
  leg.turns_before = std::min(0.5 * before.length, 1.5 * joined);
  leg.turns_behind = std::min(0.5 * leg.length, 1.5 * joined);
  const double per_length = 1.0 / (leg.turns_before + leg.turns_behind);
  for (AxisId id = 0; id < kMaxAxes; ++id)
    leg.curve[id] =
        std::copysign(ways_.turn_of(id, before, leg), leg.along[id] - before.along[id]) * per_length;
}

void SmoothAhead::shape(std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    SmoothLeg& leg = legs_[i];
    if (leg.is_shaped || i + 1 == legs_.size()) continue;
    const SmoothLeg& next = legs_[i + 1];
    leg.is_shaped = true;
    if (leg.begins != BlockBegin::at_corner || next.begins != BlockBegin::at_corner) continue;
    if (!leg.joins_behind || !next.joins_before) continue;
    for (AxisId id = 0; id < kMaxAxes; ++id) leg.middle[id] = between(leg.curve[id], next.curve[id]);
  }
}

// Blocks from one stop to the next, or to the end of what is looked at.
bool SmoothAhead::plan_stretch(std::size_t from, std::size_t to, bool is_last) {
  path_.clear();
  for (std::size_t i = from; i < to; ++i) {
    const bool begins = i == from && legs_[i].begins != BlockBegin::at_corner;
    const SmoothLeg* next = i + 1 < legs_.size() ? &legs_[i + 1] : nullptr;
    path_.add(begins ? nullptr : &before(i), legs_[i], next);
  }
  SpeedEnd begin = at_;
  if (legs_[from].begins != BlockBegin::at_corner || from > 0)
    begin.kind = legs_[from].begins == BlockBegin::unknown ? SpeedEnd::Kind::open : SpeedEnd::Kind::rest;
  SpeedEnd end;
  if (!is_last && legs_[to].begins == BlockBegin::unknown) end.kind = SpeedEnd::Kind::open;
  return speeds_.plan(path_, begin, end, planned_, fresh_);
}

bool SmoothAhead::plan(std::size_t count) {
  fresh_.clear();
  shape(count);
  for (std::size_t from = 0; from < count;) {
    if (!(legs_[from].length > 0.0)) {
      SpeedPiece& rests = fresh_.emplace_back();
      rests.ends_block = true;
      ++from;
      continue;
    }
    std::size_t to = from + 1;
    while (to < count && legs_[to].begins == BlockBegin::at_corner) ++to;
    if (!plan_stretch(from, to, to == count)) return false;
    from = to;
  }
  planned_.swap(fresh_);
  planned_legs_ = count;
  planned_to_end_ = count == legs_.size();
  return true;
}

void SmoothAhead::commit(std::size_t count, std::vector<BlockRun>& out, std::vector<SpeedPiece>* pieces) {
  std::size_t p = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const SmoothLeg& leg = legs_[i];
    double most2 = 0.0;
    double seconds = 0.0;
    for (bool ends = false; !ends; ++p) {
      const SpeedPiece& piece = planned_[p];
      most2 = std::max(most2, piece.most2());
      if (piece.length > 0.0) seconds += piece.seconds();
      ends = piece.ends_block;
    }
    BlockRun run{1.0, leg.asked_s};
    if (leg.length > 0.0) run = {most2 < leg.fastest2 ? std::sqrt(most2 / leg.fastest2) : 1.0, seconds};
    out.push_back(run);
  }
  const auto end = planned_.begin() + static_cast<std::ptrdiff_t>(p);
  const SpeedPiece& last = planned_[p - 1];
  at_ = {};
  if (last.kind != SpeedPiece::Kind::to_rest && last.length > 0.0)
    at_ = {SpeedEnd::Kind::going, last.end2, last.end_slope()};
  if (pieces != nullptr) pieces->insert(pieces->end(), planned_.begin(), end);
  planned_.erase(planned_.begin(), end);
  planned_legs_ -= count;
  settled_ = legs_[count - 1];
  legs_.erase(legs_.begin(), legs_.begin() + static_cast<std::ptrdiff_t>(count));
  if (legs_.empty() || legs_.front().begins != BlockBegin::at_corner) return;
  // The corner before it is half run, or the machine stands there.
  legs_.front().is_shaped = true;
  if (at_.kind == SpeedEnd::Kind::rest) legs_.front().begins = BlockBegin::at_rest;
}

// How many blocks are looked at for settling the first `count`: more than are needed for coming to rest.
std::size_t SmoothAhead::enough_for(std::size_t count) const {
  double way = 0.0;
  double needed = 0.0;
  std::size_t i = count;
  for (; i < legs_.size() && (way <= kStops * needed || i < count + kLeastBehind); ++i) {
    if (legs_[i].begins == BlockBegin::at_rest && i > count) break;
    way += legs_[i].length;
    // The largest acceleration of an axis is 1.
    needed = std::max(needed, 0.5 * legs_[i].fastest2 + std::sqrt(legs_[i].fastest2) * longest_ramp_s_);
  }
  return i;
}

void SmoothAhead::settle(std::size_t count, std::vector<BlockRun>& out, std::vector<SpeedPiece>* pieces) {
  while (count > 0) {
    const std::size_t some = std::min(count, kMostAtOnce);
    const std::size_t window = enough_for(some);
    if (plan(window)) {
      commit(some, out, pieces);
      count -= some;
    } else {
      // It was planned how to go on from here to a stop: so it does until what has come to be known can be
      // followed. The last block of that plan had none behind it.
      if (planned_to_end_ && planned_legs_ <= 2) legs_[planned_legs_ - 1].middle = {};
      const std::size_t on = std::min(count, std::max<std::size_t>(1, planned_legs_ / 8));
      commit(on, out, pieces);
      count -= on;
    }
    if (legs_.empty() && begins_ == BlockBegin::at_corner) begins_ = BlockBegin::at_rest;
  }
}

}  // namespace trunnion
