// Models that are wrong in ways that once went through: they are refused with their place, or end in a
// failure, never in a figure.
#include <chrono>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trunnion/base/failure.hpp"
#include "trunnion/effects/model.hpp"
#include "trunnion/effects/table.hpp"

#include "support/effect_cases.hpp"

namespace trunnion {
namespace {

using testing::HasSubstr;

Result<Model> attacked_model(const std::string& effect, Diagnostics& diagnostics) {
  return parse_model("[model]\nname = \"m\"\n[[effect]]\n" + effect, "m.toml",
                     test::effect_machine("trunnion_offset"), {}, diagnostics);
}

std::string refusal_of(const std::string& effect) {
  Diagnostics diagnostics;
  const auto model = attacked_model(effect, diagnostics);
  return model ? std::string("(no error)") : model.error().text();
}

std::string user_effect(const std::string& expression, const std::string& parameters = "k_um = 3.0") {
  return "id = \"user:x\"\njoint = \"A\"\ncomponent = \"EXA\"\nexpression = \"" + expression +
         "\"\n[effect.parameters]\n" + parameters + "\n";
}

TEST(FormulaAttack, AnAssignmentIsAnError) {
  EXPECT_EQ(refusal_of(user_effect("k = 5")),
            "m.toml:7:1: error: formula \"k = 5\", character 3: '=' assigns; a formula compares with '=='");
  for (const std::string bad : {"k + (k = 5)", "X = k", "k*(A=1)", "k=5"})
    EXPECT_THAT(refusal_of(user_effect(bad)), HasSubstr("'=' assigns")) << bad;
  for (const std::string good :
       {"k * (A == 1)", "k * (A <= 1)", "k * (A >= 1)", "k * (A != 1)", "(A < 1) * k"})
    EXPECT_EQ(refusal_of(user_effect(good)), "(no error)") << good;
}

// 0,5 * k was read as two results, of which the last counts: k.
TEST(FormulaAttack, ADecimalCommaIsAnError) {
  for (const std::string bad : {"0,5 * k", "k, 5", "(0,5) * k", "k * (1,5 + A)"})
    EXPECT_THAT(refusal_of(user_effect(bad)), HasSubstr("decimals have a point")) << bad;
  for (const std::string good : {"min(k, 5 * k)", "k * max(A, min(1, C))", "k * lag(T_a, 60)"})
    EXPECT_EQ(refusal_of(user_effect(good)), "(no error)") << good;
}

TEST(FormulaAttack, ANameLikeOneOfALagIsAnError) {
  for (const std::string bad : {"k * lag_0_", "k * lag_99_", "k * lag_x_", "k * lag(T_a, 60) + lag_0_"})
    EXPECT_THAT(refusal_of(user_effect(bad)), HasSubstr("a lag is written lag(variable, time)")) << bad;
}

TEST(FormulaAttack, WhatGivesNoNumberAnywhereIsRefusedWhenItIsRead) {
  for (const std::string bad : {"k / 0", "k * sqrt(-1 - A * A)", "k * log(-1)", "k / (A - A)"})
    EXPECT_THAT(refusal_of(user_effect(bad)),
                HasSubstr("m.toml:7:1: error: effect 'user:x' gives no number at any of 8 positions"))
        << bad;
}

TEST(FormulaAttack, WhatGivesNoNumberSomewhereFailsThere) {
  Diagnostics diagnostics;
  const auto model = attacked_model(user_effect("k * sqrt(X - 50)"), diagnostics);
  ASSERT_TRUE(model) << model.error().text();
  const ModelEvaluator evaluator(*model);
  MachineState state;
  state.q[0] = 60.0;
  EXPECT_NO_THROW(static_cast<void>(evaluator.errors(state)));
  state.q[0] = 40.0;
  try {
    static_cast<void>(evaluator.errors(state));
    FAIL();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.error().code, ErrorCode::wrong_input);
    EXPECT_THAT(failure.error().text(),
                HasSubstr("m.toml:4:1: error: effect 'user:x' gives no number at X40 Y0 Z0 A0 C0"));
  }
}

TEST(FormulaAttack, MoreThanAnyMachineErrsFailsThere) {
  Diagnostics diagnostics;
  const auto model = attacked_model(user_effect("k * exp(X)"), diagnostics);
  ASSERT_TRUE(model) << model.error().text();
  MachineState state;
  state.q[0] = 100.0;
  EXPECT_THROW(static_cast<void>(ModelEvaluator(*model).errors(state)), Failure);
}

TEST(ModelAttack, ValuesBeyondAnyMachineAreInAnotherUnit) {
  EXPECT_EQ(refusal_of("id = \"location:C\"\n[effect.parameters]\nA0C_urad = 1e7\n"),
            "m.toml:6:1: error: 'A0C_urad' is 1e+07, beyond what any machine has (1e+05): is it in another "
            "unit?");
  EXPECT_THAT(refusal_of("id = \"location:C\"\n[effect.parameters]\nX0C_um = -1e300\n"), HasSubstr("X0C_um"));
  EXPECT_THAT(refusal_of("id = \"worm:C\"\n[effect.parameters]\nsin_urad = 1e7\ncos_urad = 1.0\n"),
              HasSubstr("beyond what any machine has"));
  EXPECT_EQ(refusal_of("id = \"location:C\"\n[effect.parameters]\nA0C_urad = 99999\n"), "(no error)");
  EXPECT_THAT(refusal_of(user_effect("k * A", "k_um = 1e12")), HasSubstr("beyond what any machine has"));
}

// A component of one letter was asked for its third: exit code 70.
TEST(ModelAttack, AComponentOfOneLetterIsAnError) {
  for (const std::string component : {"B", "", "E", "EZXY"})
    EXPECT_THAT(refusal_of("id = \"component\"\naxis = \"A\"\ncomponent = \"" + component + "\"\n"),
                HasSubstr("m.toml:"))
        << component;
  EXPECT_THAT(refusal_of("id = \"crosstalk\"\naxis = \"A\"\ncomponent = \"B\"\n"),
              HasSubstr("component B is not carried by axis A"));
}

// It took 12 s for 400 sensors, and eight times as long for twice as many.
TEST(FormulaAttack, TakesTimeAsItsLength) {
  const auto seconds_of = [](int sensors) {
    std::string sum = "0";
    for (int i = 0; i < sensors; ++i) sum += " + T_s" + std::to_string(i);
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(refusal_of(user_effect("k * (" + sum + ")")), "(no error)");
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  seconds_of(10);  // the library is loaded
  EXPECT_LT(seconds_of(400), 1.0);
  EXPECT_LT(seconds_of(1600), 4.0);
}

std::string table_error(const std::string& text) {
  Diagnostics diagnostics;
  const auto table = parse_error_table(text, "t.csv", test::effect_machine("trunnion_offset"), diagnostics);
  return table ? std::string("(no error)") : table.error().text();
}

// A model names the table: what another file holds is not for messages.
TEST(TableAttack, QuotesNothingOfAFileThatIsNoTable) {
  for (const std::string text :
       {"root:$6$secret:19000:0:99999:7:::\nx:y\n", "A_secret,EXX_um\n1,2\n2,3\n",
        "EXX_secret,X_mm\n1,2\n2,3\n", "secret,secret\n1,2\n", "X_mm,secret\nsecret,1\n"})
    EXPECT_THAT(table_error(text), testing::AllOf(HasSubstr("t.csv:1"), testing::Not(HasSubstr("secret"))))
        << text;
}

TEST(TableAttack, RefusesErrorsBeyondAnyMachineAndGridsOfNothing) {
  EXPECT_THAT(table_error("X_mm,EXX_um\n0,1\n1,1e6\n"),
              HasSubstr("t.csv:3:2: error: '1e6' in column 'EXX_um'"));
  EXPECT_THAT(table_error("X_mm,EAX_urad\n0,1\n1,-1e6\n"), HasSubstr("is it in another unit?"));
  std::string sparse = "X_mm,Y_mm,EXX_um\n";
  for (int i = 0; i < 20000; ++i) sparse += std::to_string(i) + "," + std::to_string(i) + ",1\n";
  EXPECT_THAT(table_error(sparse), HasSubstr("the grid of 20000 x 20000 nodes has only 20000 rows"));
}

}  // namespace
}  // namespace trunnion
