// --longest-block-mm: no block of a cut moves the tip farther, and all else stays as it was.
#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <iostream>
#include <random>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "post/own_chain.hpp"
#include "post/posting.hpp"
#include "support/cases.hpp"

namespace trunnion::post {
namespace {

using test::point_text;
using test::posted;
using test::tilted;

// Of the ends of a block: linear words of four decimals, rotary ones a few hundred millimetres away.
constexpr double kBlockEnds_mm = 1.5e-3;
// Of three decimals.
constexpr double kCoarseEnds_mm = 5e-3;

PostOptions with_longest_block(double longest_mm, PostOptions options = {}) {
  options.path_stages = {{"longest-block-mm", longest_mm}};
  return options;
}

// A block of LinuxCNC's words that cuts.
struct CuttingBlock {
  double length_mm = 0.0;  // from tip to tip in P
  double per_minute = 0.0;
  bool by_time = false;  // G93: F is of blocks
};

// All of a program, by the tests' own chain; without one the words are the tip in P.
std::vector<CuttingBlock> cutting_blocks(const std::string& nc, const test::OwnChain* chain) {
  std::vector<CuttingBlock> out;
  test::FiveWords now{};
  bool cuts = false, by_time = false;
  double feed = 0.0;
  const auto tip = [&] {
    return chain != nullptr ? test::in_part(now, *chain).tip : Vec3(now[0], now[1], now[2]);
  };
  std::istringstream lines(nc);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '(' || line.find("G53") != std::string::npos) continue;
    const Vec3 before = tip();
    bool moves = false;
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      if (word == "G0") cuts = false;
      if (word == "G1") cuts = true;
      if (word == "G93" || word == "G94") by_time = word == "G93";
      const auto number = parse_number(std::string_view(word).substr(1));
      if (!number) continue;
      if (word[0] == 'F') feed = number.value;
      const std::size_t axis = std::string("XYZAC").find(chain != nullptr && word[0] == 'B' ? 'A' : word[0]);
      if (axis == std::string::npos) continue;
      now[axis] = number.value;
      moves = true;
    }
    if (cuts && moves) out.push_back({(tip() - before).norm(), feed, by_time});
  }
  return out;
}

double longest(const std::vector<CuttingBlock>& blocks) {
  double out = 0.0;
  for (const CuttingBlock& block : blocks) out = std::max(out, block.length_mm);
  return out;
}

// As the verification read it back.
double longest(const VerifyReport& report) {
  double out = 0.0;
  for (std::size_t i = 1; i < report.blocks.size(); ++i) {
    const VerifiedBlock& block = report.blocks[i];
    if (!block.rapid && !block.unknown)
      out = std::max(out, (block.tip_P - report.blocks[i - 1].tip_P).norm());
  }
  return out;
}

const std::string kBegin = "LOADTL/1\nSPINDL/RPM,8000,CLW\nFEDRAT/MMPM,1200\nRAPID\n";

// Segments of 3 to 60 mm on which the tool axis turns by up to 20 degrees, cuts and rapids.
std::string long_path(std::mt19937_64& random, int points = 12) {
  std::uniform_real_distribution<double> u(0.0, 1.0);
  std::string out = kBegin;
  double turn = 6.0 * u(random);
  for (int i = 0; i < points; ++i) {
    if (i == points / 2) out += "RAPID\n";
    turn += 0.35 * u(random);
    out += point_text({60.0 * u(random) - 30.0, 60.0 * u(random) - 30.0, 40.0 * u(random)},
                      tilted(0.5 + 0.3 * u(random), turn));
  }
  return out + "FINI\n";
}

void expect_passed(const test::Posted& p, const std::string& what) {
  ASSERT_TRUE(p.report) << what << ": " << p.report.error().text();
  ASSERT_TRUE(p.report->verification) << what;
  EXPECT_TRUE(p.report->verification->passed())
      << what << ": " << p.report->verification->certified_tip_deviation_mm << " mm";
}

TEST(LongestBlock, IsKeptWhileTheToolAxisTurns) {
  std::mt19937_64 random(1);
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    const test::OwnChain chain = test::own_chain(name);
    const std::string cl = long_path(random);
    const auto whole = posted(cl, machine);
    expect_passed(whole, name);
    for (const double longest_mm : {0.25, 1.7, 6.0}) {
      const std::string what = name + " " + fixed_text(longest_mm, 2);
      PostOptions options = with_longest_block(longest_mm);
      options.collect = true;
      const auto p = posted(cl, machine, options);
      expect_passed(p, what);
      ASSERT_TRUE(p.report) << what;
      const double found = longest(cutting_blocks(p.nc, &chain));
      EXPECT_LE(found, longest_mm + kBlockEnds_mm) << what;
      EXPECT_GT(found, 0.4 * longest_mm) << what;
      EXPECT_NEAR(longest(*p.report->verification), found, kBlockEnds_mm) << what;
      EXPECT_EQ(p.report->points_in, whole.report->points_in) << what;
      // And by an independent reading of program and CL text.
      const auto read = test::verified(p.nc, cl, machine, options.tolerance_mm);
      ASSERT_TRUE(read) << read.error().text();
      EXPECT_TRUE(read->passed()) << what;
    }
    EXPECT_GT(longest(cutting_blocks(whole.nc, &chain)), 1.7 + kBlockEnds_mm) << name;
  }
}

TEST(LongestBlock, IsKeptUnderToolCentrePointControl) {
  std::mt19937_64 random(2);
  for (const std::string& name : test::shipped_machines()) {
    const std::string cl = long_path(random);
    PostOptions options;
    options.rtcp = true;
    options.feed = FeedOutput::tip;
    options.collect = true;
    const Machine machine = test::shipped_machine(name);
    for (const double longest_mm : {0.4, 3.0}) {
      const std::string what = name + " " + fixed_text(longest_mm, 2);
      const auto p = posted(cl, machine, with_longest_block(longest_mm, options));
      expect_passed(p, what);
      ASSERT_TRUE(p.report) << what;
      const double found = longest(cutting_blocks(p.nc, nullptr));
      EXPECT_LE(found, longest_mm + kBlockEnds_mm) << what;
      EXPECT_GT(found, 0.5 * longest_mm) << what;
      EXPECT_LE(longest(*p.report->verification), longest_mm + kBlockEnds_mm) << what;
      const auto siemens = posted(cl, machine, with_longest_block(longest_mm, options), "siemens_840d_sl");
      expect_passed(siemens, what);
      EXPECT_LE(longest(*siemens.report->verification), longest_mm + kBlockEnds_mm) << what;
    }
  }
}

// More points than a chunk of the pipeline has, between two of the text.
TEST(LongestBlock, IsKeptWhereAMotionHasMorePartsThanAChunk) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const test::OwnChain chain = test::own_chain("trunnion_offset");
  const std::string cl = kBegin + point_text({-90, -60, 0}, tilted(0.3, 0.2)) +
                         point_text({90, 60, 20}, tilted(0.7, 0.9)) +
                         point_text({90, -60, 20}, tilted(0.4, 0.5)) + "FINI\n";
  PostOptions options = with_longest_block(0.03);
  const auto p = posted(cl, machine, options);
  expect_passed(p, "one thread");
  ASSERT_TRUE(p.report);
  EXPECT_LE(longest(cutting_blocks(p.nc, &chain)), 0.03 + kBlockEnds_mm);
  EXPECT_GT(p.report->points_inserted, 11000U);
  options.threads = 3;
  EXPECT_EQ(posted(cl, machine, options).nc, p.nc);
}

TEST(LongestBlock, LeavesShortPathsToTheByte) {
  std::mt19937_64 random(3);
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    for (const std::string control : {"linuxcnc", "fanuc_30i", "heidenhain_tnc640"}) {
      const std::string cl = random() % 2 == 0 ? long_path(random) : test::sample_path(7, 300);
      const auto without = posted(cl, machine, {}, control);
      const auto with = posted(cl, machine, with_longest_block(150.0), control);
      ASSERT_TRUE(without.report && with.report) << name << ' ' << control;
      EXPECT_EQ(with.nc, without.nc) << name << ' ' << control;
      EXPECT_EQ(with.report->points_inserted, without.report->points_inserted);
    }
  }
}

// Motions of a whole multiple of the limit go into no part more, whatever the last bits of their length are.
TEST(LongestBlock, TakesWhatIsOnTheLimit) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  for (const double longest_mm : {0.1, 0.3, 0.7, 1.1, 2.54}) {
    std::string cl = kBegin + point_text({0.7, 0.1, 3.3}, Vec3::UnitZ());
    for (int i = 1; i <= 40; ++i) cl += point_text({0.7 + 3 * i * longest_mm, 0.1, 3.3}, Vec3::UnitZ());
    const auto p = posted(cl + "FINI\n", machine, with_longest_block(longest_mm));
    expect_passed(p, fixed_text(longest_mm, 2));
    ASSERT_TRUE(p.report);
    EXPECT_EQ(p.report->points_inserted, 80U) << longest_mm;
    // A digit more is one part more.
    const auto more = posted(cl + "FINI\n", machine, with_longest_block(longest_mm - 1e-4));
    ASSERT_TRUE(more.report);
    EXPECT_EQ(more.report->points_inserted, 120U) << longest_mm;
  }
}

TEST(LongestBlock, LeavesRapidsWhole) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string cl = kBegin + point_text({0, 0, 80}, Vec3::UnitZ()) + "RAPID\n" +
                         point_text({60, 0, 80}, Vec3::UnitZ()) + point_text({60, 0, 75}, Vec3::UnitZ()) +
                         "RAPID\n" + point_text({60, 0, 90}, Vec3::UnitZ()) + "FINI\n";
  const auto without = posted(cl, machine);
  const auto with = posted(cl, machine, with_longest_block(1.0));
  expect_passed(with, "rapids");
  ASSERT_TRUE(with.report && without.report);
  EXPECT_EQ(with.report->verification->rapid_blocks, without.report->verification->rapid_blocks);
  EXPECT_EQ(with.report->points_inserted, 4U);
}

// FEDRAT/INVERS says how long a motion takes: its parts share that.
TEST(LongestBlock, KeepsTheTimeOfMotionsThatAreGivenOne) {
  std::mt19937_64 random(4);
  const Machine machine = test::shipped_machine("trunnion_offset");
  const test::OwnChain chain = test::own_chain("trunnion_offset");
  for (int i = 0; i < 5; ++i) {
    std::string cl = kBegin;
    constexpr int kMotions = 8;
    std::uniform_real_distribution<double> u(0.0, 1.0);
    for (int k = 0; k <= kMotions; ++k) {
      if (k == 1) cl += "FEDRAT/INVERS,6\n";
      // One stands in place.
      const Vec3 tip = k == 4 || k == 5 ? Vec3(5, 5, 5) : Vec3(40.0 * u(random), 40.0 * u(random), 10.0);
      cl += point_text(tip, tilted(0.5 + 0.2 * u(random), 0.4 * u(random)));
    }
    cl += "FINI\n";
    const auto without = posted(cl, machine);
    const auto with = posted(cl, machine, with_longest_block(0.8));
    expect_passed(without, "whole");
    expect_passed(with, "in parts");
    ASSERT_TRUE(with.report && without.report);
    EXPECT_NEAR(with.report->verification->duration_s, without.report->verification->duration_s, 0.05);
    double seconds = 0.0;
    const auto blocks = cutting_blocks(with.nc, &chain);
    for (const CuttingBlock& block : blocks) {
      ASSERT_TRUE(block.by_time);
      seconds += 60.0 / block.per_minute;
    }
    EXPECT_NEAR(seconds, 10.0 * kMotions, 0.005 * 10.0 * kMotions);
    EXPECT_LE(longest(blocks), 0.8 + kBlockEnds_mm);
  }
}

TEST(LongestBlock, IsRefusedBesideWhatChangesPoints) {
  std::mt19937_64 random(5);
  const std::string cl = long_path(random);
  const auto refused = [&](const PostOptions& options, const std::string& why) {
    const auto p = posted(cl, test::shipped_machine("trunnion_offset"), options);
    ASSERT_FALSE(p.report) << why;
    EXPECT_EQ(p.report.error().code, ErrorCode::wrong_use);
    EXPECT_NE(p.report.error().text().find(why), std::string::npos) << p.report.error().text();
    EXPECT_TRUE(p.nc.empty());
  };
  PostOptions options = with_longest_block(1.0);
  options.nonlinear.thin = true;
  refused(options, "--thin drops points, and --longest-block-mm adds some");
  options = with_longest_block(1.0);
  options.nonlinear.move_programmed_points = true;
  refused(options, "--move-programmed-points moves points");
  options = with_longest_block(1.0);
  options.pole.tolerance = Angle::degrees(0.1);
  refused(options, "--pole-tolerance-deg tilts the tool");
  for (const double value : {0.0, -1.0, 0.0099, 1e5, std::nan("")})
    refused(with_longest_block(value), "is not between 0.01 and 10000");
  options.pole.tolerance = Angle();
  options.path_stages = {{"longest-blok-mm", 1.0}};
  refused(options, "--longest-blok-mm: there is no such stage");
}

// Words for the machine that leave the tool on the path, and what stands between motions.
TEST(LongestBlock, IsKeptBehindWords) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const test::OwnChain chain = test::own_chain("trunnion_offset");
  for (const std::string word : {"MAXDPM/3600", "CLEARP/XYPLAN,100", "ROTABL/SHORT,COMBIN",
                                 "LIMITS/CAXIS,-300,300", "LIMITS/OFF", "COOLNT/ON", "DELAY/1", "LINTOL/0.01",
                                 "PPRINT/TEXT", "CUTTER/10", "FEDRAT/MMPM,900", "SPINDL/RPM,900,CLW"}) {
    const std::string cl = kBegin + point_text({0, 0, 0}, Vec3::UnitZ()) +
                           point_text({50, 0, 0}, Vec3::UnitZ()) + word + "\n" +
                           point_text({50, 50, 0}, Vec3::UnitZ()) + "FINI\n";
    const auto p = posted(cl, machine, with_longest_block(2.0));
    expect_passed(p, word);
    EXPECT_LE(longest(cutting_blocks(p.nc, &chain)), 2.0 + kBlockEnds_mm) << word;
    EXPECT_EQ(p.report->points_inserted, 48U) << word;
    EXPECT_EQ(p.report->segments_with_points, 2U) << word;
  }
}

// Arcs and holes of which another option lets the control have the one or the other.
TEST(LongestBlock, IsKeptInShapesThatGoOutAsMoves) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const test::OwnChain chain = test::own_chain("trunnion_offset");
  const std::string cl = kBegin + point_text({30, 0, 60}, Vec3::UnitZ()) + "CIRCLE/0,0,60,0,0,1\n" +
                         point_text({0, 30, 60}, Vec3::UnitZ()) + "RAPID\n" +
                         point_text({0, 30, 80}, Vec3::UnitZ()) + "CYCLE/DRILL,DEPTH,20,MMPM,150,CLEAR,3\n" +
                         point_text({0, 0, 0}, Vec3::UnitZ()) + point_text({20, 0, 0}, Vec3::UnitZ()) +
                         "CYCLE/OFF\nFINI\n";
  for (const bool arcs : {false, true}) {
    PostOptions options = with_longest_block(0.2);
    options.native_arcs = arcs;
    options.native_cycles = !arcs;
    const auto p = posted(cl, machine, options);
    expect_passed(p, arcs ? "arcs" : "cycles");
    ASSERT_TRUE(p.report);
    EXPECT_EQ(p.report->arcs, arcs ? 1U : 0U);
    EXPECT_EQ(p.report->holes, arcs ? 0U : 2U);
    EXPECT_LE(longest(cutting_blocks(p.nc, &chain)), 0.2 + kBlockEnds_mm);
    PostOptions both = options;
    both.native_arcs = both.native_cycles = false;
    const auto moves = posted(cl, machine, both);
    expect_passed(moves, "moves");
    EXPECT_LE(longest(cutting_blocks(moves.nc, &chain)), 0.2 + kBlockEnds_mm);
    // What goes out in the control's words is not counted as points.
    EXPECT_LT(p.report->points_inserted, moves.report->points_inserted);
  }
}

// The words of one of the controls, everything that goes beside the limit at random.
struct RandomOfLongestBlock {
  std::string machine, control, cl;
  PostOptions options;
  double longest_mm = 1.0;
};

RandomOfLongestBlock random_of_longest_block(std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(0.0, 1.0);
  const auto chance = [&](double share) { return u(random) < share; };
  RandomOfLongestBlock out;
  const auto machines = test::shipped_machines();
  out.machine = machines[random() % machines.size()];
  constexpr std::array kControls = {"linuxcnc", "fanuc_30i", "siemens_840d_sl", "heidenhain_tnc640", "iso"};
  out.control = kControls[random() % kControls.size()];
  out.longest_mm = std::exp(std::log(0.05) + u(random) * std::log(20.0 / 0.05));
  out.options.collect = true;
  out.options.tolerance_mm = chance(0.3) ? 0.003 : 0.01;
  out.options.nonlinear.one_sided = chance(0.3);
  if (chance(0.25)) {
    out.options.rtcp = true;
    out.options.feed = FeedOutput::tip;
  } else if (chance(0.3)) {
    out.options.feed = FeedOutput::per_minute;
  }
  const bool is_timed = chance(0.2);
  const double size = 5.0 + 40.0 * u(random);
  const double most_tilt = chance(0.2) ? 1.6 : 0.8;
  const double least_tilt = chance(0.3) ? 0.0 : 0.2;
  const double turns = chance(0.2) ? 3.0 : 0.5;
  out.cl = kBegin;
  double turn = 6.0 * u(random);
  for (int i = 0; i < 14; ++i) {
    if (i == 1 && is_timed) out.cl += "FEDRAT/INVERS," + fixed_text(4.0 + 20.0 * u(random), 2) + "\n";
    if (i > 2 && chance(0.15)) out.cl += "RAPID\n";
    if (i > 2 && chance(0.05)) out.cl += "DELAY/0.5\n";
    if (i > 2 && chance(0.05)) out.cl += "COOLNT/ON\n";
    if (i > 2 && chance(0.05)) out.cl += "LOADTL/" + std::to_string(2 + i) + "\nSPINDL/ON\nRAPID\n";
    turn += turns * (u(random) - 0.3);
    out.cl += point_text(size * Vec3(2.0 * u(random) - 1.0, 2.0 * u(random) - 1.0, 0.5 + 0.5 * u(random)),
                         tilted(least_tilt + (most_tilt - least_tilt) * u(random), turn));
  }
  out.cl += "FINI\n";
  return out;
}

TEST(LongestBlock, RandomPathsComeOutWithItAsWithout) {
  std::mt19937_64 random(test::seed(20261128));
  int made = 0, refused = 0;
  for (int i = 0; i < test::cases(250); ++i) {
    const RandomOfLongestBlock r = random_of_longest_block(random);
    const Machine machine = test::shipped_machine(r.machine);
    const auto without = posted(r.cl, machine, r.options, r.control);
    const auto with = posted(r.cl, machine, with_longest_block(r.longest_mm, r.options), r.control);
    const std::string what = std::to_string(i) + " " + r.machine + " " + r.control + " " +
                             fixed_text(r.longest_mm, 3) + (r.options.rtcp ? " rtcp" : "");
    ASSERT_EQ(with.report.has_value(), without.report.has_value())
        << what << ": " << (with.report ? without.report : with.report).error().text() << "\n"
        << r.cl;
    if (!with.report) {
      EXPECT_EQ(with.report.error().code, without.report.error().code) << what;
      EXPECT_EQ(with.report.error().where.line, without.report.error().where.line)
          << what << "\n"
          << with.report.error().text() << "\n"
          << without.report.error().text();
      ++refused;
      continue;
    }
    ++made;
    EXPECT_TRUE(without.report->verification->passed()) << what << "\n" << r.cl;
    EXPECT_TRUE(with.report->verification->passed()) << what << "\n" << r.cl;
    // Where the tool leaves the part for the rotary axes to turn its way out is none of the path.
    if (with.report->choice.reconfigurations == 0) {
      EXPECT_LE(longest(*with.report->verification), r.longest_mm + kCoarseEnds_mm) << what << "\n" << r.cl;
    }
    EXPECT_EQ(with.report->points_in, without.report->points_in) << what;
  }
  EXPECT_GT(made, test::cases(250) / 2);
  std::cout << made << " made, " << refused << " refused\n";
}

}  // namespace
}  // namespace trunnion::post
