#include "post/judging/path_points.hpp"

#include <algorithm>

#include "post/judging/few_blocks.hpp"

namespace trunnion::post {
namespace {

// Of a point that is plain.
constexpr double kLeastWay_mm = 1.001 * kTipTells_mm;

}  // namespace

template <class F>
void PathPoints::each_column(const F& f) {
  for (auto* columns : {&tip_P, &axis_P}) {
    for (Column& column : *columns) f(column);
  }
  for (Column* column : {&way_mm, &turn, &along_mm, &passed_mm, &special}) f(*column);
}

void PathPoints::add(const ExpectedMotions& motions, const FollowLimits& limits, double flute_mm) {
  const std::size_t count = motions.points.size();
  if (count == 0) return;
  longest_flute_mm_ = std::max(longest_flute_mm_, flute_mm);
  while (kPage * pages_.size() < first_ + size_ + count) pages_.push_back(std::make_unique<Page>());
  for (std::size_t i = 0; i < count; ++i) {
    const path::ChoicePoint& point = motions.points[i];
    if (point.rapid) end_cut();
    Target& target = at(size_++);
    target.tip_P = point.pose.tip_P;
    target.axis_P = motions.axes_P.empty() ? point.pose.axis_P : motions.axes_P[i];
    target.line = point.where.line;
    target.rapid = point.rapid;
    target.step = motions.step;
    target.ends_cut = false;
    target.in_cone = limits.in_cone(target.axis_P);
    target.flute_mm = flute_mm;
  }
}

void PathPoints::settle() {
  if (rows_ == size_ + 1 || size_ == 0) return;
  const std::size_t room = size_ + 1 + 2 * lanes::kCount<Quads>;
  if (room > special.size()) each_column([&](Column& column) { column.resize(2 * room); });
  if (rows_ == 0) {  // nothing is before the first one
    const Target& first = at(0);
    for (; rows_ < 2; ++rows_) {
      for (std::size_t i = 0; i < 3; ++i) {
        tip_P[i][rows_] = first.tip_P[static_cast<Eigen::Index>(i)];
        axis_P[i][rows_] = first.axis_P[static_cast<Eigen::Index>(i)];
      }
      way_mm[rows_] = turn[rows_] = along_mm[rows_] = passed_mm[rows_] = 0.0;
      special[rows_] = 1.0;
    }
  }
  lanes::at_a_time(way_, [this]<class T>() { settle_all<T>(); });
}

template <class T>
void PathPoints::settle_all() {
  for (; rows_ < size_ + 1; rows_ = std::min(rows_ + lanes::kCount<T>, size_ + 1)) settle_few<T>(rows_);
}

template <class T>
void PathPoints::settle_few(std::size_t row) {
  constexpr std::size_t kTogether = lanes::kCount<T>;
  const std::size_t count = std::min(kTogether, size_ + 1 - row);
  std::array<Target*, kTogether> points;
  for (std::size_t k = 0; k < kTogether; ++k) points[k] = &at(row - 1 + std::min(k, count - 1));
  const auto put = [&](std::array<Column, 3>& columns, const lanes::Triple<T>& v) {
    lanes::store_vectors(columns, row, v);
    return lanes::Triple<T>{v.x - shifted(columns[0][row - 1], v.x), v.y - shifted(columns[1][row - 1], v.y),
                            v.z - shifted(columns[2][row - 1], v.z)};
  };
  const auto way =
      put(tip_P, lanes::collect_vectors<T>([&](std::size_t k) -> const Vec3& { return points[k]->tip_P; }));
  const auto turned =
      put(axis_P, lanes::collect_vectors<T>([&](std::size_t k) -> const Vec3& { return points[k]->axis_P; }));
  const T ways_mm = lanes::sqrt(T(lanes::squared(way)));
  const T chords2 = lanes::squared(turned);
  const T turns = turn_of_chord(chords2);
  lanes::store(&way_mm[row], ways_mm);
  lanes::store(&turn[row], turns);
  // An end that is no nearer to the CL point than this belongs to the next one.
  constexpr double kPassed = 0.125;
  const T share_mm = kPassed * ways_mm;
  lanes::store(&special[row], T{});
  double along = along_mm[row - 1];
  for (std::size_t k = 0; k < count; ++k) {
    const int i = static_cast<int>(k);
    passed_mm[row + k - 1] = along + share_mm[i];
    along += ways_mm[i];
    along_mm[row + k] = along;
    points[k]->along_mm = along;
    points[k]->way_mm = ways_mm[i];
    points[k]->turn = turns[i];
  }
  const lanes::Mask<T> near = chords2 < kSmallChord2;
  const lanes::Mask<T> plain = near & (ways_mm > kLeastWay_mm);
  bool any_special = lanes::any(lanes::Mask<T>(~plain));
  for (const Target* point : points) any_special |= point->rapid | point->in_cone;
  if (any_special) settle_special(row, count);
}

// Points that are not plain, or turn far.
[[gnu::noinline]] void PathPoints::settle_special(std::size_t row, std::size_t count) {
  for (std::size_t at_row = row; at_row < row + count; ++at_row) {
    Target& target = at(at_row - 1);
    target.turn = turn[at_row] = turn_between(target.axis_P, at(at_row - 2).axis_P);
    const bool plain =
        !target.in_cone && !target.rapid && target.turn <= 0.5 * kPi && target.way_mm > kLeastWay_mm;
    if (plain) continue;
    for (std::size_t i = at_row - std::min<std::size_t>(at_row, 3); i <= at_row; ++i) special[i] = 1.0;
  }
}

void PathPoints::forget(std::size_t count) {
  const auto passed = static_cast<std::ptrdiff_t>(count);
  each_column([&](Column& column) {
    std::copy(column.begin() + passed, column.begin() + static_cast<std::ptrdiff_t>(rows_), column.begin());
  });
  rows_ -= count;
  gone_ += count;
  size_ -= count;
  first_ += count;
  const auto pages = static_cast<std::ptrdiff_t>(first_ / kPage);
  std::rotate(pages_.begin(), pages_.begin() + pages, pages_.end());
  first_ %= kPage;
}

}  // namespace trunnion::post
