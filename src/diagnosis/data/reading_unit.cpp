#include "diagnosis/data/reading_unit.hpp"

#include <map>

#include "trunnion/base/units.hpp"

namespace trunnion::diagnosis {

std::optional<double> factor_of_unit(Quantity quantity, const std::string& unit) {
  constexpr double kArcminPerDegree = 60.0, kArcsecPerDegree = 3600.0;
  static const std::map<std::string, double> lengths = {
      {"um", kMmPerUm}, {"\u00b5m", kMmPerUm},       {"\u03bcm", kMmPerUm},
      {"mm", 1.0},      {"nm", kMmPerUm * kMmPerUm}, {"in", kMmPerInch}};
  static const std::map<std::string, double> angles = {{"urad", kRadPerUrad},
                                                       {"\u00b5rad", kRadPerUrad},
                                                       {"\u03bcrad", kRadPerUrad},
                                                       {"mrad", kRadPerUrad / kMmPerUm},
                                                       {"rad", 1.0},
                                                       {"deg", kRadPerDegree},
                                                       {"arcmin", kRadPerDegree / kArcminPerDegree},
                                                       {"arcsec", kRadPerDegree / kArcsecPerDegree}};
  const auto& known = quantity == Quantity::displacement ? lengths : angles;
  const auto it = known.find(unit);
  return it == known.end() ? std::nullopt : std::optional(it->second);
}

}  // namespace trunnion::diagnosis
