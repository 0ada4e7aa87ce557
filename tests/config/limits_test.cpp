// What hostile files hold: formulas of spreadsheets, numbers beyond all, bytes that the parsers do not
// expect.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trunnion/base/number_text.hpp"
#include "trunnion/config/csv.hpp"
#include "trunnion/config/section.hpp"

namespace trunnion::config {
namespace {

// What a text becomes in a file and from there in a table again.
TEST(CsvLimits, NoFieldActsInASpreadsheet) {
  for (const std::string text : {"=cmd|' /C calc'!A0", "+1+cmd", "-2+3", "@SUM(A1)", "'=x", "''+x", "a;=b",
                                 "tab\t=b", "it's", "'quoted'", "-5", "+.5", "#1", "a,b", "\"", ""}) {
    const std::string field = csv_field(text);
    const char first = field.empty() ? 'x' : field[field[0] == '"' ? 1 : 0];
    EXPECT_TRUE(std::string("=+-@").find(first) == std::string::npos || parse_number(field)) << field;
    EXPECT_TRUE(field.find_first_of(";\t") == std::string::npos || field[0] == '"') << field;
    Diagnostics d;
    const auto table = parse_csv("a,b\n" + field + ",1\n", "d.csv", d);
    ASSERT_TRUE(table) << field;
    EXPECT_EQ(table->rows.at(0).fields.at(0), text);
  }
}

TEST(CsvLimits, RefusesNumbersThatNothingHas) {
  Diagnostics d;
  CsvRows rows("a\n9e15\n1e16\n-1e300\n", "d.csv", d);
  ASSERT_TRUE(rows.next());
  EXPECT_TRUE(rows.number(0));
  ASSERT_TRUE(rows.next());
  EXPECT_FALSE(rows.number(0));
  ASSERT_TRUE(rows.next());
  EXPECT_FALSE(rows.number_or_nan(0));
  ASSERT_EQ(d.error_count(), 2u);
  EXPECT_EQ(d.findings()[1].text(),
            "d.csv:4:1: error: '-1e300' in column 'a' is beyond the range of numbers (9e15)");
}

TEST(TomlLimits, RefusesNumbersThatNothingHas) {
  const auto root = parse_toml("a_mm = 1e300\nb = [1, -1e16]\nc = 9e15\n", "m.toml");
  ASSERT_TRUE(root);
  Diagnostics d;
  Section s(*root, "t", "m.toml", d);
  s.quantity("a_mm");
  s.find_numbers("b");
  EXPECT_EQ(s.find_number("c"), 9e15);
  ASSERT_EQ(d.error_count(), 2u);
  EXPECT_NE(d.findings()[0].text().find(": error: 'a_mm' is beyond the range of numbers (9e15): 1e+300"),
            std::string::npos);
  EXPECT_NE(d.findings()[1].text().find(": error: 'b' is beyond the range of numbers (9e15): -1e+16"),
            std::string::npos);
}

// The parser is undefined on some of them.
TEST(TomlLimits, CharactersBeyondAsciiStandInQuotesAndCommentsOnly) {
  for (const std::string text :
       {"# ä\na = \"ä\\\" ä\" # ä", "a = 'ä\\' # 'ä'",
        "\xEF\xBB\xBF"
        "a = 1",
        "a = \"\"\"\nä \"ä\" \"\"\"\nb = '''ä'\n''ä'''", "\"ä\" = 1", "a = \"\"\"ä\"\"\"\"\"\nb = 1"})
    EXPECT_TRUE(parse_toml(text, "m.toml")) << text;
  for (const auto& [text, place] : std::vector<std::pair<std::string, std::string>>{
           {"a\xc3\xa4 = 1", "m.toml:1:2"},
           {"a = 1\nb = \xe2\x80\x9cx\xe2\x80\x9d", "m.toml:2:5"},
           {"\xff", "m.toml:1:1"},
           {"a = 'x'\xc3\xa4", "m.toml:1:8"},
           {"a = \"\"\"x\"\"\"\xc3", "m.toml:1:12"}}) {
    const auto value = parse_toml(text, "m.toml");
    ASSERT_FALSE(value) << text;
    EXPECT_EQ(value.error().text(), place + ": error: a character that is not ASCII stands outside quotes");
  }
}

TEST(TomlLimits, RefusesWhatIsTooDeepOrTooLarge) {
  std::string key = "a";
  for (int i = 0; i < 20000; ++i) key += ".a";
  for (const std::string& text : {key + " = 1", "[" + key + "]", std::string(20000, '['),
                                  "a = " + std::string(20000, '{'), "a = " + std::string(20000, '[')})
    EXPECT_FALSE(parse_toml(text, "m.toml"));
  EXPECT_FALSE(parse_toml("#" + std::string(std::size_t{17} << 20, 'x'), "m.toml"));
}

// The parser takes a value for granted there: what it does is undefined (found by tests/fuzz).
TEST(TomlLimits, NoBraceClosesWhereAValueOfAnArrayMustStand) {
  for (const std::string text :
       {"a = [}", "a = [ }", "a = [1, }", "a = [[}", "a=[{b=[\n# x\n}", "a = [\"x\",}"}) {
    const auto value = parse_toml(text, "m.toml");
    ASSERT_FALSE(value) << text;
    EXPECT_THAT(value.error().text(), testing::HasSubstr("'}' stands where a value must")) << text;
  }
  EXPECT_TRUE(parse_toml("a = [{}]\nb = {}\nc = [\"[}\", { d = [] }]\n# [}", "m.toml"));
}

// The parser's own checks of these are assertions, which no release build has.
TEST(TomlLimits, NoTableIsWithoutANameBehindTheByteOrderMark) {
  for (const std::string& text : {std::string("\xef\xbb\xbf[\0x]", 6), std::string("\xef\xbb\xbf[=]")}) {
    const auto value = parse_toml(text, "m.toml");
    ASSERT_FALSE(value);
    EXPECT_EQ(value.error().text(), "m.toml:1:1: error: the head of a table without a name");
  }
  EXPECT_TRUE(parse_toml("\xef\xbb\xbf[a]\nb = 1", "m.toml"));
}

TEST(TomlLimits, NoQuoteStandsBehindAValue) {
  for (const auto& [text, place] :
       std::vector<std::pair<std::string, std::string>>{{"a = 0'\xc3\x92'", "m.toml:1:6"},
                                                        {"a = 1 \"x\"", "m.toml:1:7"},
                                                        {"a = [1 'x']", "m.toml:1:8"},
                                                        {"a'b' = 1", "m.toml:1:2"}}) {
    const auto value = parse_toml(text, "m.toml");
    ASSERT_FALSE(value) << text;
    EXPECT_EQ(value.error().text(), place + ": error: a quote stands where no text may begin");
  }
  EXPECT_TRUE(parse_toml(
      "'a'.\"b\" = ['x', \"y\"]\nc = { 'd' = '', e = \"\" }\nf = [\n'g',\n  'h' ]\n['i']\n[[\"j\"]]",
      "m.toml"));
}

}  // namespace
}  // namespace trunnion::config
