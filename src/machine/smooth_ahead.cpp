#include "machine/smooth_ahead.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/base/contract.hpp"

namespace trunnion {
namespace {

constexpr std::size_t kMostAtOnce = 2048;  // blocks that are settled at once
constexpr std::size_t kLeastBehind = 64;
constexpr double kStops = 4.0;
constexpr double kRunUp = 2.0;          // the same, for getting up to a steady speed
constexpr double kAsFast = 1.0 - 2e-3;  // this share of a speed is that speed: what rounding changes it by

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

SmoothAhead::SmoothAhead(const Machine& machine, std::optional<double> blend_mm, const JointVector& digits,
                         PlanOf what)
    : what_(what),
      blend_mm_(blend_mm),
      longest_ramp_s_(longest(per_jerk_of(machine))),
      legs_(machine, digits),
      path_(per_jerk_of(machine)),
      speeds_(2.0 * longest_ramp_s_),
      steady_(longest_ramp_s_) {}

void SmoothAhead::add(const JointVector& from, const JointVector& to, double seconds) {
  if (!legs_.add(from, to, seconds)) return;
  const std::size_t last = legs_.size() - 1;
  begin_at_corner(legs_.before(last), legs_[last]);
  if (last < 2) return;
  SteadyWay::draw(legs_[last - 2], legs_[last - 1], legs_[last]);
  steady_.judge(legs_.before(last - 2), legs_[last - 2], legs_[last - 1]);
}

void SmoothAhead::begin_at_corner(const SmoothLeg& before, SmoothLeg& leg) const {
  // A curvature that stays the same over z on either side passes the corner at turn * z / 4, one that rises
  // from 0 and falls to 0 at turn * z / 6.
  double joined = std::numeric_limits<double>::infinity();
  if (blend_mm_) {
    const double turn_mm = legs_.ways().linear_turn(before, leg);
    if (turn_mm > 0.0) joined = 4.0 * *blend_mm_ / turn_mm;
  }
  leg.joins_before = 0.5 * before.length <= joined;
  leg.joins_behind = 0.5 * leg.length <= joined;
  leg.turns_before = std::min(0.5 * before.length, 1.5 * joined);
  leg.turns_behind = std::min(0.5 * leg.length, 1.5 * joined);
  const double per_length = 1.0 / (leg.turns_before + leg.turns_behind);
  SteadyCorner& corner = leg.corner;
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    const double curve = legs_.ways().turn_of(id, before, leg) * per_length;
    leg.curve[id] = std::copysign(curve, leg.along[id] - before.along[id]);
    corner.curve = std::max(corner.curve, curve);
    corner.curve_s = std::max(corner.curve_s, curve * path_.per_jerk()[id]);
  }
  if (leg.joins_before && leg.joins_behind) corner.asked2 = std::min(before.fastest2, leg.fastest2);
}

void SmoothAhead::shape(std::size_t i) {
  SmoothLeg& leg = legs_[i];
  if (leg.is_shaped || i + 1 == legs_.size()) return;
  const SmoothLeg& next = legs_[i + 1];
  leg.is_shaped = true;
  const bool from_corner = leg.begins == BlockBegin::at_corner && leg.joins_behind;
  const bool to_corner = next.begins == BlockBegin::at_corner && next.joins_before;
  // What is not known may go on as what is known: nothing is slow for it.
  if (from_corner && next.begins == BlockBegin::unknown) leg.middle = leg.curve;
  if (to_corner && leg.begins == BlockBegin::unknown) leg.middle = next.curve;
  if (!from_corner || !to_corner) return;
  for (AxisId id = 0; id < kMaxAxes; ++id) leg.middle[id] = between(leg.curve[id], next.curve[id]);
}

// Straight on beside a block whose neighbour is not known, as long as it takes to get as fast as is asked
// for.
SmoothLeg SmoothAhead::beside(const SmoothLeg& leg, BlockBegin begins) const {
  SmoothLeg out;
  static_cast<AxisWay&>(out) = leg;
  out.begins = begins;
  out.length = leg.fastest2 / leg.acceleration + 2.0 * std::sqrt(leg.fastest2) * longest_ramp_s_;
  out.per_length = 1.0 / out.length;
  return out;
}

bool SmoothAhead::plan(const Stretch& stretch, std::vector<SpeedPiece>& out) {
  const auto& [from, to, goes_before, goes_behind, end] = stretch;
  path_.clear();
  if (goes_before) path_.add(nullptr, beside(legs_[from], BlockBegin::at_rest), &legs_[from]);
  const std::size_t first = path_.cells().size();
  for (std::size_t i = from; i < to; ++i) {
    const bool begins = i == from && legs_[i].begins != BlockBegin::at_corner;
    const SmoothLeg* next = i + 1 < legs_.size() ? &legs_[i + 1] : nullptr;
    path_.add(begins ? nullptr : &legs_.before(i), legs_[i], next);
  }
  const std::size_t last = path_.cells().size();
  if (goes_behind) path_.add(nullptr, beside(legs_[to - 1], BlockBegin::unknown), nullptr);
  SpeedEnd begin = at_;
  if (legs_[from].begins != BlockBegin::at_corner || from > 0) begin.kind = SpeedEnd::Kind::rest;
  const auto before = static_cast<std::ptrdiff_t>(out.size());
  if (!speeds_.plan(path_, {begin, end}, planned_, out)) return false;
  out.erase(out.begin() + before + static_cast<std::ptrdiff_t>(last), out.end());
  out.erase(out.begin() + before, out.begin() + before + static_cast<std::ptrdiff_t>(first));
  return true;
}

// Blocks from one stop to the next, or to the end of what is looked at.
bool SmoothAhead::plan_stretch(const Stretch& stretch) {
  if (!plan(stretch, fresh_)) return false;
  if (stretch.goes_before || stretch.goes_behind) plan_standing(stretch);
  return true;
}

// A plan that begins at rest may be the faster one, some blocks on (these plans are not the fastest ones).
void SmoothAhead::plan_standing(const Stretch& going) {
  for (std::size_t i = going.from; i < going.to; ++i) legs_[i].standing2 = 0.0;
  for (const auto& [before, behind] : {std::pair(false, false), {false, true}, {true, false}}) {
    const Stretch stretch = {going.from, going.to, before && going.goes_before, behind && going.goes_behind,
                             going.end};
    if (stretch.goes_before == going.goes_before && stretch.goes_behind == going.goes_behind) continue;
    SmoothLeg& first = legs_[going.from];
    SmoothLeg& last = legs_[going.to - 1];
    const auto bend_first = first.middle, bend_last = last.middle;
    if (going.goes_before && !stretch.goes_before) first.middle = {};
    if (going.goes_behind && !stretch.goes_behind) last.middle = {};
    standing_.clear();
    if (plan(stretch, standing_)) {
      std::size_t i = going.from;
      for (const SpeedPiece& piece : standing_) {
        legs_[i].standing2 = std::max(legs_[i].standing2, piece.most2());
        if (piece.ends_block) ++i;
      }
    }
    last.middle = bend_last;
    first.middle = bend_first;
  }
}

bool SmoothAhead::plan(std::size_t count, const SpeedEnd& end) {
  fresh_.clear();
  for (std::size_t i = 0; i < std::min(count + 1, legs_.size()); ++i) shape(i);
  for (std::size_t from = 0; from < count;) {
    if (!(legs_[from].length > 0.0)) {
      SpeedPiece& rests = fresh_.emplace_back();
      rests.ends_block = true;
      ++from;
      continue;
    }
    std::size_t to = from + 1;
    while (to < count && legs_[to].begins == BlockBegin::at_corner) ++to;
    const bool goes_behind = to < legs_.size() && legs_[to].begins == BlockBegin::unknown;
    const SpeedEnd ends = to == count ? end : SpeedEnd();
    if (!plan_stretch({from, to, legs_[from].begins == BlockBegin::unknown, goes_behind, ends})) return false;
    from = to;
  }
  planned_.pieces.swap(fresh_);
  planned_.are_steady = false;
  planned_legs_ = count;
  planned_to_end_ = count == legs_.size();
  return true;
}

void SmoothAhead::commit(std::size_t count, std::vector<BlockRun>& out, std::vector<SpeedPiece>* pieces) {
  std::size_t p = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const SmoothLeg& leg = legs_[i];
    double most2 = leg.standing2;
    double seconds = 0.0;
    for (bool ends = false; !ends; ++p) {
      const SpeedPiece& piece = planned_.pieces[p];
      most2 = std::max(most2, piece.most2());
      if (piece.length > 0.0 && what_ == PlanOf::paces_and_seconds) seconds += piece.seconds();
      ends = piece.ends_block;
    }
    BlockRun run{1.0, leg.asked_s};
    if (leg.length > 0.0) run = {most2 < leg.fastest2 ? std::sqrt(most2 / leg.fastest2) : 1.0, seconds};
    out.push_back(run);
  }
  const auto end = planned_.pieces.begin() + static_cast<std::ptrdiff_t>(p);
  const SpeedPiece& last = planned_.pieces[p - 1];
  SpeedEnd at;
  if (last.kind != SpeedPiece::Kind::to_rest && last.length > 0.0)
    at = {SpeedEnd::Kind::going, last.end2, last.end_slope()};
  if (pieces != nullptr) pieces->insert(pieces->end(), planned_.pieces.begin(), end);
  planned_.pieces.erase(planned_.pieces.begin(), end);
  planned_legs_ -= count;
  forget(count, at);
  if (legs_.empty() || legs_[0].begins != BlockBegin::at_corner) return;
  // The corner before it is half run, or the machine stands there.
  legs_[0].is_shaped = true;
  if (at_.kind == SpeedEnd::Kind::rest) legs_[0].begins = BlockBegin::at_rest;
}

// How many blocks are looked at for settling the first `count`: more than are needed for coming to rest.
std::size_t SmoothAhead::enough_for(std::size_t count) const {
  double way = 0.0;
  double needed = 0.0;
  std::size_t i = count;
  for (; i < legs_.size() && (way <= kStops * needed || i < count + kLeastBehind); ++i) {
    if (legs_[i].begins == BlockBegin::at_rest && i > count) break;
    way += legs_[i].length;
    needed = std::max(needed, stopping_way(legs_[i]));
  }
  return i;
}

// More than it takes to come to rest from the speed that is asked for: the largest acceleration of an axis
// is 1.
double SmoothAhead::stopping_way(const SmoothLeg& leg) const {
  return 0.5 * leg.fastest2 + std::sqrt(leg.fastest2) * longest_ramp_s_;
}

bool SmoothAhead::is_steady(std::size_t i) const {
  return i + 1 < legs_.size() && legs_[i].corner.is_steady && legs_[i + 1].corner.is_steady;
}

bool SmoothAhead::is_at_steady() const {
  const SpeedEnd begin = steady_at(0);
  return at_.kind == SpeedEnd::Kind::going && at_.at2 == begin.at2 && at_.slope == begin.slope;
}

SpeedEnd SmoothAhead::steady_at(std::size_t i) const {
  return {SpeedEnd::Kind::going, legs_[i].corner.speed2, legs_[i].corner.slope};
}

// So many of the first `count` are steady, and behind them as many as it takes to slow down for others.
std::size_t SmoothAhead::steady_ahead(std::size_t count) const {
  std::size_t out = 0;
  double way = 0.0;
  double needed = 0.0;
  for (std::size_t i = 0; is_steady(i); ++i) {
    way += legs_[i].length;
    needed = std::max(needed, kStops * stopping_way(legs_[i]));
    while (way - legs_[out].length > needed) {
      way -= legs_[out].length;
      if (++out == count) return out;
    }
  }
  return out;
}

// The first corner behind which it is steady for long enough, after a run-up to that; 0: none near.
std::size_t SmoothAhead::steady_again() const {
  double way = 0.0;
  double needed = 0.0;
  std::size_t from = 0;
  for (std::size_t i = 0; i < std::min(legs_.size(), kMostAtOnce); ++i) {
    if (!is_steady(i)) {
      from = i + 1;
      way = needed = 0.0;
      continue;
    }
    way += legs_[i].length;
    needed = std::max(needed, stopping_way(legs_[i]));
    if (way <= (kRunUp + 2.0 * kStops) * needed) continue;
    for (way = 0.0; way <= kRunUp * needed; ++from) way += legs_[from].length;
    return from;
  }
  return 0;
}

std::size_t SmoothAhead::settle_steady(std::size_t count, std::vector<BlockRun>& out,
                                       std::vector<SpeedPiece>* pieces) {
  const std::size_t some = is_at_steady() ? steady_ahead(count) : 0;
  if (some == 0) return 0;
  for (std::size_t i = 0; i < some; ++i) {
    const SmoothLeg& leg = legs_[i];
    const auto halves = SteadyWay::along(leg, legs_[i + 1]);
    const double most2 = std::max({halves[0].most2(), halves[1].most2(), leg.standing2});
    const double pace = most2 < kAsFast * leg.fastest2 ? std::sqrt(most2 / leg.fastest2) : 1.0;
    const bool is_timed = what_ == PlanOf::paces_and_seconds;
    out.push_back({pace, is_timed ? halves[0].seconds() + halves[1].seconds() : 0.0});
    if (pieces != nullptr) pieces->insert(pieces->end(), halves.begin(), halves.end());
  }
  shape(some - 1);
  planned_.pieces.clear();
  planned_legs_ = 0;
  forget(some, steady_at(some));
  return some;
}

// Steady blocks that are left for coming into what follows: it may go on so.
void SmoothAhead::know_steady() {
  planned_.are_steady = true;
  planned_to_end_ = false;
  for (; is_steady(planned_legs_); ++planned_legs_) {
    const auto halves = SteadyWay::along(legs_[planned_legs_], legs_[planned_legs_ + 1]);
    planned_.pieces.insert(planned_.pieces.end(), halves.begin(), halves.end());
  }
}

std::size_t SmoothAhead::settle_planned(std::size_t count, std::vector<BlockRun>& out,
                                        std::vector<SpeedPiece>* pieces) {
  if (planned_legs_ == 0 && is_at_steady()) know_steady();
  if (const std::size_t to = steady_again(); to > 0 && plan(to, steady_at(to))) {
    const SpeedEnd end = steady_at(to);
    const std::size_t some = std::min(count, to);
    commit(some, out, pieces);
    if (some == to) at_ = end;  // to the bit
    return some;
  }
  const std::size_t some = std::min(count, kMostAtOnce);
  if (plan(enough_for(some), {})) {
    commit(some, out, pieces);
    return some;
  }
  TRUNNION_EXPECTS(planned_legs_ > 0);  // from rest there is a plan
  // It was planned how to go on from here to a stop: so it does until what has come to be known can be
  // followed. The last block of that plan had none behind it.
  if (planned_to_end_ && planned_legs_ <= 2) legs_[planned_legs_ - 1].middle = {};
  const std::size_t on = std::min(count, std::max<std::size_t>(1, planned_legs_ / 8));
  commit(on, out, pieces);
  return on;
}

void SmoothAhead::settle(std::size_t count, std::vector<BlockRun>& out, std::vector<SpeedPiece>* pieces) {
  while (count > 0) {
    const std::size_t steady = settle_steady(count, out, pieces);
    count -= steady > 0 ? steady : settle_planned(count, out, pieces);
    if (legs_.empty() && legs_.goes_on()) legs_.stop();
  }
}

void SmoothAhead::forget(std::size_t count, const SpeedEnd& at) {
  legs_.forget(count);
  at_ = at;
}

}  // namespace trunnion
