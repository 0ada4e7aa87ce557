// The tool above its tip: how far its axis is off that of the path where the tip is, and how far its flute is
// off its place, held against a chain of the tests' own.
#include <cctype>
#include <cstdio>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <regex>
#include <set>
#include <sstream>
#include <tuple>

#include "post/own_chain.hpp"
#include "post/posting.hpp"
#include "support/cases.hpp"

namespace trunnion::post {
namespace {

using test::PlacedTool;

constexpr double kFluteTolerance_mm = 0.005;

// Round a leading edge: the tip goes round an arc of `radius_mm`, while the axis turns over it, out of step.
std::vector<PlacedTool> leading_edge(std::mt19937_64& random, double radius_mm) {
  const auto any = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const Vec3 centre(any(20.0, 60.0), any(-40.0, 40.0), any(5.0, 20.0));
  const double tilt = any(25.0, 45.0) * kRadPerDegree;
  const double swing = any(15.0, 30.0) * kRadPerDegree;
  const double late = any(0.2, 0.6);
  const double start = any(0.0, kTwoPi);
  std::vector<PlacedTool> path;
  constexpr int kPoints = 24;
  for (int i = 0; i <= kPoints; ++i) {
    const double x = static_cast<double>(i) / kPoints;
    const double round = kPi * x;
    const double share = std::clamp((x - late * 0.5) / (1.0 - late * 0.5), 0.0, 1.0);
    // With the decimals of point_text.
    const Vec3 tip = centre + radius_mm * Vec3(std::cos(round), std::sin(round), 0.1 * x);
    path.push_back({(1e4 * tip).array().round() / 1e4,
                    test::tilted(tilt + 0.3 * swing * share * share, start + swing * share * share)});
  }
  return path;
}

std::string flute_cl(const std::vector<PlacedTool>& path) {
  std::string out = "UNITS/MM\nLOADTL/1\nFEDRAT/250.,MMPM\n";
  for (const PlacedTool& p : path) out += test::point_text(p.tip, p.axis);
  return out + "FINI\n";
}

// At the place of the segment from `a` to `b` at which tip and flute end are nearest together: samples, then
// samples about the best one.
double least_off_mm(const PlacedTool& p, const PlacedTool& a, const PlacedTool& b, double flute_mm) {
  const double angle = std::atan2(a.axis.cross(b.axis).norm(), a.axis.dot(b.axis));
  const auto off = [&](double t) {
    const Vec3 axis =
        angle < 1e-9
            ? a.axis
            : Vec3((std::sin((1.0 - t) * angle) * a.axis + std::sin(t * angle) * b.axis) / std::sin(angle));
    const Vec3 tip = p.tip - a.tip - t * (b.tip - a.tip);
    return std::max(tip.norm(), (tip + flute_mm * (p.axis - axis)).norm());
  };
  constexpr int kSamples = 40;
  double at = 0.0;
  double width = 1.0;
  for (int round = 0; round < 6; ++round) {
    const double from = std::max(0.0, at - width);
    const double to = std::min(1.0, at + width);
    for (int i = 0; i <= kSamples; ++i) {
      const double t = from + (to - from) * i / kSamples;
      if (off(t) < off(at)) at = t;
    }
    width = 2.0 * (to - from) / kSamples;
  }
  return off(at);
}

struct FluteTruth {
  double axis_deg = 0.0;
  double flute_mm = 0.0;       // at the place nearest to the tip, the tip's own distance included
  double best_flute_mm = 0.0;  // at the place where tip and flute are nearest together
};

// Of all samples of the tool, with the path's place the one nearest to the tip; the path is followed from
// point to point, each of which ends a block.
FluteTruth sampled(const std::vector<PlacedTool>& tool, const std::vector<PlacedTool>& path,
                   double flute_mm) {
  FluteTruth out;
  std::size_t j = 0;
  for (const PlacedTool& p : tool) {
    const auto place = [&](std::size_t k) {
      const Vec3 d = path[k + 1].tip - path[k].tip;
      return std::clamp((p.tip - path[k].tip).dot(d) / d.squaredNorm(), 0.0, 1.0);
    };
    const auto off = [&](std::size_t k) {
      return (p.tip - path[k].tip - place(k) * (path[k + 1].tip - path[k].tip)).norm();
    };
    if (j + 2 < path.size() && off(j + 1) < off(j)) ++j;
    const Vec3& a = path[j].axis;
    const Vec3& b = path[j + 1].axis;
    const double angle = std::atan2(a.cross(b).norm(), a.dot(b));
    const auto axis_at = [&](double t) {
      if (angle < 1e-9) return a;
      return Vec3((std::sin((1.0 - t) * angle) * a + std::sin(t * angle) * b) / std::sin(angle));
    };
    const auto tip_at = [&](double t) { return Vec3(path[j].tip + t * (path[j + 1].tip - path[j].tip)); };
    const auto off_flute = [&](double t) {
      return (p.tip - tip_at(t) + flute_mm * (p.axis - axis_at(t))).norm();
    };
    const double foot = place(j);
    const Vec3 axis = axis_at(foot);
    out.axis_deg =
        std::max(out.axis_deg, std::atan2(p.axis.cross(axis).norm(), p.axis.dot(axis)) * kDegreePerRad);
    out.flute_mm = std::max({out.flute_mm, off_flute(foot), off(j)});
    double best_mm = off_flute(foot);
    // On this segment or on a neighbour of it.
    for (std::size_t k = j > 0 ? j - 1 : 0; k <= std::min(j + 1, path.size() - 2); ++k)
      best_mm = std::min(best_mm, least_off_mm(p, path[k], path[k + 1], flute_mm));
    out.best_flute_mm = std::max(out.best_flute_mm, best_mm);
  }
  return out;
}

VerifyReport verified_with_flute(const std::string& nc, const std::string& cl, const Machine& machine,
                                 double flute_mm) {
  const nc::Controller c = post::with_axes_of(machine, test::shipped_controller("linuxcnc"));
  VerifyOptions options;
  options.tolerance_mm = kFluteTolerance_mm;
  options.tools.flute_mm = flute_mm;
  Diagnostics d;
  auto report = verify({std::make_unique<test::TextOf>(cl), "part.cls"},
                       {std::make_unique<test::TextOf>(nc), "part.nc"}, {machine, c, options}, d);
  if (!report) throw std::runtime_error(report.error().text());
  return *report;
}

// Of all paths on one machine.
struct EdgeFigures {
  double before_mm = 0.0;
  double after_mm = 0.0;
  std::size_t points_before = 0;
  std::size_t points = 0;
};

// Round leading edges on four machines, words of four decimals in degrees: what is posted for a flute holds
// for it, and for its tip, judged by the tests' own chain; without a flute it does not.
TEST(LongFlute, ProgramsHoldTheirFlute) {
  const int seeds = test::cases(5, "TRUNNION_CASES");
  double beyond_mm = 0.0;
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    const test::OwnChain chain = test::own_chain(name);
    std::map<double, EdgeFigures> figures;
    for (int seed = 0; seed < seeds; ++seed) {
      std::mt19937_64 random(static_cast<unsigned>(seed) + 71);
      const auto path = leading_edge(random, std::uniform_real_distribution<double>(0.4, 1.5)(random));
      const std::string cl = flute_cl(path);
      for (const double flute_mm : {15.0, 50.0}) {
        PostOptions options;
        options.tolerance_mm = kFluteTolerance_mm;
        options.tools.flute_mm = flute_mm;
        const auto p = test::posted(cl, machine, options);
        ASSERT_TRUE(p.report) << name << " " << seed << ": " << p.report.error().text();
        ASSERT_TRUE(p.report->verification);
        EXPECT_TRUE(p.report->verification->passed()) << name << " " << seed;
        EXPECT_EQ(p.report->verification->flute_mm, flute_mm);
        EXPECT_EQ(p.report->segments_not_converged, 0U) << name << " " << seed;
        const FluteTruth truth = sampled(test::tool_of(test::cut_of(p.nc, chain), chain), path, flute_mm);
        EXPECT_LE(truth.best_flute_mm, kFluteTolerance_mm + 1e-6) << name << " " << seed << " " << flute_mm;
        EXPECT_LE(truth.best_flute_mm, p.report->verification->certified_flute_deviation_mm + 1e-6);
        options.tools.flute_mm = 0.0;
        const auto tip = test::posted(cl, machine, options);
        ASSERT_TRUE(tip.report);
        const double before_mm =
            sampled(test::tool_of(test::cut_of(tip.nc, chain), chain), path, flute_mm).best_flute_mm;
        beyond_mm = std::max(beyond_mm, before_mm);
        EdgeFigures& f = figures[flute_mm];
        f.before_mm = std::max(f.before_mm, before_mm);
        f.after_mm = std::max(f.after_mm, truth.best_flute_mm);
        f.points += p.report->points_inserted;
        f.points_before += tip.report->points_inserted;
      }
    }
    for (const auto& [flute_mm, f] : figures) {
      std::printf(
          "[ figures  ] %s, %.0f mm up: %.2f um off before, %.2f um with the flute; %zu points before, %zu\n",
          name.c_str(), flute_mm, 1e3 * f.before_mm, 1e3 * f.after_mm, f.points_before, f.points);
    }
  }
  EXPECT_GT(beyond_mm, 1.5 * kFluteTolerance_mm);
}

// What a page colours: of every block that is collected the flute's own figure, not only that of the worst.
// The tests' own chain finds no more anywhere on it, and the largest is the report's, collected or not.
TEST(Flute, EveryCollectedBlockHasItsOwnFigure) {
  constexpr double kFlute_mm = 30.0;
  const std::string name = "trunnion_offset";
  const Machine machine = test::shipped_machine(name);
  const test::OwnChain chain = test::own_chain(name);
  std::mt19937_64 random(91);
  const auto path = leading_edge(random, 1.0);
  PostOptions options;
  options.tolerance_mm = kFluteTolerance_mm;
  options.tools.flute_mm = kFlute_mm;
  const auto without = test::posted(flute_cl(path), machine, options);
  options.collect = true;
  const auto p = test::posted(flute_cl(path), machine, options);
  ASSERT_TRUE(p.report && without.report);
  EXPECT_EQ(p.nc, without.nc);
  const VerifyReport& report = *p.report->verification;
  EXPECT_EQ(report.certified_flute_deviation_mm, without.report->verification->certified_flute_deviation_mm);
  std::map<std::size_t, double> of_line;
  double largest_mm = 0.0;
  std::size_t below = 0;
  for (const VerifiedBlock& block : report.blocks) {
    if (block.rapid) continue;
    of_line[block.nc_line] = static_cast<double>(block.flute_deviation_mm);
    largest_mm = std::max(largest_mm, of_line[block.nc_line]);
    if (of_line[block.nc_line] < 0.8 * report.certified_flute_deviation_mm) ++below;
  }
  EXPECT_NEAR(largest_mm, report.certified_flute_deviation_mm, 1e-6);
  EXPECT_GT(below, 0U);
  const test::Cut cut = test::cut_of(p.nc, chain);
  constexpr int kPieces = 4;
  std::size_t compared = 0;
  for (std::size_t i = 1; i < cut.ends.size(); ++i) {
    const auto known = of_line.find(cut.line[i] + 1);
    if (known == of_line.end()) continue;
    for (int k = 1; k <= kPieces; ++k) {
      test::FiveWords w{};
      for (std::size_t n = 0; n < w.size(); ++n)
        w[n] = cut.ends[i - 1][n] + (cut.ends[i][n] - cut.ends[i - 1][n]) * k / kPieces;
      const PlacedTool tool = test::in_part(w, chain);
      double off_mm = std::numeric_limits<double>::infinity();
      for (std::size_t j = 0; j + 1 < path.size(); ++j)
        off_mm = std::min(off_mm, least_off_mm(tool, path[j], path[j + 1], kFlute_mm));
      EXPECT_LE(off_mm, known->second + 1e-6) << "NC line " << cut.line[i] + 1;
      ++compared;
    }
  }
  EXPECT_GT(compared, 100U);
}

// A blade's pass with its points close together.
std::vector<PlacedTool> dense_blade(double twist) {
  constexpr int kPoints = 200;
  std::vector<PlacedTool> path;
  for (int i = 0; i < kPoints; ++i) {
    const double x = static_cast<double>(i) / (kPoints - 1);
    const Vec3 tip(30.0 + 30.0 * x, 20.0 * std::sin(2.0 * x), -20.0 * x);
    path.push_back({(1e4 * tip).array().round() / 1e4,
                    test::tilted(0.5 + 0.5 * x + 0.1 * std::sin(9.0 * x), 3.0 * twist * x)});
  }
  return path;
}

// Where points are dropped a block may be nearer to one segment before a CL point and to the next behind it:
// a bound that straddles the tolerance is decided, and no program refused for it.
TEST(Flute, ThinnedBladesAreNotRefused) {
  std::mt19937_64 random(5);
  for (int i = 0; i < test::cases(24); ++i) {
    const std::string cl = flute_cl(dense_blade(std::uniform_real_distribution<double>(0.3, 1.2)(random)));
    for (const std::string& name : test::shipped_machines()) {
      PostOptions options;
      options.tolerance_mm = kFluteTolerance_mm;
      options.axis_tolerance = Angle::degrees(2.0);
      options.tools.flute_mm = i % 2 == 0 ? 30.0 : 50.0;
      options.nonlinear.thin = true;
      const auto p = test::posted(cl, test::shipped_machine(name), options);
      ASSERT_TRUE(p.report) << name << " " << i << ": " << p.report.error().text();
      ASSERT_TRUE(p.report->verification);
      EXPECT_TRUE(p.report->verification->passed())
          << name << " " << i << ": " << p.report->verification->certified_flute_deviation_mm;
    }
  }
}

// Rotary axes that are tilted by 100 urad: with a flute length the direction of the tool is corrected, too.
// Words of four decimals and of three, in the tests' own chain with the same tilts.
TEST(Flute, TiltedAxesAreCorrected) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const Model model = test::model_of(
      "[[effect]]\nid = \"location:A\"\n[effect.parameters]\nB0A_urad = 100.0\nC0A_urad = -80.0\n"
      "[[effect]]\nid = \"location:C\"\n[effect.parameters]\nA0C_urad = -90.0\nB0C_urad = 110.0\n",
      machine);
  test::OwnChain chain = test::own_chain("trunnion_offset");
  chain.tilt = {Vec3(0.0, 100e-6, -80e-6), Vec3(-90e-6, 110e-6, 0.0)};
  constexpr double kFlute_mm = 50.0;
  for (const std::string control : {"linuxcnc", "fanuc_30i"}) {
    for (int seed = 0; seed < 5; ++seed) {
      std::mt19937_64 random(static_cast<unsigned>(seed) + 300);
      const auto path = leading_edge(random, std::uniform_real_distribution<double>(0.4, 1.5)(random));
      const std::string cl = flute_cl(path);
      const auto truth = [&](double flute_mm) {
        PostOptions options;
        options.tolerance_mm = kFluteTolerance_mm;
        options.tools.flute_mm = flute_mm;
        const auto p = test::posted(cl, machine, options, control, &model);
        EXPECT_TRUE(p.report && p.report->verification && p.report->verification->passed()) << seed;
        return sampled(test::tool_of(test::cut_of(p.nc, chain), chain), path, kFlute_mm).best_flute_mm;
      };
      EXPECT_LE(truth(kFlute_mm), kFluteTolerance_mm + 1e-6) << control << " " << seed;
      EXPECT_GT(truth(0.0), 1.4 * kFluteTolerance_mm) << control << " " << seed;
    }
  }
}

// Tilts of the tables near the pole, cuts with a fixed axis: what lies in the plane of A's tilt is taken out
// at the pole, too, the rest from a tilt of the root of it on. What no rotary axis can put right is said, and
// judged.
TEST(Flute, TiltedAxesAreCorrectedNearThePole) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  constexpr double kFlute_mm = 50.0;
  struct Case {
    double A0C_urad, B0A_urad;
    double tilt_deg;
    bool holds;
  };
  // The root of 200 urad is 0.81 deg.
  for (const Case& c :
       {Case{-200.0, 0.0, 0.0, true}, Case{-200.0, 0.0, 0.3, true}, Case{0.0, 200.0, 0.0, false},
        Case{0.0, 200.0, 0.3, false}, Case{0.0, 200.0, 0.9, true}, Case{-200.0, 200.0, 1.5, true},
        Case{-200.0, 200.0, 5.0, true}, Case{150.0, 60.0, 0.0, true}}) {
    const Model model = test::model_of(
        "[[effect]]\nid = \"location:A\"\n[effect.parameters]\nB0A_urad = " + fixed_text(c.B0A_urad, 1) +
            "\n[[effect]]\nid = \"location:C\"\n[effect.parameters]\nA0C_urad = " +
            fixed_text(c.A0C_urad, 1) + "\n",
        machine);
    test::OwnChain chain = test::own_chain("trunnion_offset");
    chain.tilt = {Vec3(0.0, 1e-6 * c.B0A_urad, 0.0), Vec3(1e-6 * c.A0C_urad, 0.0, 0.0)};
    std::vector<PlacedTool> path;
    for (int i = 0; i < 40; ++i) {
      const Vec3 tip(-20.0 + i, 10.0 + 2.0 * std::sin(0.2 * i), 5.0);
      path.push_back({(1e4 * tip).array().round() / 1e4, test::tilted(c.tilt_deg * kRadPerDegree, 0.3)});
    }
    PostOptions options;
    options.tolerance_mm = kFluteTolerance_mm;
    options.tools.flute_mm = kFlute_mm;
    const auto p = test::posted(flute_cl(path), machine, options, "linuxcnc", &model);
    ASSERT_TRUE(p.report) << p.report.error().text();
    const VerifyReport& v = *p.report->verification;
    EXPECT_EQ(v.passed(), c.holds) << c.tilt_deg << " " << v.certified_flute_deviation_mm;
    EXPECT_EQ(p.report->points_inserted, 0U) << c.tilt_deg;
    const double truth_mm =
        sampled(test::tool_of(test::cut_of(p.nc, chain), chain), path, kFlute_mm).best_flute_mm;
    EXPECT_LE(truth_mm, v.certified_flute_deviation_mm + 1e-6) << c.tilt_deg;
    EXPECT_LE(v.certified_flute_deviation_mm, 1.05 * truth_mm + 1e-4) << c.tilt_deg;
    // In the tilt's plane the words take it out but for their digits, across it nothing of it at the pole.
    if (c.holds && c.B0A_urad != 60.0) {
      EXPECT_LE(truth_mm, 1.3e-4) << c.tilt_deg;
    }
    if (c.tilt_deg == 0.0) {
      EXPECT_NEAR(truth_mm, 1e-6 * std::abs(c.B0A_urad) * kFlute_mm, 1.3e-4);
    }
    bool said = false;
    for (const auto& finding : p.diagnostics.findings())
      said = said || finding.text().find("the rotary axes cannot correct the tilt") != std::string::npos;
    EXPECT_EQ(said, !c.holds) << c.tilt_deg;
  }
}

// In the pole's cone the tool may be tilted on purpose: its flute has what that moves its end by, and no
// more.
// On a way between two cuts the rotary axes go straight, far from the great circle between its ends. What the
// errors turn the tool by is taken out there as well, and nothing else.
TEST(Flute, RapidsKeepTheirCourseWhenTheDirectionIsCorrected) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const Model model = test::model_of(
      "[[effect]]\nid = \"location:A\"\n[effect.parameters]\nB0A_urad = 25.0\n"
      "[[effect]]\nid = \"location:C\"\n[effect.parameters]\nA0C_urad = 18.0\nB0C_urad = -9.0\n",
      machine);
  const std::string cl =
      "UNITS/MM\nMULTAX/ON\nLOADTL/4,ADJUST,4\nFEDRAT/MMPM,800.0\n"
      "GOTO/  -76.8814,   21.3819,  -41.9992, -0.964383,  0.066672,  0.255968\n"
      "GOTO/  -77.1707,   21.0875,  -42.0000, -0.965355,  0.055382,  0.254994\n"
      "RAPID\nGOTO/  -17.4666,    9.7426,   60.0000,  0.083580,  0.423970,  0.901811\n"
      "FEDRAT/MMPM,800.0\nGOTO/  -17.4666,    9.7426,    5.0000,  0.083580,  0.423970,  0.901811\nFINI\n";
  const auto rotary_words = [&](const Model* with) {
    PostOptions options;
    options.tolerance_mm = kFluteTolerance_mm;
    options.tools.flute_mm = 50.0;
    const auto p = test::posted(cl, machine, options, "linuxcnc", with);
    if (!p.report) throw std::runtime_error(p.report.error().text());
    std::vector<double> out;
    const std::regex word("[AC](-?[0-9.]+)");
    for (std::sregex_iterator i(p.nc.begin(), p.nc.end(), word); i != std::sregex_iterator(); ++i)
      out.push_back(std::stod((*i)[1]));
    return out;
  };
  const std::vector<double> nominal = rotary_words(nullptr);
  const std::vector<double> corrected = rotary_words(&model);
  ASSERT_GT(nominal.size(), 12U);
  ASSERT_EQ(nominal.size(), corrected.size());
  for (std::size_t i = 0; i < nominal.size(); ++i) EXPECT_NEAR(nominal[i], corrected[i], 0.02) << i;
}

TEST(Flute, TheConeHasAToleranceOfItsOwn) {
  constexpr double kFlute_mm = 50.0;
  std::vector<PlacedTool> path;
  for (int k = -30; k <= 30; ++k) {
    const double j = std::sin(0.2 * kRadPerDegree);
    path.push_back({{30.0 + 0.4 * k, 40.0, 0.0}, Vec3(0.003 * k, j, std::sqrt(1.0 - 9e-6 * k * k - j * j))});
  }
  const std::string cl = flute_cl(path);
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    const test::OwnChain chain = test::own_chain(name);
    PostOptions options;
    options.tolerance_mm = kFluteTolerance_mm;
    options.tools.flute_mm = kFlute_mm;
    options.pole.tolerance = Angle::degrees(0.25);
    const auto p = test::posted(cl, machine, options);
    ASSERT_TRUE(p.report) << name << p.report.error().text();
    const VerifyReport& v = *p.report->verification;
    EXPECT_TRUE(v.passed()) << name << flute_text(v);
    EXPECT_EQ(p.report->pole_stretches, 1U) << name;
    EXPECT_NEAR(v.pole_flute_tolerance_mm, kFluteTolerance_mm + kFlute_mm * 0.25 * kRadPerDegree, 1e-6);
    const double truth_mm =
        sampled(test::tool_of(test::cut_of(p.nc, chain), chain), path, kFlute_mm).best_flute_mm;
    EXPECT_GT(truth_mm, 0.5 * kFlute_mm * 0.2 * kRadPerDegree) << name;
    EXPECT_GE(v.certified_pole_flute_deviation_mm, truth_mm - 1e-6) << name;
    EXPECT_LE(v.certified_pole_flute_deviation_mm, 1.05 * truth_mm + 1e-4) << name;
    // The same program where less is allowed.
    const nc::Controller c = post::with_axes_of(machine, test::shipped_controller("linuxcnc"));
    VerifyOptions less;
    less.tolerance_mm = kFluteTolerance_mm;
    less.tools.flute_mm = kFlute_mm;
    less.axis_tolerance = Angle::degrees(1.0);
    less.pole.tolerance = Angle::degrees(0.1);
    Diagnostics d;
    const auto stricter = verify({std::make_unique<test::TextOf>(cl), "part.cls"},
                                 {std::make_unique<test::TextOf>(p.nc), "part.nc"}, {machine, c, less}, d);
    ASSERT_TRUE(stricter) << name;
    EXPECT_FALSE(stricter->cuts_within_tolerance()) << name;
    EXPECT_GT(stricter->certified_pole_flute_deviation_mm, stricter->pole_flute_tolerance_mm) << name;
  }
}

// The same tilts, cuts with a fixed axis so that nothing else is in the figure: before, where the tip alone
// is corrected, the tilts; after it the digits of the words.
TEST(Flute, TiltedAxesLeaveTheDigitsOfTheWords) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const Model model = test::model_of(
      "[[effect]]\nid = \"location:A\"\n[effect.parameters]\nB0A_urad = 100.0\nC0A_urad = -100.0\n"
      "[[effect]]\nid = \"location:C\"\n[effect.parameters]\nA0C_urad = -100.0\nB0C_urad = 100.0\n",
      machine);
  test::OwnChain chain = test::own_chain("trunnion_offset");
  chain.tilt = {Vec3(0.0, 100e-6, -100e-6), Vec3(-100e-6, 100e-6, 0.0)};
  constexpr double kFlute_mm = 50.0;
  for (const auto& [control, digit_deg, digit_mm] :
       {std::tuple("linuxcnc", 1e-4, 1e-4), std::tuple("fanuc_30i", 1e-3, 1e-3)}) {
    double before_mm = 0.0;
    double after_mm = 0.0;
    for (int seed = 0; seed < 20; ++seed) {
      std::mt19937_64 random(static_cast<unsigned>(seed) + 900);
      const auto any = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
      };
      const Vec3 axis = test::tilted(any(5.0, 85.0) * kRadPerDegree, any(0.0, kTwoPi));
      const Vec3 from(any(-60.0, 60.0), any(-60.0, 60.0), any(0.0, 40.0));
      std::vector<PlacedTool> path;
      for (int i = 0; i < 20; ++i) {
        const Vec3 tip = from + Vec3(i, 0.3 * i, -0.2 * i);
        path.push_back({(1e4 * tip).array().round() / 1e4, axis});
      }
      const auto truth = [&](double flute_mm) {
        PostOptions options;
        options.tolerance_mm = kFluteTolerance_mm;
        options.tools.flute_mm = flute_mm;
        const auto p = test::posted(flute_cl(path), machine, options, control, &model);
        EXPECT_TRUE(p.report && p.report->verification && p.report->verification->passed()) << seed;
        return sampled(test::tool_of(test::cut_of(p.nc, chain), chain), path, kFlute_mm).best_flute_mm;
      };
      before_mm = std::max(before_mm, truth(0.0));
      after_mm = std::max(after_mm, truth(kFlute_mm));
    }
    std::printf(
        "[ figures  ] tilts of 100 urad, words of %g deg and %g mm: %.2f um off at %.0f mm before, "
        "%.3f um after\n",
        digit_deg, digit_mm, 1e3 * before_mm, kFlute_mm, 1e3 * after_mm);
    // Half a digit of each axis.
    EXPECT_LE(after_mm, kFlute_mm * std::sqrt(0.5) * digit_deg * kRadPerDegree + std::sqrt(0.75) * digit_mm);
    EXPECT_GT(before_mm, 100e-6 * kFlute_mm);
  }
}

// The words of the machine's linear axes that put the tip at `tip` with the rotary words of `w`.
test::FiveWords with_tip(test::FiveWords w, Vec3 tip, const test::OwnChain& chain) {
  for (std::size_t k = 2; k-- > 0;)
    tip = test::turned(tip - chain.point[k], chain.axis[k], w[3 + k] * kRadPerDegree) + chain.point[k];
  for (Eigen::Index i = 0; i < 3; ++i) w[static_cast<std::size_t>(i)] = tip[i];
  return w;
}

// One word of the outer rotary axis wrong by 0.02 deg, alone or with words that leave the tip where it was:
// 17 micrometres at the end of the flute, of which a point on the other side of the path may take 5.
TEST(LongFlute, AChangedRotaryWordIsFoundEveryTime) {
  std::mt19937_64 random(77);
  int changed = 0;
  int found = 0;
  int found_by_tip = 0;
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    const test::OwnChain chain = test::own_chain(name);
    const auto path = dense_blade(0.8);
    const std::string cl = flute_cl(path);
    PostOptions options;
    options.tolerance_mm = kFluteTolerance_mm;
    options.tools.flute_mm = 50.0;
    const auto p = test::posted(cl, machine, options);
    ASSERT_TRUE(p.report && p.report->verification->passed()) << name;
    std::vector<std::string> lines;
    std::istringstream text(p.nc);
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    const test::Cut cut = test::cut_of(p.nc, chain);
    const auto place_of = [](const std::string& line, char letter) { return line.find(letter); };
    const auto has_all = [&](const std::string& line) {
      return std::all_of(chain.letters.begin(), chain.letters.end(),
                         [&](char letter) { return place_of(line, letter) != std::string::npos; });
    };
    for (int i = 0; i < test::cases(60); ++i) {
      const auto at = std::uniform_int_distribution<std::size_t>(5, cut.ends.size() - 5)(random);
      // What the next block does not say would stand where this one ends.
      if (!has_all(lines[cut.line[at]]) || !has_all(lines[cut.line[at + 1]])) continue;
      test::FiveWords words = cut.ends[at];
      const Vec3 tip = test::in_part(words, chain).tip;
      words[3] += i % 2 == 0 ? 0.02 : -0.02;
      const bool tip_stays = i % 4 < 2;
      if (tip_stays) words = with_tip(words, tip, chain);
      std::vector<std::string> wrong = lines;
      std::string& line = wrong[cut.line[at]];
      for (std::size_t k = 0; k < words.size(); ++k) {
        const std::size_t begin = place_of(line, chain.letters[k]) + 1;
        line.replace(begin, line.find_first_of(" \n", begin) - begin, fixed_text(words[k], 4));
      }
      std::string nc;
      for (const std::string& one : wrong) nc += one + "\n";
      ++changed;
      const VerifyReport v = verified_with_flute(nc, cl, machine, 50.0);
      const bool is_found = !v.cuts_within_tolerance();
      found += is_found;
      // An axis at 45 degrees turns the tool by less, and along the path: there it may stay within.
      if (name != "nutating_45") {
        EXPECT_TRUE(is_found) << name << " " << i << " " << line;
      } else if (!is_found) {
        EXPECT_LE(sampled(test::tool_of(test::cut_of(nc, chain), chain), path, 50.0).best_flute_mm,
                  kFluteTolerance_mm + 1e-6)
            << line;
      }
      found_by_tip += tip_stays && !verified_with_flute(nc, cl, machine, 0.0).cuts_within_tolerance();
    }
  }
  std::printf(
      "[ figures  ] %d words changed by 0.02 deg, %d found; of those that leave the tip %d without a flute\n",
      changed, found, found_by_tip);
  EXPECT_GT(changed, test::cases(100));
}

TEST(Flute, BoundsHoldAndAreNearToSamples) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const int seeds = test::cases(12, "TRUNNION_CASES");
  for (int seed = 0; seed < seeds; ++seed) {
    std::mt19937_64 random(static_cast<unsigned>(seed) + 5);
    const auto path = leading_edge(random, std::uniform_real_distribution<double>(0.4, 1.5)(random));
    const std::string cl = flute_cl(path);
    PostOptions options;
    options.tolerance_mm = kFluteTolerance_mm;
    const auto p = test::posted(cl, machine, options);
    ASSERT_TRUE(p.report) << p.report.error().text();
    const auto tool = test::tool_of(test::cut_of(p.nc));
    for (const double flute_mm : {15.0, 50.0}) {
      const VerifyReport v = verified_with_flute(p.nc, cl, machine, flute_mm);
      const FluteTruth truth = sampled(tool, path, flute_mm);
      // The place of the path runs evenly between those of the tip.
      EXPECT_GE(v.max_axis_deviation_at_tip.deg(), 0.96 * truth.axis_deg) << seed;
      EXPECT_LE(v.max_axis_deviation_at_tip.deg(), 1.1 * truth.axis_deg + 0.003) << seed;
      EXPECT_GE(v.certified_flute_deviation_mm, truth.best_flute_mm - 1e-6) << seed;
      EXPECT_LE(v.certified_flute_deviation_mm, 1.1 * truth.flute_mm + 1e-4) << seed;
      EXPECT_LE(v.max_flute_deviation_mm, v.certified_flute_deviation_mm) << seed;
      EXPECT_EQ(v.cuts_within_tolerance(), v.certified_flute_deviation_mm <= kFluteTolerance_mm) << seed;
      // The tip's own figures are not touched by it.
      const VerifyReport tip = verified_with_flute(p.nc, cl, machine, 0.0);
      EXPECT_TRUE(tip.passed()) << seed;
      EXPECT_EQ(tip.certified_flute_deviation_mm, 0.0);
    }
  }
}

// A turn of A alone about the tip's place, by 0.02 degrees: 17 micrometres 50 mm up.
TEST(Flute, ATurnOfTheAxisIsFoundAtItsEnd) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  std::string cl = "UNITS/MM\nLOADTL/1\nFEDRAT/250.,MMPM\n";
  for (int i = 0; i < 12; ++i) cl += test::point_text({30.0 + 2.0 * i, 10.0, 5.0}, test::tilted(0.5, 0.3));
  PostOptions options;
  options.tolerance_mm = kFluteTolerance_mm;
  const auto p = test::posted(cl + "FINI\n", machine, options);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_TRUE(verified_with_flute(p.nc, cl, machine, 50.0).passed());
  // The same path with the tool axis elsewhere: what the program of this one does to that path.
  std::string turned = "UNITS/MM\nLOADTL/1\nFEDRAT/250.,MMPM\n";
  for (int i = 0; i < 12; ++i) {
    const double by = i == 6 ? 0.02 * kRadPerDegree : 0.0;
    turned += test::point_text({30.0 + 2.0 * i, 10.0, 5.0}, test::tilted(0.5 + by, 0.3));
  }
  const VerifyReport v = verified_with_flute(p.nc, turned, machine, 50.0);
  EXPECT_FALSE(v.passed());
  // 17.5 um at the place of the tip; a little ahead on the path, where the tip is off too, the tool is
  // nearer.
  const auto at = [](int i, double by) {
    return PlacedTool{{30.0 + 2.0 * i, 10.0, 5.0}, test::tilted(0.5 + by, 0.3)};
  };
  const double turn = 0.02 * kRadPerDegree;
  const double nearest_mm = std::min(least_off_mm(at(6, 0.0), at(5, 0.0), at(6, turn), 50.0),
                                     least_off_mm(at(6, 0.0), at(6, turn), at(7, 0.0), 50.0));
  EXPECT_LT(nearest_mm, 50.0 * turn);
  std::vector<PlacedTool> path;
  for (int i = 0; i < 12; ++i) path.push_back(at(i, i == 6 ? turn : 0.0));
  const double truth_mm = sampled(test::tool_of(test::cut_of(p.nc)), path, 50.0).best_flute_mm;
  EXPECT_NEAR(truth_mm, nearest_mm, 0.05 * nearest_mm);
  EXPECT_GE(v.certified_flute_deviation_mm, truth_mm - 1e-6);
  EXPECT_LE(v.certified_flute_deviation_mm, 1.05 * truth_mm);
  EXPECT_NEAR(v.worst_flute.cl_line, 4 + 6, 1);
  // Of the program it is the line of that block, too: four of the cut's come behind it.
  std::istringstream lines(p.nc);
  std::string line;
  std::uint32_t number = 0;
  int behind = 0;
  while (std::getline(lines, line))
    behind += ++number > v.worst_flute.nc_line && line.find('X') != std::string::npos ? 1 : 0;
  EXPECT_GE(behind, 4);
  EXPECT_TRUE(verified_with_flute(p.nc, turned, machine, 0.0).passed());
}

// A cut with a fixed tool axis on a machine that tilts the more the farther X is: while the flute is held the
// rotary words stand still, so that the axes stay clamped; where it would not be they follow.
TEST(Flute, RotaryAxesStandStillInACutWithAFixedAxis) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  std::string cl = "UNITS/MM\nLOADTL/1\nFEDRAT/250.,MMPM\n";
  constexpr int kPoints = 200;
  for (int i = 0; i < kPoints; ++i)
    cl += test::point_text({-50.0 + 0.5 * i, 10.0, 5.0}, test::tilted(0.5, 0.3));
  cl += "FINI\n";
  // P1 is straight over the travel, of which the cut takes a twentieth.
  const auto posted_with = [&](double P1_urad) {
    const Model model = test::model_of(
        "[model]\nname = \"m\"\n[[effect]]\nid = \"component:EAX\"\n"
        "[effect.parameters]\nP1_urad = " +
            std::to_string(P1_urad) + "\n",
        machine);
    PostOptions options;
    options.tolerance_mm = 0.01;
    options.tools.flute_mm = 30.0;
    return test::posted(cl, machine, options, "linuxcnc", &model);
  };
  const auto rotary_words = [](const std::string& nc) {
    std::set<std::string> out;
    for (std::size_t at = nc.find(" A"); at != std::string::npos; at = nc.find(" A", at + 1))
      if (std::isdigit(static_cast<unsigned char>(nc[at + 2])) != 0 || nc[at + 2] == '-')
        out.insert(nc.substr(at, nc.find_first_of(" \n", at + 1) - at));
    return out;
  };
  const auto held = posted_with(1500.0);
  ASSERT_TRUE(held.report) << held.report.error().text();
  EXPECT_TRUE(held.report->verification->passed());
  EXPECT_GT(held.report->verification->certified_flute_deviation_mm, 0.0005);
  const std::size_t of_approach = rotary_words(posted_with(0.0).nc).size();
  EXPECT_EQ(rotary_words(held.nc).size(), of_approach);
  const auto followed = posted_with(8000.0);
  ASSERT_TRUE(followed.report) << followed.report.error().text();
  EXPECT_TRUE(followed.report->verification->passed());
  EXPECT_GT(rotary_words(followed.nc).size(), of_approach);
  EXPECT_LT(rotary_words(followed.nc).size(), of_approach + 8);  // one by one they would be some fifty
}

// What arcs of the control leave their chords by counts for the flute, too: with one tool axis the tip is no
// farther off than the tool.
TEST(Flute, ArcsOfTheControlCount) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string cl =
      "LOADTL/1\nFEDRAT/MMPM,600\nRAPID\nGOTO/15,0,5,0,0,1\nGOTO/15,0,0,0,0,1\nCIRCLE/0,0,0,0,0,1\n"
      "GOTO/0,15,0,0,0,1\nGOTO/-15,0,0,0,0,1\nFINI\n";
  PostOptions options;
  options.native_arcs = true;
  options.tools.flute_mm = 40.0;
  const auto p = test::posted(cl, machine, options);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_EQ(p.report->arcs, 1U);
  const VerifyReport& v = *p.report->verification;
  EXPECT_TRUE(v.passed());
  EXPECT_GE(v.certified_flute_deviation_mm, v.max_tip_deviation_mm - 1e-9);
}

// The head tells the figure that decides.
TEST(Flute, HeadTellsTheLargestDeviation) {
  PostReport report;
  VerifyReport& v = report.verification.emplace();
  v.tolerance_mm = 0.005;
  v.certified_tip_deviation_mm = 0.001;
  v.certified_flute_deviation_mm = 0.02;
  EXPECT_NE(verdict_text(report).find(" 0.001000 OF 0.005000"), std::string::npos);
  v.flute_mm = 50.0;
  EXPECT_NE(verdict_text(report).find("NOT WITHIN TOLERANCE: 0.020000 OF 0.005000"), std::string::npos);
}

}  // namespace
}  // namespace trunnion::post
