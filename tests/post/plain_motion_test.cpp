// Plain motions go out without the questions that concern other programs only; the text is that of the
// general way. A feed per revolution takes every motion there, and is the same feed.
#include <gtest/gtest.h>

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

TEST(PlainMotion, HasTheTextOfTheGeneralWay) {
  std::size_t lines = 0;
  std::size_t refused = 0;
  for (const std::string& name : test::shipped_machines()) {
    Machine machine = test::shipped_machine(name);
    Axis& x = machine.axes[*machine.axis("X")];
    const double x_max = x.max;
    for (const char* control : {"linuxcnc", "fanuc_30i", "heidenhain_tnc640"}) {
      for (unsigned seed = 0; seed < 12; ++seed) {
        // Some leave the travel, and are told how many positions do.
        x.max = seed % 6 == 5 ? 10.0 : x_max;
        PostOptions options;
        options.verify = false;
        options.tolerance_mm = seed % 3 == 0 ? 0.001 : 0.02;
        options.feed = seed % 2 == 0 ? FeedOutput::inverse : FeedOutput::per_minute;
        if (seed % 4 >= 2) {
          options.nonlinear.method = path::Method::reinsert;
          options.nonlinear.certify = false;
        }
        const std::string cl = with_words(test::sample_path(seed, 80), seed);
        const auto plain = test::posted(with_feed(cl, "FEDRAT/MMPM,1500"), machine, options, control);
        const auto general = test::posted(with_feed(cl, "FEDRAT/MMPR,0.25"), machine, options, control);
        ASSERT_EQ(plain.report.has_value(), general.report.has_value())
            << name << ' ' << control << ' ' << seed;
        if (!plain.report) {
          EXPECT_EQ(plain.report.error().text(), general.report.error().text());
          ++refused;
          continue;
        }
        EXPECT_EQ(plain.nc, general.nc) << name << ' ' << control << ' ' << seed;
        EXPECT_EQ(plain.report->duration_s, general.report->duration_s);
        EXPECT_EQ(plain.report->feed_time_lost_s, general.report->feed_time_lost_s);
        EXPECT_EQ(plain.report->points_inserted, general.report->points_inserted);
        EXPECT_EQ(plain.report->worst_predicted_mm, general.report->worst_predicted_mm);
        lines += plain.report->nc_lines;
      }
    }
  }
  EXPECT_GT(lines, 5000U);
  EXPECT_LT(refused, 72U);
}

}  // namespace
}  // namespace trunnion::post
