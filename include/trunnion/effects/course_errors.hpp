#pragma once
#include <array>
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
    const auto courses = model.courses();
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
      link.turns = link.turns || at.course->component >= 3;
    }
  }
  CourseErrors(const CourseErrors&) = delete;
  CourseErrors& operator=(const CourseErrors&) = delete;

  /// At these positions: of links that vary, as ModelEvaluator::errors.
  const ChainErrorsOf<T>& at(const JointsOf<T>& q) {
    auto left = lanes::Mask<T>{};
    for (const Course& one : courses_) {
      const T& x = q[one.course->axis];
      left |= ~((load(one.low) <= x) & (x < load(one.high)));
    }
    if (lanes::any(left)) find(q);
    const T end = lanes::splat<T>(1.0);
    for (const Course& one : courses_) {
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
  /// Where the range check has nothing to say.
  lanes::Mask<T> inside(const JointsOf<T>& q) const {
    lanes::Mask<T> inside = ~lanes::Mask<T>{};
    for (const Course& one : courses_) {
      const T& x = q[one.course->axis];
      inside &= (x >= one.course->nodes.front()) & (x <= one.course->nodes.back());
    }
    return inside;
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

  // Seldom asked for: of the positions that have left their piece.
  [[gnu::noinline]] void find(const JointsOf<T>& q) {
    for (Course& one : courses_) {
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

  std::vector<Course> courses_;
  ChainErrorsOf<T> errors_;
};

}  // namespace trunnion
