#pragma once
#include <array>
#include <optional>
#include <utility>

#include "post/judging/path_place.hpp"

namespace trunnion::post {

/// The course of blocks on a machine with errors, beside the segment of the CL path that they are on.
class BlockCourse {
 public:
  /// Of the machine with its errors: `of` makes a DeviationMeter. A nominal one has none.
  template <class... Of>
  void set_meter(const ProgramState& state, Of&&... of) {
    meter_.emplace(std::forward<Of>(of)...);
    for (Vertex& v : ends_) meter_->place(v, v.q, state);
    station_ = ends_[0].station;
  }
  bool has_meter() const { return meter_.has_value(); }
  const DeviationMeter& meter() const { return *meter_; }
  /// What the machine does at a position never changes, and all deviations are to be proved.
  bool is_fixed_and_proved() const { return meter_->is_fixed() && meter_->proves(); }

  using Segment = std::pair<Target, Target>;
  /// `flute_mm`: FluteLength of the tool that cuts it.
  void begin_segment(const Target& from, const Target& to, double flute_mm) {
    segment_ = {from, to};
    segment_->second.flute_mm = flute_mm;
  }
  /// From here on blocks pass more than one segment.
  void leave_segment() { segment_.reset(); }
  const std::optional<Segment>& segment() const { return segment_; }

  /// Of the tool up to its flute length, from its segment: a bound, mm.
  double flute_mm(const JointVector& from_q, const JointVector& to_q, bool tcp, const ProgramState& state,
                  double enough_mm) {
    place_ends(from_q, to_q, tcp, state);
    DeviationMeter::Beside known;
    known.flute_mm.upper = enough_mm;
    known.axis_rad.upper = kPi;
    const auto& [a, b] = *segment_;
    // About where its ends are: near the end of a segment of the path, or at a point between.
    const double t0 = fraction_of(ends_[0], a, b);
    const double t1 = fraction_of(ends_[1], a, b);
    return meter_->beside({ends_[0], ends_[1], t0, t1}, a, b, state, known).flute_mm.upper;
  }

  /// From its segment, of the block between these joint positions that is about to go out.
  DeviationMeter::Deviation deviation(const JointVector& from_q, const JointVector& to_q, bool tcp,
                                      const ProgramState& state, const DeviationMeter::Deviation& enough) {
    place_ends(from_q, to_q, tcp, state);
    return meter_->of(ends_[0], ends_[1], {segment_->first, segment_->second}, state, enough);
  }
  /// On the nominal machine, of the same block.
  std::pair<path::Station, path::Station> nominal(const TableKinematics& kinematics, const JointVector& from,
                                                  const JointVector& to) {
    if (station_.q != from) station_ = path::station(kinematics, from);
    const path::Station before = std::exchange(station_, path::station(kinematics, to));
    return {before, station_};
  }

 private:
  void place_ends(const JointVector& from_q, const JointVector& to_q, bool tcp, const ProgramState& state) {
    Vertex& from = ends_[0];
    Vertex& to = ends_[1];
    const bool is_fixed = is_fixed_and_proved();
    if (is_fixed && to.q == from_q) std::swap(from, to);  // it ended the last block
    if (!is_fixed || from.q != from_q) {
      from.q = from_q;
      meter_->place(from, to_q, state);
    }
    to.q = to_q;
    meter_->place(to, to_q, state);
    from.tcp = to.tcp = tcp;
  }

  std::optional<DeviationMeter> meter_;
  path::Station station_;       // of the nominal machine, where it was last asked for
  std::array<Vertex, 2> ends_;  // of the block that was looked at last
  std::optional<Segment> segment_;
};

}  // namespace trunnion::post
