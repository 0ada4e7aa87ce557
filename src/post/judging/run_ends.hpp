#pragma once
#include <vector>

#include "trunnion/nc/motion_run.hpp"
#include "trunnion/path/station_run.hpp"

#include "post/feeds/control_times.hpp"
#include "post/judging/travel_seen.hpp"
#include "post/words_in_force.hpp"

// Private to the verifier.
namespace trunnion::post {

// Rounding of the evaluation of a block's time, of it.
inline constexpr double kSpeedRounding = 1e-6;

/// The ends of the blocks of a run, as far as the CL path and the errors of the machine have no part in it.
/// Row 0 is where the first of them begins.
struct RunEnds {
  explicit RunEnds(const TableKinematics& kinematics) : stations(kinematics) {}

  /// Of motions whose words are positions of the machine; the first begins at `from`.
  void evaluate(const nc::MotionRun& run, const JointVector& from, const WordsInForce& words,
                const ControlTimes& times, const TravelSeen& travel);

  path::StationRun stations;
  std::vector<double> seconds, slowest_s;  // of the blocks, and what their slowest axes need
  std::vector<double> way_mm;              // of the nominal tip, from end to end
  double speed_ratio = 0.0;                // the largest
  JointVector smallest_q, largest_q;
  bool within_limits = false;  // and no axis is too fast

 private:
  template <class T>
  void put_words(const nc::MotionRun& run, const JointVector& from, const WordsInForce& words);
  template <class T>
  void find_ways(std::size_t count);
  template <class T>
  void find_speed(std::size_t count);
};

}  // namespace trunnion::post
