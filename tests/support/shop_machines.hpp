#pragma once
#include <stdexcept>
#include <string>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/machine.hpp"

namespace trunnion::test {

/// Kinds of machines as shops have them: an A-C trunnion with an offset, machine zero elsewhere, other words,
/// other axes under the table.
struct ShopMachine {
  const char* kind;
  double zero_mm;     // of the trunnion in machine Z
  const char* point;  // of the words
  bool table_moves;   // X and Y under the table
  int z_sense;        // of Z's direction
  bool z_under_the_table;
};

inline constexpr std::array kShopMachines = {
    ShopMachine{"zero at the top", -700.0, "tip", false, 1, false},
    ShopMachine{"zero at the bottom", 400.0, "tip", false, 1, false},
    ShopMachine{"zero in the middle", 0.0, "tip", false, 1, false},
    ShopMachine{"words of the spindle", -100.0, "spindle", false, 1, false},
    ShopMachine{"X and Y under the table", 100.0, "tip", true, 1, false},
    ShopMachine{"Z counts downwards", 0.0, "tip", false, -1, false},
    ShopMachine{"all under the table", 0.0, "tip", true, -1, true},
};

inline Machine shop_machine(const ShopMachine& kind, const std::string& more = {}) {
  const auto number = [](double v) { return shortest_text(v); };
  // Z of machine positions: travel from 400 mm below the trunnion's zero to 700 mm above it.
  const bool rises = (kind.z_sense > 0) != kind.z_under_the_table;
  const double low = rises ? kind.zero_mm - 400.0 : -(kind.zero_mm + 700.0);
  const double height = kind.zero_mm;
  const std::string side = kind.table_moves ? "-1" : "1";
  std::string out = "[machine]\nname = \"" + std::string(kind.kind) +
                    "\"\n[tool]\nlength_mm = 150\n[part]\n" + "zero_mm = [0, 0, " + number(height) + "]\n";
  const auto linear = [&](const char* name, const std::string& direction, double min, double max) {
    out += std::string("[[axis]]\nname = \"") + name + "\"\ntype = \"linear\"\ndirection = " + direction +
           "\nmin_mm = " + number(min) + "\nmax_mm = " + number(max) + "\nrapid_mm_min = 36000\n";
  };
  linear("X", "[" + side + ", 0, 0]", -500.0, 500.0);
  linear("Y", "[0, " + side + ", 0]", -500.0, 500.0);
  linear("Z", std::string("[0, 0, ") + (kind.z_sense > 0 ? "1" : "-1") + "]", low, low + 1100.0);
  out += "[[axis]]\nname = \"A\"\ntype = \"rotary\"\ndirection = [-1, 0, 0]\npoint_mm = [0, 0.4, " +
         number(height - 65.0) + "]\nmin_deg = -30\nmax_deg = 120\nrapid_deg_min = 7200\n" +
         "[[axis]]\nname = \"C\"\ntype = \"rotary\"\ndirection = [0, 0, -1]\npoint_mm = [0.1, 0, " +
         number(height - 30.0) + "]\ncyclic = true\nrapid_deg_min = 14400\n[chain]\n";
  const std::string xy = kind.table_moves ? "" : "\"X\", \"Y\"";
  const std::string under = kind.table_moves ? "\"Y\", \"X\", " : "";
  out += "tool = [" + xy + (kind.z_under_the_table ? "" : std::string(xy.empty() ? "" : ", ") + "\"Z\"") +
         "]\npart = [" + (kind.z_under_the_table ? "\"Z\", " : "") + under +
         "\"A\", \"C\"]\n[output]\npoint = \"" + kind.point + "\"\n" + more;
  Diagnostics diagnostics;
  auto machine = parse_machine(out, "shop.toml", diagnostics);
  if (!machine) throw std::runtime_error(diagnostics.findings().front().text());
  return *machine;
}

}  // namespace trunnion::test
