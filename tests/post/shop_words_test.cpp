// What a shop's own controller and machine file add around the cut: clamps, the tool made ready beforehand,
// path smoothing, another work offset.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "trunnion/nc/reader.hpp"

#include "post/posting.hpp"

namespace trunnion::post {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

nc::Controller shop_controller(const Machine& machine, const std::string& base) {
  nc::Controller c = test::shipped_controller(base);
  c.clamps = {{nc::AxisWords::bit(nc::AxisLetter::A), {"M10"}, {"M11"}},
              {nc::AxisWords::bit(nc::AxisLetter::C), {"M12"}, {"M13"}}};
  c.tool_preselect = {"T{tool}"};
  return with_axes_of(machine, c);
}

struct ShopText {
  std::string nc;
  std::string findings;
  bool good = false;
  std::string error;
};

ShopText shop_text(const std::string& cl, const Machine& machine, const nc::Controller& c,
                   PostOptions options = {}) {
  options.tools = test::with_some_tool(options.tools, cl, machine);
  PostJob job;
  job.cl_file = "part.cls";
  job.machine = &machine;
  job.controller = &c;
  ShopText out;
  Diagnostics diagnostics;
  const auto report = post(
      std::make_unique<test::TextOf>(cl), job, options,
      [&](std::string_view text) {
        out.nc += text;
        return Result<void>{};
      },
      diagnostics);
  for (const auto& finding : diagnostics.findings()) out.findings += finding.text() + "\n";
  out.good = report && report->verification && report->verification->passed();
  if (!report) out.error = report.error().message;
  return out;
}

// Two positions of the table, then a cut in which both rotary axes turn.
const char* const kPositions =
    "LOADTL/1,LENGTH,120\nSPINDL/RPM,5000,CLW\nFEDRAT/MMPM,800\nRAPID\nGOTO/10,0,40,0,0,1\nGOTO/10,0,20\n"
    "GOTO/20,0,20\nRAPID\nGOTO/20,0,80\nLOADTL/2,LENGTH,90\nSPINDL/RPM,4000,CLW\nRAPID\n"
    "GOTO/5,10,40,0,0.5,0.866025404\nGOTO/5,10,25\nGOTO/15,10,25\nRAPID\nGOTO/15,10,90\nLOADTL/1\n"
    "SPINDL/RPM,5000,CLW\nRAPID\nGOTO/0,0,40,0,0,1\nGOTO/0,0,20\nGOTO/10,5,20,0.1,0.2,0.974679434\nFINI\n";

// As postconfigs/README.md has it.
TEST(ShopWords, TheReferencePointIsReadBackAsARetract) {
  Machine machine = test::shipped_machine("trunnion_offset");
  machine.safe.z_is_given = true;
  for (const std::string base : {"fanuc_30i", "iso", "haas_ngc", "linuxcnc"}) {
    nc::Controller c = test::shipped_controller(base);
    c.retract[nc::index(nc::AxisLetter::Z)] = {"G91 G28 Z0.", "G90"};
    const auto p = shop_text(kPositions, machine, with_axes_of(machine, c));
    EXPECT_TRUE(p.good) << base << ' ' << p.error << p.findings << p.nc;
    EXPECT_THAT(p.nc, HasSubstr("G91 G28 Z0.")) << base;
  }
}

TEST(Clamps, HoldWhatACutDoesNotTurnAndLetGoBeforeItTurns) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto c = shop_controller(machine, "haas_ngc");
  const auto out = shop_text(kPositions, machine, c);
  ASSERT_TRUE(out.good) << out.error << out.findings;
  std::string order;
  Diagnostics diagnostics;
  const auto blocks = nc::read_program(c, out.nc, "p.nc", diagnostics);
  ASSERT_TRUE(blocks);
  std::uint16_t clamped = 0;
  nc::AxisWords at;
  for (const nc::Block& block : *blocks) {
    if (const auto* clamp = std::get_if<nc::Clamp>(&block)) {
      clamped = static_cast<std::uint16_t>(clamp->on ? clamped | clamp->axes : clamped & ~clamp->axes);
      order += clamp->on ? "+" : "-";
    }
    const auto* motion = std::get_if<nc::Motion>(&block);
    if (motion == nullptr) continue;
    for (const nc::AxisLetter letter : {nc::AxisLetter::A, nc::AxisLetter::C}) {
      const bool turns = !at.has(letter) || at[letter] != motion->words[letter];
      EXPECT_FALSE(turns && (clamped & nc::AxisWords::bit(letter)) != 0) << out.nc;
    }
    at = motion->words;
  }
  // Freed at the start, held in the first two cuts; in the last one A turns.
  EXPECT_EQ(order.substr(0, 4), "--++") << out.nc;
  EXPECT_EQ(clamped, nc::AxisWords::bit(nc::AxisLetter::C)) << out.nc;
  EXPECT_THAT(out.nc, HasSubstr("M10\n"));
}

TEST(Clamps, AProgramThatTurnsAClampedAxisIsRefused) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto c = shop_controller(machine, "iso");
  const auto errors_of = [&](const std::string& text) {
    Diagnostics diagnostics;
    static_cast<void>(nc::read_program(c, text, "p.nc", diagnostics));
    return diagnostics.findings().empty() ? std::string() : diagnostics.findings().front().text();
  };
  EXPECT_EQ(errors_of("G0 A10. C20.\nM10\nG1 X5. F100.\nA10. X6.\nC30.\nM30\n"), "");
  EXPECT_EQ(errors_of("G0 A10. C20.\nM10\nG1 X5. F100.\nX6. A11.\nM30\n"),
            "p.nc:4:1: error: axis A turns while it is clamped");
  EXPECT_EQ(errors_of("M12\nG0 C20.\nM30\n"), "p.nc:2:4: error: axis C turns while it is clamped");
  EXPECT_EQ(errors_of("G0 C20.\nM12\nM13\nC30.\nM30\n"), "");
}

TEST(Clamps, AreHeldUnderToolCentrePointControlToo) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto c = shop_controller(machine, "fanuc_30i");
  PostOptions options;
  options.rtcp = true;
  options.feed = FeedOutput::tip;
  const auto out = shop_text(kPositions, machine, c, options);
  ASSERT_TRUE(out.good) << out.error << out.findings;
  EXPECT_THAT(out.nc, HasSubstr("M10\n"));
}

TEST(Preselect, GoesOutWhereTheFileSelectsAndTheControlHasWords) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string cl =
      "LOADTL/1,LENGTH,120\nSELECT/TOOL,7\nSPINDL/RPM,5000,CLW\nFEDRAT/MMPM,800\nGOTO/10,0,20\nGOTO/"
      "20,0,20\nFINI\n";
  const auto out = shop_text(cl, machine, shop_controller(machine, "fanuc_30i"));
  ASSERT_TRUE(out.good) << out.error << out.findings;
  EXPECT_THAT(out.nc, HasSubstr("T7\n"));
  const auto without = shop_text(cl, machine, with_axes_of(machine, test::shipped_controller("fanuc_30i")));
  ASSERT_TRUE(without.good) << without.error << without.findings;
  EXPECT_THAT(without.nc, Not(HasSubstr("T7")));
}

TEST(Smoothing, IsSaidInTheHeadAndInTheControlsWords) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  auto c = shop_controller(machine, "haas_ngc");
  c.continuous_within = {"G187 P3 E{tolerance}"};
  c.continuous_off = {"G187"};
  PostOptions options;
  options.smoothing_mm = 0.02;
  const auto out = shop_text(kPositions, machine, c, options);
  ASSERT_TRUE(out.good) << out.error << out.findings;
  EXPECT_THAT(out.nc, HasSubstr("G187 P3 E0.02\n"));
  EXPECT_THAT(out.nc,
              HasSubstr("(PATH SMOOTHING: THE CONTROL ROUNDS CORNERS BY 0.02 MM, BESIDE THE TOLERANCE)"));
  EXPECT_THAT(out.nc, ContainsRegex("G187\nN[0-9]+ M30"));
  const auto linuxcnc =
      shop_text(kPositions, machine, with_axes_of(machine, test::shipped_controller("linuxcnc")), options);
  ASSERT_TRUE(linuxcnc.good) << linuxcnc.error << linuxcnc.findings;
  EXPECT_THAT(linuxcnc.nc, HasSubstr("G64 P0.0200\n"));
  EXPECT_THAT(linuxcnc.nc, Not(HasSubstr("G61")));
  const auto none =
      shop_text(kPositions, machine, with_axes_of(machine, test::shipped_controller("hnc_8")), options);
  EXPECT_FALSE(none.good);
  EXPECT_THAT(none.error,
              HasSubstr("no words for path blending within a tolerance: [path_mode] continuous_within"));
  options.smoothing_mm = 1e-6;
  const auto tiny = shop_text(kPositions, machine, c, options);
  EXPECT_THAT(tiny.error, HasSubstr("less than the last digit"));
}

TEST(WorkOffset, IsThatOfTheOptionElseOfTheFileElseOfTheMachine) {
  Machine machine = test::shipped_machine("trunnion_offset");
  const auto c = with_axes_of(machine, test::shipped_controller("haas_ngc"));
  const std::string tool = "LOADTL/1,LENGTH,120\nSPINDL/RPM,5000,CLW\nFEDRAT/MMPM,800\n";
  const std::string cut = "GOTO/10,0,20\nGOTO/20,0,20\n";
  const auto first_offset = [&](const ShopText& out) {
    const auto at = out.nc.find("\nN20 G5");
    return at == std::string::npos ? out.error + out.findings : out.nc.substr(at + 5, 3);
  };
  EXPECT_EQ(first_offset(shop_text(tool + cut, machine, c)), "G54");
  EXPECT_EQ(first_offset(shop_text(tool + "SET/OFSETL,4\n" + cut, machine, c)), "G57");
  machine.work_offset = 3;
  const auto by_machine = shop_text(tool + cut, machine, c);
  EXPECT_EQ(first_offset(by_machine), "G56");
  EXPECT_THAT(by_machine.nc, HasSubstr("(G56 MUST BE AT MACHINE"));
  EXPECT_EQ(first_offset(shop_text(tool + "SET/OFSETL,4\n" + cut, machine, c)), "G57");
  PostOptions options;
  options.work_offset = 2;
  const auto by_option = shop_text(tool + "SET/OFSETL,4\n" + cut, machine, c, options);
  EXPECT_EQ(first_offset(by_option), "G55");
  EXPECT_THAT(by_option.findings, HasSubstr("calls work offset 4, the option 2: that holds"));
  const auto two = shop_text(tool + "SET/OFSETL,4\n" + cut + "SET/OFSETL,5\n" + cut, machine, c);
  EXPECT_FALSE(two.good);
  EXPECT_THAT(two.error,
              HasSubstr("work offset 5 is called after offset 4: a program can have only one work offset"));
}

TEST(SpindleSpeed, ThatNobodySaidIsAWarning) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto c = with_axes_of(machine, test::shipped_controller("haas_ngc"));
  const std::string cut = "FEDRAT/MMPM,800\nGOTO/10,0,20\nGOTO/20,0,20\n";
  EXPECT_THAT(shop_text("LOADTL/1,LENGTH,120\n" + cut, machine, c).findings,
              HasSubstr("part.cls:3:1: warning: no SPINDL before this cut: the spindle does not turn"));
  const std::string first = "LOADTL/1,LENGTH,120\nSPINDL/RPM,5000,CLW\n" + cut;
  EXPECT_THAT(shop_text(first, machine, c).findings, Not(HasSubstr("SPINDL")));
  const auto again = shop_text(first + "LOADTL/2,LENGTH,90\n" + cut, machine, c);
  EXPECT_THAT(again.findings,
              HasSubstr("part.cls:8:1: warning: no SPINDL since the tool was loaded: it turns at "
                        "the 5000 rpm of the tool before"));
  EXPECT_EQ(again.findings.find("SPINDL"), again.findings.rfind("SPINDL"));
}

}  // namespace
}  // namespace trunnion::post
