// Thermal offsets as shifts of the work offset: what the control makes of them, and where they are wrong.
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sstream>

#include "trunnion/base/number_text.hpp"
#include "trunnion/post/axes_of.hpp"
#include "trunnion/post/post.hpp"

#include "post/posting.hpp"
#include "support/cl_text.hpp"
#include "support/controllers.hpp"
#include "support/machines.hpp"

namespace trunnion::post {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using Text = test::TextOf;

// Blades like spokes: each is cut by an operation of its own, with its own C; the tilt turns while it cuts
// when `turning`.
std::string blades(int count, bool turning) {
  std::string out = "PARTNO TEST\nMULTAX/ON\nLOADTL/3\nSPINDL/RPM,8000,CLW\nFEDRAT/MMPM,600\n";
  for (int b = 0; b < count; ++b) {
    out += "TOOL PATH/Blade (" + std::to_string(b + 1) + "),TOOL,T3\n";
    const double turn = b * 2.0 * kPi / count;
    const auto point = [&](double along, double up, double tilt) {
      out += "GOTO/" + fixed_text(along * std::cos(turn), 5) + "," + fixed_text(along * std::sin(turn), 5) +
             "," + fixed_text(up, 5) + "," + fixed_text(std::sin(tilt) * std::cos(turn), 8) + "," +
             fixed_text(std::sin(tilt) * std::sin(turn), 8) + "," + fixed_text(std::cos(tilt), 8) + "\n";
    };
    out += "RAPID\n";
    point(30.0, 60.0, 0.5);
    for (int i = 0; i <= 20; ++i) point(30.0 + i, 10.0, 0.5 + (turning ? 0.03 * i : 0.0));
    out += "RAPID\n";
    point(50.0, 60.0, 0.5 + (turning ? 0.6 : 0.0));
    out += "END-OF-PATH\n";
  }
  return out + "FINI\n";
}

thermal::OffsetTable offsets(const std::string& csv) {
  Diagnostics d;
  auto table = thermal::parse_offsets(csv, "o.csv", d);
  if (!table) throw std::runtime_error(table.error().text());
  return *table;
}

std::string by_blade(const std::string& frame = "machine") {
  std::string out = "operation,dx_um,dy_um,dz_um,frame\n";
  for (int b = 1; b <= 4; ++b) {
    out += "Blade (" + std::to_string(b) + ")," + std::to_string(10 + b) + "," + std::to_string(-5 * b) +
           "," + std::to_string(2 * b) + "," + frame + "\n";
  }
  return out;
}

struct OffsetPost {
  Result<PostReport> report;
  std::string nc;
  Diagnostics diagnostics;
};

struct Setting {
  const RunTimeDrift* drift = nullptr;
  std::string control = "linuxcnc";
  bool rtcp = false;
  OffsetOutput output = OffsetOutput::work_offset;
  double tolerance_mm = 0.003;
  thermal::OffsetLimits limits = {};
  const Model* model = nullptr;
};

OffsetPost offset_post(const std::string& cl, Machine machine, const thermal::OffsetTable* table,
                       const Setting& setting = {}) {
  const nc::Controller c = with_axes_of(machine, test::shipped_controller(setting.control));
  PostJob job;
  job.cl_file = "part.cls";
  job.machine = &machine;
  job.controller = &c;
  job.offsets = table;
  job.offset_output = setting.output;
  job.offset_limits = setting.limits;
  job.run_time_drift = setting.drift;
  job.model = setting.model;
  PostOptions options;
  options.tolerance_mm = setting.tolerance_mm;
  options.rtcp = setting.rtcp;
  if (setting.rtcp) options.feed = FeedOutput::tip;
  if (!c.has_inverse_time()) options.feed = FeedOutput::per_minute;
  OffsetPost out;
  out.report = post(
      std::make_unique<Text>(cl), job, options,
      [&](std::string_view text) {
        out.nc += text;
        return Result<void>{};
      },
      out.diagnostics);
  return out;
}

Machine machine_with_offset() {
  Machine machine = test::shipped_machine("trunnion_offset");
  machine.work_offset_mm = Vec3(5.0, -3.0, 20.0);
  return machine;
}

// A step at a blade's start is not cut: the limit is that of the time since the last one.
thermal::OffsetLimits quick() {
  thermal::OffsetLimits limits;
  limits.slew_mm_s = 1.0;
  return limits;
}

std::vector<nc::AxisWords> motions(const nc::Controller& c, const std::string& text) {
  std::vector<nc::AxisWords> out;
  for (const auto& block : test::nc_blocks(c, text)) {
    if (const auto* m = std::get_if<nc::Motion>(&block)) out.push_back(m->words);
  }
  return out;
}

std::string warnings(const Diagnostics& d) {
  std::string out;
  for (const auto& f : d.findings()) out += f.text() + "\n";
  return out;
}

// The program's own coordinates are those of the cold machine, and the shifts are minus the table's rows.
TEST(OffsetOutput, OneShiftForEachBladeLeavesTheProgramAsItIs) {
  const Machine machine = machine_with_offset();
  const auto table = offsets(by_blade());
  Setting setting;
  setting.limits = quick();
  const OffsetPost cold = offset_post(blades(4, true), machine, nullptr);
  const OffsetPost p = offset_post(blades(4, true), machine, &table, setting);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_TRUE(p.report->verification->passed()) << p.report->verification->certified_tip_deviation_mm;
  EXPECT_EQ(p.report->offset_shifts, 4U);
  EXPECT_LT(p.report->shift_error_mm, 1e-4);
  const auto c = test::shipped_controller("linuxcnc");
  EXPECT_EQ(motions(c, p.nc), motions(c, cold.nc));
  // 5 mm less 11 um, -3 mm plus 5 um, 20 mm less 2 um; and the offset itself in the end.
  EXPECT_THAT(p.nc, HasSubstr("G10 L2 P1 X4.9890 Y-2.9950 Z19.9980\n"));
  EXPECT_THAT(p.nc, HasSubstr("G10 L2 P1 X4.9860 Y-2.9800 Z19.9920\n"));
  EXPECT_THAT(p.nc, HasSubstr("G10 L2 P1 X5.0000 Y-3.0000 Z20.0000\nM5\nG94\nM2"));
  // On a machine without the drift it is off by it.
  EXPECT_GT(p.report->nominal_verification->certified_tip_deviation_mm, 0.02);
}

// A wrong shift is a wrong program: the verification reads it.
TEST(OffsetOutput, AWrongShiftIsFound) {
  const Machine machine = machine_with_offset();
  const auto table = offsets(by_blade());
  Setting setting;
  setting.limits = quick();
  OffsetPost p = offset_post(blades(4, true), machine, &table, setting);
  const auto c = test::shipped_controller("linuxcnc");
  VerifyOptions options;
  options.tolerance_mm = 0.003;
  options.offsets = &table;
  const auto verified = [&](const std::string& nc) {
    Diagnostics d;
    return verify({std::make_unique<Text>(blades(4, true)), "part.cls"}, {std::make_unique<Text>(nc), "p.nc"},
                  {machine, c, options}, d);
  };
  EXPECT_TRUE(verified(p.nc)->passed());
  const auto at = p.nc.find("Y-2.9800");
  ASSERT_NE(at, std::string::npos);
  p.nc.replace(at, 8, "Y-3.0200");  // the sign of the shift
  EXPECT_NEAR(verified(p.nc)->certified_tip_deviation_mm, 0.04, 0.003);
}

// What the last block gives back the next program counts from.
TEST(OffsetOutput, AnOffsetThatIsNotGivenBackIsFound) {
  const Machine machine = machine_with_offset();
  const auto table = offsets(by_blade());
  for (const char* control : {"linuxcnc", "fanuc_30i", "haas_ngc"}) {
    Setting setting;
    setting.limits = quick();
    setting.control = control;
    const OffsetPost p = offset_post(blades(4, false), machine, &table, setting);
    const auto c = test::shipped_controller(control);
    VerifyOptions options;
    options.tolerance_mm = 0.003;
    options.offsets = &table;
    const auto passes = [&](const std::string& nc) {
      Diagnostics d;
      const auto report = verify({std::make_unique<Text>(blades(4, false)), "part.cls"},
                                 {std::make_unique<Text>(nc), "p.nc"}, {machine, c, options}, d);
      return report && report->passed();
    };
    EXPECT_TRUE(passes(p.nc)) << control;
    const auto at = p.nc.rfind("G10 L2 P1");
    ASSERT_NE(at, std::string::npos) << control;
    std::string other = p.nc, changed = p.nc, gone = p.nc;
    other.replace(at, 9, "G10 L2 P2");
    EXPECT_FALSE(passes(other)) << control;
    const auto z = changed.find('Z', at);
    changed.insert(z + 1, "1");
    EXPECT_FALSE(passes(changed)) << control << changed.substr(at, 60);
    gone.erase(at, gone.find('\n', at) - at);
    EXPECT_FALSE(passes(gone)) << control;
  }
}

TEST(OffsetOutput, EveryControlWithWordsForItIsReadBack) {
  const auto table = offsets(by_blade());
  for (const std::string& name : test::shipped_controllers()) {
    const auto c = test::shipped_controller(name);
    for (const auto output : {OffsetOutput::work_offset, OffsetOutput::local_shift}) {
      const Machine machine = machine_with_offset();
      Setting setting;
      setting.output = output;
      setting.control = name;
      setting.tolerance_mm = 0.005;
      setting.limits = quick();
      const OffsetPost p = offset_post(blades(4, true), machine, &table, setting);
      if (c.offset_shift.set.empty() && c.offset_shift.add.empty()) {
        EXPECT_THAT(p.report.error().message, HasSubstr("no words for this shift")) << name;
        continue;
      }
      ASSERT_TRUE(p.report) << name << " " << p.report.error().text();
      EXPECT_TRUE(p.report->verification->passed())
          << name << " " << p.report->verification->certified_tip_deviation_mm;
      EXPECT_EQ(p.report->offset_shifts, 4U) << name;
      EXPECT_THAT(p.nc, testing::ContainsRegex("[Aa][Ff][Tt][Ee][Rr] [Aa][Nn] [Aa]")) << name;
      const bool added = output == OffsetOutput::local_shift || c.offset_shift.set.empty();
      EXPECT_EQ(testing::Value(p.nc, testing::ContainsRegex(" [Ww][Ii][Tt][Hh] [Zz][Ee][Rr][Oo][Ss]")), added)
          << name << p.nc;
      if (output == OffsetOutput::local_shift) {
        EXPECT_THAT(p.nc, Not(HasSubstr("G10"))) << name;
      }
    }
  }
}

// A preset takes back the shift that the program has added, and so does the cycle that it shares: the offsets
// were lost, and the program passed.
TEST(OffsetOutput, APresetBehindAnAddedShiftIsFound) {
  const auto table = offsets(by_blade());
  const Machine machine = machine_with_offset();
  Setting setting;
  setting.output = OffsetOutput::local_shift;
  setting.control = "heidenhain_tnc640";
  setting.tolerance_mm = 0.005;
  setting.limits = quick();
  const OffsetPost p = offset_post(blades(4, false), machine, &table, setting);
  ASSERT_TRUE(p.report) << p.report.error().text();
  const nc::Controller c = with_axes_of(machine, test::shipped_controller(setting.control));
  VerifyOptions options;
  options.tolerance_mm = setting.tolerance_mm;
  options.offsets = &table;
  const auto read = [&](const std::string& nc) {
    Diagnostics d;
    return verify({std::make_unique<Text>(blades(4, false)), "part.cls"},
                  {std::make_unique<Text>(nc), "p.nc"}, {machine, c, options}, d);
  };
  const std::string shift = "TRANS DATUM AXIS";
  const auto begin = p.nc.find(shift + " X-");
  ASSERT_NE(begin, std::string::npos) << p.nc;
  for (const std::string words : {"CYCL DEF 247 DATUM SETTING ~\nQ339=+1\n",
                                  "CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+0\nCYCL DEF 7.2 Y+0\nCYCL DEF "
                                  "7.3 Z+0\nPLANE RESET STAY\n"}) {
    std::string edited = p.nc;
    edited.insert(edited.find('\n', begin) + 1, words);
    const auto report = read(edited);
    ASSERT_FALSE(report) << words;
    EXPECT_THAT(report.error().message, HasSubstr("shift")) << words;
  }
}

// What was probed at the machine is not overwritten.
TEST(OffsetOutput, AProbedWorkOffsetIsNotSet) {
  Machine machine = machine_with_offset();
  machine.probed_at = JointVector{};
  const auto table = offsets(by_blade());
  Setting setting;
  setting.limits = quick();
  EXPECT_THAT(offset_post(blades(4, true), machine, &table, setting).report.error().message,
              HasSubstr("must not be set anew"));
  setting.output = OffsetOutput::local_shift;
  const OffsetPost p = offset_post(blades(4, true), machine, &table, setting);
  EXPECT_TRUE(p.report->verification->passed());
  EXPECT_THAT(p.nc, HasSubstr("G52 X-0.0110 Y0.0050 Z-0.0020\n"));
  EXPECT_THAT(p.nc, HasSubstr("G52 X0.0000 Y0.0000 Z0.0000\nM5\nG94\nM2"));
}

// The frame trap: under tool-centre-point control the offset turns with the table. A drift in the machine is
// taken out by one shift where the table stands still, and is not where it turns; a drift that rides with the
// part is the other way round.
TEST(OffsetOutput, TheFrameTrapIsSeen) {
  const Machine machine = machine_with_offset();
  const auto in_machine = offsets(by_blade());
  const auto in_part = offsets(by_blade("part"));
  for (const char* control : {"linuxcnc", "fanuc_30i", "siemens_840d_sl", "heidenhain_tnc640", "haas_ngc"}) {
    SCOPED_TRACE(control);
    Setting tcp;
    tcp.control = control;
    tcp.rtcp = true;
    tcp.limits = quick();
    Setting joints = tcp;
    joints.rtcp = false;
    if (!test::shipped_controller(control).has_tcp()) continue;
    const auto passed = [&](bool turning, const thermal::OffsetTable& table, const Setting& setting) {
      const OffsetPost p = offset_post(blades(4, turning), machine, &table, setting);
      EXPECT_TRUE(p.report) << p.report.error().text();
      if (!p.report) return false;
      const bool warned = warnings(p.diagnostics).find("turn with") != std::string::npos ||
                          warnings(p.diagnostics).find("turns with") != std::string::npos;
      EXPECT_EQ(warned, p.report->shift_error_mm > 0.5e-3);
      const VerifyReport& v = *p.report->verification;
      SCOPED_TRACE(v.certified_tip_deviation_mm);
      return v.passed();
    };
    EXPECT_TRUE(passed(false, in_machine, tcp));
    EXPECT_FALSE(passed(true, in_machine, tcp));
    EXPECT_TRUE(passed(true, in_part, tcp));
    EXPECT_TRUE(passed(true, in_machine, joints));
    EXPECT_TRUE(passed(false, in_part, joints));
    EXPECT_FALSE(passed(true, in_part, joints));
  }
}

// Blades of minutes while the machine drifts: one shift each, and what drifts during a blade stays.
TEST(OffsetOutput, ATableOverTimeIsTakenAtEachBlade) {
  const Machine machine = machine_with_offset();
  const auto table = offsets("time_s,dx_um,dy_um,dz_um\n0,5,0,0\n40,45,0,0\n");
  Setting setting;
  setting.tolerance_mm = 0.02;
  const OffsetPost p = offset_post(blades(4, true), machine, &table, setting);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_GE(p.report->offset_shifts, 4U);
  EXPECT_TRUE(p.report->verification->passed());
  EXPECT_GT(p.report->verification->certified_tip_deviation_mm, 0.001);
}

TEST(OffsetOutput, ClampSlewAndDeadBandHoldForShifts) {
  const Machine machine = machine_with_offset();
  Setting setting;
  setting.limits = quick();
  setting.limits.clamp_mm = 0.012;
  const auto table = offsets(by_blade());
  const OffsetPost clamped = offset_post(blades(4, true), machine, &table, setting);
  ASSERT_TRUE(clamped.report);
  EXPECT_THAT(warnings(clamped.diagnostics), HasSubstr("beyond the clamp of 12.0 um"));
  EXPECT_THAT(clamped.nc, HasSubstr("G10 L2 P1 X4.9880 Y-2.9880"));
  EXPECT_FALSE(clamped.report->verification->passed());  // the machine drifts all the same, and it is told

  setting.limits = {};
  setting.limits.slew_mm_s = 1e-5;
  const OffsetPost slow = offset_post(blades(4, true), machine, &table, setting);
  EXPECT_THAT(warnings(slow.diagnostics), HasSubstr("are followed late"));
  EXPECT_FALSE(slow.report->verification->passed());

  setting.limits = quick();
  setting.limits.dead_band_mm = 0.1;
  const OffsetPost still = offset_post(blades(4, true), machine, &table, setting);
  EXPECT_EQ(still.report->offset_shifts, 1U);

  setting.limits.enabled = false;
  const OffsetPost off = offset_post(blades(4, true), machine, &table, setting);
  EXPECT_THAT(off.nc, HasSubstr("G10 L2 P1 X5.0000 Y-3.0000 Z20.0000"));
}

// Terms of values that the control holds at run time: right at every pose in every frame, since their
// coefficients are those of the pose; and the same program is right on the cold machine, where they hold
// zero.
TEST(OffsetOutput, VariablesAreRightAtEveryPose) {
  const Machine machine = machine_with_offset();
  for (const char* control : {"linuxcnc", "fanuc_30i", "siemens_840d_sl"}) {
    for (const bool rtcp : {false, true}) {
      for (const char* frame : {"machine", "part"}) {
        SCOPED_TRACE(std::string(control) + (rtcp ? " tcp " : " ") + frame);
        Setting setting;
        setting.control = control;
        setting.rtcp = rtcp;
        setting.output = OffsetOutput::variables;
        setting.limits = quick();
        const auto table = offsets(by_blade(frame));
        const OffsetPost p = offset_post(blades(4, true), machine, &table, setting);
        // Nine terms are more than a line of some controls takes: refused, not cut.
        if (!p.report) {
          EXPECT_STREQ(control, "fanuc_30i");
          EXPECT_THAT(p.report.error().message, HasSubstr("is longer than the 128 that the control takes"));
          continue;
        }
        EXPECT_TRUE(p.report->verification->passed()) << p.report->verification->certified_tip_deviation_mm;
        EXPECT_TRUE(p.report->nominal_verification->passed());
        EXPECT_EQ(p.report->offset_shifts, 4U);
      }
    }
  }
  Setting setting;
  setting.control = "heidenhain_tnc640";
  setting.output = OffsetOutput::variables;
  const auto table = offsets(by_blade());
  EXPECT_THAT(offset_post(blades(2, false), machine, &table, setting).report.error().message,
              HasSubstr("no words for values at run time"));
}

TEST(OffsetOutput, VariablesAreClampedAndSlewedByTheProgram) {
  const Machine machine = machine_with_offset();
  Setting setting;
  setting.output = OffsetOutput::variables;
  const auto table = offsets(by_blade());
  setting.limits = quick();
  setting.limits.clamp_mm = 0.012;
  EXPECT_FALSE(offset_post(blades(4, true), machine, &table, setting).report->verification->passed());
  setting.limits = {};
  setting.limits.slew_mm_s = 1e-5;
  EXPECT_FALSE(offset_post(blades(4, true), machine, &table, setting).report->verification->passed());
}

// As a verification reads it.
bool reads_whole(const nc::Controller& c, const std::string& nc) {
  Diagnostics d;
  nc::ReaderOptions options;
  options.whole_program = true;
  return nc::read_program(c, nc, "p.nc", d, options).has_value();
}

// The control keeps its variables when it is switched off.
TEST(OffsetOutput, VariablesBeginAtNothing) {
  const Machine machine = machine_with_offset();
  const auto table = offsets(by_blade());
  for (const char* control : {"linuxcnc", "fanuc_30i", "siemens_840d_sl"}) {
    Setting setting;
    setting.output = OffsetOutput::variables;
    setting.control = control;
    setting.limits = quick();
    const OffsetPost p = offset_post(blades(4, false), machine, &table, setting);
    ASSERT_TRUE(p.report) << control << p.report.error().text();
    const nc::Controller c = with_axes_of(machine, test::shipped_controller(control));
    const auto reads = [&](const std::string& nc) { return reads_whole(c, nc); };
    EXPECT_TRUE(reads(p.nc)) << control << p.nc;
    for (const std::string& line : c.run_time.begin) {
      const auto at = p.nc.find(line + "\n");
      ASSERT_NE(at, std::string::npos) << control << ": " << line;
      std::string without = p.nc, twice = p.nc;
      without.erase(at, line.size());
      EXPECT_FALSE(reads(without)) << control << ": " << line;
      twice.insert(p.nc.rfind("\n", p.nc.rfind('X')) + 1, line + "\n");
      EXPECT_FALSE(reads(twice)) << control << ": " << line;
    }
  }
}

// Lines of the calculation that stand in another order, or say another limit, calculate something else.
TEST(OffsetOutput, LinesOfTheCalculationStandInTheirOrder) {
  const Machine machine = machine_with_offset();
  const auto table = offsets(by_blade());
  for (const char* control : {"linuxcnc", "fanuc_30i", "siemens_840d_sl"}) {
    Setting setting;
    setting.output = OffsetOutput::variables;
    setting.control = control;
    setting.limits = quick();
    const OffsetPost p = offset_post(blades(2, false), machine, &table, setting);
    ASSERT_TRUE(p.report) << control << p.report.error().text();
    const nc::Controller c = with_axes_of(machine, test::shipped_controller(control));
    const auto reads = [&](const std::vector<std::string>& lines) {
      std::string nc;
      for (const std::string& line : lines) nc += line + "\n";
      return reads_whole(c, nc);
    };
    std::vector<std::string> lines;
    std::istringstream in(p.nc);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    ASSERT_TRUE(reads(lines)) << control;
    // The calculation of the first operation: behind the last line that sets a value to 0.
    std::size_t first = 0;
    while (lines[first].find(c.run_time.begin.back()) == std::string::npos) ++first;
    while (lines[first].find("501") == std::string::npos || lines[first].find('=') == std::string::npos)
      ++first;
    const std::size_t last = first + c.run_time.latch.size() - (control[0] == 's' ? 1 : 0);
    for (std::size_t i = first; i + 1 < last; ++i) {
      if (lines[i] == lines[i + 1]) continue;
      auto changed = lines;
      std::swap(changed[i], changed[i + 1]);
      EXPECT_FALSE(reads(changed)) << control << ": exchanged '" << lines[i] << "' and '" << lines[i + 1];
      changed = lines;
      changed.erase(changed.begin() + static_cast<std::ptrdiff_t>(i));
      EXPECT_FALSE(reads(changed)) << control << ": without '" << lines[i];
      const auto point = lines[i].rfind("0.");
      if (point == std::string::npos) continue;
      changed = lines;
      changed[i].replace(point, 1, "7");
      EXPECT_FALSE(reads(changed)) << control << ": " << changed[i];
    }
  }
}

// Limits that are alike in all axes, and larger than what is asked for: a value of 25 mm would go into the
// cut.
TEST(OffsetOutput, LimitsOfTheCalculationAreThoseAskedFor) {
  const Machine machine = machine_with_offset();
  const auto table = offsets(by_blade());
  for (const char* control : {"linuxcnc", "fanuc_30i", "siemens_840d_sl"}) {
    Setting setting;
    setting.output = OffsetOutput::variables;
    setting.control = control;
    setting.limits = {true, 0.1, 0.01, 0.002};
    const std::string cl = blades(3, false);
    const OffsetPost p = offset_post(cl, machine, &table, setting);
    ASSERT_TRUE(p.report) << control << p.report.error().text();
    const nc::Controller c = with_axes_of(machine, test::shipped_controller(control));
    const auto faults = [&](const thermal::OffsetLimits& limits) {
      VerifyOptions options;
      options.tolerance_mm = setting.tolerance_mm;
      options.offset_limits = limits;
      Diagnostics d;
      const auto v = verify({std::make_unique<Text>(cl), "part.cls"},
                            {std::make_unique<Text>(p.nc), "part.nc"}, {machine, c, options}, d);
      EXPECT_TRUE(v) << control;
      std::string out;
      if (!v) return out;
      for (const auto& place : v->checks[static_cast<std::size_t>(CheckOf::offsets)].places)
        out += place.what + "\n";
      return out;
    };
    EXPECT_EQ(faults(setting.limits), "") << control << p.nc;
    EXPECT_EQ(faults({true, 0.2, 0.02, 0.003}), "") << control;
    EXPECT_THAT(faults({true, 0.05, 0.01, 0.002}), HasSubstr("--thermal-clamp-um")) << control;
    EXPECT_THAT(faults({true, 0.1, 0.005, 0.002}), HasSubstr("--thermal-slew-um-s")) << control;
    EXPECT_THAT(faults({true, 0.1, 0.01, 0.0005}), HasSubstr("--thermal-dead-band-um")) << control;
  }
}

// Two sensors; `kelvin_per_hour` of each since the part's zero was taken, over ten hours.
RunTimeDrift warming(double first, double second) {
  RunTimeDrift out;
  out.sensors = {"spindle", "column"};
  out.mm_per_K.resize(3, 2);
  out.mm_per_K << 0.0031, -0.0012, -0.0008, 0.0025, 0.0040, 0.0006;
  for (int minute = -60; minute <= 600; ++minute) {
    const double hours = (minute + 60) / 60.0;
    out.history.time_s.push_back(60.0 * minute);
    out.history.temperature_K.push_back({first * hours, second * hours});
  }
  return out;
}

thermal::OffsetTable drift_of(const RunTimeDrift& d) {
  thermal::OffsetTable table;
  table.file = "drift";
  for (std::size_t row = 0; row < d.history.time_s.size(); ++row) {
    const auto& K = d.history.temperature_K[row];
    table.rows.push_back({d.history.time_s[row], {}, d.mm_per_K * Eigen::Vector2d(K[0], K[1]), 0.0});
  }
  return table;
}

// The program calculates its own offsets. An hour of warming before it begins and slow warming while it runs
// are taken out, and on the cold machine the same text cuts the nominal path.
TEST(OffsetOutput, CalculatesOffsetsFromTheControlsTemperatures) {
  const Machine machine = machine_with_offset();
  const RunTimeDrift drift = warming(1.5, -0.7);
  const auto table = drift_of(drift);
  for (const char* control : {"linuxcnc", "siemens_840d_sl"}) {
    for (const bool rtcp : {false, true}) {
      SCOPED_TRACE(std::string(control) + (rtcp ? " tcp" : ""));
      Setting setting;
      setting.control = control;
      setting.rtcp = rtcp;
      setting.output = OffsetOutput::variables;
      setting.limits = quick();
      setting.drift = &drift;
      const OffsetPost p = offset_post(blades(4, true), machine, &table, setting);
      ASSERT_TRUE(p.report) << p.report.error().text();
      EXPECT_TRUE(p.report->verification->passed()) << p.report->verification->certified_tip_deviation_mm;
      EXPECT_TRUE(p.report->nominal_verification->passed());
      EXPECT_GE(p.report->offset_shifts, 4U);
      EXPECT_LT(p.report->run_time_bend_mm, 1e-3);
      EXPECT_EQ(p.report->run_time_bend_mm > 0.0, rtcp);  // without it a shift in M is one of the axes
      // A program with one wrong factor misses the tolerance.
      RunTimeDrift wrong = drift;
      wrong.mm_per_K(2, 0) = -wrong.mm_per_K(2, 0);
      setting.drift = &wrong;
      EXPECT_FALSE(offset_post(blades(4, true), machine, &table, setting).report->verification->passed());
    }
  }
}

// Whatever the sensors say, no axis moves by more than the clamp: here one reads 1000 K.
TEST(OffsetOutput, ABrokenSensorMovesNoAxisByMoreThanTheClamp) {
  const Machine machine = machine_with_offset();
  RunTimeDrift drift = warming(0.0, 0.0);
  drift.history.time_s = {-1.0, 0.0};
  drift.history.temperature_K = {{0.0, 0.0}, {1000.0, 0.0}};
  thermal::OffsetTable cold;
  cold.file = "none";
  cold.rows.push_back({0.0, {}, Vec3::Zero(), 0.0});
  Setting setting;
  setting.output = OffsetOutput::variables;
  setting.limits = quick();
  setting.limits.clamp_mm = 0.010;
  setting.drift = &drift;
  const OffsetPost p = offset_post(blades(2, true), machine, &cold, setting);
  ASSERT_TRUE(p.report) << p.report.error().text();
  const double left = p.report->verification->max_tip_deviation_mm;
  EXPECT_GT(left, 0.010);
  EXPECT_LT(left, std::sqrt(3.0) * 0.010 + setting.tolerance_mm);
}

TEST(OffsetOutput, OperationsThatTheProgramLacksAreAnError) {
  const auto table = offsets("operation,dx_um\nBLADE_1,10\n");
  const OffsetPost p = offset_post(blades(2, false), machine_with_offset(), &table);
  ASSERT_FALSE(p.report);
  EXPECT_THAT(p.report.error().text(), HasSubstr("none of the operations of the offsets stands in part.cls"));
}

TEST(OffsetOutput, OperationsWithoutARowAreNamed) {
  const auto table = offsets("operation,dx_um\nBlade (1),10\n");
  const OffsetPost p = offset_post(blades(3, false), machine_with_offset(), &table);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_THAT(warnings(p.diagnostics), HasSubstr("no row for the operations Blade (2), Blade (3): "));
}

// A log of another day, and one that ends before the program does.
TEST(OffsetOutput, ATableOverTimeThatDoesNotCoverTheProgramIsToldOf) {
  const auto told = [](const std::string& csv) {
    const auto table = offsets(csv);
    Setting setting;
    setting.output = OffsetOutput::axis_values;
    const OffsetPost p = offset_post(blades(2, false), machine_with_offset(), &table, setting);
    EXPECT_TRUE(p.report) << p.report.error().text();
    return warnings(p.diagnostics).find("outside them the first or last value is used") != std::string::npos;
  };
  EXPECT_TRUE(told("time_s,dx_um\n36000,1\n39600,1\n"));
  EXPECT_TRUE(told("time_s,dx_um\n0,1\n2,1\n"));
  EXPECT_FALSE(told("time_s,dx_um\n0,1\n3600,1\n"));
  EXPECT_FALSE(told("time_s,dx_um\n0,1\n"));
}

// The same limits count when every point is corrected: a blade that asks for more than the clamp fails.
TEST(OffsetOutput, AxisValuesBeyondTheClampFailTheVerification) {
  const auto table = offsets(by_blade());
  Setting setting;
  setting.output = OffsetOutput::axis_values;
  setting.limits = quick();
  EXPECT_TRUE(
      offset_post(blades(4, true), machine_with_offset(), &table, setting).report->verification->passed());
  setting.limits.clamp_mm = 0.012;
  EXPECT_FALSE(
      offset_post(blades(4, true), machine_with_offset(), &table, setting).report->verification->passed());
}

// Blocks that take up lost motion have the offset that those before and behind them have: C at a reversal
// from the one blade's arc to the other would otherwise go by it and back.
TEST(OffsetOutput, LostMotionIsTakenUpWithTheOffsetInForce) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  std::string cl = "PARTNO TEST\nMULTAX/ON\nLOADTL/3\nSPINDL/RPM,8000,CLW\nFEDRAT/MMPM,600\nRAPID\n";
  const auto point = [&](double x, double y, double z) {
    cl +=
        "GOTO/" + fixed_text(x, 5) + "," + fixed_text(y, 5) + "," + fixed_text(z, 5) + ",0.3,0.1,0.948683\n";
  };
  point(30.0, 0.0, 60.0);
  for (int i = 0; i <= 72; ++i) {
    const double turn = i * 4.0 * kPi / 72;
    point(30.0 * std::cos(turn), 30.0 * std::sin(turn), 10.0 + 3.0 * std::cos(2.0 * turn));
  }
  point(30.0, 0.0, 60.0);
  const auto table = offsets("time_s,dx_um,dy_um,dz_um,sigma_um\n0,40,-30,50,1\n3600,45,-33,58,4\n");
  const Model model = test::model_of(
      "[model]\nname = \"m\"\n[[effect]]\nid = \"backlash:X\"\n[effect.parameters]\nb_um = 4\n"
      "[[effect]]\nid = \"backlash:Y\"\n[effect.parameters]\nb_um = 5\n"
      "[[effect]]\nid = \"backlash:Z\"\n[effect.parameters]\nb_um = 3\n",
      machine);
  Setting setting;
  setting.output = OffsetOutput::axis_values;
  setting.model = &model;
  const OffsetPost without = offset_post(cl, machine, nullptr, setting);
  const OffsetPost with = offset_post(cl, machine, &table, setting);
  ASSERT_TRUE(without.report && with.report);
  EXPECT_TRUE(with.report->verification->passed()) << with.report->verification->certified_tip_deviation_mm;
  EXPECT_LE(with.report->nc_lines, without.report->nc_lines + 6);
  EXPECT_DOUBLE_EQ(with.report->head.offset_sigma_mm, 0.004);
}

}  // namespace
}  // namespace trunnion::post
