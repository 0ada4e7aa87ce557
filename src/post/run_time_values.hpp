#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "trunnion/nc/blocks.hpp"
#include "trunnion/nc/controller.hpp"

namespace trunnion::post {

/// The three values that a program latches at its operations, as the control's words do it
/// (Controller::RunTime): calculated from temperatures where the program says so, clamped, left alone within
/// the dead band, changed by at most a step.
class RunTimeValues {
 public:
  explicit RunTimeValues(const nc::Controller& controller) : format_(controller.numbers.axes) {}

  /// A line of the calculation, while the sensors are at `temperature_K` and were at `reference_K` when the
  /// part's zero was taken, which is when rises begin; a sensor that is not among them stands still.
  void take(const nc::RunTimeStep& step, std::span<const double> temperature_K,
            std::span<const double> reference_K) {
    using Kind = nc::RunTimeStep::Kind;
    const double unit = std::pow(10.0, -nc::kFactorDecimals);
    switch (step.kind) {
      case Kind::reset:
        measured_mm_ = Vec3::Zero();
        break;
      case Kind::read:
        put(read_K_, step.sensor, step.sensor < temperature_K.size() ? temperature_K[step.sensor] : 0.0);
        break;
      case Kind::reference:
        put(reference_K_, step.sensor, step.sensor < reference_K.size() ? reference_K[step.sensor] : 0.0);
        break;
      case Kind::start:
        calculated_ = true;
        calculated_mm_[static_cast<Eigen::Index>(step.axis)] =
            measured_mm_[static_cast<Eigen::Index>(step.axis)];
        break;
      case Kind::add:
        calculated_mm_[static_cast<Eigen::Index>(step.axis)] +=
            static_cast<double>(step.factor) * unit *
            (now_K(step.sensor, temperature_K) - known(reference_K_, step.sensor, 0.0));
        break;
    }
  }
  /// `source_mm` is what the control holds at this moment where the program does not calculate it.
  void latch(const nc::LatchValues& words, const Vec3& source_mm) {
    const auto mm = [&](std::int64_t quanta) { return format_.internal(nc::AxisLetter::X, quanta); };
    const double clamp = mm(words.clamp);
    const double step = mm(words.step);
    if (words.first) now_mm_ = Vec3::Zero();
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double wanted = std::clamp(calculated_ ? calculated_mm_[k] : source_mm[k], -clamp, clamp);
      const double change = wanted - now_mm_[k];
      if (std::abs(change) > mm(words.dead_band)) now_mm_[k] += std::clamp(change, -step, step);
    }
  }
  /// What the terms of a motion add to its words of X, Y and Z, mm.
  Vec3 change(const nc::VariableMotion& motion) const {
    Vec3 out = Vec3::Zero();
    const double unit = std::pow(10.0, -nc::kCoefficientDecimals);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        out[static_cast<Eigen::Index>(i)] +=
            static_cast<double>(motion.coefficient[i][k]) * unit * now_mm_[static_cast<Eigen::Index>(k)];
      }
    }
    return out;
  }

 private:
  static void put(std::vector<double>& values, std::size_t i, double value) {
    if (values.size() <= i) values.resize(i + 1, 0.0);
    values[i] = value;
  }
  static double known(const std::vector<double>& values, std::size_t i, double otherwise) {
    return i < values.size() ? values[i] : otherwise;
  }
  // Where the program reads the sensors itself, what it read last.
  double now_K(std::size_t sensor, std::span<const double> temperature_K) const {
    if (!read_K_.empty()) return known(read_K_, sensor, 0.0);
    return sensor < temperature_K.size() ? temperature_K[sensor] : 0.0;
  }

  nc::AxisFormat format_;
  std::vector<double> read_K_, reference_K_;
  Vec3 measured_mm_ = Vec3::Zero();
  Vec3 calculated_mm_ = Vec3::Zero();
  bool calculated_ = false;
  Vec3 now_mm_ = Vec3::Zero();
};

}  // namespace trunnion::post
