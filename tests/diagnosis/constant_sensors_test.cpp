#include "diagnosis/verdict/constant_sensors.hpp"

#include "diagnosis/campaigns.hpp"

// Thermometers that say the same in every row of a long run.
namespace trunnion::diagnosis {
namespace {

std::string told_of(const std::string& minutes, const std::string& room) {
  const Machine machine = test::thermal_machine("trunnion_offset");
  const Dataset data = test::measured(machine,
                                      "[[run]]\nid = \"warm\"\nminutes = " + minutes +
                                          "\nquantity = \"displacement\"\nu_random = 0.8\nu_common = 0.3\nn "
                                          "= [[1, 0, 0]]\nT_ambient_degC = " +
                                          room + "\nT_screw_x_degC = [[0, 20], [" + minutes +
                                          ", 20]]\nrepeat = 12\nposes = [[0, 0, 100, 0, 0]]\n",
                                      "[model]\nname = \"none\"\n", 1);
  return constant_sensors_text(Observations(machine, data));
}

TEST(ConstantSensors, AreAskedForInLongRunsOnly) {
  const std::string all = told_of("60", "[[0, 20], [60, 20]]");
  EXPECT_NE(all.find("T_ambient_degC"), std::string::npos) << all;
  EXPECT_NE(all.find("T_screw_x_degC"), std::string::npos) << all;
  const std::string one = told_of("60", "[[0, 20], [60, 23]]");
  EXPECT_EQ(one.find("T_ambient_degC"), std::string::npos) << one;
  EXPECT_NE(one.find("T_screw_x_degC"), std::string::npos) << one;
  EXPECT_EQ(told_of("20", "[[0, 20], [20, 20]]"), "");
}

}  // namespace
}  // namespace trunnion::diagnosis
