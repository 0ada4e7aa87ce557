#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <string>

#include "cl/support.hpp"

namespace trunnion::cl {
namespace {

constexpr char kSeedText[] =
    "$$*          Pro/CLfile  Version 9.0\nPARTNO / MFG0001\nUNITS / INCHES\nLOADTL / 2\n$$-> CUTTER / "
    "6.000000\n"
    "$$-> CSYS / 1.0, 0.0, 0.0, 0.0,  $\n 0.0, 1.0, 0.0, 0.0,  $\n 0.0, 0.0, 1.0, 0.0\nMULTAX / ON\n"
    "TOOL PATH/CONTOUR,TOOL,BALL\nMSYS/-120.2591,-1196.5000,142.5000,0.0,1.0,0.0,1.0,0.0,0.0\n"
    "SPINDL / RPM, 7957.753876,  CLW\nRAPID\nFROM/0,0,5\nGOTO / 202.0002188470, 98.5000002785, "
    "140.9830392719,  $\n"
    "0.9997838891, -0.0000009626, 0.0207888211\nFEDRAT / 1193.663081,  IPM\nGOTO/1.5,.5,-25.\nGODLTA/0,0,1\n"
    "CSYS/1,0,0,0,0,1,0,0,0,0,1,0\nTLAXIS/0.6,0,0.8\nCOOLNT/FLOOD\nLINTOL/0.01\nPPRINT it's text\nDELAY/1\n"
    "SYN/'A','B'\nCYCLE/DRILL,FEDTO,2.75,MMPM,731.5,RAPTO,3.,RTRCTO,10.,DWELL,0\nGOTO/1,2,3,0.6,0,0.8\nCYCLE/"
    "OFF\n"
    "CIRCLE/5.3162,23.0,70.0,0.0,0.0,-1.0,12.5,0.06,0.5,25.0,0.0\nGOTO/5.3162,10.5,70\nEND-OF-PATH\nFINI\n";

std::string mutated(std::string text, std::mt19937_64& random) {
  static constexpr std::string_view kAlphabet =
      "0123456789.,,//$$'-+eED GOTOCIRCLERAPIDFEDRAT\n\n\r\t=()*\x01\x80\xFF";
  std::uniform_int_distribution<int> how(0, 6);
  std::uniform_int_distribution<int> times(1, 12);
  for (int n = times(random); n > 0 && !text.empty(); --n) {
    const std::size_t at = std::uniform_int_distribution<std::size_t>(0, text.size() - 1)(random);
    const std::size_t length = std::uniform_int_distribution<std::size_t>(1, 40)(random);
    const char letter =
        kAlphabet[std::uniform_int_distribution<std::size_t>(0, kAlphabet.size() - 1)(random)];
    switch (how(random)) {
      case 0:
        text[at] = letter;
        break;
      case 1:
        text.insert(at, 1, letter);
        break;
      case 2:
        text.erase(at, length);
        break;
      case 3:
        text.insert(at, text.substr(at, length));
        break;
      case 4:
        text.insert(at, std::to_string(std::ldexp(1.0, static_cast<int>(length) * 20 - 300)));
        break;
      case 5:
        text.insert(at, text.substr(0, std::min(text.size(), length)));
        break;
      default:
        if (n == 1) text.resize(at);
    }
  }
  return text;
}

void expect_sound(const test::Reading& reading, const std::string& text) {
  for (const Motion& motion : reading.motions()) {
    ASSERT_TRUE(motion.tip_P.allFinite()) << text;
    ASSERT_NEAR(motion.axis_P.norm(), 1.0, 1e-12) << text;
    ASSERT_TRUE(std::isfinite(motion.feed.value) && motion.feed.value >= 0.0) << text;
  }
}

TEST(Fuzz, MutatedFilesNeverCrashHangOrGiveNumbersThatAreNone) {
  std::mt19937_64 random(20261121);
  std::size_t motions = 0;
  std::size_t faulty = 0;
  constexpr int kRounds = 20000;
  for (int round = 0; round < kRounds; ++round) {
    const std::string text = mutated(kSeedText, random);
    const auto reading = test::read(text);
    expect_sound(reading, text);
    motions += reading.motions().size();
    if (!reading.findings.empty()) ++faulty;
  }
  EXPECT_GT(motions, 2U * kRounds);  // the mutations leave most of the text alive
  EXPECT_GT(faulty, static_cast<std::size_t>(kRounds) / 2);
}

// The fast path for plain GOTOs and the one that reads every word give the same bits.
TEST(Fuzz, PlainAndWordByWordReadingAgreeToTheBit) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> coordinate(-2000.0, 2000.0);
  std::uniform_real_distribution<double> component(-1.0, 1.0);
  std::uniform_int_distribution<int> digits(1, 16);
  std::string plain;
  constexpr int kPoints = 20000;
  for (int i = 0; i < kPoints; ++i) {
    char line[400];
    const Vec3 axis = Vec3(component(random), component(random), component(random)).normalized();
    const int n = digits(random);
    const int m = std::max(4, digits(random));
    std::snprintf(line, sizeof(line), "GOTO/%.*f,%.*f,%.*f,%.*f,%.*f,%.*f\n", n, coordinate(random), n,
                  coordinate(random), n, coordinate(random), m, axis.x(), m, axis.y(), m, axis.z());
    plain += line;
  }
  std::string blank = plain;
  for (std::size_t at = 0; (at = blank.find("GOTO", at)) != std::string::npos; at += 5)
    blank.replace(at, 4, "GO TO");
  const auto fast = test::read(plain);
  const auto slow = test::read(blank);
  ASSERT_EQ(fast.motions().size(), static_cast<std::size_t>(kPoints)) << test::joined(fast.findings);
  ASSERT_EQ(slow.motions().size(), static_cast<std::size_t>(kPoints)) << test::joined(slow.findings);
  EXPECT_EQ(fast.resolution.axis, slow.resolution.axis);
  EXPECT_EQ(fast.resolution.coordinate_mm, slow.resolution.coordinate_mm);
  const auto a = fast.motions();
  const auto b = slow.motions();
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].tip_P, b[i].tip_P) << i;
    ASSERT_EQ(a[i].axis_P, b[i].axis_P) << i;
  }
}

}  // namespace
}  // namespace trunnion::cl
