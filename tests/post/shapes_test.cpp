// Arcs and drilling cycles in the control's own words: random ones at random tilts on every machine file,
// read back and held against the circles and holes that they were made from.
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <sstream>

#include "trunnion/nc/expand.hpp"

#include "post/posting.hpp"

namespace trunnion::post {
namespace {

using nc::AxisLetter;

std::string numbers(const Vec3& v, int decimals) {
  return fixed_text(v.x(), decimals) + "," + fixed_text(v.y(), decimals) + "," + fixed_text(v.z(), decimals);
}

Vec3 rounded(const Vec3& v, double unit) {
  return {unit * std::round(v.x() / unit), unit * std::round(v.y() / unit), unit * std::round(v.z() / unit)};
}

struct Circle {
  Vec3 center, axis;
  double radius = 0.0;
};
struct Bore {
  Vec3 top, axis;
  double depth = 0.0;
  double clear = 0.0;
};
struct Part {
  std::string cl = "PARTNO SHAPES\nMULTAX/ON\nLOADTL/3\nSPINDL/RPM,8000,CLW\nFEDRAT/MMPM,600\n";
  std::vector<Circle> circles;
  std::vector<Bore> bores;
};

/// Tool axes anywhere up to 50 deg; under each a part of a circle, a whole one and three holes.
Part random_part(unsigned seed, const std::string& cycle, double depth, double clear, int groups = 4,
                 double most_tilt = 0.85) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  Part part;
  const auto go = [&](const Vec3& p, const Vec3& axis) {
    part.cl += "GOTO/" + numbers(p, 5) + "," + numbers(axis, 9) + "\n";
  };
  for (int g = 0; g < groups; ++g) {
    const double tilt = most_tilt * u(random);
    const double turn = 6.0 * u(random);
    const Vec3 axis =
        rounded({std::sin(tilt) * std::cos(turn), std::sin(tilt) * std::sin(turn), std::cos(tilt)}, 1e-9);
    const Vec3 e1 = axis.cross(Vec3(0.3, 0.8, 0.1)).normalized();
    const Vec3 e2 = axis.cross(e1);
    const Vec3 center =
        rounded(Vec3(20.0 * u(random) - 10.0, 20.0 * u(random) - 10.0, 15.0 * u(random)), 1e-5);
    const double radius = 2.0 + 18.0 * u(random);
    const double sense = u(random) < 0.5 ? -1.0 : 1.0;
    const double sweep = 0.2 + 5.5 * u(random);
    const auto at = [&](double angle) {
      return rounded(center + radius * (std::cos(angle) * e1 + sense * std::sin(angle) * e2), 1e-5);
    };
    part.cl += "RAPID\n";
    go(at(0.0) + 30.0 * axis, axis);
    go(at(0.0), axis);
    const std::string circle = "CIRCLE/" + numbers(center, 5) + "," + numbers(sense * axis, 9) + "\n";
    part.cl += circle;
    go(at(sweep), axis);
    part.cl += circle;
    go(at(sweep), axis);
    part.circles.push_back({center, axis, radius});
    part.circles.push_back({center, axis, radius});
    part.cl += "RAPID\n";
    go(at(sweep) + 30.0 * axis, axis);
    part.cl += "CYCLE/" + cycle + ",DEPTH," + fixed_text(depth, 3) + ",MMPM,150,CLEAR," +
               fixed_text(clear, 3) + "\n";
    for (int h = 0; h < 3; ++h) {
      const Vec3 top = rounded(center + 20.0 * (u(random) - 0.5) * e1 + 20.0 * (u(random) - 0.5) * e2, 1e-5);
      go(top, axis);
      part.bores.push_back({top, axis, depth, clear});
    }
    part.cl += "CYCLE/OFF\n";
  }
  part.cl += "FINI\n";
  return part;
}

PostOptions native() {
  PostOptions options;
  options.native_arcs = true;
  options.native_cycles = true;
  return options;
}

/// The tip in P for X Y Z words, the rotary axes as they stand.
class Tips {
 public:
  Tips(const Machine& machine, const nc::Controller& controller)
      : machine_(machine), controller_(controller) {}
  void rotary(const nc::AxisWords& words) {
    for (AxisId id = 0; id < machine_.axes.size(); ++id) {
      const AxisLetter letter = *nc::axis_letter(machine_.axes[id].name);
      if (words.has(letter)) words_[id] = controller_.numbers.axes.internal(letter, words[letter]);
    }
  }
  Vec3 at(const std::array<double, 3>& xyz) const {
    JointVector words = words_;
    for (AxisId id = 0; id < machine_.axes.size(); ++id) {
      const std::size_t i = nc::index(*nc::axis_letter(machine_.axes[id].name));
      if (i < 3) words[id] = xyz[i];
    }
    return forward(machine_, joints_of_words(machine_, words, machine_.tool_vector()), machine_.tool_vector())
        .p;
  }

 private:
  const Machine& machine_;
  const nc::Controller& controller_;
  JointVector words_;
};

std::string figures(const VerifyReport& r) {
  std::string out = "tip " + fixed_text(r.certified_tip_deviation_mm, 6) + ", points " +
                    fixed_text(r.max_point_deviation_mm, 6) + ", missed " + std::to_string(r.points_missed) +
                    ", too fast " + std::to_string(r.too_fast_count) + ", beyond " +
                    std::to_string(r.beyond_limits_count);
  for (const WorstPlace& w : r.worst)
    out += "\n  NC line " + std::to_string(w.nc_line) + ", CL line " + std::to_string(w.cl_line) + ": " +
           fixed_text(w.tip_mm, 6);
  return out;
}

void expect_the_shapes(const std::string& text, const Part& part, const Machine& machine,
                       const std::string& control) {
  const nc::Controller c = with_axes_of(machine, test::shipped_controller(control));
  const double digit = std::pow(10.0, -c.numbers.axes.decimals(AxisLetter::X));
  // Ends and centre are rounded, and 0.0005 deg at 30 mm from the axes.
  const double near =
      3.0 * digit + 30.0 * 0.5 * std::pow(10.0, -c.numbers.axes.decimals(AxisLetter::A)) * kRadPerDegree;
  Tips tips(machine, c);
  std::size_t arcs = 0;
  std::size_t holes = 0;
  for (const nc::Block& block : test::nc_blocks(c, text)) {
    if (const auto* arc = std::get_if<nc::Arc>(&block)) {
      ASSERT_LT(arcs, part.circles.size());
      const Circle& circle = part.circles[arcs++];
      tips.rotary(arc->words);
      for (const auto& xyz : nc::course_of(*arc, c.numbers.axes, 0.001).xyz_mm) {
        const Vec3 from = tips.at(xyz) - circle.center;
        const double height = from.dot(circle.axis);
        ASSERT_NEAR(height, 0.0, near);
        ASSERT_NEAR((from - height * circle.axis).norm(), circle.radius, near);
      }
    } else if (const auto* hole = std::get_if<nc::Hole>(&block)) {
      ASSERT_LT(holes, part.bores.size());
      const Bore& bore = part.bores[holes++];
      tips.rotary(hole->words);
      double deepest = 0.0;
      for (const nc::Stroke& s : nc::strokes_of(*hole, c.cycles, c.numbers.axes)) {
        const Vec3 from = tips.at(s.xyz_mm) - bore.top;
        const double height = from.dot(bore.axis);
        if (height <= bore.clear + near) {
          ASSERT_LT((from - height * bore.axis).norm(), near);
        }
        ASSERT_GE(height, -bore.depth - near);
        deepest = std::max(deepest, -height);
      }
      ASSERT_NEAR(deepest, bore.depth, near);
    }
  }
  EXPECT_EQ(arcs, part.circles.size());
  EXPECT_EQ(holes, part.bores.size());
}

struct ShapeKind {
  std::string name, words;
  nc::Hole::Kind kind;
};
const std::vector<ShapeKind> kShapeKinds = {{"drill", "DRILL", nc::Hole::Kind::drill},
                                            {"dwell", "DRILL,DWELL,0.5", nc::Hole::Kind::drill},
                                            {"peck", "DEEP,STEP,2.5", nc::Hole::Kind::peck},
                                            {"chip_break", "BRKCHP,STEP,2.5", nc::Hole::Kind::chip_break},
                                            {"feed_out", "REAM", nc::Hole::Kind::feed_out}};

TEST(LongShapes, RandomOnesAtRandomTiltsOnEveryMachineReadBackAsTheyWereMeant) {
  unsigned seed = 1;
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    for (const std::string control :
         {"linuxcnc", "fanuc_30i", "haas_ngc", "siemens_840d_sl", "heidenhain_tnc640"}) {
      const nc::Controller c = with_axes_of(machine, test::shipped_controller(control));
      for (const ShapeKind& kind : kShapeKinds) {
        nc::Hole hole;
        hole.kind = kind.kind;
        hole.dwell_ms = kind.name == "dwell" ? 500 : 0;
        SCOPED_TRACE(name + " " + control + " " + kind.name);
        Part part = random_part(++seed, kind.words, 12.0, 3.0);
        const auto p = test::posted(part.cl, machine, native(), control);
        ASSERT_TRUE(p.report) << p.report.error().text();
        EXPECT_TRUE(p.report->verification->passed()) << figures(*p.report->verification);
        if (c.cycles.words(hole).empty()) {
          EXPECT_EQ(p.report->holes, 0U);
          part.bores.clear();
        }
        expect_the_shapes(p.nc, part, machine, control);
        if (HasFatalFailure()) FAIL() << part.cl << p.nc;
        const auto again = test::verified(p.nc, part.cl, machine, 0.01, control);
        ASSERT_TRUE(again);
        EXPECT_TRUE(again->passed());
      }
    }
  }
}

// The arcs of a program for LinuxCNC at this share of their F; what follows keeps its own.
std::string with_slower_arcs(const std::string& nc, double share, std::size_t& arcs) {
  std::string out;
  double feed = 0.0;
  bool says_feed = false;
  std::istringstream lines(nc);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t at = line.rfind(" F");
    if (at != std::string::npos) feed = std::stod(line.substr(at + 2));
    const std::string words = line.substr(0, at);
    const bool is_arc = line.starts_with("G2 ") || line.starts_with("G3 ");
    arcs += is_arc ? 1U : 0U;
    if (is_arc || (says_feed && line.starts_with("G1 ")))
      line = words + " F" + fixed_text(is_arc ? share * feed : feed, 3);
    says_feed = is_arc;
    out += line + "\n";
  }
  return out;
}

// One F is that of a whole arc: where an axis is too slow for the feed it is slow where that axis stands,
// too.
TEST(Shapes, AxesMayBeTooSlowForTheFeed) {
  std::mt19937_64 random(20261128);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  std::size_t slow = 0;
  std::size_t arcs = 0;
  for (const std::string& name : test::shipped_machines()) {
    for (int i = 0; i < test::cases(10); ++i) {
      Machine machine = test::shipped_machine(name);
      for (Axis& axis : machine.axes) {
        if (axis.kind != AxisKind::linear) continue;
        axis.max_feed = 1.0 + 7.0 * u(random);
        if (i % 2 == 0) axis.acceleration = 100.0 + 900.0 * u(random);
      }
      const std::string control = i % 3 == 0 ? "linuxcnc" : i % 3 == 1 ? "heidenhain_tnc640" : "fanuc_30i";
      SCOPED_TRACE(name + " " + control + " " + std::to_string(i));
      const Part part =
          random_part(static_cast<unsigned>(random() % 100000), kShapeKinds[random() % 5].words, 12.0, 3.0);
      const auto p = test::posted(part.cl, machine, native(), control);
      ASSERT_TRUE(p.report) << p.report.error().text();
      EXPECT_TRUE(p.report->verification->passed()) << figures(*p.report->verification) << part.cl << p.nc;
      slow += p.report->feed_time_lost_s > 1.0 ? 1U : 0U;
      if (control != "linuxcnc") continue;
      std::size_t in_text = 0;
      const std::string edited = with_slower_arcs(p.nc, 0.8, in_text);
      arcs += in_text;
      if (in_text == 0) continue;
      const auto of_edited = test::verified(edited, part.cl, machine, 0.01, control);
      ASSERT_TRUE(of_edited);
      EXPECT_FALSE(of_edited->passed()) << part.cl << edited;
      // The editing itself is nothing that is found.
      const auto of_same =
          test::verified(with_slower_arcs(p.nc, 1.0, in_text), part.cl, machine, 0.01, control);
      ASSERT_TRUE(of_same);
      EXPECT_TRUE(of_same->passed()) << part.cl << edited;
    }
  }
  EXPECT_GT(slow, 0U);
  EXPECT_GT(arcs, 0U);
}

// Points of inches to four decimals: the tops of holes in a tilted face differ by a micrometre, and so do the
// heights to which a cycle clears them.
TEST(LongShapes, HolesOfATiltedFaceMayBeAMicrometreApart) {
  std::mt19937_64 random(20261129);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  for (int i = 0; i < test::cases(200); ++i) {
    const std::string name = i % 2 == 0 ? "trunnion_offset" : "xyzac_trt";
    const std::string control = i % 3 == 0 ? "linuxcnc" : i % 3 == 1 ? "haas_ngc" : "siemens_840d_sl";
    const Vec3 axis = rounded(Vec3(0.5 * u(random), 0.5 * u(random), 1.0).normalized(), 1e-9);
    const Vec3 along = axis.cross(Vec3(u(random), 1.0, u(random))).normalized();
    const auto hole = [&](double mm, double up_mm = 0.0) {
      const Vec3 at = (Vec3(20.0, 10.0, 5.0) + mm * along + up_mm * axis) / 25.4;
      return "GOTO/" + numbers(at, 4) + "," + numbers(axis, 9) + "\n";
    };
    const double second = 5.0 + u(random), third = 10.0 + u(random);
    const auto cl_with = [&](double up_mm) {
      return "UNITS/INCHES\nRAPID\n" + hole(0.0) + "CYCLE/DRILL,0.315,IPM,7.874,0.079\n" + hole(0.0) +
             hole(second) + hole(third, up_mm) + "CYCLE/OFF\nRAPID\n" + hole(0.0) + "\nFINI\n";
    };
    const std::string cl = cl_with(0.0);
    const auto p = test::posted(cl, test::shipped_machine(name), native(), control);
    ASSERT_TRUE(p.report) << p.report.error().text();
    EXPECT_TRUE(p.report->verification->passed()) << figures(*p.report->verification) << cl << p.nc;
    for (const double up_mm : {-0.05, 0.05}) {
      const auto of_other = test::verified(p.nc, cl_with(up_mm), test::shipped_machine(name), 0.01, control);
      ASSERT_TRUE(of_other);
      EXPECT_FALSE(of_other->passed()) << cl_with(up_mm) << p.nc;
    }
  }
}

// The step is as deep as the hole, or deeper: one stroke, whatever the control counts from.
TEST(Shapes, OneStepIsADrilledHole) {
  for (const std::string control :
       {"linuxcnc", "haas_ngc", "fanuc_30i", "siemens_840d_sl", "heidenhain_tnc640"}) {
    for (const char* words : {"DEEP,STEP,4", "BRKCHP,STEP,2.5", "DEEP,STEP,9"}) {
      const Machine machine = test::shipped_machine("trunnion_offset");
      const Part part = random_part(7, words, 2.5, 3.0);
      const auto p = test::posted(part.cl, machine, native(), control);
      SCOPED_TRACE(control + " " + words);
      ASSERT_TRUE(p.report) << p.report.error().text();
      EXPECT_TRUE(p.report->verification->passed()) << figures(*p.report->verification) << p.nc;
      expect_the_shapes(p.nc, part, machine, control);
      for (const nc::Block& block :
           test::nc_blocks(with_axes_of(machine, test::shipped_controller(control)), p.nc)) {
        const auto* hole = std::get_if<nc::Hole>(&block);
        EXPECT_TRUE(hole == nullptr || hole->kind == nc::Hole::Kind::drill);
      }
    }
  }
}

// A control counts the steps from the clearance: little may be left to the last one.
TEST(LongShapes, TheLastStepMayBeLessThanTheTolerance) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  for (const std::string control :
       {"linuxcnc", "haas_ngc", "fanuc_30i", "siemens_840d_sl", "heidenhain_tnc640"}) {
    for (const std::string words : {"DEEP,STEP,2.5", "BRKCHP,STEP,2.5"}) {
      for (const double left_mm : {0.0, 0.001, 0.002, 0.009, 0.02, 2.49, 2.495, 2.499}) {
        const Part part = random_part(11, words, 9.5 + left_mm, 3.0);
        const auto p = test::posted(part.cl, machine, native(), control);
        SCOPED_TRACE(control + " " + words + " " + std::to_string(left_mm));
        ASSERT_TRUE(p.report) << p.report.error().text();
        EXPECT_TRUE(p.report->verification->passed()) << figures(*p.report->verification);
        for (const double other_mm : {-0.03, 0.03}) {
          const Part other = random_part(11, words, 9.5 + left_mm + other_mm, 3.0);
          const auto of_other = test::verified(p.nc, other.cl, machine, 0.01, control);
          ASSERT_TRUE(of_other);
          EXPECT_FALSE(of_other->passed()) << other_mm;
        }
      }
    }
  }
}

bool passes(const std::string& text, const std::string& cl, const Machine& machine, const nc::Controller& c) {
  VerifyOptions options;
  Diagnostics d;
  const auto report = verify({std::make_unique<test::TextOf>(cl), "part.cls"},
                             {std::make_unique<test::TextOf>(text), "part.nc"}, {machine, c, options}, d);
  return report && report->passed() && !d.has_errors();
}

TEST(Shapes, InTheControlsPlaneAndUnderToolCentrePointControl) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  for (const std::string control : {"fanuc_30i", "siemens_840d_sl", "heidenhain_tnc640"}) {
    SCOPED_TRACE(control);
    PostOptions options = native();
    options.tilted_plane = true;
    const Part part = random_part(77, "DEEP,STEP,2.5", 12.0, 3.0);
    const auto p = test::posted(part.cl, machine, options, control);
    ASSERT_TRUE(p.report) << p.report.error().text();
    EXPECT_TRUE(p.report->verification->passed());
    EXPECT_EQ(p.report->arcs, part.circles.size());
    EXPECT_EQ(p.report->holes, part.bores.size());
    EXPECT_GT(p.report->tilted_planes, 0U);
    EXPECT_TRUE(passes(p.nc, part.cl, machine, with_axes_of(machine, test::shipped_controller(control))));
  }
  // Under tool-centre-point control X and Y are those of the part: circles about its Z only, and no cycles.
  PostOptions options = native();
  options.rtcp = true;
  options.feed = FeedOutput::tip;
  const Part tilted = random_part(78, "DRILL", 12.0, 3.0);
  const auto moves = test::posted(tilted.cl, machine, options, "linuxcnc");
  ASSERT_TRUE(moves.report);
  EXPECT_EQ(moves.report->arcs + moves.report->holes, 0U);
  EXPECT_EQ(moves.report->shapes_as_moves, tilted.circles.size() + tilted.bores.size());
  const Part upright = random_part(79, "DRILL", 12.0, 3.0, 2, 0.0);
  const auto arcs = test::posted(upright.cl, machine, options, "linuxcnc");
  ASSERT_TRUE(arcs.report);
  EXPECT_TRUE(arcs.report->verification->passed());
  EXPECT_EQ(arcs.report->arcs, upright.circles.size());
  EXPECT_EQ(arcs.report->holes, 0U);
}

// Every word of every arc and cycle, changed by 0.05 mm (centres by 0.2: an arc between two ends hardly
// moves).
TEST(Shapes, AChangedWordIsFound) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const nc::Controller c = test::shipped_controller("linuxcnc");
  const Part part = random_part(5, "DEEP,STEP,2.5", 12.0, 3.0, 2);
  const auto p = test::posted(part.cl, machine, native());
  ASSERT_TRUE(p.report);
  ASSERT_TRUE(passes(p.nc, part.cl, machine, c));
  std::size_t changed = 0;
  for (std::size_t begin = 0, end = p.nc.find('\n'); end != std::string::npos;
       begin = end + 1, end = p.nc.find('\n', begin)) {
    const std::string line = p.nc.substr(begin, end - begin);
    const bool arc = line.starts_with("G2 ") || line.starts_with("G3 ");
    if (!arc && line.find("G83") == std::string::npos) continue;
    const auto found = [&](const std::string& other) {
      std::string text = p.nc;
      text.replace(begin, end - begin, other);
      ++changed;
      EXPECT_FALSE(passes(text, part.cl, machine, c)) << line << "\n" << other;
    };
    for (const char letter : arc ? std::string("XYIJ") : std::string("XYZR")) {
      const std::size_t at = line.find(std::string(" ") + letter) + 2;
      const std::size_t size = std::min(line.find(' ', at), line.size()) - at;
      const double by = letter == 'I' || letter == 'J' ? 0.2 : 0.05;
      found(line.substr(0, at) + fixed_text(std::stod(line.substr(at, size)) + by, 4) +
            line.substr(at + size));
    }
    if (arc) found((line[1] == '2' ? "G3" : "G2") + line.substr(2));
    if (arc) continue;
    std::string at_once = line.substr(0, line.find(" Q")) + line.substr(line.find(" F"));
    at_once.replace(at_once.find("G83"), 3, "G81");
    found(at_once);
  }
  EXPECT_GE(changed, 30U);
}

TEST(Shapes, ARapidIntoWhatIsNotDrilledIsFound) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  nc::Controller c = test::shipped_controller("linuxcnc");
  const Part part = random_part(6, "DEEP,STEP,2.5", 12.0, 3.0, 1);
  const auto p = test::posted(part.cl, machine, native());
  ASSERT_TRUE(p.report);
  EXPECT_TRUE(passes(p.nc, part.cl, machine, c));
  c.cycles.back_mm = -0.5;
  EXPECT_FALSE(passes(p.nc, part.cl, machine, c));
}

// Shorter than a digit: as an arc its end would be its start, and that is a whole circle.
TEST(Shapes, AnArcThatRoundingClosesIsNoCircle) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string cl =
      "LOADTL/1\nFEDRAT/MMPM,600\nRAPID\nGOTO/15,0,5,0,0,1\nGOTO/15,0,0,0,0,1\nCIRCLE/0,0,0,0,0,1\n"
      "GOTO/15,0.00004,0,0,0,1\nGOTO/15,5,0,0,0,1\nFINI\n";
  const auto p = test::posted(cl, machine, native());
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_TRUE(p.report->verification->passed());
  EXPECT_EQ(p.report->arcs, 0U);
  EXPECT_EQ(p.report->shapes_as_moves, 1U);
}

// The control's words hold no arc between corrected ends, and none whose rounding takes the tolerance.
TEST(Shapes, WhatTheWordsCannotHoldGoesOutAsMoves) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const Part part = random_part(7, "DEEP,STEP,2.5,1STPECK,4", 12.0, 3.0, 2);
  const auto first = test::posted(part.cl, machine, native());
  ASSERT_TRUE(first.report);
  EXPECT_EQ(first.report->holes, 0U);
  EXPECT_EQ(first.report->arcs, part.circles.size());
  EXPECT_TRUE(first.report->verification->passed());

  PostOptions tight = native();
  tight.tolerance_mm = 0.002;  // three decimals
  const auto coarse = test::posted(part.cl, machine, tight, "fanuc_30i");
  ASSERT_TRUE(coarse.report);
  EXPECT_TRUE(coarse.report->verification->passed())
      << coarse.report->verification->certified_tip_deviation_mm;

  const auto none = test::posted(part.cl, machine, native(), "hnc_8");
  if (none.report) {
    EXPECT_EQ(none.report->arcs + none.report->holes, 0U);
  }

  // Unless they are asked for, as ever.
  const auto plain = test::posted(part.cl, machine);
  ASSERT_TRUE(plain.report);
  EXPECT_EQ(plain.report->arcs + plain.report->holes + plain.report->shapes_as_moves, 0U);
  EXPECT_THAT(plain.nc, ::testing::Not(::testing::ContainsRegex("\n(G2|G3|G8[1-9]) ")));
}

}  // namespace
}  // namespace trunnion::post
