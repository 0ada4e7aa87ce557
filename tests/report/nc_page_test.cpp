#include "trunnion/report/nc_page.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/machines.hpp"

namespace trunnion::report {
namespace {

using testing::HasSubstr;

post::VerifyReport two_blocks() {
  post::VerifyReport r;
  r.tolerance_mm = 0.01;
  for (std::size_t i = 0; i < post::kChecks; ++i) r.checks[i].about = "compared";
  r.blocks.resize(2);
  r.blocks[1].path_mm = 1.0;
  return r;
}

// A program that keeps to its path and cuts wrong all the same: what failed comes first.
TEST(NcPage, SaysWhichCheckFailedAndWhere) {
  post::VerifyReport r = two_blocks();
  post::Check& spindle = r.checks[static_cast<std::size_t>(post::CheckOf::spindle)];
  spindle.state = post::Check::State::failed;
  spindle.count = 37;
  spindle.places.push_back({20, "the spindle is off"});
  const Machine machine = test::shipped_machine("trunnion_offset");
  const Page page = nc_page({"part.nc", "part.cls", &machine, &r, {}, "{}", "made"});
  EXPECT_THAT(page.verdict, testing::StartsWith("Not passed. spindle, NC line 20: the spindle is off."));
  EXPECT_EQ(page.tone, Tone::bad);
  const std::string html = page_html(page);
  EXPECT_THAT(html, HasSubstr("What was compared"));
  EXPECT_THAT(html, HasSubstr("37"));
}

TEST(NcPage, NamesTheUnsafeMove) {
  post::VerifyReport r = two_blocks();
  r.unsafe_count = 1;
  r.unsafe.push_back({7, "axis A turns below the safe height"});
  const Machine machine = test::shipped_machine("trunnion_offset");
  EXPECT_THAT(nc_page({"part.nc", "part.cls", &machine, &r, {}, "{}", "made"}).verdict,
              HasSubstr("NC line 7: axis A turns below the safe height."));
}

}  // namespace
}  // namespace trunnion::report
