// Where the tool is out of the way: [retract], [table] and [part] of the machine file.
#include "trunnion/machine/safe_height.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trunnion/machine/machine.hpp"

namespace trunnion {
namespace {

using ::testing::HasSubstr;

// An A-C trunnion, its axes 100 mm below the program zero.
std::string file_with(const std::string& more, const std::string& z_direction = "1",
                      const std::string& tool = "\"X\", \"Y\", \"Z\"",
                      const std::string& part = "\"A\", \"C\"") {
  std::string out = "[machine]\nname = \"m\"\n[tool]\nlength_mm = 150\n[part]\nzero_mm = [0, 0, 0]\n";
  for (const char* name : {"X", "Y", "Z"}) {
    const bool is_z = *name == 'Z';
    out += std::string("[[axis]]\nname = \"") + name + "\"\ntype = \"linear\"\ndirection = [" +
           (*name == 'X' ? "1" : "0") + ", " + (*name == 'Y' ? "1" : "0") + ", " +
           (is_z ? z_direction : "0") + "]\nmin_mm = " + (is_z ? "-400" : "-300") +
           "\nmax_mm = " + (is_z ? "700" : "300") + "\n";
  }
  out +=
      "[[axis]]\nname = \"A\"\ntype = \"rotary\"\ndirection = [1, 0, 0]\npoint_mm = [0, 0, -100]\nmin_deg = "
      "-30\n"
      "max_deg = 90\n[[axis]]\nname = \"C\"\ntype = \"rotary\"\ndirection = [0, 0, -1]\npoint_mm = [0, 0, "
      "-100]\n"
      "cyclic = true\n[chain]\ntool = [" +
      tool + "]\npart = [" + part + "]\n";
  return out + more;
}

Machine machine_with(const std::string& file) {
  Diagnostics diagnostics;
  const auto machine = parse_machine(file, "m.toml", diagnostics);
  if (!machine) throw std::runtime_error(diagnostics.findings().front().text());
  return *machine;
}

std::string error_with(const std::string& file) {
  Diagnostics diagnostics;
  EXPECT_FALSE(parse_machine(file, "m.toml", diagnostics));
  return diagnostics.findings().empty() ? "" : diagnostics.findings().front().text();
}

TEST(SafeHeight, IsTheEndOfZThatLeavesThePart) {
  EXPECT_EQ(machine_with(file_with("")).safe.z_mm(), 700.0);
  EXPECT_EQ(machine_with(file_with("", "-1")).safe.z_mm(), -400.0);
  // Z under the table: what lowers the part.
  EXPECT_EQ(machine_with(file_with("", "1", "\"X\", \"Y\"", "\"Z\", \"A\", \"C\"")).safe.z_mm(), -400.0);
  EXPECT_EQ(machine_with(file_with("", "-1", "\"X\", \"Y\"", "\"Z\", \"A\", \"C\"")).safe.z_mm(), 700.0);
  const Machine given = machine_with(file_with("[retract]\nz_mm = 610\nx_mm = -300\n"));
  EXPECT_EQ(given.safe.z_mm(), 610.0);
  EXPECT_EQ(given.safe.to_mm[0], -300.0);
  EXPECT_FALSE(given.safe.to_mm[1]);
  EXPECT_TRUE(given.safe.is_safe(610.0, 0.0));
  EXPECT_TRUE(given.safe.is_safe(650.0, 0.0));
  EXPECT_FALSE(given.safe.is_safe(609.0, 0.5));
  EXPECT_TRUE(machine_with(file_with("", "-1")).safe.is_safe(-400.0, 0.0));
  EXPECT_FALSE(machine_with(file_with("", "-1")).safe.is_safe(0.0, 0.0));
}

TEST(SafeHeight, MustBeWithinTheTravel) {
  EXPECT_THAT(error_with(file_with("[retract]\nz_mm = 701\n")),
              HasSubstr("error: 'z_mm' is 701.000 mm, beyond the travel of Z, -400.000 mm to 700.000 mm"));
  EXPECT_THAT(error_with(file_with("[retract]\nz_mm = 701\n")), ::testing::StartsWith("m.toml:"));
  EXPECT_THAT(error_with(file_with("[table]\nradius_mm = -1\ntop_mm = 0\n")), HasSubstr("must be above 0"));
  EXPECT_THAT(error_with(file_with("[retract]\nz = 1\n")), HasSubstr("z"));
}

// The disc of radius 200 mm, 40 mm above the axis: at A 90 deg its rim stands 200 mm above it, and between,
// at the angle whose tangent is 200/40, the root of 200^2 + 40^2.
TEST(SafeHeight, ClearsWhatTheTableSweeps) {
  const std::string table = "[table]\nradius_mm = 200\ntop_mm = 40\n";
  const double top_mm = std::hypot(200.0, 40.0) - 100.0;
  const auto fault = [&](double z_mm, double tool_mm) {
    return safe_height_fault(
        machine_with(file_with(table + "[retract]\nz_mm = " + std::to_string(z_mm) + "\n")), tool_mm);
  };
  EXPECT_FALSE(fault(top_mm + 150.1, 150.0));
  ASSERT_TRUE(fault(top_mm + 149.0, 150.0));
  EXPECT_THAT(*fault(top_mm + 149.0, 150.0), HasSubstr("1.000 mm below what the table sweeps"));
  EXPECT_TRUE(fault(top_mm + 150.1, 160.0));
  // A control that takes the length out at once goes down by it.
  const auto drop = [&](double z_mm) {
    return length_drop_fault(
        machine_with(file_with(table + "[retract]\nz_mm = " + std::to_string(z_mm) + "\n")), 150.0);
  };
  EXPECT_FALSE(drop(top_mm + 300.1));
  EXPECT_THAT(drop(top_mm + 299.0).value_or(""), HasSubstr("1.000 mm below what the table sweeps"));
  EXPECT_FALSE(safe_height_fault(machine_with(file_with("[retract]\nz_mm = -400\n")), 150.0));
  const Machine with_part = machine_with([&] {
    std::string file = file_with(table);
    file.replace(file.find("zero_mm"), 0, "radius_mm = 50\nheight_mm = 300\n");
    return file;
  }());
  EXPECT_FALSE(safe_height_fault(with_part, 150.0));
  EXPECT_THAT(safe_height_fault(with_part, 500.0).value_or(""), HasSubstr("below what the part sweeps"));
}

TEST(SafeHeight, KnowsWhatIsInsideTheTable) {
  const Machine m = machine_with(file_with("[table]\nradius_mm = 200\ntop_mm = 40\n"));
  EXPECT_FALSE(inside_table_mm(m, {0, 0, -59}));
  EXPECT_NEAR(inside_table_mm(m, {0, 100, -61}).value_or(0.0), 1.0, 1e-9);
  EXPECT_FALSE(inside_table_mm(m, {0, 201, -61}));
}

}  // namespace
}  // namespace trunnion
