#pragma once
#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "trunnion/effects/model.hpp"
#include "trunnion/machine/error_columns.hpp"

namespace trunnion {

/// Errors of a chain at a few positions side by side, for models all of whose varying effects are straight
/// courses (ModelEvaluator::only_courses). A run of positions seldom leaves the pieces between two nodes on
/// which it stands: these are kept, and are then read without a search. T is `Lanes` or `Quads`.
template <class T>
class CourseErrors {
 public:
  /// `model` must outlive the object; where not all are courses it must not be asked.
  explicit CourseErrors(const ModelEvaluator& model) {
    if (!model.only_courses()) return;
    auto courses = model.courses();
    const auto behind = std::stable_partition(courses.begin(), courses.end(), turns);
    turning_ = static_cast<std::size_t>(behind - courses.begin());
    courses_.reserve(courses.size());
    for (const ModelEvaluator::LinkCourse& at : courses) {
      TwistOf<T>& link = link_of(errors_, at.link);
      const Twist& constant = link_of(model.constant(), at.link);
      Course one{at.course};
      T* const to = link.component(one.course->component);
      for (const Course& other : courses_) one.is_first = one.is_first && other.to != to;
      if (one.is_first) link = TwistOf<T>(constant);
      one.to = to;
      const Vec3& of = one.course->component < 3 ? constant.trans_mm : constant.rot_rad;
      one.constant = of[one.course->component % 3];
      courses_.push_back(one);
    }
    for (const ModelEvaluator::LinkCourse& at : courses) {
      TwistOf<T>& link = link_of(errors_, at.link);
      link.turns = link.turns || turns(at);
    }
  }
  CourseErrors(const CourseErrors&) = delete;
  CourseErrors& operator=(const CourseErrors&) = delete;

  /// At these positions: of links that vary, as ModelEvaluator::errors.
  const ChainErrorsOf<T>& at(const JointsOf<T>& q) { return look_up(courses_, q); }
  /// The same, where only the rotations are asked for: the translations are left as they were.
  const ChainErrorsOf<T>& rotations_at(const JointsOf<T>& q) { return look_up(turning(), q); }
  /// The rotations hang on the position: else `rotations_at` looks nothing up.
  bool rotations_vary() const { return turning_ > 0; }
  /// Where the range check has nothing to say.
  lanes::Mask<T> inside(const JointsOf<T>& q) const { return inside(courses_, q); }
  /// The same of what `rotations_at` looks up.
  lanes::Mask<T> rotations_inside(const JointsOf<T>& q) const {
    return inside(std::span(courses_).first(turning_), q);
  }

 private:
  using Column = std::array<double, lanes::kCount<T>>;
  struct Course {
    const StraightCourse* course;
    T* to = nullptr;        // the component to which it adds
    double constant = 0.0;  // what that always has
    bool is_first = true;   // to add to it
    Column low{}, high{};   // none yet: no position is within it
    Column at_low{}, at_high{};
  };
  static T load(const Column& column) { return lanes::load<T>(column.data()); }
  static bool turns(const ModelEvaluator::LinkCourse& at) { return at.course->component >= 3; }
  std::span<Course> turning() { return std::span(courses_).first(turning_); }

  const ChainErrorsOf<T>& look_up(std::span<Course> courses, const JointsOf<T>& q) {
    auto left = lanes::Mask<T>{};
    for (const Course& one : courses) {
      const T& x = q[one.course->axis];
      left |= ~((load(one.low) <= x) & (x < load(one.high)));
    }
    if (lanes::any(left)) find(courses, q);
    const T end = lanes::splat<T>(1.0);
    for (const Course& one : courses) {
      const T low = load(one.low);
      const T way = (q[one.course->axis] - low) / (load(one.high) - low);
      // Beyond the last nodes their value is held.
      const T up = lanes::select(way < 0.0, T{}, way);
      const T t = lanes::select(up > 1.0, end, up);
      const T value = (1.0 - t) * load(one.at_low) + t * load(one.at_high);
      *one.to = one.is_first ? one.constant + value : *one.to + value;
    }
    return errors_;
  }
  static lanes::Mask<T> inside(std::span<const Course> courses, const JointsOf<T>& q) {
    lanes::Mask<T> inside = ~lanes::Mask<T>{};
    for (const Course& one : courses) {
      const T& x = q[one.course->axis];
      inside &= (x >= one.course->nodes.front()) & (x <= one.course->nodes.back());
    }
    return inside;
  }

  // Seldom asked for: of the positions that have left their piece.
  [[gnu::noinline]] static void find(std::span<Course> courses, const JointsOf<T>& q) {
    for (Course& one : courses) {
      const StraightCourse& course = *one.course;
      for (std::size_t i = 0; i < lanes::kCount<T>; ++i) {
        const double x = q[course.axis][static_cast<int>(i)];
        if (one.low[i] <= x && x < one.high[i]) continue;
        const std::size_t first = course.piece_at(x);
        one.low[i] = course.nodes[first];
        one.high[i] = course.nodes[first + 1];
        one.at_low[i] = course.values[first];
        one.at_high[i] = course.values[first + 1];
      }
    }
  }

  std::vector<Course> courses_;  // those that turn come first
  std::size_t turning_ = 0;      // so many do
  ChainErrorsOf<T> errors_;
};

}  // namespace trunnion
