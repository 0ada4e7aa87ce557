#include "trunnion/post/tools.hpp"

#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "trunnion/nc/reader.hpp"

#include "post/posting.hpp"

namespace trunnion::post {
namespace {

std::string findings_of(const Diagnostics& diagnostics) {
  std::string out;
  for (const auto& finding : diagnostics.findings()) out += finding.text() + "\n";
  return out;
}

ToolTable tools_of(const std::string& text, const std::string& file = "tools.csv") {
  Diagnostics d;
  auto table = parse_tools(text, file, d);
  if (!table) throw std::runtime_error(findings_of(d));
  return *table;
}

std::string errors_in(const std::string& text, const std::string& file = "tools.csv") {
  Diagnostics d;
  EXPECT_FALSE(parse_tools(text, file, d));
  return findings_of(d);
}

TEST(ToolFile, RowsOfCsv) {
  const auto tools =
      tools_of("tool,length_mm,radius_mm,flute_length_mm,register\n1,150.5,5,20,\n2,80,,,12\n# a remark\n");
  ASSERT_EQ(tools.size(), 2U);
  EXPECT_EQ(tools.at(1).length_mm, 150.5);
  EXPECT_EQ(tools.at(1).radius_mm, 5.0);
  EXPECT_EQ(tools.at(1).flute_length_mm, 20.0);
  EXPECT_FALSE(tools.at(1).length_register);
  EXPECT_EQ(tools.at(2).length_register, 12U);
  EXPECT_FALSE(tools.at(2).radius_mm);
}

TEST(ToolFile, FaultsOfCsvHaveTheirPlace) {
  EXPECT_EQ(
      errors_in("tool,length\n1,2\n"),
      "tools.csv:1:1: error: there is no column 'length_mm'\n"
      "tools.csv:1:2: error: column 'length' is not known: tool, length_mm, radius_mm, flute_length_mm, "
      "register\n");
  EXPECT_EQ(errors_in("tool,length_mm\n1,0\n2.5,10\n3,long\n4,10\n4,11\n"),
            "tools.csv:2:2: error: 0 is not a gauge length: more than 0 and at most 10000 mm\n"
            "tools.csv:3:1: error: 2.5 is not a whole number\n"
            "tools.csv:4:2: error: 'long' in column 'length_mm' is not a number\n"
            "tools.csv:6:1: error: tool 4 stands here twice\n");
  EXPECT_EQ(errors_in("tool,length_mm,flute_length_mm\n1,80,80\n2,12,80\n"),
            "tools.csv:3:3: error: a flute of 80 mm on a tool that is 12 mm long\n");
}

// As LinuxCNC writes it: letters and numbers, a comment behind the semicolon.
TEST(ToolFile, TableOfLinuxCnc) {
  const auto tools = tools_of(
      "; my tools\nT1 P1 D0.125000 Z+150.511000 ;1/8 end mill\nt2 p17 z80 d12\nT3 P3 Z0 D1 ; never "
      "measured\nT4 P4\n"
      "T99999 P0 X+0.0 Y+0.0 Z+12.5\n",
      "Tool.TBL");
  ASSERT_EQ(tools.size(), 3U);
  EXPECT_EQ(tools.at(1).length_mm, 150.511);
  EXPECT_EQ(tools.at(1).radius_mm, 0.0625);
  EXPECT_EQ(tools.at(2).length_mm, 80.0);
  EXPECT_EQ(tools.at(99999).length_mm, 12.5);
  EXPECT_EQ(errors_in("T1 Z-3\nT2 Z5 X1\nT3 Zq\nZ5\nT5 Z1\nT5 Z2\n", "t.tbl"),
            "t.tbl:1:4: error: T1: Z-3 is not a gauge length: more than 0 and at most 10000 mm\n"
            "t.tbl:2:7: error: 'X1' is an offset in another axis than Z: it is not understood\n"
            "t.tbl:3:4: error: 'Zq' is no word of a tool table: a letter and a number\n"
            "t.tbl:4:1: error: a tool without its number (T)\n"
            "t.tbl:6:1: error: T5 stands here twice\n");
}

// Two tools at the same points of the part, the second one 70 mm shorter.
const char* const kTwoTools =
    "MULTAX/ON\nFEDRAT/MMPM,500\nLOADTL/1\nRAPID\nGOTO/0,0,20,0,0,1\nGOTO/10,0,10,0,0,1\nGOTO/"
    "10,5,10,0.6,0,0.8\n"
    "LOADTL/2\nRAPID\nGOTO/0,0,20,0,0,1\nGOTO/10,0,10,0,0,1\nGOTO/10,5,10,0.6,0,0.8\nFINI\n";

Machine machine_with(OutputPoint point) {
  Machine machine = test::shipped_machine("trunnion_offset");
  machine.output_point = point;
  return machine;
}

/// Words of X Y Z A C of the feed motions.
std::vector<std::array<double, 5>> feed_words(const std::string& nc, const nc::Controller& control) {
  Diagnostics d;
  const auto blocks = nc::read_program(control, nc, "p.nc", d);
  std::vector<std::array<double, 5>> out;
  for (const auto& block : blocks.value()) {
    const auto* motion = std::get_if<nc::Motion>(&block);
    if (motion == nullptr || motion->kind != nc::MotionKind::feed) continue;
    std::array<double, 5> words{};
    std::size_t i = 0;
    for (const auto letter :
         {nc::AxisLetter::X, nc::AxisLetter::Y, nc::AxisLetter::Z, nc::AxisLetter::A, nc::AxisLetter::C})
      words.at(i++) = control.numbers.axes.internal(letter, motion->words[letter]);
    out.push_back(words);
  }
  return out;
}

// By hand: over the same point of the part the gauge point stands higher by what the tool is longer.
TEST(GaugeLength, WordsOfTheGaugePointAreThoseOfEachTool) {
  const ToolTable tools = tools_of("tool,length_mm\n1,150\n2,80\n");
  PostOptions options;
  options.tools.table = &tools;
  const Machine machine = machine_with(OutputPoint::spindle);
  const auto posted = test::posted(kTwoTools, machine, options);
  ASSERT_TRUE(posted.report) << findings_of(posted.diagnostics);
  EXPECT_TRUE(posted.report->verification->passed());
  const auto words = feed_words(posted.nc, test::shipped_controller("linuxcnc"));
  ASSERT_EQ(words.size() % 2, 0U);
  const std::size_t half = words.size() / 2;
  ASSERT_GE(half, 2U);
  for (std::size_t i = 0; i < half; ++i) {
    for (std::size_t axis = 0; axis < 5; ++axis)
      EXPECT_NEAR(words[i][axis] - words[half + i][axis], axis == 2 ? 70.0 : 0.0, 1.1e-4) << i << " " << axis;
  }
  EXPECT_EQ(posted.nc.find("G43"), std::string::npos);
  // Judged with the lengths swapped, or with one of them, the program is 70 mm off.
  for (const char* wrong : {"tool,length_mm\n1,80\n2,150\n", "tool,length_mm\n1,150\n2,150\n"}) {
    const ToolTable other = tools_of(wrong);
    const nc::Controller control = with_axes_of(machine, test::shipped_controller("linuxcnc"));
    VerifyOptions verify_options;
    verify_options.tools.table = &other;
    Diagnostics d;
    const auto report =
        verify({std::make_unique<test::TextOf>(kTwoTools), "part.cls"},
               {std::make_unique<test::TextOf>(posted.nc), "part.nc"}, {machine, control, verify_options}, d);
    ASSERT_TRUE(report);
    EXPECT_FALSE(report->passed());
    EXPECT_NEAR(report->max_tip_deviation_mm, 70.0, 1.0) << wrong;
  }
}

TEST(GaugeLength, TipWordsAreTheSameForEveryTool) {
  const auto one = test::posted(kTwoTools, machine_with(OutputPoint::tip));
  const std::string with_lengths =
      "MULTAX/ON\nFEDRAT/MMPM,500\nLOADTL/1,LENGTH,150\nRAPID\nGOTO/0,0,20,0,0,1\nGOTO/10,0,10,0,0,1\nGOTO/"
      "10,5,10,0.6,0,0.8\nLOADTL/2,LENGTH,80\nRAPID\nGOTO/0,0,20,0,0,1\nGOTO/10,0,10,0,0,1\nGOTO/"
      "10,5,10,0.6,0,0.8\nFINI\n";
  const auto two = test::posted(with_lengths, machine_with(OutputPoint::tip));
  ASSERT_TRUE(one.report);
  ASSERT_TRUE(two.report);
  const auto control = test::shipped_controller("linuxcnc");
  EXPECT_EQ(feed_words(one.nc, control), feed_words(two.nc, control));
  EXPECT_EQ(two.report->tools.at(1).length_mm, 80.0);
  EXPECT_NE(findings_of(one.diagnostics).find("tools 1, 2 have the gauge length of the machine file, 150 mm"),
            std::string::npos)
      << findings_of(one.diagnostics);
  EXPECT_EQ(findings_of(two.diagnostics).find("gauge length"), std::string::npos);
}

// A tilted spindle throws the tip aside by as much as the tool is long: what is right for one tool is 13 um
// off for the other, in tip words too.
TEST(GaugeLength, ErrorsAreCorrectedForTheToolInTheSpindle) {
  const Machine machine = machine_with(OutputPoint::tip);
  const Model model = test::model_of(
      "[model]\nname = \"m\"\n[[effect]]\nid = \"spindle_tilt\"\n[effect.parameters]\nA0S_urad = 200\n",
      machine);
  std::string cl = test::sample_path(5);
  const auto put = [&](const std::string& before, const std::string& text) {
    const auto at = cl.rfind(before);
    cl.replace(at, before.size(), text);
  };
  put("LOADTL/3", "LOADTL/3,LENGTH,150");
  put("RAPID", "LOADTL/4,LENGTH,83.5\nRAPID");
  PostOptions options;
  options.tolerance_mm = 0.005;
  const auto one = test::posted(cl, machine, options, "linuxcnc", &model);
  ASSERT_TRUE(one.report) << one.report.error().text();
  EXPECT_TRUE(one.report->verification->passed());
  options.threads = 2;
  EXPECT_EQ(test::posted(cl, machine, options, "linuxcnc", &model).nc, one.nc);
  const ModelEvaluator truth(model);
  const auto deviation = [&](const std::string& path) {
    const nc::Controller control = with_axes_of(machine, test::shipped_controller("linuxcnc"));
    VerifyOptions verify_options;
    verify_options.tolerance_mm = 0.005;
    verify_options.truth = &truth;
    Diagnostics d;
    return verify({std::make_unique<test::TextOf>(path), "part.cls"},
                  {std::make_unique<test::TextOf>(one.nc), "part.nc"}, {machine, control, verify_options}, d)
        .value()
        .certified_tip_deviation_mm;
  };
  EXPECT_LE(deviation(cl), 0.005);
  put("LOADTL/4,LENGTH,83.5", "LOADTL/4,LENGTH,150");
  EXPECT_NEAR(deviation(cl), 0.0133, 0.004);
}

// Z travel of 120 mm above the part's zero: the shorter tool fits, the longer one does not.
TEST(GaugeLength, LimitsAreThoseOfTheToolInTheSpindle) {
  Machine machine = machine_with(OutputPoint::tip);
  machine.axes[*machine.axis("Z")].max = 120.0;
  const std::string head = "MULTAX/ON\nFEDRAT/MMPM,500\nLOADTL/7,LENGTH,";
  const std::string path = "\nRAPID\nGOTO/0,0,20,0,0,1\nGOTO/0,0,10.5,0,0,1\nFINI\n";
  EXPECT_TRUE(test::posted(head + "99" + path, machine).report);
  const auto refused = test::posted(head + "150" + path, machine);
  ASSERT_FALSE(refused.report);
  EXPECT_EQ(
      refused.report.error().message,
      "spindle nose at Z 170.000 (tip 20.000 + tool 150.000): 50.000 above the limit of 120; 2 positions are "
      "beyond them, the first at line 5");
}

TEST(GaugeLength, AToolHasOneLength) {
  const auto twice =
      test::posted("FEDRAT/MMPM,500\nLOADTL/7,LENGTH,99\nGOTO/0,0,0\nLOADTL/7,LENGTH,98\nGOTO/0,0,1\nFINI\n",
                   machine_with(OutputPoint::tip));
  ASSERT_FALSE(twice.report);
  EXPECT_EQ(twice.report.error().text(),
            "part.cls:4:1: error: tool 7 has a gauge length of 98 mm here and was loaded with 99 mm before");
}

// H5 adds what stands in register 5, whichever tool is in the spindle: 30 mm too little for the second.
TEST(GaugeLength, ARegisterHoldsOneLength) {
  const auto cl = [](const std::string& first, const std::string& second) {
    return "FEDRAT/MMPM,500\nLOADTL/1," + first + "\nGOTO/0,0,0\nLOADTL/2," + second + "\nGOTO/0,0,1\nFINI\n";
  };
  const std::string two = cl("LENGTH,100,ADJUST,5", "LENGTH,130,ADJUST,5");
  const Machine machine = machine_with(OutputPoint::tip);
  const std::string told =
      "part.cls:4:1: error: length register 5 is that of tool 1 with 100 mm and of tool 2 with 130 mm: it "
      "holds "
      "one length, and the control would add it to both";
  for (const char* control : {"linuxcnc", "iso", "fanuc_30i", "haas_ngc"}) {
    const auto p = test::posted(two, machine, {}, control);
    ASSERT_FALSE(p.report) << control;
    EXPECT_EQ(p.report.error().text(), told);
  }
  EXPECT_FALSE(test::verified("", two, machine, 0.01, "iso"));
  // The length belongs to the tool there, and here the words are those of the gauge point.
  for (const char* control : {"siemens_840d_sl", "heidenhain_tnc640"})
    EXPECT_TRUE(test::posted(two, machine, {}, control).report) << control;
  EXPECT_TRUE(test::posted(two, machine_with(OutputPoint::spindle)).report);
  EXPECT_FALSE(test::posted(cl("LENGTH,100,ADJUST,2", "LENGTH,130"), machine).report);
  EXPECT_TRUE(test::posted(cl("LENGTH,100,ADJUST,6", "LENGTH,130,ADJUST,5"), machine).report);
  const auto equal = test::posted(cl("LENGTH,100,ADJUST,5", "LENGTH,100,ADJUST,5"), machine);
  EXPECT_TRUE(equal.report);
  EXPECT_NE(findings_of(equal.diagnostics)
                .find("part.cls: warning: length register 5 is that of tool 1 with 100 mm"),
            std::string::npos);
  // Of the tools of the shop, too: tool 5 stands in the magazine, and its length in the register.
  const ToolTable shop = tools_of("tool,length_mm\n1,100\n5,130\n");
  PostOptions options;
  options.tools.table = &shop;
  EXPECT_FALSE(
      test::posted("FEDRAT/MMPM,500\nLOADTL/1,ADJUST,5\nGOTO/0,0,0\nFINI\n", machine, options).report);
  EXPECT_TRUE(
      test::posted("FEDRAT/MMPM,500\nLOADTL/1,ADJUST,6\nGOTO/0,0,0\nFINI\n", machine, options).report);
}

TEST(GaugeLength, ARegisterWithAnotherToolsNumberIsToldOf) {
  const std::string cl = "FEDRAT/MMPM,500\nLOADTL/4\nGOTO/0,0,0\nLOADTL/5\nGOTO/0,0,1\nFINI\n";
  const Machine machine = machine_with(OutputPoint::tip);
  PostOptions options;
  const ToolTable crossed = tools_of("tool,length_mm,register\n4,100,5\n5,80,4\n");
  options.tools.table = &crossed;
  const auto p = test::posted(cl, machine, options, "fanuc_30i");
  ASSERT_TRUE(p.report);
  EXPECT_NE(findings_of(p.diagnostics).find("tool 4 (100 mm) takes length register 5"), std::string::npos);
  // Registers of their own, and controls whose lengths belong to the tool.
  const ToolTable apart = tools_of("tool,length_mm,register\n4,100,14\n5,80,15\n");
  options.tools.table = &apart;
  EXPECT_EQ(
      findings_of(test::posted(cl, machine, options, "fanuc_30i").diagnostics).find("takes length register"),
      std::string::npos);
  options.tools.table = &crossed;
  EXPECT_EQ(findings_of(test::posted(cl, machine, options, "siemens_840d_sl").diagnostics)
                .find("takes length register"),
            std::string::npos);
}

TEST(GaugeLength, ToolFileAndClFileThatDifferAreTold) {
  const ToolTable shop = tools_of("tool,length_mm\n1,100\n2,4\n");  // 2: in inches
  PostOptions options;
  options.tools.table = &shop;
  const auto p = test::posted(
      "FEDRAT/MMPM,500\nLOADTL/1,LENGTH,104\nGOTO/0,0,0\nLOADTL/2,LENGTH,101.6\nGOTO/0,0,1\nFINI\n",
      machine_with(OutputPoint::tip), options);
  ASSERT_TRUE(p.report) << p.report.error().text();
  const std::string found = findings_of(p.diagnostics);
  EXPECT_NE(found.find("differ: tool 2 101.6 mm and 4 mm: is it the same tool, and in mm?"),
            std::string::npos)
      << found;
}

const char* const kNoTool = "FEDRAT/MMPM,500\nRAPID\nGOTO/0,0,20\nGOTO/0,0,10\nGOTO/5,0,10\nFINI\n";

Result<PostReport> without_tool(const Machine& machine, const PostOptions& options,
                                const std::string& control, std::string& nc) {
  const nc::Controller c = with_axes_of(machine, test::shipped_controller(control));
  PostJob job;
  job.cl_file = "part.cls";
  job.machine = &machine;
  job.controller = &c;
  Diagnostics d;
  return post(
      std::make_unique<test::TextOf>(kNoTool), job, options,
      [&](std::string_view text) {
        nc += text;
        return Result<void>{};
      },
      d);
}

TEST(NoTool, IsAnErrorWhereTheControlAddsALength) {
  for (const char* control :
       {"linuxcnc", "iso", "fanuc_30i", "haas_ngc", "siemens_840d_sl", "hnc_8", "heidenhain_tnc640"}) {
    std::string nc;
    const auto report = without_tool(machine_with(OutputPoint::tip), {}, control, nc);
    ASSERT_FALSE(report) << control;
    EXPECT_EQ(report.error().code, ErrorCode::wrong_input);
    EXPECT_EQ(report.error().where.line, 3U);
    EXPECT_NE(report.error().message.find("--tool N"), std::string::npos) << report.error().message;
  }
}

TEST(NoTool, ANumberStandsInFrontOfTheFile) {
  for (const char* control :
       {"linuxcnc", "iso", "fanuc_30i", "haas_ngc", "siemens_840d_sl", "hnc_8", "heidenhain_tnc640"}) {
    PostOptions options;
    options.tools.tool = 5;
    options.tools.length_mm = 90.0;
    std::string nc;
    const auto report = without_tool(machine_with(OutputPoint::tip), options, control, nc);
    ASSERT_TRUE(report) << control << " " << report.error().text();
    EXPECT_TRUE(report->verification->passed()) << control;
    EXPECT_EQ(report->tools.at(0).length_mm, 90.0);
    EXPECT_EQ(report->tools.at(0).source, LengthSource::option);
    EXPECT_NE(nc.find(control == std::string("heidenhain_tnc640") ? "TOOL CALL 5 Z" : "T5"),
              std::string::npos)
        << nc;
  }
}

// The gauge point stands 90 mm above the tip, and no length is on.
TEST(NoTool, ALengthAloneMakesWordsOfTheGaugePoint) {
  for (const char* control : {"linuxcnc", "iso", "fanuc_30i", "haas_ngc", "siemens_840d_sl", "hnc_8"}) {
    PostOptions options;
    options.tools.length_mm = 90.0;
    std::string nc;
    const Machine machine = machine_with(OutputPoint::tip);
    const auto report = without_tool(machine, options, control, nc);
    ASSERT_TRUE(report) << control << " " << report.error().text();
    EXPECT_TRUE(report->verification->passed()) << control;
    EXPECT_EQ(nc.find("G43"), std::string::npos);
    EXPECT_NE(nc.find(control == std::string("siemens_840d_sl") ? "D0" : "G49"), std::string::npos) << nc;
    const auto words = feed_words(nc, with_axes_of(machine, test::shipped_controller(control)));
    ASSERT_FALSE(words.empty());
    EXPECT_NEAR(words.front()[2], 100.0, 1e-9) << control;
    EXPECT_NEAR(words.back()[2], 100.0, 1e-9) << control;
  }
  PostOptions options;
  options.tools.length_mm = 90.0;
  std::string nc;
  EXPECT_FALSE(without_tool(machine_with(OutputPoint::tip), options, "heidenhain_tnc640", nc));
  options.rtcp = true;
  options.feed = FeedOutput::tip;
  EXPECT_FALSE(without_tool(machine_with(OutputPoint::tip), options, "fanuc_30i", nc));
}

TEST(NoTool, WordsOfTheGaugePointNeedNone) {
  std::string nc;
  const auto report = without_tool(machine_with(OutputPoint::spindle), {}, "linuxcnc", nc);
  ASSERT_TRUE(report) << report.error().text();
  EXPECT_TRUE(report->verification->passed());
  EXPECT_EQ(report->tools.at(0).length_mm, 150.0);
  EXPECT_FALSE(report->tools.at(0).number);
}

// Read back: a tool that nobody knows, and a length that is never switched on.
TEST(GaugeLength, TheVerificationReadsToolAndLength) {
  const auto posted = test::posted(
      "FEDRAT/MMPM,500\nLOADTL/7,LENGTH,99\nRAPID\nGOTO/0,0,20\nGOTO/0,0,10\nGOTO/5,0,10\nFINI\n",
      machine_with(OutputPoint::tip));
  ASSERT_TRUE(posted.report);
  const std::string cl =
      "FEDRAT/MMPM,500\nLOADTL/7,LENGTH,99\nRAPID\nGOTO/0,0,20\nGOTO/0,0,10\nGOTO/5,0,10\nFINI\n";
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string nc = posted.nc;
    const auto at = nc.find(from);
    EXPECT_NE(at, std::string::npos) << from << "\n" << nc;
    return nc.replace(at, from.size(), to);
  };
  const Machine machine = machine_with(OutputPoint::tip);
  EXPECT_TRUE(test::verified(posted.nc, cl, machine, 0.01)->passed());
  EXPECT_FALSE(test::verified(changed("T7 M6", "T9 M6"), cl, machine, 0.01));
  const auto no_length = test::verified(changed("G43 H7", "G49"), cl, machine, 0.01);
  EXPECT_FALSE(no_length && no_length->passed());
}

}  // namespace
}  // namespace trunnion::post
