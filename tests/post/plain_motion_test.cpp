// Plain motions go out without the questions that concern other programs only; the text is that of the
// general way. A feed per revolution takes every motion there, and is the same feed.
#include <array>
#include <gtest/gtest.h>
#include <optional>

#include "post/posting.hpp"

namespace trunnion::post {
namespace {

// 6000 rpm times 0.25 mm are 1500 mm/min, to the bit.
std::string with_feed(std::string cl, const std::string& feed) {
  const std::string rpm = "RPM,8000";
  cl.replace(cl.find(rpm), rpm.size(), "RPM,6000");
  const std::string before = "FEDRAT/MMPM,1200";
  cl.replace(cl.find(before), before.size(), feed);
  return cl;
}

// Things are said in the cut, and one point is said twice.
std::string with_words(std::string cl, unsigned seed) {
  const char* const words[] = {"PPRINT here\n", "LINTOL/ON,0.002\n", "COOLNT/OFF\n", "LINTOL/ON,0.05\n",
                               "DELAY/0.5\n"};
  std::size_t at = 0;
  for (unsigned line = 0; (at = cl.find("GOTO", at + 1)) != std::string::npos; ++line) {
    if ((line + seed) % 7 == 0) {
      const std::string word = words[(line / 7 + seed) % std::size(words)];
      cl.insert(at, word);
      at += word.size();
    }
    if (line % 11 == 5) {
      const std::string again = cl.substr(at, cl.find('\n', at) + 1 - at);
      cl.insert(at, again);
      at += again.size();
    }
  }
  return cl;
}

// The report of the plain way, or nothing where both refuse; all that the two may tell is the same.
std::optional<PostReport> posted_both_ways(const std::string& cl, const Machine& machine,
                                           const PostOptions& options, const char* control,
                                           const Model* model = nullptr) {
  const auto plain = test::posted(with_feed(cl, "FEDRAT/MMPM,1500"), machine, options, control, model);
  const auto general = test::posted(with_feed(cl, "FEDRAT/MMPR,0.25"), machine, options, control, model);
  EXPECT_EQ(plain.report.has_value(), general.report.has_value());
  if (!plain.report || !general.report) {
    if (!plain.report && !general.report) {
      EXPECT_EQ(plain.report.error().text(), general.report.error().text());
    }
    return std::nullopt;
  }
  EXPECT_EQ(plain.nc, general.nc);
  EXPECT_EQ(plain.report->duration_s, general.report->duration_s);
  EXPECT_EQ(plain.report->feed_time_lost_s, general.report->feed_time_lost_s);
  EXPECT_EQ(plain.report->points_inserted, general.report->points_inserted);
  EXPECT_EQ(plain.report->worst_predicted_mm, general.report->worst_predicted_mm);
  EXPECT_EQ(plain.report->largest_correction_mm, general.report->largest_correction_mm);
  return *plain.report;
}

TEST(PlainMotion, HasTheTextOfTheGeneralWay) {
  std::size_t lines = 0;
  std::size_t refused = 0;
  double lost_s = 0.0;
  for (const std::string& name : test::shipped_machines()) {
    Machine machine = test::shipped_machine(name);
    Axis& x = machine.axes[*machine.axis("X")];
    const double x_max = x.max;
    Axis& c = machine.axes[*machine.axis("C")];
    const auto c_feed = c.max_feed;
    for (const char* control : {"linuxcnc", "fanuc_30i", "heidenhain_tnc640"}) {
      for (unsigned seed = 0; seed < 12; ++seed) {
        // Some leave the travel, and are told how many positions do.
        x.max = seed % 6 == 5 ? 10.0 : x_max;
        // In some C cannot follow the feed.
        c.max_feed = seed % 5 == 1 ? std::optional(0.05) : c_feed;
        PostOptions options;
        options.verify = false;
        options.tolerance_mm = seed % 3 == 0 ? 0.001 : 0.02;
        options.feed = seed % 2 == 0 ? FeedOutput::inverse : FeedOutput::per_minute;
        if (seed % 4 >= 2) {
          options.nonlinear.method = path::Method::reinsert;
          options.nonlinear.certify = false;
        }
        const std::string cl = with_words(test::sample_path(seed, 80), seed);
        SCOPED_TRACE(name + ' ' + control + ' ' + std::to_string(seed));
        const auto report = posted_both_ways(cl, machine, options, control);
        if (!report) {
          ++refused;
          continue;
        }
        lines += report->nc_lines;
        lost_s += report->feed_time_lost_s;
      }
    }
  }
  EXPECT_GT(lines, 5000U);
  EXPECT_LT(refused, 72U);
  EXPECT_GT(lost_s, 10.0);
}

// Errors that hang on the place alone: corrected positions go out in runs, too.
Model errors_of_place(const Machine& machine, std::mt19937_64& random) {
  const auto any = [&](double size) {
    return fixed_text(std::uniform_real_distribution<double>(-size, size)(random), 3);
  };
  const std::string text =
      "[model]\nname = \"m\"\n[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = " + any(60.0) +
      "\nA0C_urad = " + any(80.0) +
      "\n[[effect]]\nid = \"component:EYX\"\n[effect.parameters]\nP2_um = " + any(40.0) +
      "\nP3_um = " + any(20.0) +
      "\n[[effect]]\nid = \"component:EAC\"\n[effect.parameters]\ncos1_urad = " + any(50.0) +
      "\n[[effect]]\nid = \"periodic:Y\"\n[effect.parameters]\nsin_um = " + any(3.0) + "\np_mm = 10.0\n";
  return test::model_of(text, machine);
}

TEST(PlainMotion, HasTheTextOfTheGeneralWayWithErrorsOfThePlace) {
  std::mt19937_64 random(14);
  std::size_t lines = 0;
  std::size_t inserted = 0;
  for (const std::string& name : test::shipped_machines()) {
    Machine machine = test::shipped_machine(name);
    Axis& c = machine.axes[*machine.axis("C")];
    const auto c_feed = c.max_feed;
    Axis& x = machine.axes[*machine.axis("X")];
    const double x_max = x.max;
    for (unsigned seed = 0; seed < 16; ++seed) {
      c.max_feed = seed % 5 == 1 ? std::optional(0.05) : c_feed;
      x.max = seed % 8 == 5 ? 10.0 : x_max;
      const Model model = errors_of_place(machine, random);
      PostOptions options;
      options.verify = false;
      options.tolerance_mm = std::array{0.02, 0.005, 0.001}[seed % 3];
      options.feed = seed % 2 == 0 ? FeedOutput::inverse : FeedOutput::per_minute;
      if (seed % 4 >= 2) {
        options.nonlinear.method = path::Method::reinsert;
        options.nonlinear.certify = seed % 8 >= 4;
      }
      const char* const control = seed % 6 == 4 ? "fanuc_30i" : "linuxcnc";
      const std::string cl = with_words(test::sample_path(seed, 80), seed);
      SCOPED_TRACE(name + ' ' + std::to_string(seed));
      const auto report = posted_both_ways(cl, machine, options, control, &model);
      if (!report) continue;
      lines += report->nc_lines;
      inserted += report->points_inserted;
    }
  }
  EXPECT_GT(lines, 3000U);
  EXPECT_GT(inserted, 1000U);
}

// The tip goes round C's axis, so that only rounding moves X, Y and Z: blocks whose F cannot say how long
// they last go the general way in the midst of a run.
TEST(PlainMotion, LeavesBlocksThatRunAwayToTheGeneralWay) {
  std::size_t held = 0;
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    const Vec3 on_axis_P = machine.axes[*machine.axis("C")].point_mm - machine.part_zero_mm;
    std::string cl = "MULTAX/ON\nLOADTL/3\nSPINDL/RPM,8000,CLW\nFEDRAT/MMPM,1200\nRAPID\n";
    for (int i = 0; i < 200; ++i) {
      const double turn = 0.013 * i;
      const double radius_mm = i % 20 < 12 ? 30.0 : 30.0 + 0.2 * (i % 5);
      const Vec3 tip = on_axis_P + radius_mm * Vec3(std::cos(turn), std::sin(turn), 0.0);
      const Vec3 axis(std::sin(0.5) * std::cos(turn), std::sin(0.5) * std::sin(turn), std::cos(0.5));
      cl += "GOTO/" + fixed_text(tip.x(), 4) + "," + fixed_text(tip.y(), 4) + ",5.0," +
            fixed_text(axis.x(), 9) + "," + fixed_text(axis.y(), 9) + "," + fixed_text(axis.z(), 9) + "\n";
    }
    cl += "FINI\n";
    PostOptions options;
    options.verify = false;
    // 0.5 mm/s, to the bit.
    const auto plain = test::posted(with_feed(cl, "FEDRAT/MMPM,30"), machine, options);
    const auto general = test::posted(with_feed(cl, "FEDRAT/MMPR,0.005"), machine, options);
    ASSERT_TRUE(plain.report) << name << plain.report.error().text();
    ASSERT_TRUE(general.report) << name;
    EXPECT_EQ(plain.nc, general.nc) << name;
    EXPECT_EQ(plain.report->blocks_held, general.report->blocks_held);
    EXPECT_EQ(plain.report->duration_s, general.report->duration_s);
    held += plain.report->blocks_held;
  }
  EXPECT_GT(held, 10U);
}

}  // namespace
}  // namespace trunnion::post
