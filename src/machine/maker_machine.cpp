#include "trunnion/machine/maker_machine.hpp"

#include <array>

#include "trunnion/config/section.hpp"
#include "trunnion/config/value.hpp"

namespace trunnion {
namespace {

using config::Section;

bool is_rotary_letter(char letter) {
  return letter <= 'C';
}

void read_positive(Section& s, const char* key, double& out) {
  const auto value = s.find_quantity(key);
  if (!value) return;
  if (!(*value > 0.0)) s.error(key, "'" + std::string(key) + "' must be above 0");
  out = *value;
}

void read_speed(Section& root, const char* key, bool rotary, NewMachine& machine) {
  double speed = 0.0;
  read_positive(root, key, speed);
  if (speed <= 0.0) return;
  for (const char letter : "XYZ" + machine.rotary) {
    if (is_rotary_letter(letter) == rotary) machine.rapid[letter] = speed;
  }
}

void read_axis(Section& s, MakerMachine& out) {
  const std::string name = s.text("name");
  const bool cyclic = s.flag_or("cyclic", false);
  const std::string letters = "XYZ" + out.machine.rotary;
  const bool known = name.size() == 1 && letters.find(name[0]) != std::string::npos;
  if (!known) s.error("name", "'name' must be one of " + letters + ", not '" + name + "'");
  const bool rotary = known && is_rotary_letter(name[0]);
  const auto min = s.find_quantity(rotary ? "min_deg" : "min_mm");
  const auto max = s.find_quantity(rotary ? "max_deg" : "max_mm");
  double length = 0.0;
  if (!rotary) read_positive(s, "length_mm", length);
  s.finish();
  if (!known) return;
  if (min.has_value() != max.has_value() || (min && !(*min < *max)))
    s.error("name", "axis " + name + ": its lower end, then its upper end, or neither");
  if (min && max) out.machine.travel[name[0]] = {*min, *max, false};
  if (cyclic && rotary) out.machine.travel[name[0]] = {0.0, 0.0, true};
  if (length > 0.0) out.length_mm[name[0]] = length;
}

}  // namespace

Result<MakerMachine> parse_maker_machine(std::string_view toml, const std::string& file,
                                         Diagnostics& diagnostics) {
  const auto value = config::parse_toml(toml, file);
  if (!value) {
    diagnostics.error(file, value.error().where, value.error().message);
    return tl::unexpected(value.error());
  }
  const std::size_t errors = diagnostics.error_count();
  MakerMachine out;
  Section root(*value, "file", file, diagnostics);
  out.machine.name = root.text("name");
  out.machine.controller = root.find_text("controller");
  out.machine.rotary = root.text("rotary");
  out.sources = root.texts("sources");
  out.differs = root.find_text("differs").value_or("");
  constexpr std::array kPairs = {"AC", "BC", "AB"};
  if (std::find(kPairs.begin(), kPairs.end(), out.machine.rotary) == kPairs.end())
    root.error("rotary", "'rotary' must be AC, BC or AB, the one on the bed first");
  read_speed(root, "rapid_mm_min", false, out.machine);
  read_speed(root, "rapid_deg_min", true, out.machine);
  for (Section& axis : root.sections("axis")) read_axis(axis, out);
  root.finish();
  if (diagnostics.error_count() > errors) return tl::unexpected(diagnostics.first_error());
  return out;
}

}  // namespace trunnion
