#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "trunnion/base/shdr.hpp"
#include "trunnion/thermal/model.hpp"

namespace trunnion::report {

/// Makes lines of ThermalService's own protocol out of what other sources send: messages of an MQTT broker
/// and lines of MTConnect adapters.
///
/// An input of the model (a sensor, `spindle_rpm`, `feed_mm_min`, a channel that was measured, `time_s`)
/// takes the item of its name, or the one that `NAME=ITEM` or `NAME=ITEM*FACTOR` gives it. The item of a
/// message is its topic, with the keys of JSON objects behind it (`topic/key`); ITEM may leave out what
/// stands before a `/` (or, of an adapter, the device before a `:`).
///
/// - The time of a reading is when it came, by a clock that never goes back, unless `time_s` has an item:
/// clocks of
///   loggers jump.
/// - Adapters send what has changed: every line of one says that its other values still hold. `UNAVAILABLE`,
/// NaN and
///   null are not read.
/// - A measurement (um, times its factor) is one when its text differs from the last one: publishers repeat
/// what
///   they have.
class LiveReadings {
 public:
  /// Fails (wrong_use) on an item for something that the model does not take.
  static Result<LiveReadings> create(const thermal::ThermalModel& model,
                                     const std::vector<std::string>& items);

  /// The run's time that the clock stands for at `now_s`, s: where a journal left it.
  void set_clock(double time_s, double now_s) { offset_s_ = time_s - now_s; }
  /// A line to handle, or an empty one where nothing in it is the model's. Fails (wrong_input) on what is
  /// faulty: all of it is left out.
  Result<std::string> of_message(const std::string& topic, const std::string& payload, double now_s);
  /// The same of a line of the adapter `source`; a line that has nothing for the model gives its held values
  /// again, at most every ten seconds.
  Result<std::string> of_shdr(const std::string& source, const ShdrLine& line, double now_s);
  /// The adapter's connection has ended: its values hold no longer.
  void forget(const std::string& source) { held_.erase(source); }

 private:
  enum class Kind { temperature, spindle, feed, measured, time };
  struct Input {
    Kind kind = Kind::temperature;
    std::string name, item;
    double factor = 1.0;
  };
  /// Values by the place of their input; NaN: not read.
  using Values = std::map<std::size_t, double>;
  struct Held {
    Values values;
    double said_s = -1e9;  // when they were last handed on
  };
  Result<Values> values_of(const std::vector<LiveValue>& live);
  std::string line_of(const Values& values, double now_s);

  std::vector<Input> inputs_;
  std::map<std::string, Held> held_;        // by adapter
  std::map<std::size_t, double> measured_;  // the last one of an input
  std::optional<double> source_time_s_;     // the last value of `time_s`
  bool has_time_ = false;                   // some item gives it
  double offset_s_ = 0.0;
};

}  // namespace trunnion::report
