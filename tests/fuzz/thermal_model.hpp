#pragma once
#include "trunnion/thermal/model.hpp"

#include "fuzz/fuzz.hpp"
#include "support/folders.hpp"

namespace trunnion::fuzz {

/// The model that logs and lines of the live loop are predicted with.
inline const thermal::ThermalModel& thermal_model() {
  static const thermal::ThermalModel read = [] {
    Diagnostics diagnostics;
    auto out = thermal::load_model(test::source_folder() + "/tests/fuzz/thermal_model.toml", diagnostics);
    if (!out) broken(out.error().text());
    return *out;
  }();
  return read;
}

}  // namespace trunnion::fuzz
