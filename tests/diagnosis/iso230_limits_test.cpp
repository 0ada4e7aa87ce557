#include "trunnion/diagnosis/iso230_limits.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trunnion::iso230 {
namespace {

using testing::HasSubstr;

NamedNumber number(const char* text) {
  const auto parsed = parse_named_number(text);
  EXPECT_TRUE(parsed.has_value()) << text;
  return parsed.value_or(NamedNumber{});
}

// Two axes in mm and one in rad: X.A 10 um, Y.A 20 um, C.A 30 urad; Y has no R.
std::vector<NamedValue> values() {
  return {{"X", "A", false, 0.010}, {"X", "R", false, 0.004}, {"Y", "A", false, 0.020},
          {"Y", "R", false, {}},    {"C", "A", true, 30e-6},  {"X", "B_mean", false, -0.003}};
}

TEST(Iso230Limits, TheUncertaintyCountsAgainstWhoHasToProve) {
  // 10 um against 12 um: U = 1.9 proves it, 2.1 leaves it open; against 7 um: 2.9 proves the contrary.
  const auto of = [&](const char* limit, const char* uncertainty) {
    const auto held = hold_against(values(), {number(limit)}, {number(uncertainty)});
    EXPECT_TRUE(held.has_value());
    EXPECT_EQ(held->size(), 1U);
    return held->front().conformity;
  };
  EXPECT_EQ(of("X.A=12", "X.A=1.9"), Conformity::within);
  EXPECT_EQ(of("X.A=12", "A=2.1"), Conformity::undecided);
  EXPECT_EQ(of("X.A=7", "A=2.9"), Conformity::beyond);
  EXPECT_EQ(of("X.A=7", "A=3.1"), Conformity::undecided);
}

TEST(Iso230Limits, WithoutUncertaintyTheLimitItselfDecides) {
  const auto held = hold_against(values(), {number("A=20")}, {});
  ASSERT_TRUE(held.has_value());
  ASSERT_EQ(held->size(), 3U);
  EXPECT_EQ((*held)[0].conformity, Conformity::within);
  EXPECT_EQ((*held)[1].conformity, Conformity::within);  // 20 of 20
  EXPECT_EQ((*held)[2].conformity, Conformity::beyond);  // 30 urad of 20
  EXPECT_FALSE(all_within(*held));
}

TEST(Iso230Limits, TheLimitOfALineGoesBeforeThatOfAll) {
  for (const auto& limits :
       {std::vector{number("A=5"), number("X.A=11")}, std::vector{number("X.A=11"), number("A=5")}}) {
    const auto held = hold_against(values(), limits, {});
    ASSERT_TRUE(held.has_value());
    EXPECT_DOUBLE_EQ((*held)[0].limit, 0.011);
    EXPECT_DOUBLE_EQ((*held)[1].limit, 0.005);
  }
}

TEST(Iso230Limits, SignedValuesCountBySize) {
  const auto held = hold_against(values(), {number("B_mean=2")}, {});
  ASSERT_TRUE(held.has_value());
  EXPECT_EQ(held->front().conformity, Conformity::beyond);
}

TEST(Iso230Limits, WhatTheStandardDoesNotGiveIsNotWithin) {
  const auto held = hold_against(values(), {number("Y.R=100")}, {});
  ASSERT_TRUE(held.has_value());
  EXPECT_EQ(held->front().conformity, Conformity::no_value);
  EXPECT_FALSE(all_within(*held));
}

TEST(Iso230Limits, RefusesWhatItCannotTake) {
  for (const char* text : {"A", "=3", "A=", "A=x", "A=0", "A=-1", "A=nan", "A=3um", "X.=3"})
    EXPECT_FALSE(parse_named_number(text).has_value()) << text;
  const auto unknown = hold_against(values(), {number("Z.A=3")}, {});
  ASSERT_FALSE(unknown.has_value());
  EXPECT_THAT(unknown.error().message, HasSubstr("no value Z.A"));
  EXPECT_FALSE(hold_against(values(), {number("A=3")}, {number("Q=1")}).has_value());
}

}  // namespace
}  // namespace trunnion::iso230
