#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "trunnion/base/lanes.hpp"
#include "trunnion/post/verify.hpp"

#include "post/judging/path_place.hpp"

namespace trunnion::post {

/// The points of a CL path that are known and not yet behind the program, in their order; what is looked up
/// of many of them stands in columns, too.
class PathPoints {
 public:
  /// As the next ones, without what they have to do with those before, and without rows.
  void add(const ExpectedMotions& motions, const FollowLimits& limits, double flute_mm);
  /// What was added last ends a cut (Target::ends_cut).
  void end_cut() {
    if (size_ > 0) at(size_ - 1).ends_cut = true;
  }
  /// Of all points that were added.
  double longest_flute_mm() const { return longest_flute_mm_; }
  /// After the last one that is added, before any is looked at.
  void settle();
  /// The first ones.
  void forget(std::size_t count);

  /// How many have been forgotten.
  std::size_t gone() const { return gone_; }

  bool empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }
  const Target& operator[](std::size_t i) const { return at(i); }
  const Target& back() const { return at(size_ - 1); }

  /// Surely no rapid, nor anything else that is seldom.
  bool is_plain(std::size_t i) const { return special[i + 1] == 0.0; }

  /// Row i + 1 is point i, row 0 the last one that was forgotten, or point 0. As many rows as lanes can be
  /// read behind the last one.
  using Column = std::vector<double>;
  std::size_t rows() const { return rows_; }
  std::array<Column, 3> tip_P, axis_P;
  Column way_mm, turn, along_mm;  // as Target has them
  Column passed_mm;               // along the path, beyond which a block will not end at the point
  Column special;                 // not 0: the point, or one of the three behind it, is not plain

 private:
  // Points stay where they are; only rows are moved where the first ones are forgotten.
  static constexpr std::size_t kPage = 512;
  using Page = std::array<Target, kPage>;
  Target& at(std::size_t i) const { return (*pages_[(first_ + i) / kPage])[(first_ + i) % kPage]; }
  template <class F>
  void each_column(const F& f);
  template <class T>
  void settle_all();
  template <class T>
  void settle_few(std::size_t row);
  void settle_special(std::size_t row, std::size_t count);

  std::vector<std::unique_ptr<Page>> pages_;
  std::size_t first_ = 0;  // on its page
  std::size_t size_ = 0;
  std::size_t rows_ = 0;
  std::size_t gone_ = 0;
  lanes::Way way_ = lanes::way();
  double longest_flute_mm_ = 0.0;
};

}  // namespace trunnion::post
