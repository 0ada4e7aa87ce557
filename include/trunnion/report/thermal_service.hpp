#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "trunnion/thermal/condition.hpp"
#include "trunnion/thermal/predictor.hpp"

namespace trunnion::report {

/// The live loop without its sockets: one line in, one line out. README of the layer thermal, "Live loop",
/// has the messages.
///
/// JSON:  {"time_s": 12.5, "T_degC": {"front": 21.3}, "spindle_rpm": 6000, "feed_mm_min": 500, "measured_um":
/// {"dx": 12.1}}
///        {"query": "offset"}   {"query": "live"}   {"run": "start"}   {"enabled": false}
/// XML:   <reading time_s="12.5" spindle_rpm="6000"><T name="front">21.3</T></reading>
///        <measurement time_s="1800"><um channel="dx">12.1</um></measurement>   <query/>   <run/>
///        <enabled>0</enabled>
/// The answer has the form of the question: the correction that may be applied now (minus the deviation,
/// limited), its sigma and limits, or what was wrong; "live" adds for how long no reading came (s, by the
/// service's own clock) and how many lines were faulty. A faulty line changes nothing.
///
/// The time of a run neither goes back nor jumps ahead by more than a day: after such a pause the machine is
/// in another state, and one line with another clock (seconds of the calendar) would shut out all that
/// follow.
class ThermalService {
 public:
  ThermalService(thermal::ThermalModel model, const thermal::OffsetLimits& limits);

  /// @param now_s  of a clock of the service's own (seconds, any origin): without an accepted reading for 15
  ///               min the answers say `stale`, whatever time the last reading had
  std::string handle(const std::string& line, double now_s = 0.0);
  /// The answer to a line of another protocol that was faulty: it is counted as one of this.
  std::string refuse(const std::string& why);
  /// Time of the run, s; empty before its first reading.
  std::optional<double> time_s() const {
    return predictor_.started() ? std::optional(predictor_.time_s()) : std::nullopt;
  }
  /// Whether the last line changed the state: only such lines belong into the journal.
  bool changed() const { return changed_; }
  std::size_t readings() const { return readings_; }
  std::size_t rejected() const { return rejected_; }

 private:
  struct Message {
    std::optional<double> time_s, spindle_rpm, feed_mm_min;
    std::map<std::string, double> temperature_degC, measured_um;
    bool query = false;
    bool live = false;
    bool new_run = false;
    std::optional<bool> enabled;
  };
  struct Live;
  struct Answer;
  static Result<Message> parse_json(const std::string& line);
  static Result<Message> parse_xml(const std::string& line);
  Result<Answer> act(const Message& message);
  Result<void> check_reading(const Message& message) const;
  void take_reading(const Message& message, Answer& answer);
  void start_run();
  Result<void> fill(Answer& answer);

  thermal::ThermalModel model_;
  thermal::OffsetLimits limits_;
  thermal::Predictor predictor_;
  thermal::OffsetFollower follower_;
  std::vector<double> temperature_degC_;  // last good reading of each sensor, for jumps
  std::optional<double> followed_s_;
  double now_s_ = 0.0;
  double heard_s_ = 0.0;  // when the last reading was accepted
  std::size_t readings_ = 0;
  std::size_t rejected_ = 0;
  bool changed_ = false;
};

}  // namespace trunnion::report
