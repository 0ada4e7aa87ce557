// The ini of an open control, as far as it describes a machine.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <vector>

#include "trunnion/base/field_text.hpp"
#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/machine/new_machine.hpp"

namespace trunnion {
namespace {

struct Entry {
  std::string section, key, value;
  std::uint32_t line = 0;
};

std::vector<std::string> words_of(std::string_view text) {
  std::vector<std::string> out;
  for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
    const auto end = std::min(text.find_first_of(" \t"), text.size());
    out.emplace_back(text.substr(0, end));
    text.remove_prefix(end);
  }
  return out;
}

template <class Take>
void for_each_line(std::string_view text, const Take& take) {
  for (std::uint32_t line = 1; !text.empty(); ++line) {
    const auto end = std::min(text.find('\n'), text.size());
    take(trimmed(text.substr(0, end)), line);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

std::vector<Entry> entries_of(std::string_view text) {
  std::vector<Entry> out;
  std::string section;
  for_each_line(text, [&](std::string_view line, std::uint32_t number) {
    if (line.empty() || line.front() == '#' || line.front() == ';') return;
    if (line.front() == '[') {
      section = line.substr(1, line.find(']') - 1);
      return;
    }
    const auto equals = line.find('=');
    if (equals == std::string_view::npos) return;
    out.push_back({section, std::string(trimmed(line.substr(0, equals))),
                   std::string(trimmed(line.substr(equals + 1))), number});
  });
  return out;
}

// Values of the pins of the kinematics module: `setp PIN VALUE`, or `net SIGNAL PIN` with `sets SIGNAL
// VALUE`.
class Pins {
 public:
  void command(std::string_view line) {
    std::vector<std::string> words = words_of(line);
    std::erase_if(words, [](const std::string& w) { return w == "=>" || w == "<=" || w == "<=>"; });
    if (words.size() < 3) return;
    if (words[0] == "setp") values_[words[1]] = words[2];
    if (words[0] == "sets") signals_[words[1]] = words[2];
    if (words[0] != "net") return;
    for (std::size_t i = 2; i < words.size(); ++i) nets_[words[i]] = words[1];
  }
  /// 0 for one that nobody sets; nothing for one whose value is no number.
  std::optional<double> value(const std::string& pin) const {
    const auto direct = values_.find(pin);
    if (direct != values_.end()) return read(direct->second);
    const auto net = nets_.find(pin);
    if (net == nets_.end()) return 0.0;
    const auto signal = signals_.find(net->second);
    return signal == signals_.end() ? 0.0 : read(signal->second);
  }

 private:
  static std::optional<double> read(const std::string& text) {
    const auto number = parse_number(text);
    return number ? std::optional(number.value) : std::nullopt;
  }
  std::map<std::string, std::string> values_, signals_, nets_;
};

class IniReader {
 public:
  IniReader(std::string_view text, std::string file, Diagnostics& diagnostics)
      : entries_(entries_of(text)), file_(std::move(file)), diagnostics_(diagnostics) {}

  Result<NewMachine> read() {
    // Where the control's own kinematics count from: programs with tool-centre-point control need no more.
    machine_.part_zero_mm = Vec3::Zero();
    const std::size_t errors = diagnostics_.error_count();
    const Entry* name = find("EMC", "MACHINE");
    machine_.name = name != nullptr ? name->value : std::filesystem::path(file_).stem().string();
    machine_.table_turns_positively = true;
    read_units();
    read_kinematics();
    if (diagnostics_.error_count() == errors) {
      read_pins();
      for (const char letter : "XYZ" + machine_.rotary) read_axis(letter);
    }
    if (diagnostics_.error_count() > errors) return tl::unexpected(diagnostics_.first_error());
    return machine_;
  }

 private:
  const Entry* find(std::string_view section, std::string_view key) const {
    const auto it = std::find_if(entries_.begin(), entries_.end(),
                                 [&](const Entry& e) { return e.section == section && e.key == key; });
    return it == entries_.end() ? nullptr : &*it;
  }
  void error(const Entry* at, const std::string& message) {
    diagnostics_.error(file_, at != nullptr ? SourceRef{at->line, 1} : SourceRef{}, message);
  }

  void read_units() {
    const Entry* units = find("TRAJ", "LINEAR_UNITS");
    const std::string text = units != nullptr ? units->value : "mm";
    if (text == "inch" || text == "in" || text == "imperial")
      mm_per_unit_ = kMmPerInch;
    else if (text != "mm" && text != "metric")
      error(units, "LINEAR_UNITS is '" + text + "', neither mm nor inch");
    const Entry* angles = find("TRAJ", "ANGULAR_UNITS");
    if (angles != nullptr && !angles->value.starts_with("deg"))
      error(angles, "ANGULAR_UNITS is '" + angles->value + "', not deg");
  }

  void read_kinematics() {
    const Entry* entry = find("KINS", "KINEMATICS");
    if (entry == nullptr) return error(nullptr, "no KINEMATICS in [KINS]");
    const std::vector<std::string> words = words_of(entry->value);
    module_ = words.empty() ? "" : words[0];
    machine_.switchable_kinematics = true;  // these modules come with identity kinematics beside their own
    if (module_ == "xyzac-trt-kins")
      machine_.rotary = "AC";
    else if (module_ == "xyzbc-trt-kins")
      machine_.rotary = "BC";
    else
      error(entry, "kinematics '" + module_ +
                       "' do not say where rotary axes stand; xyzac-trt-kins and xyzbc-trt-kins do. Give the "
                       "points by "
                       "--point-mm instead of --ini");
  }

  // HALCMD lines of the ini, and the HAL files that stand beside it.
  void read_pins() {
    Pins pins;
    for (const Entry& e : entries_) {
      if (e.section != "HAL") continue;
      if (e.key == "HALCMD") pins.command(e.value);
      if (!e.key.ends_with("HALFILE") || e.value.starts_with("LIB:") || !e.value.ends_with(".hal")) continue;
      const auto text = read_file((std::filesystem::path(file_).parent_path() / e.value).string());
      if (text) {
        for_each_line(*text, [&](std::string_view line, std::uint32_t) { pins.command(line); });
      } else {
        diagnostics_.warning(file_, {e.line, 1},
                             "the HAL file " + e.value + " cannot be read; what it sets is not known");
      }
    }
    const auto pin = [&](const char* name) {
      const auto value = pins.value(module_ + "." + name);
      if (!value) error(nullptr, "the value of " + module_ + "." + name + " is no number");
      return value.value_or(0.0) * mm_per_unit_;
    };
    const Vec3 point(pin("x-rot-point"), pin("y-rot-point"), pin("z-rot-point"));
    machine_.points_mm['C'] = point;
    const char outer = machine_.rotary[0];
    machine_.points_mm[outer] = point + (outer == 'A' ? Vec3(0.0, pin("y-offset"), pin("z-offset"))
                                                      : Vec3(pin("x-offset"), 0.0, pin("z-offset")));
  }

  std::optional<double> number_in(const std::string& section, const char* key) {
    const Entry* entry = find(section, key);
    if (entry == nullptr) return std::nullopt;
    const auto number = parse_number(entry->value);
    if (!number)
      error(entry, std::string(key) + " in [" + section + "] is '" + entry->value + "', no number");
    return number ? std::optional(number.value) : std::nullopt;
  }

  void read_axis(char letter) {
    const bool rotary = letter <= 'C';
    const auto joint = std::string("XYZ" + machine_.rotary).find(letter);
    const std::array sections = {std::string("AXIS_") + letter, "JOINT_" + std::to_string(joint)};
    const auto first = [&](const char* key) {
      const auto value = number_in(sections[0], key);
      return value ? value : number_in(sections[1], key);
    };
    const double unit = rotary ? kRadPerDegree : mm_per_unit_;
    const auto min = first("MIN_LIMIT");
    const auto max = first("MAX_LIMIT");
    if (!min || !max || !(*min < *max)) {
      error(find(sections[0], "MIN_LIMIT"), "[" + sections[0] + "] needs MIN_LIMIT below MAX_LIMIT");
      return;
    }
    machine_.travel[letter] = {*min * unit, *max * unit, false};
    if (const auto speed = first("MAX_VELOCITY"); speed && *speed > 0.0)
      machine_.rapid[letter] = *speed * unit;  // units a second
    if (const auto rate = first("MAX_ACCELERATION"); rate && *rate > 0.0)
      machine_.acceleration[letter] = *rate * unit;  // units a second, a second
    if (const auto jerk = first("MAX_JERK"); jerk && *jerk > 0.0) machine_.jerk[letter] = *jerk * unit;
  }

  std::vector<Entry> entries_;
  std::string file_;
  Diagnostics& diagnostics_;
  NewMachine machine_;
  std::string module_;
  double mm_per_unit_ = 1.0;
};

}  // namespace

Result<NewMachine> machine_of_ini(std::string_view text, const std::string& file, Diagnostics& diagnostics) {
  return IniReader(text, file, diagnostics).read();
}

}  // namespace trunnion
