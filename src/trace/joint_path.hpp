#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "trunnion/trace/compare.hpp"

// Private to the layer: the program as a line in the space of the axes.
namespace trunnion::trace {

/// Positions of all axes in one measure: mm, and rad times `kLever_mm`. What is near in it is near at the
/// tool of a part of that size.
using Scaled = Eigen::Matrix<double, static_cast<int>(kMaxAxes), 1>;
inline constexpr double kLever_mm = 100.0;

Scaled scaled(const Machine& machine, const JointVector& q);
JointVector unscaled(const Machine& machine, const Scaled& x);
/// What of `v` is across a unit vector.
inline Scaled across(const Scaled& v, const Scaled& tangent) {
  return v - tangent.dot(v) * tangent;
}

/// The way of the axes that the program asks for, block by block, by its length `s` in the scaled measure.
/// Where it is not known (the way to the first place, behind a retract) it has a hole without length.
class JointPath {
 public:
  JointPath(const Machine& machine, const std::vector<PlannedBlock>& blocks);

  struct Segment {
    std::size_t block = 0;  // of PlannedBlock
    bool known = true;
    double begins_s = 0.0, ends_s = 0.0;  // seconds since the program's first place, as planned
  };
  struct Place {
    double s = 0.0;
    double distance = 0.0;
    std::size_t segment = 0;
    bool beyond = false;  // behind an end of what is known of the path, or before a beginning
  };

  double length() const { return along_.back(); }
  double diagonal() const;
  std::size_t segments() const { return segments_.size(); }
  const Segment& segment(std::size_t i) const { return segments_[i]; }
  double begin_of(std::size_t i) const { return along_[i]; }
  double end_of(std::size_t i) const { return along_[i + 1]; }
  const Scaled& node(std::size_t i) const { return nodes_[i]; }
  /// Unit vector along a segment; zero where it has no length.
  Scaled tangent(std::size_t i) const;

  /// The segment that holds `s`; at a node the one that ends there, but for the first.
  std::size_t segment_at(double s) const;
  Scaled at(double s) const;
  /// An end of a hole is that near.
  bool is_near_hole(double s, double within) const;
  /// When the program is to come to `s`, dwells at the place itself not waited for.
  double planned_s(double s) const;
  /// When it is to leave `s`.
  double leaves_s(double s) const;

  /// The nearest place between two lengths.
  Place nearest(const Scaled& x, double from, double to) const;
  /// Places that are nearer than their neighbours and than `within`, nearest first, `most` of them.
  std::vector<Place> candidates(const Scaled& x, double within, std::size_t most) const;

 private:
  struct Box {
    Scaled low, high;
    double distance2(const Scaled& x) const;
    void add(const Scaled& x);
  };
  void add_block(const Machine& machine, const std::vector<PlannedBlock>& blocks, std::size_t k);
  void add_node(const Scaled& x, const Segment& segment);
  void make_boxes();
  bool is_known(std::size_t i) const { return i < segments_.size() && segments_[i].known; }
  Place on_segment(std::size_t i, const Scaled& x) const;

  std::vector<Scaled> nodes_;
  std::vector<double> along_;
  std::vector<Segment> segments_;
  std::vector<Box> boxes_, large_boxes_;
};

}  // namespace trunnion::trace
