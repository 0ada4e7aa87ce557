#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "trunnion/thermal/condition.hpp"
#include "trunnion/thermal/model.hpp"

namespace trunnion::thermal {

/// How far each sensor moved in a model's training, root mean square, K; infinite where no channel says it.
/// A sensor that hardly moved there may stand still for hours.
std::vector<double> usual_moves_K(const ThermalModel& model, const std::vector<std::string>& sensors);

/// Judges sensors reading by reading, as far as what has come so far tells: jumps and standstills by the
/// limits that whole logs are judged by.
class SensorWatch {
 public:
  explicit SensorWatch(std::vector<double> usual_move_K);

  /// These readings without those that cannot be believed: after a jump none, until one is back at the last
  /// good one.
  std::vector<double> believed(double time_s, std::span<const double> degC);
  /// It stands still while another sensor moves, and never moved in this run though it did in the training,
  /// or its noise turned its readings round before and no more.
  bool stuck(std::size_t sensor) const;

 private:
  struct Sensor {
    double good_degC = kNotRead, good_s = 0.0;
    std::size_t away = 0;  // readings since it jumped
    // Its standstill, and what was before.
    double since_s = 0.0;
    std::size_t readings = 0, readings_before = 0;
    double direction = 0.0;
    std::size_t turns = 0;
    bool moved = false;
    std::vector<double> least_degC, most_degC;  // of all sensors since then
  };
  void follow(std::size_t sensor, double time_s, double degC);
  std::vector<double> usual_move_K_;
  std::vector<Sensor> sensors_;
  SensorLimits limits_;
  double time_s_ = 0.0;
};

}  // namespace trunnion::thermal
