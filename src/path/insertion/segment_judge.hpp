#pragma once
#include <cstdint>
#include <limits>
#include <optional>

#include "trunnion/path/flute.hpp"
#include "trunnion/path/nonlinear.hpp"

namespace trunnion::path {

/// Whether the machine, on its way between two places, keeps within the tolerance of one segment of the path:
/// the tip of its chord, the tool axis of its great circle, the flute of both at one place.
class SegmentJudge {
 public:
  /// `sampled`: within, as far as samples can tell.
  enum class Verdict : std::uint8_t { beyond, sampled, proved };
  /// The largest deviations of some pieces.
  struct Largest {
    double tip_mm = 0.0;
    double axis_rad = 0.0;
    double flute_mm = 0.0;
  };
  /// What is known of a piece before it is looked at.
  struct Known {
    /// Square of what the axes at its ends are at most off some axes of the reference.
    double off_axis2 = std::numeric_limits<double>::infinity();
    const Vec3* middle_P = nullptr;   // where its tip is in the middle
    std::optional<double> ends_mm{};  // how far its ends are off the reference at most
  };

  /// `options` must outlive this.
  SegmentJudge(const Machine& machine, const Vec3& tool_mm, const NonlinearOptions& options)
      : options_(options), certifier_(TableKinematics(machine, tool_mm)) {}

  /// The segment from now on.
  void start(const Point& a, const Point& b, const Tolerance& tolerance);
  /// A part of it between two places at the pole: `ends` are those that nodes are planned between, and
  /// `share` is the fraction of the segment at which it begins. `in_place`: the tip has to stand still.
  void start_part(const Reference& ends, double share, bool in_place);
  /// The whole of it again, from `a` to `b`.
  void end_part(const Point& a, const Point& b);

  /// Of the motion from `a` to `b`.
  Verdict verdict(const Station& a, const Station& b, const Known& known) const;
  bool within(const Station& a, const Station& b) const { return verdict(a, b, {}) != Verdict::beyond; }
  /// The same between these fractions of the segment, about.
  bool within(const Station& a, const Station& b, const FluteCertifier::Places& about) const {
    return flute_ ? flute_verdict(a, b, about) != Verdict::beyond : within(a, b);
  }
  /// Joins the deviations of the motion from `a` to `b` to those that were largest so far.
  void measure(const Station& a, const Station& b, Largest& largest) const;
  /// Rotary axes that run straight from `a` to `b` keep the tool axis where it has to be.
  bool axis_holds(const Station& a, const Station& b) const;
  double off_mm(const Vec3& tip_P) const {
    return distance_to_segment(tip_P, reference_.tip0_P, reference_.tip1_P);
  }

  const TableKinematics& kinematics() const { return certifier_.kinematics(); }
  const Certifier& certifier() const { return certifier_; }
  const NonlinearOptions& options() const { return options_; }
  const Tolerance& tolerance() const { return tolerance_; }
  const Reference& reference() const { return reference_; }
  /// The part of the segment that nodes are planned for, where the flute counts.
  const FluteSegment* flute_part() const { return flute_ ? &flute_->part : nullptr; }

 private:
  Verdict flute_verdict(const Station& a, const Station& b, const FluteCertifier::Places& about) const;
  Verdict tip_verdict(const Station& a, const Station& b, const Vec3* known_middle_P, double ends_mm) const;
  bool axis_surely_within(const Station& a, const Station& b, double off_axis2) const;
  bool flute_surely_within(const Station& a, const Station& b) const;
  FluteCertifier flute_certifier() const {
    using Tip = FluteCertifier::Tip;
    return FluteCertifier(kinematics(), options_.straight_tip ? Tip::straight : Tip::as_axes_go);
  }

  const NonlinearOptions& options_;
  Certifier certifier_;
  Tolerance tolerance_;
  Reference reference_;
  /// Where the flute counts: the segment, and the part of it that nodes are planned for.
  struct Flute {
    FluteSegment whole, part;
  };
  std::optional<Flute> flute_;
};

}  // namespace trunnion::path
