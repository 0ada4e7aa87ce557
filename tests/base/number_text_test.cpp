#include "trunnion/base/number_text.hpp"

#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <random>

namespace trunnion {
namespace {

TEST(ParseNumber, TakesWhatClFilesHold) {
  EXPECT_EQ(parse_number(".5").value, 0.5);
  EXPECT_EQ(parse_number("25.").value, 25.0);
  EXPECT_EQ(parse_number("+1.5").value, 1.5);
  EXPECT_EQ(parse_number("-0.5").value, -0.5);
  EXPECT_EQ(parse_number("1.5D+3").value, 1500.0);
  EXPECT_EQ(parse_number("1e-400").value, 0.0);
}

TEST(ParseNumber, SaysWhyNot) {
  EXPECT_EQ(parse_number("").fault, NumberFault::empty);
  EXPECT_EQ(parse_number("+").fault, NumberFault::empty);
  EXPECT_EQ(parse_number("nan").fault, NumberFault::not_a_number);
  EXPECT_EQ(parse_number("inf").fault, NumberFault::not_a_number);
  EXPECT_EQ(parse_number("+-1").fault, NumberFault::not_a_number);
  EXPECT_EQ(parse_number(".").fault, NumberFault::not_a_number);
  EXPECT_EQ(parse_number("1e400").fault, NumberFault::out_of_range);
  EXPECT_EQ(parse_number("1.2.3").fault, NumberFault::trailing_characters);
  EXPECT_EQ(parse_number("0x10").fault, NumberFault::trailing_characters);
}

TEST(FixedText, RoundsToWholeQuantaFirst) {
  EXPECT_EQ(fixed_text(-0.00004, 4), "0.0000");
  EXPECT_EQ(fixed_text(-0.00005, 4), "-0.0001");
  EXPECT_EQ(fixed_text(1.25, 1), "1.3");
  EXPECT_EQ(fixed_text(-12.0, 0), "-12");
  EXPECT_EQ(fixed_text(0.05, 4), "0.0500");
  EXPECT_EQ(fixed_text(-1e20, 2), "-100000000000000000000.00");
}

TEST(FixedText, AgreesWithPrintfWithinHalfAQuantum) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> value(-1e4, 1e4);
  for (int i = 0; i < 100000; ++i) {
    const double v = value(random);
    ASSERT_LE(std::abs(parse_number(fixed_text(v, 4)).value - v), 0.5e-4 + 1e-11);
  }
}

TEST(ShortestText, ReadsBackAsTheSameDouble) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> exponent(-300, 300);
  for (int i = 0; i < 10000; ++i) {
    const double v = std::pow(10.0, exponent(random));
    ASSERT_EQ(parse_number(shortest_text(v)).value, v);
  }
  EXPECT_EQ(shortest_text(-0.0), "0");
}

}  // namespace
}  // namespace trunnion
