#pragma once
#include <array>
#include <optional>
#include <span>

#include "trunnion/nc/controller.hpp"

#include "post/feeds/axis_rates.hpp"

namespace trunnion::post {

/// How long a control takes for a block with its F.
class ControlTimes {
 public:
  /// `controller` must outlive this.
  ControlTimes(const Machine& machine, const nc::Controller& controller)
      : axes_(machine), controller_(controller) {}

  const AxisRates& axes() const { return axes_; }
  AxisRates& axes() { return axes_; }
  const nc::Controller& controller() const { return controller_; }

  /// Length by which the control divides a per-minute F: mm, or rad where only rotary axes move.
  struct Way {
    double length = 0.0;
    bool rotary_only = false;
  };
  /// `tcp_way_mm`: the way of the tip's words under tool-centre-point control.
  Way way(const JointVector& a, const JointVector& b, const std::optional<double>& tcp_way_mm) const;
  /// Includes the lowest rate that the control keeps in inverse time
  /// (Controller::FeedRules::min_linear_rate_mm_s).
  double seconds(const Way& way, nc::FeedMode mode, std::int64_t feed) const;

  /// Blocks one after the other: block i goes from q[axis][i] to q[axis][i + 1] with F feed[i].
  struct Blocks {
    std::array<const double*, kMaxAxes> q;
    nc::FeedMode mode;
    std::span<const std::int64_t> feed;
  };
  /// What `seconds` and `AxisRates::slowest_axis_s` give for them, a few at a time. Up to three more than
  /// there are are read and written.
  void of_blocks(const Blocks& blocks, std::span<double> seconds, std::span<double> slowest_s) const;

 private:
  template <class T>
  void of_few(const Blocks& blocks, std::span<double> seconds, std::span<double> slowest_s) const;

  AxisRates axes_;
  const nc::Controller& controller_;
};

}  // namespace trunnion::post
