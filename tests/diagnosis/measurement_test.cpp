#include "trunnion/diagnosis/measurement.hpp"

#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/measurement_template.hpp"

#include "support/machines.hpp"

namespace trunnion::diagnosis {
namespace {

const std::string kHeader =
    "run_id,time_s,X_mm,Y_mm,Z_mm,A_deg,C_deg,T_frame_degC,quantity,n_x,n_y,n_z,value,unit,u_random,u_"
    "common\n";

Result<Dataset> read(const std::vector<std::string>& bodies, Diagnostics& diagnostics) {
  std::vector<NamedText> files;
  for (const auto& body : bodies)
    files.push_back({std::string(1, static_cast<char>('a' + files.size())) + ".csv", kHeader + body});
  return parse_measurements(files, test::shipped_machine("trunnion_offset"), diagnostics);
}

TEST(Measurement, ConvertsUnitsAndFillsInDefaults) {
  Diagnostics diagnostics;
  const auto data = read({"r1,5,10,20,30,90,-45,23,rotation,0,0,1,7,urad,0.5,\n"}, diagnostics);
  ASSERT_TRUE(data) << data.error().text();
  const Reading& r = data->readings.at(0);
  EXPECT_EQ(r.quantity, Quantity::rotation);
  EXPECT_DOUBLE_EQ(r.value, 7e-6);
  EXPECT_DOUBLE_EQ(r.u_random, 0.5e-6);
  EXPECT_FALSE(r.u_common);  // empty: to be estimated
  const MachineState state = data->track.state(0);
  EXPECT_DOUBLE_EQ(state.q[3], kPi / 2);
  EXPECT_DOUBLE_EQ(state.temperature(0), 3.0);  // above 20 degC
  EXPECT_DOUBLE_EQ(data->rows[0].tool_mm.z(), -150.0);
}

TEST(Measurement, EmptyValueIsStateOnly) {
  Diagnostics diagnostics;
  const auto data =
      read({"r1,0,0,0,0,0,0,20,,,,,,,,\nr1,1,0,0,0,0,0,20,displacement,1,0,0,2,um,1,0\n"}, diagnostics);
  ASSERT_TRUE(data) << data.error().text();
  EXPECT_EQ(data->rows.size(), 2u);
  EXPECT_EQ(data->readings.size(), 1u);
  EXPECT_EQ(data->readings[0].row, 1u);
}

TEST(Measurement, GroupsReadingsOfTheSameDirection) {
  Diagnostics diagnostics;
  const auto data =
      read({"r1,0,0,0,0,0,0,20,displacement,1,0,0,2,um,1,0\nr1,1,5,0,0,0,0,20,displacement,0.9999999,0,0,2,"
            "um,1,0\n"
            "r1,2,5,0,0,0,0,20,displacement,0,1,0,2,um,1,0\nr2,0,5,0,0,0,0,20,displacement,1,0,0,2,um,1,0\n"},
           diagnostics);
  ASSERT_TRUE(data);
  EXPECT_EQ(data->group_count, 3u);
  EXPECT_EQ(data->readings[0].group, data->readings[1].group);
}

TEST(Measurement, ReportsEveryFaultWithItsPlace) {
  Diagnostics diagnostics;
  const auto data = read(
      {"r1,0,0,0,0,0,0,20,displacement,1,0,0,2,urad,1,0\nr1,1,x,0,0,0,0,20,displacement,2,0,0,2,um,0,-1\n"},
      diagnostics);
  ASSERT_FALSE(data);
  std::vector<std::string> texts;
  for (const auto& f : diagnostics.findings()) texts.push_back(f.text());
  EXPECT_EQ(texts.size(), 5u);
  EXPECT_EQ(texts[0],
            "a.csv:2:14: error: the unit of a displacement must be 'um' (or 'mm', 'nm', 'in'), not 'urad'");
  EXPECT_EQ(texts[1].substr(0, 10), "a.csv:3:3:");
}

TEST(Measurement, TakesOtherUnitsByTheUnitColumn) {
  Diagnostics diagnostics;
  const auto data = read({"r1,0,0,0,0,0,0,20,displacement,1,0,0,0.002,mm,0.001,0\n"
                          "r1,1,0,0,0,0,0,20,rotation,1,0,0,2,arcsec,0.5,0\n"
                          "r1,2,0,0,0,0,0,20,rotation,1,0,0,0.001,deg,0.001,0\n"},
                         diagnostics);
  ASSERT_TRUE(data);
  EXPECT_NEAR(data->readings[0].value, 0.002, 1e-15);
  EXPECT_NEAR(data->readings[0].u_random, 0.001, 1e-15);
  EXPECT_NEAR(data->readings[1].value, 9.69627362219072e-6, 1e-18);  // 2 / 206264.80624709636
  EXPECT_NEAR(data->readings[2].value, 1.7453292519943295e-5, 1e-18);
}

// Where a comma is the decimal mark fields are separated by semicolons.
TEST(Measurement, TakesSemicolonsAndDecimalCommas) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  for (const char* kind : {"laser", "rtest", "ballbar", "probe"}) {
    const auto empty = measurement_template(machine, kind);
    ASSERT_TRUE(empty) << empty.error().text();
    std::string filled, elsewhere;  // value 1.5 in every row
    for (std::size_t i = 0; i < empty->size(); ++i) {
      if (empty->compare(i, 9, ",,um,1,\n") == 0 || empty->compare(i, 6, ",,um,1") == 0) {
        filled += ",1.5";
        continue;
      }
      filled += (*empty)[i];
    }
    for (const char c : filled) elsewhere += c == ',' ? ';' : c == '.' ? ',' : c;
    std::vector<Dataset> all;
    for (const std::string& text : {filled, elsewhere}) {
      const std::vector<NamedText> files = {{"t.csv", text}};
      Diagnostics diagnostics;
      const auto data = parse_measurements(files, machine, diagnostics);
      ASSERT_TRUE(data) << kind << data.error().text();
      all.push_back(*data);
    }
    ASSERT_EQ(all[0].readings.size(), all[1].readings.size()) << kind;
    ASSERT_GT(all[0].readings.size(), 20u) << kind;
    for (std::size_t k = 0; k < all[0].readings.size(); ++k) {
      EXPECT_EQ(all[0].readings[k].value, 1.5e-3);
      EXPECT_EQ(all[1].readings[k].value, 1.5e-3);
      const auto &a = all[0].track.state(all[0].readings[k].row),
                 &b = all[1].track.state(all[1].readings[k].row);
      EXPECT_EQ(a.q, b.q);
    }
  }
}

TEST(Measurement, UnknownColumnIsAnError) {
  Diagnostics diagnostics;
  const std::vector<NamedText> files = {{"a.csv", "run_id,X_mm,u_comon\n"}};
  EXPECT_FALSE(parse_measurements(files, test::shipped_machine("trunnion_offset"), diagnostics));
  EXPECT_NE(diagnostics.findings()[0].message.find("u_comon"), std::string::npos);
}

TEST(Measurement, SameRunInTwoFilesGoesOnWithItsTimesOrIsAnother) {
  const std::string row = ",0,0,0,0,0,20,displacement,1,0,0,2,um,1,0\n";
  Diagnostics diagnostics;
  const auto goes_on = read({"r,0" + row + "r,9" + row, "r,10" + row}, diagnostics);
  ASSERT_TRUE(goes_on);
  EXPECT_EQ(goes_on->context.runs.size(), 1u);
  const auto again = read({"r,0" + row + "r,9" + row, "r,0" + row}, diagnostics);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->context.runs.size(), 2u);
}

TEST(Measurement, TextReadsBackToTheSameReadings) {
  Diagnostics diagnostics;
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto data =
      read({"r1,0,1.5,-2,3,30,45,21.25,displacement,0.6,0.8,0,2.125,um,1,\nr1,1,0,0,0,0,0,20,,,,,,,,\n"},
           diagnostics);
  ASSERT_TRUE(data);
  const std::vector<NamedText> files = {{"b.csv", measurements_text(*data, machine, {" a comment"})}};
  const auto back = parse_measurements(files, machine, diagnostics);
  ASSERT_TRUE(back) << back.error().text();
  ASSERT_EQ(back->readings.size(), 1u);
  EXPECT_EQ(back->rows.size(), 2u);
  EXPECT_NEAR(back->readings[0].value, data->readings[0].value, 1e-12);
  EXPECT_NEAR((back->readings[0].n - data->readings[0].n).norm(), 0.0, 1e-9);
  EXPECT_NEAR(back->track.state(0).q[3], data->track.state(0).q[3], 1e-9);
  EXPECT_NEAR(back->track.state(0).temperature(0), 1.25, 1e-9);
}

}  // namespace
}  // namespace trunnion::diagnosis
