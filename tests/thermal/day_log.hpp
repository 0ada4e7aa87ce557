#pragma once
#include <cstddef>
#include <string>

#include "trunnion/base/number_text.hpp"

namespace trunnion::test {

/// 24 h at 30 Hz.
inline constexpr std::size_t kDayRows = 24UL * 3600UL * 30UL;

/// Sensor `k` of the eight, in row `i`, degrees Celsius.
inline double day_degC(std::size_t i, std::size_t k) {
  return 20.0 + static_cast<double>((i * (k + 7)) % 9973) / 1000.0;
}

/// Text of a thermal log of a day with eight sensors.
inline std::string day_log_text() {
  std::string text = "time_s,T_1_degC,T_2_degC,T_3_degC,T_4_degC,T_5_degC,T_6_degC,T_7_degC,T_8_degC\n";
  text.reserve(kDayRows * 80);
  for (std::size_t i = 0; i < kDayRows; ++i) {
    text += fixed_text(static_cast<double>(i) / 30.0, 3);
    for (std::size_t k = 0; k < 8; ++k) text += "," + fixed_text(day_degC(i, k), 3);
    text += '\n';
  }
  return text;
}

}  // namespace trunnion::test
