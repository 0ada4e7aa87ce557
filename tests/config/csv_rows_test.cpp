#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/base/number_text.hpp"
#include "trunnion/config/csv.hpp"

namespace trunnion::config {
namespace {

TEST(CsvRows, QuotedAndPlainLinesGiveTheSameFields) {
  Diagnostics diagnostics;
  CsvRows rows("# note\r\na,b\r\n1 , 2\r\n\"x, y\",\"\"\n\n,\n", "t.csv", diagnostics);
  ASSERT_EQ(rows.columns(), (std::vector<std::string>{"a", "b"}));
  ASSERT_TRUE(rows.next());
  EXPECT_EQ(rows.fields()[0], "1");
  EXPECT_EQ(rows.number(1), 2.0);
  ASSERT_TRUE(rows.next());
  EXPECT_EQ(rows.line(), 4U);
  EXPECT_EQ(rows.fields()[0], "x, y");
  EXPECT_TRUE(std::isnan(*rows.number_or_nan(1)));
  ASSERT_TRUE(rows.next());
  EXPECT_EQ(rows.fields().size(), 2U);
  EXPECT_FALSE(rows.next());
  EXPECT_FALSE(diagnostics.has_errors());
  EXPECT_EQ(rows.comments(), (std::vector<std::string>{" note"}));
}

// The short way through a plain decimal must round like the C library (strtod rounds correctly in glibc).
TEST(NumberText, PlainDecimalsRoundCorrectly) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 200000; ++i) {
    const auto digits = std::to_string(random() % 1000000000000000ULL);
    std::string text = digits;
    text.insert(random() % (digits.size() + 1), ".");
    if (random() % 2 == 0) text.insert(0, "-");
    const auto number = parse_number(text);
    ASSERT_TRUE(number) << text;
    ASSERT_EQ(number.value, std::strtod(text.c_str(), nullptr)) << text;
  }
}

}  // namespace
}  // namespace trunnion::config
