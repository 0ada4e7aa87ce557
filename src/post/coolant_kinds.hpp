#pragma once
#include <array>
#include <cstddef>

#include "trunnion/cl/record.hpp"
#include "trunnion/nc/blocks.hpp"

// Kinds of coolant of a CL file and of a program.
namespace trunnion::post {

inline nc::CoolantKind coolant_kind(cl::Coolant::Kind kind) {
  using enum nc::CoolantKind;  // of off, on, flood, mist, tap, through, air
  constexpr std::array kKinds = {off, flood, flood, mist, flood, through_tool, air};
  return kKinds[static_cast<std::size_t>(kind)];
}

inline cl::Coolant::Kind coolant_kind(nc::CoolantKind kind) {
  using enum cl::Coolant::Kind;  // of off, flood, mist, through_tool, air
  constexpr std::array kKinds = {off, flood, mist, through, air};
  return kKinds[static_cast<std::size_t>(kind)];
}

}  // namespace trunnion::post
