#include "trunnion/config/section.hpp"

#include <gtest/gtest.h>

#include "trunnion/base/units.hpp"

namespace trunnion::config {
namespace {

Value parsed(const char* text) {
  auto value = parse_toml(text, "m.toml");
  EXPECT_TRUE(value) << (value ? "" : value.error().text());
  return value.value_or(Value{});
}

std::vector<std::string> texts(const Diagnostics& d) {
  std::vector<std::string> out;
  for (const auto& f : d.findings()) out.push_back(f.text());
  return out;
}

TEST(Section, ConvertsByTheUnitInTheKey) {
  const Value root = parsed(
      "length_mm = 5\nangle_deg = 90\nerror_um = 2.5\nsmall_urad = 3\nrate_mm_min = 600\nrate_deg_min = "
      "60\n");
  Diagnostics d;
  Section s(root, "t", "m.toml", d);
  EXPECT_EQ(s.quantity("length_mm"), 5.0);
  EXPECT_EQ(s.quantity("angle_deg"), kPi / 2);
  EXPECT_DOUBLE_EQ(s.quantity("error_um"), 0.0025);
  EXPECT_DOUBLE_EQ(s.quantity("small_urad"), 3e-6);
  EXPECT_DOUBLE_EQ(s.quantity("rate_mm_min"), 10.0);
  EXPECT_DOUBLE_EQ(s.quantity("rate_deg_min"), kPi / 180.0);
  s.finish();
  EXPECT_TRUE(d.findings().empty());
}

TEST(Section, ReportsEveryFaultWithItsPlace) {
  const Value root = parsed("length = 5\nangle_deg = \"x\"\nunknown = 1\nbad_mm = nan\nv_mm = [1, 2]\n");
  Diagnostics d;
  Section s(root, "tool", "m.toml", d);
  s.quantity("length_mm");
  s.quantity("angle_deg");
  s.quantity("missing_mm");
  s.quantity("bad_mm");
  s.vector("v_mm");
  s.finish();
  EXPECT_EQ(texts(d), (std::vector<std::string>{
                          "m.toml:1:1: error: key 'length' has no unit: write 'length_mm'",
                          "m.toml:2:1: error: 'angle_deg' must be a number, not a string",
                          "m.toml:1:1: error: missing key 'missing_mm' in [tool]",
                          "m.toml:4:1: error: 'bad_mm' must be a finite number, not nan",
                          "m.toml:5:1: error: 'v_mm' must have 3 numbers, not 2",
                          "m.toml:3:1: error: unknown key 'unknown' in [tool]",
                      }));
}

TEST(Toml, SyntaxErrorHasItsPlace) {
  const auto value = parse_toml("[a]\nb = = 1\n", "m.toml");
  ASSERT_FALSE(value);
  EXPECT_EQ(value.error().where.line, 2u);
}

TEST(Toml, TextReadsBackAsTheSameValue) {
  const char* text =
      "name = \"a \\\"b\\\" \\n c\"\nflag = true\ncount = 3\nreal = 0.1\nwhole = 2.0\nlist = [1.5, "
      "2.5]\ninline = { a = 1, b = \"x\" }\n"
      "[one]\nx_mm = 1.0\n[one.two]\ny = -1e-9\n[[effect]]\nid = \"a\"\n[effect.parameters]\nk_um = "
      "1.0\n[[effect]]\nid = \"b\"\n";
  const std::string once = toml_text(parsed(text));
  EXPECT_EQ(toml_text(parsed(once.c_str())), once);
  const Value back = parsed(once.c_str());
  EXPECT_EQ(*back.find("name")->as_string(), "a \"b\" \n c");
  EXPECT_EQ(back.find("effect")->as_array()->size(), 2u);
  EXPECT_EQ(std::get<double>(back.find("whole")->data), 2.0);
  EXPECT_EQ(std::get<double>(back.find("one")->find("two")->find("y")->data), -1e-9);
}

}  // namespace
}  // namespace trunnion::config
