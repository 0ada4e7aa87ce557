#pragma once
#include <array>
#include <vector>

#include "trunnion/effects/effect.hpp"
#include "trunnion/machine/error_columns.hpp"

namespace trunnion {

/// The pieces of a straight course, between two nodes each, on which a few positions stand: a run of
/// positions seldom leaves its piece, and is then evaluated without a search. T is `Lanes` or `Quads`.
template <class T>
class CoursePiece {
 public:
  /// The course at these positions, mm or rad: as effects::straight_value gives for each. All calls with the
  /// same course.
  T value(const StraightCourse& course, const T& x) {
    constexpr std::size_t kTogether = lanes::kCount<T>;
    if (lanes::any(~((lanes::load<T>(low_.data()) <= x) & (x < lanes::load<T>(high_.data()))))) {
      std::array<double, kTogether> at;
      lanes::store(at.data(), x);
      for (std::size_t i = 0; i < kTogether; ++i) find(course, at[i], i);
    }
    const T low = lanes::load<T>(low_.data());
    const T way = (x - low) / (lanes::load<T>(high_.data()) - low);
    const T one = lanes::splat<T>(1.0);
    // Beyond the last nodes their value is held.
    const T up = lanes::select(way < 0.0, T{}, way);
    const T t = lanes::select(up > 1.0, one, up);
    return (1.0 - t) * lanes::load<T>(at_low_.data()) + t * lanes::load<T>(at_high_.data());
  }

 private:
  // The piece of lane `i`, seldom asked for.
  [[gnu::noinline]] void find(const StraightCourse& course, double x, std::size_t i) {
    const std::size_t first = course.piece_at(x);
    low_[i] = course.nodes[first];
    high_[i] = course.nodes[first + 1];
    at_low_[i] = course.values[first];
    at_high_[i] = course.values[first + 1];
  }
  using Column = std::array<double, lanes::kCount<T>>;
  Column low_{}, high_{};  // none yet: no position is within it
  Column at_low_{}, at_high_{};
};

/// Of all courses of a model.
template <class T>
using CoursePieces = std::vector<CoursePiece<T>>;

}  // namespace trunnion
