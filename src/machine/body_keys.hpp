#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/config/section.hpp"
#include "trunnion/machine/machine.hpp"

// Private to the reader of machine files.
namespace trunnion {

inline constexpr std::string_view kBed = "bed";
inline constexpr std::string_view kSpindle = "spindle";

/// [[body]]: the shape of a body of the machine, for pictures.
struct BodyFile {
  std::string of;  // kBed, kSpindle or an axis
  std::string file;
  double mm_per_unit = 1.0;
  Vec3 offset_mm = Vec3::Zero();
};
std::vector<BodyFile> read_bodies(config::Section& root, const Machine& machine);

}  // namespace trunnion
