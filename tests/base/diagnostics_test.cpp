#include "trunnion/base/diagnostics.hpp"

#include <gtest/gtest.h>

#include "trunnion/base/contract.hpp"

namespace trunnion {
namespace {

TEST(Diagnostics, TextNamesFileLineColumn) {
  Diagnostics d;
  d.error("a.cls", {3, 7}, "GOTO has 5 values");
  d.warning("a.cls", {}, "no units");
  EXPECT_EQ(d.findings()[0].text(), "a.cls:3:7: error: GOTO has 5 values");
  EXPECT_EQ(d.findings()[1].text(), "a.cls: warning: no units");
  EXPECT_EQ(d.first_error().text(), "a.cls:3:7: error: GOTO has 5 values");
}

TEST(Diagnostics, WarnsOnceAKey) {
  Diagnostics d;
  for (std::uint32_t i = 1; i <= 1000; ++i) d.warning_once("PPFUN", "a.cls", {i, 1}, "PPFUN is ignored");
  ASSERT_EQ(d.findings().size(), 1u);
  EXPECT_EQ(d.findings()[0].where.line, 1u);
  EXPECT_FALSE(d.has_errors());
}

TEST(Contract, ThrowsWithTheCondition) {
  EXPECT_THROW(TRUNNION_EXPECTS(1 + 1 == 3), BugError);
}

}  // namespace
}  // namespace trunnion
