#include "trunnion/report/page.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "report/assets.hpp"
#include "report/axis_figures.hpp"
#include "report/packed.hpp"
#include "report/page_data.hpp"
#include "report/svg.hpp"
#include "support/folders.hpp"
#include "support/machines.hpp"

namespace trunnion::report {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Thinned, KeepsEndsAndExtremes) {
  std::mt19937 random(7);
  for (int round = 0; round < 50; ++round) {
    std::vector<double> values(1000 + random() % 9000);
    for (double& v : values) v = std::normal_distribution<>()(random);
    const auto kept = thinned(values, 300);
    EXPECT_LE(kept.size(), 401U);
    EXPECT_EQ(kept.front(), 0U);
    EXPECT_EQ(kept.back(), values.size() - 1);
    EXPECT_TRUE(std::is_sorted(kept.begin(), kept.end()));
    const auto largest = std::max_element(values.begin(), values.end()) - values.begin();
    const auto smallest = std::min_element(values.begin(), values.end()) - values.begin();
    EXPECT_TRUE(std::binary_search(kept.begin(), kept.end(), static_cast<std::size_t>(largest)));
    EXPECT_TRUE(std::binary_search(kept.begin(), kept.end(), static_cast<std::size_t>(smallest)));
  }
}

TEST(Thinned, KeepsGaps) {
  std::vector<double> values(3000, 1.0);
  values[1234] = std::numeric_limits<double>::quiet_NaN();
  const auto kept = thinned(values, 100);
  EXPECT_TRUE(std::binary_search(kept.begin(), kept.end(), std::size_t{1234}));
}

TEST(Thinned, LeavesFewAsTheyAre) {
  EXPECT_EQ(thinned({3, 1, 2}, 10), (std::vector<std::size_t>{0, 1, 2}));
  EXPECT_TRUE(thinned({}, 10).empty());
}

TEST(ShortNumber, HasNoExponentWhereNoneIsNeeded) {
  EXPECT_EQ(short_number(0.0), "0");
  EXPECT_EQ(short_number(-0.0), "0");
  EXPECT_EQ(short_number(123456.7), "123457");
  EXPECT_EQ(short_number(0.00123), "0.00123");
  EXPECT_EQ(short_number(1.5e-7), "1.5e-07");
}

TEST(DrawnScale, TicksAreRoundNumbersInside) {
  const DrawnScale scale(-0.3, 4.7, false, 0, 100);
  EXPECT_EQ(scale.ticks(), (std::vector<double>{0, 1, 2, 3, 4}));
  EXPECT_DOUBLE_EQ(scale.at(-0.3), 0);
  EXPECT_DOUBLE_EQ(scale.at(4.7), 100);
  const DrawnScale decades(0.001, 100, true, 0, 5);
  EXPECT_NEAR(decades.at(1.0), 3.0, 1e-12);
  EXPECT_EQ(decades.ticks().size(), 6U);
}

TEST(DrawnScale, OfOneValueHasRoom) {
  const DrawnScale scale(2, 2, false, 0, 10);
  EXPECT_NEAR(scale.at(2), 5, 1e-12);
}

Page sample_page() {
  Page page;
  page.title = "Sample <of> a page";
  page.verdict = "All is well: 1 < 2 & so on";
  page.tone = Tone::good;
  page.facts = {{"largest", "largest deviation", "1.234 um", 1.2340000001}};
  XyPlot flat{{"path length", "mm"}, {"deviation", "um"}, {}, {{"tolerance", 2.0}}, {}, false};
  Series line{.name = "after", .mark = Mark::line, .x = {}, .y = {}, .y2 = {}, .labels = {}, .colour = {}};
  Series points{
      .name = "before", .mark = Mark::points, .x = {}, .y = {}, .y2 = {}, .labels = {}, .colour = {}};
  SpacePlot space;
  space.frame = "part frame P";
  space.colour = {"deviation", "um"};
  for (int i = 0; i < 40000; ++i) {
    const double t = i * 0.001;
    line.x.push_back(t);
    line.y.push_back(1 + std::sin(t));
    if (i % 400 == 0) {
      points.x.push_back(t);
      points.y.push_back(1.5 + std::cos(t));
    }
    space.x.push_back(30 * std::cos(t));
    space.y.push_back(30 * std::sin(t));
    space.z.push_back(t);
    space.value.push_back(1 + std::sin(3 * t));
  }
  flat.series = {line, points};
  XyPlot bars{{"step", ""}, {"error", "um"}, {}, {}, {"base", "one", "two"}, false};
  bars.series.push_back(
      {.name = "", .mark = Mark::bars, .x = {0, 1, 2}, .y = {9, 4, 1}, .y2 = {}, .labels = {}, .colour = {}});
  BoxPlot boxes{{"residual", "um"}, {{"run 1", {1, 2, 3, 4, 20}}, {"run 2", {2, 3, 4}}}};
  MatrixPlot matrix{{"a", "b"}, {"a", "b"}, {{1, 0.3}, {0.3, 1}}, {"rho", ""}, 1.0};
  SpacePlot vectors;
  vectors.kind = SpacePlot::Kind::vectors;
  vectors.magnification = 1000;
  vectors.colour = {"residual", "um"};
  for (int i = 0; i < 60; ++i) {
    vectors.x.push_back(i % 10 * 20.0);
    vectors.y.push_back(i / 10 * 20.0);
    vectors.z.push_back(0);
    vectors.u.push_back(0.004);
    vectors.v.push_back(0.001 * (i % 7));
    vectors.w.push_back(0.002);
    vectors.value.push_back(4.0 + i % 7);
  }
  page.sections.push_back(
      {"Path",
       {Paragraph{"One </script> paragraph."}, Figure{"space", "In space", "A helix.", space},
        Figure{"flat", "Deviation", "Along the path.", flat}}});
  page.sections.push_back(
      {"Others",
       {Figure{"bars", "Bars", "", bars}, Figure{"boxes", "Boxes", "", boxes},
        Figure{"matrix", "Pairs", "", matrix}, Figure{"vectors", "Vectors", "x 1000", vectors},
        Table{"t", "Table", "", {"name", "value"}, {false, true}, {{"a<b", "1"}}, {}}}});
  page.result_json = R"({"text": "</script>", "value": 1.5})";
  page.made_by = "page_test";
  return page;
}

std::string between(const std::string& text, const std::string& from, const std::string& to) {
  const auto begin = text.find(from);
  if (begin == std::string::npos) return "";
  const auto start = begin + from.size();
  return text.substr(start, text.find(to, start) - start);
}

TEST(Page, EmbedsTheResultUnchanged) {
  const std::string html = page_html(sample_page());
  const auto result = nlohmann::json::parse(between(html, "id=\"result\">", "</script>"));
  EXPECT_EQ(result["text"], "</script>");
  EXPECT_EQ(result["value"], 1.5);
  EXPECT_THAT(html, HasSubstr("data-value=\"1.2340000001\""));
}

TEST(Page, FetchesNothing) {
  std::string html = page_html(sample_page());
  EXPECT_THAT(html, HasSubstr("default-src 'none'"));
  // The chart library names namespaces and its own licence; the page's own text names no address at all.
  if (const auto library = packed(chart_library()); has_interactive_charts())
    html.erase(html.find(library), library.size());
  EXPECT_THAT(html, Not(HasSubstr("://")));
  EXPECT_THAT(html, Not(HasSubstr("<script src")));
  EXPECT_THAT(html, Not(HasSubstr("@import")));
}

// The browser test presses every button; where there is no browser these settings are what is checked.
TEST(Page, SendsNothing) {
  const std::string html = page_html(sample_page());
  for (const char* rule :
       {"default-src 'none'", "connect-src 'none'", "form-action 'none'", "base-uri 'none'"})
    EXPECT_THAT(html, HasSubstr(rule));
  EXPECT_THAT(html, HasSubstr("showSendToCloud: false, plotlyServerURL: ''"));
  EXPECT_THAT(html, HasSubstr("globalThis.open = () => null;"));
}

TEST(Page, EscapesText) {
  const std::string html = page_html(sample_page());
  EXPECT_THAT(html, HasSubstr("<title>Sample &lt;of&gt; a page</title>"));
  EXPECT_THAT(html, HasSubstr("One &lt;/script&gt; paragraph."));
  EXPECT_THAT(html, HasSubstr("a&lt;b"));
}

TEST(Page, SaysWhatWasThinned) {
  const std::string html = page_html(sample_page());
  EXPECT_THAT(html, HasSubstr("of 40000 points"));
}

TEST(Page, HoldsADrawingOfEveryFigure) {
  const std::string html = page_html(sample_page());
  std::size_t drawings = 0;
  for (auto at = html.find("<svg viewBox"); at != std::string::npos; at = html.find("<svg viewBox", at + 1))
    ++drawings;
  EXPECT_EQ(drawings, 6U);
  // For the test in a browser.
  std::ofstream(test::binary_folder() + "/tests/sample_page.html") << html;
}

TEST(PageData, FloatsReadBack) {
  const auto data = page_data(sample_page());
  const std::string text = data["figures"]["bars"]["series"][0]["y"];
  // 9, 4 and 1 as little-endian float32 by hand: 00 00 10 41, 00 00 80 40, 00 00 80 3f.
  EXPECT_EQ(text, "AAAQQQAAgEAAAIA/");
}

// The pole of an A-C trunnion is A = 0, whatever C; the rotary solutions differ in the sign of A.
TEST(PolePlaces, AreTheTiltOfATrunnionWithItsSign) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const AxisId a = *machine.axis("A");
  const AxisId c = *machine.axis("C");
  post::VerifyReport report;
  const double tilts_deg[] = {-30.0, -0.5, 0.0, 0.00005, 0.5, 70.0, 90.0};
  for (const double tilt : tilts_deg) {
    post::VerifiedBlock block;
    block.q[a] = tilt * kRadPerDegree;
    block.q[c] = 3.0 * tilt;
    report.blocks.push_back(block);
  }
  const auto places = pole_places(machine, report);
  ASSERT_EQ(places.size(), std::size(tilts_deg));
  for (std::size_t i = 0; i < places.size(); ++i)
    EXPECT_NEAR(places[i].distance_rad, std::abs(tilts_deg[i]) * kRadPerDegree, 1e-9) << tilts_deg[i];
  EXPECT_EQ(places[0].branch, -places[4].branch);
  EXPECT_EQ(places[1].branch, places[0].branch);
  EXPECT_EQ(places[5].branch, places[4].branch);
  EXPECT_EQ(places[2].branch, 0);
  EXPECT_EQ(places[3].branch, 0);
}

// 0 to 90 degrees and back in two seconds each: 2700 degrees a minute.
TEST(AxesSection, ShowsVelocitiesOfFeedBlocks) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const AxisId c = *machine.axis("C");
  post::VerifyReport report;
  for (int i = 0; i < 3; ++i) {
    post::VerifiedBlock block;
    block.q[c] = i == 1 ? kPi / 2 : 0.0;
    block.seconds = 2.0;
    block.path_mm = i;
    report.blocks.push_back(block);
  }
  const Section section = axes_section(machine, report);
  bool found = false;
  for (const Item& item : section.items) {
    const auto* figure = std::get_if<Figure>(&item);
    if (figure == nullptr || figure->id != "rotary-velocities") continue;
    for (const Series& s : std::get<XyPlot>(figure->plot).series) {
      if (s.name != "C") continue;
      found = true;
      ASSERT_EQ(s.y.size(), 2U);
      EXPECT_NEAR(s.y[0], 2700.0, 1e-9);
      EXPECT_NEAR(s.y[1], -2700.0, 1e-9);
    }
  }
  EXPECT_TRUE(found);
}

// Base64 of the zlib stream of "a", "b", ... as Python's zlib (another build of the same library) undoes it
// is the browser's test; here that equal steps cost next to nothing, and that the size follows from what
// changes.
TEST(Packed, EvenStepsCostNothing) {
  std::vector<double> even(100'000);
  for (std::size_t i = 0; i < even.size(); ++i) even[i] = 3.0 * static_cast<double>(i);
  EXPECT_LT(packed(even, 1.0).size(), 2000U);
  std::mt19937 random(3);
  std::vector<double> noise(100'000);
  for (double& v : noise) v = static_cast<double>(random() % 256);
  EXPECT_GT(packed(noise, 1.0).size(), 100'000U);
}

}  // namespace
}  // namespace trunnion::report
