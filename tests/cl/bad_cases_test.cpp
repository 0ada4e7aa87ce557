#include <algorithm>
#include <filesystem>
#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "trunnion/base/files.hpp"

#include "cl/support.hpp"
#include "support/folders.hpp"

namespace trunnion::cl {
namespace {

std::vector<std::filesystem::path> bad_cases() {
  std::vector<std::filesystem::path> cases;
  for (const auto& entry :
       std::filesystem::directory_iterator(trunnion::test::source_folder() + "/tests/cases/bad")) {
    if (entry.path().extension() == ".cls") cases.push_back(entry.path());
  }
  std::sort(cases.begin(), cases.end());
  return cases;
}

// Each file's first line says what its only error has to be: `$$ expect: file:line:column: error: message`.
TEST(BadCases, EachGivesExactlyTheErrorOfItsFirstLine) {
  const std::string prefix = "$$ expect: ";
  const auto cases = bad_cases();
  EXPECT_GE(cases.size(), 20U);
  for (const auto& path : cases) {
    const auto text = read_file(path.string());
    ASSERT_TRUE(text) << path;
    const std::string first = text->substr(0, text->find('\n'));
    ASSERT_TRUE(first.starts_with(prefix)) << path;
    Diagnostics diagnostics;
    const auto program = read_program(*text, path.filename().string(), {}, diagnostics);
    ASSERT_FALSE(program) << path;
    EXPECT_EQ(program.error().code, ErrorCode::wrong_input) << path;
    EXPECT_EQ(program.error().text(), first.substr(prefix.size())) << path;
    EXPECT_EQ(diagnostics.findings().size(), 1U) << path;
  }
}

TEST(BadCases, AllFaultsOfAFileAreReported) {
  const auto reading = test::read(
      "GOTO/1,2\nGOTO/0,0,0,0,0,1\nFEDRAT/-5\nGOTO/1,NAN,1e999\nSPINDL/RPM\nCIRCEL/1\nCIRCEL/2\nGOTO/"
      "1,2,3,0,0,0\n");
  EXPECT_EQ(test::joined(reading.findings),
            "1:1: error: GOTO: 2 values; 3 (x, y, z) or 6 (x, y, z, i, j, k) are needed\n"
            "3:8: error: FEDRAT: -5 is not above 0\n"
            "4:8: error: GOTO: 'NAN' is not a number\n"
            "4:12: error: GOTO: '1E999' is beyond the range of numbers\n"
            "6:1: error: CIRCEL is not known; did you mean CIRCLE? (if it means nothing: SYN/'CIRCEL','$$')\n"
            "7:1: error: CIRCEL is not known; did you mean CIRCLE? (if it means nothing: SYN/'CIRCEL','$$')\n"
            "8:12: error: GOTO: the tool axis (0, 0, 0) has no direction\n");
  EXPECT_EQ(reading.motions().size(), 1U);
}

TEST(BadCases, OfAKindOfFaultTenAreSaidAndTheRestIsCounted) {
  std::string text;
  for (int i = 0; i < 5000; ++i) text += "GOTO/" + std::to_string(i) + "\nMOVNRB/" + std::to_string(i) + "\n";
  const auto reading = test::read(text);
  ASSERT_EQ(reading.findings.size(), 22U);
  EXPECT_EQ(
      reading.findings[20],
      "9999:1: note: 4990 more of these, the last one here: GOTO: 1 value; 3 (x, y, z) or 6 (x, y, z, i, j, "
      "k) are needed");
  EXPECT_EQ(reading.findings[21],
            "10000:1: note: 4990 more of these, the last one here: MOVNRB changes the geometry and is not "
            "understood by this program (Creo: OUTPUT_3DNURBS NO)");
}

TEST(BadCases, AFileOfNothingButDifferentFaultsStopsAtAThousand) {
  std::string text;
  for (int i = 0; i < 5000; ++i) {
    std::string word = "GO";
    for (int k = i + 1; k > 0; k /= 26) word += static_cast<char>('A' + k % 26);
    text += word + "X\n";
  }
  const auto reading = test::read(text);
  ASSERT_EQ(reading.findings.size(), 1000U);
  EXPECT_EQ(reading.findings.back(), "1000:1: error: 1000 errors: the rest of the file is not read");
}

TEST(BadCases, WordsThatNobodyKnowsAreAtMostAHundredWarnings) {
  std::string text = "GOTO/0,0,0\n";
  for (int i = 0; i < 5000; ++i) text += "XQ" + std::to_string(i) + "\n";
  const auto reading = test::read(text);
  ASSERT_EQ(reading.findings.size(), 101U);
  EXPECT_EQ(reading.findings.back(), " note: 4900 more warnings");
}

// GTO/0,0,10 would be a motion that gets lost with a warning.
TEST(BadCases, AnUnknownWordThatMayBeAMotionIsAnError) {
  const auto verdict = [](const std::string& line) {
    return test::joined(test::read("GOTO/0,0,9\n" + line + "\n").findings);
  };
  EXPECT_EQ(verdict("GTO/0,0,10,0,0,1"),
            "2:1: error: GTO is not known, and its 6 numbers may be a point (if it means nothing: "
            "SYN/'GTO','$$')\n");
  EXPECT_EQ(verdict("MOVETO/0,0,-10").substr(0, 61),
            "2:1: error: MOVETO is not known, and its 3 numbers may be a p");
  // A number before a word hides what it says.
  EXPECT_EQ(verdict("N20 LOADTL/7"),
            "2:1: error: N20LOADTL: a block number before LOADTL; statements of a CL file have none: take "
            "the numbers out\n");
  EXPECT_NE(verdict("N50 CUTCOM/LEFT").find("error: N50CUTCOM: a block number before CUTCOM"),
            std::string::npos);
  EXPECT_EQ(verdict("MOVETO/0,0,-10,5"), "2:1: warning: MOVETO is not known and was skipped\n");
  EXPECT_EQ(verdict("CIRCEL/0,0,0,0,0,1").substr(0, 84),
            "2:1: error: CIRCEL is not known, and its 6 numbers may be a point; did you mean CIRC");
  EXPECT_EQ(
      verdict("CIRCEL/1"),
      "2:1: error: CIRCEL is not known; did you mean CIRCLE? (if it means nothing: SYN/'CIRCEL','$$')\n");
  EXPECT_EQ(verdict("MULTAXX/ON").substr(0, 60),
            "2:1: error: MULTAXX is not known; did you mean MULTAX? (if i");
  EXPECT_EQ(verdict("COLNT/ON"), "2:1: warning: COLNT is not known and was skipped; did you mean COOLNT?\n");
  EXPECT_EQ(verdict("GOTOO/1"), "2:1: error: GOTOO: no motion word of this name; did you mean GOTO?\n");
  EXPECT_EQ(verdict("SYN/'CIRCEL','$$'\nCIRCEL/1"), "");
}

// Nothing of a file acts on a terminal: messages are ASCII, whatever stands in a word.
TEST(BadCases, BytesThatAreNotAsciiAreShownAsNumbers) {
  EXPECT_EQ(test::joined(test::read("GOTO/0,0,0\nXQ\x9B"
                                    "2J/1\n")
                             .findings),
            "2:1: warning: XQ\\x9B2J is not known and was skipped\n");
}

TEST(BadCases, EmptyTextsHaveNoMotion) {
  for (const std::string text : {"", "\n", "\n\n\n", "$$ only a comment", "   \t  "}) {
    const auto reading = test::read(text);
    ASSERT_EQ(reading.findings.size(), 1U);
    EXPECT_TRUE(reading.findings[0].ends_with("error: no motion (GOTO) in the file")) << reading.findings[0];
  }
}

TEST(BadCases, Utf16IsNamed) {
  const std::string text("\xFF\xFEG\0O\0T\0O\0", 10);
  EXPECT_EQ(test::joined(test::read(text).findings),
            "1:1: error: UTF-16 text: a CL file is ASCII or UTF-8\n");
}

TEST(BadCases, AMissingFileOrAFolderIsAnInputOutputError) {
  Diagnostics diagnostics;
  for (const std::string path : {"/nonexistent/part.cls", "/"}) {
    const auto program = load_program(path, {}, diagnostics);
    ASSERT_FALSE(program);
    EXPECT_EQ(program.error().code, ErrorCode::io_failed);
    EXPECT_EQ(program.error().file, path);
  }
}

}  // namespace
}  // namespace trunnion::cl
