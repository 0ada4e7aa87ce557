#include "trunnion/base/printable.hpp"

#include <gtest/gtest.h>

#include "trunnion/base/diagnostics.hpp"

namespace trunnion {
namespace {

TEST(Printable, LeavesOrdinaryTextAlone) {
  for (const std::string text : {"", "part 7 (rev. B)", "Stück 1 µm ≤ 刀具", "a\\b"})
    EXPECT_EQ(printable(text), text);
}

TEST(Printable, ShowsWhatWouldAct) {
  EXPECT_EQ(printable("a\x1b[2Jb"), "a\\x1b[2Jb");  // clears the screen
  EXPECT_EQ(printable("a\x7f\x07"), "a\\x7f\\x07");
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m"),
            "\\x9b31m");  // CSI as one C1 character
  EXPECT_EQ(printable("\x9b"
                      "31m"),
            "\\x9b31m");  // and as a byte
  EXPECT_EQ(printable("\xe2\x80\xae"
                      "cod.exe"),
            "\\u202ecod.exe");
  EXPECT_EQ(printable("a\xe2\x80\xa8"
                      "b"),
            "a\\u2028b");
  EXPECT_EQ(printable(std::string("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(printable("\xc0\x9b\xed\xa0\x80\xf5"), "\\xc0\\x9b\\xed\\xa0\\x80\\xf5");  // no UTF-8
  EXPECT_EQ(printable("\xe2\x82"), "\\xe2\\x82");
}

TEST(Printable, KeepsWhatIsAskedFor) {
  EXPECT_EQ(printable("a\nb\tc\r", "\n\t"), "a\nb\tc\\x0d");
  EXPECT_EQ(printable(printable("\x1b]0;x\x07")), printable("\x1b]0;x\x07"));
}

TEST(Printable, AFindingIsOneLineWhateverItNames) {
  Diagnostics d;
  d.error("a\x1b.cls", {1, 2}, "unknown key 'x\nb.cls: error: none\x1b[31m'");
  EXPECT_EQ(d.findings()[0].text(), "a\\x1b.cls:1:2: error: unknown key 'x\\x0ab.cls: error: none\\x1b[31m'");
}

TEST(PrintableJson, WritesTheCharactersThatActByTheirNumbers) {
  EXPECT_EQ(printable_json("{\"a\": \"x\xe2\x80\xa8y\xc2\x9b\xe2\x80\xae\"}\n"),
            "{\"a\": \"x\\u2028y\\u009b\\u202e\"}\n");
  EXPECT_EQ(printable_json("{\"\xc3\xa4\": \"\xe2\x82\xac\"}"), "{\"\xc3\xa4\": \"\xe2\x82\xac\"}");
}

}  // namespace
}  // namespace trunnion
