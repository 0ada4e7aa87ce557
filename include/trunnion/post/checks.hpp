#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace trunnion::post {

/// What a program is compared with its CL file by, in the order of the table.
enum class CheckOf : std::uint8_t {
  path,     // tip, tool axis, travel, path mode, compensation of the cutter's radius
  feeds,    // how fast it cuts
  rapids,   // rapids where the CL file has rapids, and what moves outside the cuts
  tools,    // tool and length at every cut
  offsets,  // work offset and what is added to it
  spindle,  // sense and speed, coolant
  order,    // every CL motion once, in order; dwells and stops
  end       // the end of the program is reached
};
inline constexpr std::size_t kChecks = 8;

/// A line of the program that one of the checks does not let pass.
struct CheckPlace {
  std::uint32_t nc_line = 0;
  std::string what;  // with the numbers
};

/// One line of the table of a verification.
struct Check {
  enum class State : std::uint8_t { passed, failed, not_known };
  State state = State::passed;
  std::string about;               // what was compared, or why that is not known
  std::size_t count = 0;           // places that do not pass
  std::vector<CheckPlace> places;  // the first of them
};
/// A word that the controller file lets pass by its name ([read] allowed), and that the program has.
struct AllowedUse {
  std::string word;
  std::size_t count = 0;
  std::uint32_t nc_line = 0;  // the first
};

using Checks = std::array<Check, kChecks>;

/// `path`, `feeds` and so on.
const char* name_of(CheckOf check);
/// `passed`, `failed`, `not known to this control file`.
const char* name_of(Check::State state);

}  // namespace trunnion::post
