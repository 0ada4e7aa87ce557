// What stands around the cut: the way to the safe height and back, rapids on their lines, what the program
// must say before it moves. Programs are walked in machine positions by a little interpreter that knows tool
// and travel only.
#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/machine/kinematics.hpp"

#include "post/posting.hpp"
#include "support/cases.hpp"
#include "support/shop_machines.hpp"
#include "support/without_a_stop.hpp"

namespace trunnion {
namespace {

using post::PostOptions;
using ::testing::HasSubstr;
using ::testing::Not;

// A line between two CL points that the tool runs at rapid rate.
struct RapidLine {
  Vec3 from_P, to_P;
};
struct Part {
  std::string cl;
  std::vector<RapidLine> rapids;
};

double uniform(std::mt19937_64& random, double from, double to) {
  return from + (to - from) * static_cast<double>(random() >> 11) * 0x1p-53;
}

// Operations of a rapid above the part, a rapid down, cuts and a rapid up, tool axes all over the upper half;
// tool changes, stops, spindle and coolant off between them and in the cut.
Part random_part(std::mt19937_64& random) {
  Part part;
  part.cl = "UNITS/MM\nLOADTL/1\nSPINDL/5000,RPM,CLW\nCOOLNT/FLOOD\nFEDRAT/800.,MMPM\n";
  std::optional<Vec3> at;
  const auto go = [&](const Vec3& tip, const Vec3& axis, bool rapid) {
    if (rapid) part.cl += "RAPID\n";
    if (rapid && at) part.rapids.push_back({*at, tip});
    part.cl += test::point_text(tip, axis);
    at = tip;
  };
  int tool = 1;
  for (int operation = 0; operation < 4; ++operation) {
    Vec3 axis = test::tilted(uniform(random, 0.05, 1.2), uniform(random, -3.1, 3.1));
    Vec3 tip(uniform(random, -60.0, 60.0), uniform(random, -60.0, 60.0), uniform(random, 20.0, 60.0));
    go(tip + 40.0 * axis, axis, true);
    go(tip, axis, true);
    for (int i = 0; i < 4; ++i) {
      tip += Vec3(uniform(random, -8.0, 8.0), uniform(random, -8.0, 8.0), uniform(random, -2.0, 2.0));
      axis = (axis + 0.1 * Vec3(uniform(random, -1.0, 1.0), uniform(random, -1.0, 1.0), 0.0)).normalized();
      go(tip, axis, false);
      if (i == 1 && random() % 4 == 0) part.cl += "OPSTOP\n";
    }
    if (random() % 3 != 0) go(tip + 60.0 * axis, axis, true);
    if (random() % 3 == 0) part.cl += "COOLNT/OFF\nSPINDL/OFF\nSTOP\nSPINDL/4000,RPM,CLW\nCOOLNT/FLOOD\n";
    if (random() % 2 == 0) part.cl += "LOADTL/" + std::to_string(++tool) + "\n";
  }
  part.cl += "FINI\n";
  return part;
}

// Where the axes stand, as far as the program has said.
class Walker {
 public:
  Walker(const Machine& machine, const nc::Controller& controller, const Part& part)
      : machine_(machine),
        c_(controller),
        part_(part),
        kinematics_(machine, machine.tool_vector()),
        offsets_(words_of(machine, JointVector{}, machine.tool_vector())),
        z_(*machine.axis("Z")) {}

  std::vector<std::string> walk(const std::vector<nc::Block>& blocks) {
    for (const nc::Block& block : blocks) {
      ++number_;
      if (const auto* retract = std::get_if<nc::Retract>(&block)) go_up(*retract);
      if (std::holds_alternative<nc::ToolCall>(block)) {
        expect(is_up(), "a tool change that is not at the safe height");
        known_ = {};
        tool_ = true;
        length_ = machine_.output_point == OutputPoint::spindle || c_.length.automatic;
        spindle_ = false;
      }
      if (const auto* length = std::get_if<nc::LengthCompensation>(&block))
        length_ = length->number > 0 || machine_.output_point == OutputPoint::spindle;
      if (const auto* spindle = std::get_if<nc::Spindle>(&block)) {
        spindle_ = spindle->rpm > 0;
        expect(spindle_ ? tool_ : is_up(), "the spindle starts without its tool or stops at the part");
      }
      if (std::holds_alternative<nc::Stop>(block)) expect(is_up(), "a stop at the part");
      if (const auto* motion = std::get_if<nc::Motion>(&block)) move(*motion);
      if (std::holds_alternative<nc::ProgramEnd>(block)) {
        expect(is_up() && !spindle_, "the end at the part, or with the spindle running");
      }
    }
    return found_;
  }

 private:
  void expect(bool holds, const std::string& what) {
    if (!holds) found_.push_back("block " + std::to_string(number_) + ": " + what);
  }
  bool is_up() const { return known_[z_] && std::abs(q_[z_] - *machine_.safe.z_mm()) < 1e-9; }
  void go_up(const nc::Retract& retract) {
    expect(retract.axes == nc::AxisWords::bit(nc::AxisLetter::Z), "another axis than Z");
    q_[z_] = c_.numbers.axes.internal(nc::AxisLetter::Z, retract.to[nc::AxisLetter::Z]);
    known_[z_] = true;
    expect(is_up(), "a retract to elsewhere");
  }
  void move(const nc::Motion& motion) {
    const JointVector before = q_;
    const auto was_known = known_;
    const bool was_up = is_up();
    bool turns = false, sideways = false, z_moves = false;
    for (AxisId id = 0; id < machine_.axes.size(); ++id) {
      const nc::AxisLetter letter = *nc::axis_letter(machine_.axes[id].name);
      if (!motion.words.has(letter)) continue;
      const double to = c_.numbers.axes.internal(letter, motion.words[letter]) - offsets_[id];
      const bool changes = !was_known[id] || std::abs(to - q_[id]) > 1e-9;
      q_[id] = to;
      known_[id] = true;
      if (!changes) continue;
      (machine_.axes[id].kind == AxisKind::rotary ? turns : id == z_ ? z_moves : sideways) = true;
    }
    const bool stays_up = was_up && is_up();
    if (z_moves) expect(length_, "Z moves without the tool's length");
    if (!(was_up && !turns && !sideways) && motion.kind == nc::MotionKind::feed) {
      expect(spindle_, "a cut with the spindle off");
      return;
    }
    if (stays_up || (was_up && !turns && !sideways)) return;
    // Down to above where it was, or on the line of a rapid.
    expect(std::all_of(was_known.begin(), was_known.end(), [](bool k) { return k; }),
           "a rapid below the safe height from a place that is not known");
    double least_mm = 1e9;
    for (const RapidLine& line : part_.rapids) {
      double off_mm = 0.0;
      for (int i = 0; i <= 64; ++i) {
        const Vec3 tip_P = kinematics_.pose(JointVector::interpolate(before, q_, i / 64.0)).tip_P;
        off_mm = std::max(off_mm, distance_to_segment(tip_P, line.from_P, line.to_P));
      }
      least_mm = std::min(least_mm, off_mm);
    }
    expect(least_mm < 1.0 + 0.002, "a rapid leaves its line by " + std::to_string(least_mm) + " mm");
  }

  const Machine& machine_;
  const nc::Controller& c_;
  const Part& part_;
  TableKinematics kinematics_;
  JointVector offsets_;
  AxisId z_;
  JointVector q_;
  std::array<bool, kMaxAxes> known_{};
  bool tool_ = false, length_ = false, spindle_ = false;
  std::size_t number_ = 0;
  std::vector<std::string> found_;
};

TEST(LongAroundTheCut, IsSafeOnEveryControlAndKindOfMachine) {
  std::mt19937_64 random(20);
  std::size_t programs = 0;
  for (const auto& kind : test::kShopMachines) {
    const Machine machine = test::shop_machine(kind);
    for (const std::string& control : test::shipped_controllers()) {
      const nc::Controller c = post::with_axes_of(machine, test::shipped_controller(control));
      // Which adds the length of every tool: refused.
      if (machine.output_point == OutputPoint::spindle && c.length.automatic) continue;
      for (int i = 0; i < 6; ++i) {
        const Part part = random_part(random);
        const auto p = test::posted(part.cl, machine, {}, control);
        SCOPED_TRACE(std::string(kind.kind) + ", " + control + "\n" + part.cl + p.nc);
        ASSERT_TRUE(p.report) << p.report.error().text();
        const auto& v = *p.report->verification;
        ASSERT_TRUE(v.passed()) << (v.unsafe.empty() ? "" : v.unsafe[0].what) << " rapids "
                                << v.max_rapid_deviation_mm << " tip " << v.certified_tip_deviation_mm
                                << " missed " << v.points_missed << " limits " << v.limits_ok() << " axis "
                                << v.max_axis_deviation.deg();
        const auto found = Walker(machine, c, part).walk(test::nc_blocks(c, p.nc));
        ASSERT_TRUE(found.empty()) << found[0];
        ++programs;
      }
    }
  }
  EXPECT_GE(programs, (test::kShopMachines.size() * test::shipped_controllers().size() - 1) * 6);
}

// The same under tool-centre-point control: what the verification finds.
TEST(AroundTheCut, IsSafeUnderToolCentrePointControl) {
  std::mt19937_64 random(21);
  for (const auto& kind : test::kShopMachines) {
    if (kind.point != std::string("tip")) continue;
    for (const char* control :
         {"fanuc_30i", "siemens_840d_sl", "heidenhain_tnc640", "haas_ngc", "linuxcnc"}) {
      PostOptions options;
      options.rtcp = true;
      options.feed = post::FeedOutput::tip;
      const Part part = random_part(random);
      const auto p = test::posted(part.cl, test::shop_machine(kind), options, control);
      SCOPED_TRACE(std::string(kind.kind) + ", " + control + "\n" + part.cl + p.nc);
      ASSERT_TRUE(p.report) << p.report.error().text();
      const auto& v = *p.report->verification;
      EXPECT_TRUE(v.passed()) << (v.unsafe.empty() ? "" : v.unsafe[0].what) << " rapids "
                              << v.max_rapid_deviation_mm << " speed " << v.max_speed_ratio << " tip "
                              << v.certified_tip_deviation_mm << " missed " << v.points_missed;
    }
  }
}

constexpr const char* kTwoTools =
    "UNITS/MM\nLOADTL/1\nSPINDL/4000,RPM,CLW\nCOOLNT/FLOOD\nFEDRAT/800.,MMPM\nRAPID\n"
    "GOTO/0.,0.,100.,0.5,0.,0.8660254\nRAPID\nGOTO/20.,0.,40.,0.5,0.,0.8660254\nGOTO/"
    "10.,0.,30.,0.5,0.,0.8660254\n"
    "OPSTOP\nGOTO/10.,40.,30.,0.5,0.,0.8660254\nLOADTL/2\nRAPID\nGOTO/0.,40.,60.,0.,0.7071068,0.7071068\n"
    "GOTO/0.,40.,50.,0.,0.7071068,0.7071068\nFINI\n";

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  if (at != std::string::npos) text.replace(at, what.size(), by);
  return text;
}

TEST(AroundTheCut, ComesBackAfterAStopAndResumesAfterAToolChange) {
  const Machine machine = test::shop_machine(test::kShopMachines[2], "[retract]\nz_mm = 610\nx_mm = -200\n");
  const auto p = test::posted(kTwoTools, machine, {}, "iso");
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_TRUE(p.report->verification->passed());
  EXPECT_THAT(p.nc, HasSubstr("G53 G0 Z610.\nN"));
  EXPECT_THAT(p.nc, ::testing::ContainsRegex("G53 G0 Z610.\nN[0-9]+ M1\n"));
  EXPECT_THAT(p.nc,
              ::testing::ContainsRegex(
                  "T2 M6\nN[0-9]+ G17 G21 G40 G80 G90 G94\nN[0-9]+ G54\nN[0-9]+ S4000 M3\nN[0-9]+ M8\n"));
  EXPECT_THAT(p.nc, ::testing::ContainsRegex(
                        "G53 G0 Z610.\nN[0-9]+ G53 G0 X-200.\nN[0-9]+ M5\nN[0-9]+ M9\nN[0-9]+ M30\n"));
}

// The spindle stopped where the tool stood, and the program's own verification refused that.
TEST(AroundTheCut, OrientStopsTheSpindleWhereOffDoes) {
  const auto posted = [](const std::string& stop, const std::string& control) {
    return test::posted(
        "LOADTL/4,LENGTH,100\nSPINDL/3000,CLW\nRAPID\nGOTO/0,0,60\nFEDRAT/100,MMPM\nGOTO/0,0,20\n"
        "RAPID\nGOTO/0,0,60\n" +
            stop + "\nSPINDL/3000,CLW\nGOTO/5,0,20\nFINI\n",
        test::shipped_machine("trunnion_offset"), {}, control);
  };
  for (const std::string control : {"linuxcnc", "fanuc_30i", "siemens_840d_sl", "heidenhain_tnc640"}) {
    const auto orient = posted("SPINDL/ORIENT,90", control), off = posted("SPINDL/OFF", control);
    ASSERT_TRUE(orient.report) << control << " " << orient.report.error().text();
    EXPECT_TRUE(orient.report->verification->passed()) << control;
    EXPECT_EQ(orient.nc, off.nc) << control;
  }
}

// Points a few hundredths of a millimetre apart, some repeated, stops, rapids and tool changes between them:
// the tool comes back to where it was, and the short way that follows is cut and not taken for cut.
void expect_stops_in_dense_paths(std::uint64_t seed, int cases, double least_step_mm) {
  constexpr std::array kStops = {"OPSTOP\n", "STOP\n", "SPINDL/OFF\nSPINDL/ON\n", "DELAY/0.5\n",
                                 "LOADTL/3\nSPINDL/ON\nRAPID\n"};
  constexpr std::array kControls = {"linuxcnc", "fanuc_30i", "siemens_840d_sl", "heidenhain_tnc640", "iso"};
  std::mt19937_64 random(seed);
  const auto machines = test::shipped_machines();
  for (int i = 0; i < cases; ++i) {
    std::string cl = "LOADTL/1\nSPINDL/5000,RPM,CLW\nFEDRAT/800.,MMPM\nRAPID\n";
    const double step = std::exp(uniform(random, std::log(least_step_mm), std::log(0.4)));
    const double swing = uniform(random, 0.0, 1.0) < 0.5 ? 0.0 : 0.01 * uniform(random, 0.0, 1.0);
    Vec3 tip(uniform(random, -20.0, 20.0), uniform(random, -20.0, 20.0), 10.0);
    double tilt = uniform(random, 0.1, 0.8), turn = uniform(random, 0.0, 6.0);
    for (int k = 0; k < 14; ++k) {
      if (k > 1 && random() % 12 == 0) cl += "RAPID\n";
      const std::string point = test::point_text(tip, test::tilted(tilt, turn));
      cl += point;
      if (random() % 5 == 0) cl += point;  // as CAM systems repeat it
      tip += step * Vec3(uniform(random, 0.5, 1.5), uniform(random, -0.5, 0.5), uniform(random, -0.3, 0.3));
      tilt += swing * uniform(random, -1.0, 1.0);
      turn += swing * uniform(random, -1.0, 1.0);
      if (k > 0 && random() % 4 == 0) cl += kStops[random() % kStops.size()];
    }
    const std::string control = kControls[random() % kControls.size()];
    const std::string machine = machines[random() % machines.size()];
    const auto p = test::posted(cl + "FINI\n", test::shipped_machine(machine), {}, control);
    ASSERT_TRUE(p.report) << i << ": " << p.report.error().text();
    const post::VerifyReport& v = *p.report->verification;
    EXPECT_TRUE(v.passed()) << i << " " << machine << " " << control << ": tip "
                            << v.certified_tip_deviation_mm << " mm, missed " << v.points_missed << "\n"
                            << cl;
    const std::string edited = test::without_a_stop(p.nc, random);
    if (edited.empty()) continue;
    const auto of_edited =
        test::verified(edited, cl + "FINI\n", test::shipped_machine(machine), 0.01, control);
    ASSERT_TRUE(of_edited);
    EXPECT_FALSE(of_edited->passed()) << i << "\n" << cl << edited;
  }
}

TEST(AroundTheCut, StopsBetweenPointsThatAreNear) {
  expect_stops_in_dense_paths(11, 200, 0.02);
}

TEST(LongAroundTheCut, StopsBetweenPointsThatAreNear) {
  expect_stops_in_dense_paths(12, test::cases(5000, "TRUNNION_CASES"), 0.002);
}

// From a stop at the end of a rapid the tool comes back there, repeated or not, before the next one turns it.
TEST(LongAroundTheCut, StopsBetweenRapids) {
  const auto cl = [](const std::string& between, const std::string& last) {
    return "LOADTL/1\nSPINDL/5000,RPM,CLW\nFEDRAT/800.,MMPM\nGOTO/"
           "12.2756,5.3665,20.0107,-0.271084140,0.105849596,"
           "0.956717958\nRAPID\nGOTO/1.4323,9.6005,58.2794,-0.271084140,0.105849596,0.956717958\n" +
           between + "RAPID\nGOTO/" + last + "\nFINI\n";
  };
  const std::string again = "RAPID\nGOTO/1.4323,9.6005,58.2794,-0.271084140,0.105849596,0.956717958\n";
  for (const std::string& machine : test::shipped_machines()) {
    for (const char* control : {"linuxcnc", "fanuc_30i", "siemens_840d_sl", "heidenhain_tnc640", "iso"}) {
      for (const std::string stop : {"OPSTOP\n", "STOP\n", "SPINDL/OFF\nSPINDL/ON\n", ""}) {
        for (const char* last : {"1.4323,9.6005,58.2794,-0.054005036,-0.265943288,0.962474739",
                                 "-8.5,3.2,54.1,-0.054005036,-0.265943288,0.962474739",
                                 "1.4323,9.6005,98.2794,-0.271084140,0.105849596,0.956717958"}) {
          for (const std::string& between : {stop, stop + again, again + stop, again + stop + again}) {
            const auto p = test::posted(cl(between, last), test::shipped_machine(machine), {}, control);
            SCOPED_TRACE(machine + " " + control + "\n" + between + last);
            ASSERT_TRUE(p.report) << p.report.error().text();
            EXPECT_TRUE(p.report->verification->passed()) << p.nc;
          }
        }
      }
    }
  }
}

// The tip of the longer tool stands 50 mm below the face that it works at: not a height, and the table's size
// need not be known to see it.
TEST(AroundTheCut, ASafeHeightBelowThePathIsNone) {
  const std::string cl =
      "UNITS/MM\nMULTAX\nLOADTL/4,LENGTH,120\nSPINDL/2000,CLW\nFEDRAT/300\nRAPID\nGOTO/0,0,40,0,0,1\n"
      "GOTO/0,0,20\nRAPID\nGOTO/0,0,40\nLOADTL/7,LENGTH,200\nSPINDL/2000,CLW\nRAPID\nGOTO/30,0,40\n"
      "GOTO/30,0,20\nRAPID\nGOTO/30,0,40\nFINI\n";
  const auto machine = [](double z_mm) {
    Machine m = test::shipped_machine("trunnion_offset");
    m.safe.to_mm[2] = z_mm;
    m.safe.z_is_given = true;
    return m;
  };
  const auto low = test::posted(cl, machine(170.0));
  ASSERT_FALSE(low.report);
  EXPECT_THAT(
      low.report.error().text(),
      ::testing::HasSubstr("70.000 mm below a place of the path, machine Z 240.000 mm with a tool of 200"));
  // The first tool, too, where the retract goes down.
  EXPECT_FALSE(test::posted(cl, machine(100.0)).report);
  const auto high = test::posted(cl, machine(240.0));
  ASSERT_TRUE(high.report) << high.report.error().text();
  std::string edited = high.nc;
  for (std::size_t at = 0; (at = edited.find("G53 G0 Z240", at)) != std::string::npos;)
    edited.replace(at, 11, "G53 G0 Z170");
  const auto v = test::verified(edited, cl, machine(170.0), 0.01);
  ASSERT_TRUE(v);
  ASSERT_FALSE(v->unsafe.empty());
  EXPECT_THAT(v->unsafe[0].what, ::testing::HasSubstr("from the safe height the tool goes 70.000 mm up"));
}

// 5 mm above the cut: back from a stop the tool comes from there, and not from 50 mm above.
TEST(AroundTheCut, ComesBackFromASafeHeightThatIsLow) {
  Machine machine = test::shipped_machine("trunnion_offset");
  machine.safe.to_mm[2] = 195.0;
  machine.safe.z_is_given = true;
  const auto p = test::posted(
      "UNITS/MM\nMULTAX\nLOADTL/1,LENGTH,150\nSPINDL/2000,CLW\nFEDRAT/300\nRAPID\nGOTO/0,0,40,0,0,1\n"
      "GOTO/0,0,20\nSTOP\nGOTO/10,0,20\nRAPID\nGOTO/10,0,40\nFINI\n",
      machine);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_TRUE(p.report->verification->passed());
}

// A program that was edited: what the verification says of it.
TEST(AroundTheCut, IsJudgedInEditedPrograms) {
  const Machine machine = test::shop_machine(test::kShopMachines[2]);
  const auto p = test::posted(kTwoTools, machine);
  ASSERT_TRUE(p.report) << p.report.error().text();
  const auto unsafe = [&](const std::string& text) {
    const auto v = test::verified(text, kTwoTools, machine, 0.01);
    EXPECT_TRUE(v);
    if (!v || v->unsafe.empty()) return std::string("nothing");
    EXPECT_FALSE(v->passed());
    return v->unsafe[0].what;
  };
  EXPECT_EQ(unsafe(p.nc), "nothing");
  const std::string up = "G53 G0 Z700.0000\n";
  EXPECT_THAT(unsafe(replaced(p.nc, up, "G53 G0 Z0.0000\n")), HasSubstr("does not reach the safe height"));
  EXPECT_THAT(unsafe(replaced(p.nc, up, "G53 G0 Z7000.0000\n")), HasSubstr("beyond the travel"));
  EXPECT_THAT(unsafe(replaced(p.nc, up + "G0 A", "G0 A")), HasSubstr("axis A turns below the safe height"));
  EXPECT_THAT(unsafe(replaced(p.nc, up + "(tool 2", "(tool 2")),
              HasSubstr("the tool is changed below the safe height"));
  EXPECT_THAT(unsafe(replaced(p.nc, up + "M5", "M5")), HasSubstr("the spindle stops before"));
}

constexpr const char* kTwoSides =
    "UNITS/MM\nLOADTL/4\nSPINDL/8000,RPM,CLW\nFEDRAT/400.,MMPM\nRAPID\nGOTO/-90.,0.,60.,0.,0.,1.\n"
    "GOTO/-90.,0.,20.\nRAPID\nGOTO/-90.,0.,60.\nRAPID\nGOTO/100.,0.,40.,0.5,0.,0.8660254\n"
    "GOTO/100.,0.,20.\nRAPID\nGOTO/120.,0.,54.641\nFINI\n";

// Text behind the last line that holds `mark`, or in its place.
std::string behind_last(std::string text, const std::string& mark, const std::string& line) {
  const auto at = text.rfind(mark);
  EXPECT_NE(at, std::string::npos) << mark;
  if (at == std::string::npos) return text;
  return text.insert(text.find('\n', at) + 1, line + "\n");
}

std::string without_last(std::string text, const std::string& mark) {
  const auto at = text.rfind(mark);
  EXPECT_NE(at, std::string::npos) << mark;
  if (at == std::string::npos) return text;
  const auto begin = text.rfind('\n', at) + 1;
  return text.erase(begin, text.find('\n', at) + 1 - begin);
}

// What the reader, or a check, says of it; nothing where it passes.
std::string verdict_of(const std::string& text, const Machine& machine, const std::string& control) {
  const auto v = test::verified(text, kTwoSides, machine, 0.01, control);
  if (!v) return v.error().text();
  if (!v->unsafe.empty()) return v->unsafe[0].what;
  for (const post::Check& check : v->checks)
    if (check.state == post::Check::State::failed)
      return check.places.empty() ? "failed" : check.places[0].what;
  return v->passed() ? "" : "failed";
}

// The first Z of a tilted plane moves machine Z, whatever else is known.
TEST(AroundTheCut, IsJudgedInATiltedPlane) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  struct Down {
    const char *control, *mark, *line, *off;
  };
  for (const Down& down : {Down{"siemens_840d_sl", "D1", "G0 Z-40", "CYCLE800()"},
                           {"siemens_840d_sl", "CYCLE800(0", "G0 Z-40", "CYCLE800()"},
                           {"fanuc_30i", "G53.1", "G43 H4 Z-40.", "G69"},
                           {"heidenhain_tnc640", "PLANE SPATIAL", "L Z-40 FMAX", "PLANE RESET"}}) {
    PostOptions options;
    options.tilted_plane = true;
    const auto p = test::posted(kTwoSides, machine, options, down.control);
    ASSERT_TRUE(p.report) << p.report.error().text();
    EXPECT_EQ(verdict_of(p.nc, machine, down.control), "");
    EXPECT_THAT(
        verdict_of(behind_last(p.nc, down.mark, down.line), machine, down.control),
        testing::AnyOf(HasSubstr("the tool comes down where not all axes are known to stand: machine Z is "),
                       HasSubstr("whether the control adds a tool's length is not known")))
        << down.control << " " << down.mark;
    EXPECT_THAT(verdict_of(without_last(p.nc, down.off), machine, down.control), Not("")) << down.control;
  }
  // Above the part, before the length is on: far beyond the travel of X.
  for (const char* control : {"siemens_840d_sl", "fanuc_30i", "heidenhain_tnc640"}) {
    PostOptions options;
    options.tilted_plane = true;
    const auto p = test::posted(kTwoSides, machine, options, control);
    const bool is_siemens = std::string_view(control) == "siemens_840d_sl";
    auto at = p.nc.find(is_siemens                                 ? "CYCLE800(0"
                        : std::string_view(control) == "fanuc_30i" ? "G53.1"
                                                                   : "PLANE SPATIAL");
    at = p.nc.find('X', p.nc.find('\n', at));
    ASSERT_NE(at, std::string::npos);
    const std::size_t behind = p.nc.find_first_of(" \n", at);
    EXPECT_THAT(verdict_of(p.nc.substr(0, at) +
                               (std::string_view(control) == "heidenhain_tnc640" ? "X+2400" : "X2400.") +
                               p.nc.substr(behind),
                           machine, control),
                HasSubstr("axis X would stand beyond its travel"))
        << control;
  }
  // Down, and sideways only there.
  PostOptions options;
  options.tilted_plane = true;
  const auto p = test::posted(kTwoSides, machine, options, "heidenhain_tnc640");
  const auto at = p.nc.find('\n', p.nc.find("PLANE SPATIAL")) + 1;
  const auto next = p.nc.find('\n', at) + 1;
  const auto behind = p.nc.find('\n', next) + 1;
  EXPECT_THAT(verdict_of(p.nc.substr(0, at) + p.nc.substr(next, behind - next) + p.nc.substr(at, next - at) +
                             p.nc.substr(behind),
                         machine, "heidenhain_tnc640"),
              HasSubstr("the tool comes down where not all axes are known to stand: machine Z is "));
}

TEST(AroundTheCut, EndsTiltedPlaneAndToolCentrePointControl) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  PostOptions options;
  options.tilted_plane = true;
  const auto in_plane = test::posted(kTwoSides, machine, options, "fanuc_30i");
  ASSERT_TRUE(in_plane.report) << in_plane.report.error().text();
  EXPECT_THAT(verdict_of(without_last(in_plane.nc, "G69"), machine, "fanuc_30i"),
              HasSubstr("the program ends in a tilted plane: end that first ('G69')"));
  options = {};
  options.rtcp = true;
  for (const auto& [control, off] : {std::pair{"fanuc_30i", "G49"},
                                     {"haas_ngc", "G49"},
                                     {"siemens_840d_sl", "TRAFOOF"},
                                     {"heidenhain_tnc640", "M129"},
                                     {"linuxcnc", "M429"}}) {
    const auto p = test::posted(kTwoSides, machine, options, control);
    ASSERT_TRUE(p.report) << p.report.error().text();
    EXPECT_EQ(verdict_of(p.nc, machine, control), "");
    EXPECT_THAT(verdict_of(without_last(p.nc, off), machine, control),
                HasSubstr("a retract under tool-centre-point control: end that first"));
  }
}

// The tip stands still while the part swings.
TEST(AroundTheCut, NoAxisSwingsUnderToolCentrePointControl) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  PostOptions options;
  options.rtcp = true;
  for (const char* control : {"fanuc_30i", "haas_ngc", "siemens_840d_sl", "heidenhain_tnc640", "linuxcnc"}) {
    const auto p = test::posted(kTwoSides, machine, options, control);
    ASSERT_TRUE(p.report) << p.report.error().text();
    const bool tnc = control == std::string("heidenhain_tnc640");
    const auto swung = [&](const std::string& mark, const std::string& words) {
      return verdict_of(behind_last(p.nc, mark, tnc ? "L " + words + " FMAX" : "G0 " + words), machine,
                        control);
    };
    const std::string plus = tnc ? "+" : "";
    // Behind the rapid up from the first cut, and behind the last motion.
    const std::string up = p.nc.find("G0 Z60.0000") != std::string::npos ? "G0 Z60.0000"
                           : p.nc.find("G0 Z60.") != std::string::npos   ? "G0 Z60."
                           : tnc                                         ? "L Z+60 FMAX"
                                                                         : "G0 Z60";
    EXPECT_THAT(swung(up, "A" + plus + "90."), HasSubstr("a rotary axis turns below the safe height"))
        << control;
    // Where the way up that follows does not end up there any more, that is what is said first.
    EXPECT_THAT(
        swung("Z" + plus + "54.641", "A" + plus + "90."),
        testing::AnyOf(HasSubstr("a rotary axis turns below the safe height"),
                       HasSubstr("tool length compensation is switched on or off below the safe height")))
        << control;
    EXPECT_THAT(swung("Z" + plus + "54.641", "Z" + plus + "70. A" + plus + "90."), Not("")) << control;
    // What the CL file asks for: half of the way that its rapid turns.
    EXPECT_EQ(swung(up, "A" + plus + "10."), "") << control;
  }
}

TEST(AroundTheCut, NamesTheKeyThatIsMissing) {
  Machine machine = test::shop_machine(test::kShopMachines[2]);
  machine.safe = {};
  EXPECT_THAT(test::posted(kTwoTools, machine).report.error().text(),
              HasSubstr("does not say where to: add [retract] z_mm"));
  machine = test::shop_machine(test::kShopMachines[2], "[table]\nradius_mm = 900\ntop_mm = 10\n");
  EXPECT_THAT(test::posted(kTwoTools, machine).report.error().text(),
              HasSubstr("below what the table sweeps"));
}

TEST(Rapids, KeepTheirLine) {
  const std::string cl =
      "UNITS/MM\nLOADTL/1\nSPINDL/8000,RPM,CLW\nFEDRAT/800.,MMPM\nRAPID\nGOTO/"
      "100.,20.,40.,0.9,0.2,0.3872983\n"
      "GOTO/100.,0.,40.,0.9,0.2,0.3872983\nRAPID\nGOTO/120.,0.,80.,0.9,0.2,0.3872983\n"
      "RAPID\nGOTO/60.,40.,80.,0.2,0.1,0.9746794\nGOTO/60.,60.,60.,0.2,0.1,0.9746794\nFINI\n";
  const Machine machine = test::shop_machine(test::kShopMachines[0]);
  PostOptions options;
  for (const double tolerance_mm : {1.0, 0.1}) {
    options.rapid_tolerance_mm = tolerance_mm;
    const auto p = test::posted(cl, machine, options, "haas_ngc");
    ASSERT_TRUE(p.report) << p.report.error().text();
    EXPECT_TRUE(p.report->verification->passed());
    EXPECT_LE(p.report->verification->max_rapid_deviation_mm, tolerance_mm);
    EXPECT_GT(p.report->verification->max_rapid_deviation_mm, 0.1 * tolerance_mm);
    EXPECT_EQ(p.report->verification->worst_rapid.cl_line, 11U);
  }
  options.rapid_tolerance_mm = 1e6;
  const auto wide = test::posted(cl, machine, options, "haas_ngc");
  EXPECT_GT(wide.report->verification->max_rapid_deviation_mm, 5.0);
  const auto v = test::verified(wide.nc, cl, machine, 0.01, "haas_ngc");
  EXPECT_FALSE(v->passed());
}

TEST(Kinematics, IsSaidWhereTheControlCanSwitch) {
  const Machine can = test::shipped_machine("xyzac_trt");
  const auto p = test::posted(kTwoTools, can);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_THAT(p.nc, HasSubstr("\nM429\n"));
  EXPECT_LT(p.nc.find("M429"), p.nc.find("G53"));
  EXPECT_THAT(p.nc, Not(HasSubstr("M428")));
  EXPECT_FALSE(test::verified(replaced(p.nc, "M429\n", ""), kTwoTools, can, 0.01));
  const nc::Controller cannot =
      post::with_axes_of(test::shipped_machine("paper"), test::shipped_controller("linuxcnc"));
  EXPECT_THAT(test::posted(kTwoTools, test::shipped_machine("paper")).nc, Not(HasSubstr("M42")));
  EXPECT_FALSE(cannot.tcp.unknown_at_start);
}

// A control with one kinematics stops at M429, in the middle of the cut.
TEST(Kinematics, AreNotEndedWhereTheControlCannotSwitch) {
  const Machine cannot = test::shipped_machine("paper");
  const auto p = test::posted(kTwoTools, cannot);
  ASSERT_TRUE(p.report) << p.report.error().text();
  ASSERT_TRUE(test::verified(p.nc, kTwoTools, cannot, 0.01));
  const std::string cut = "\nG1 ";
  ASSERT_THAT(p.nc, HasSubstr(cut));
  const auto v = test::verified(replaced(p.nc, cut, "\nM429" + cut), kTwoTools, cannot, 0.01);
  ASSERT_FALSE(v);
  EXPECT_THAT(v.error().text(), HasSubstr("'M429', and the program never says 'M428'"));
}

}  // namespace
}  // namespace trunnion
