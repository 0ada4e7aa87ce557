#include "trunnion/config/csv.hpp"

#include <gtest/gtest.h>

namespace trunnion::config {
namespace {

TEST(Csv, ReadsQuotesCommentsCrlfAndBom) {
  Diagnostics d;
  const auto t =
      parse_csv("\xEF\xBB\xBF# made by hand\r\nX_mm,\"a,b\",u\r\n1,\"say \"\"x\"\"\",\r\n\n2,,3", "d.csv", d);
  ASSERT_TRUE(t);
  EXPECT_EQ(t->columns, (std::vector<std::string>{"X_mm", "a,b", "u"}));
  ASSERT_EQ(t->rows.size(), 2u);
  EXPECT_EQ(t->rows[0].fields[1], "say \"x\"");
  EXPECT_EQ(t->rows[0].fields[2], "");
  EXPECT_EQ(t->rows[1].line, 5u);
  EXPECT_EQ(t->comments, (std::vector<std::string>{" made by hand"}));
}

TEST(Csv, ReportsAllFaultyRows) {
  Diagnostics d;
  EXPECT_FALSE(parse_csv("a,b\n1\n1,2\n1,2,3\n\"1,2\n", "d.csv", d));
  ASSERT_EQ(d.findings().size(), 3u);
  EXPECT_EQ(d.findings()[0].text(), "d.csv:2:2: error: row has 1 fields, the header has 2");
  EXPECT_EQ(d.findings()[1].text(), "d.csv:4:3: error: row has 3 fields, the header has 2");
  EXPECT_EQ(d.findings()[2].text(), "d.csv:5:1: error: quotes are not closed or stand inside a field");
}

TEST(Csv, EmptyFileAndDoubleColumnsAreErrors) {
  Diagnostics d;
  EXPECT_EQ(parse_csv("", "d.csv", d).error().text(), "d.csv:1:1: error: no header line: the file is empty");
  Diagnostics d2;
  EXPECT_EQ(parse_csv("a,a\n", "d.csv", d2).error().text(),
            "d.csv:1:2: error: column 2 has a name that stands twice in the header");
}

// People send what their spreadsheet saves: the first bytes of an xlsx of openpyxl, of an xls.
TEST(Csv, SaysThatAWorkbookIsNoText) {
  using std::string_view_literals::operator""sv;
  for (const std::string_view bytes :
       {"PK\x03\x04\x14\x00\x00\x00\x08\x00"sv, "\xD0\xCF\x11\xE0\xA1\xB1\x1A\xE1"sv}) {
    Diagnostics d;
    EXPECT_EQ(parse_csv(bytes, "d.xlsx", d).error().text(),
              "d.xlsx:1:1: error: this is a spreadsheet's own file (xlsx, ods, xls), no text: save the sheet "
              "as CSV, or "
              "xlsx2csv FILE.xlsx FILE.csv (Debian package xlsx2csv)");
    EXPECT_EQ(d.findings().size(), 1u);
  }
}

TEST(Csv, NumbersAreCheckedWithTheirPlace) {
  Diagnostics d;
  const auto t = parse_csv("a,b\n 1.5 ,x\n", "d.csv", d);
  EXPECT_EQ(csv_number(*t, t->rows[0], 0, d), 1.5);
  EXPECT_FALSE(csv_number(*t, t->rows[0], 1, d));
  EXPECT_EQ(d.findings()[0].text(), "d.csv:2:2: error: 'x' in column 'b' is not a number");
}

TEST(Csv, FieldIsQuotedWhereItMustBe) {
  EXPECT_EQ(csv_field("plain"), "plain");
  EXPECT_EQ(csv_field("a,\"b\""), "\"a,\"\"b\"\"\"");
}

}  // namespace
}  // namespace trunnion::config
