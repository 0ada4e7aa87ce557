#include "nc/control/section_reading.hpp"

namespace trunnion::nc {

void read_clamps(Section& root, Controller& c) {
  in_section(root, "clamp", [&](Section& s) {
    c.clamps.clear();
    std::uint16_t all = 0;
    for (const auto& key : s.keys("^[ABC]{1,3}$")) {
      auto words = s.find_section(key);
      if (!words) continue;
      Controller::Clamp clamp;
      for (const char letter : key) {
        const auto axis = axis_letter(std::string(1, letter));
        if (!axis || !is_rotary(*axis) || ((all | clamp.axes) & AxisWords::bit(*axis)) != 0) {
          s.error(key, "'" + key + "' must be letters of rotary axes, A, B or C, each in one table only");
          return;
        }
        clamp.axes = static_cast<std::uint16_t>(clamp.axes | AxisWords::bit(*axis));
      }
      all = static_cast<std::uint16_t>(all | clamp.axes);
      read_template(*words, "on", {}, clamp.on);
      read_template(*words, "off", {}, clamp.off);
      if (clamp.on.empty() || clamp.off.empty()) words->error("on", "'on' and 'off' go together");
      words->finish();
      c.clamps.push_back(std::move(clamp));
    }
  });
}

}  // namespace trunnion::nc
