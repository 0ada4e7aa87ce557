#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <string>

#include "trunnion/base/lanes.hpp"

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

// What CAM systems write, statement by statement; numbers and order are then changed.
constexpr std::array kStatements = {
    "PARTNO/PART\n",
    "UNITS/MM\n",
    "UNITS/INCHES\n",
    "MODE/MILL\n",
    "MULTAX/ON\n",
    "MULTAX/OFF\n",
    "MSYS/10,20,30,0,1,0,1,0,0\n",
    "MCS/0,1,0,-1,0,0,0,0,1,5,6,7\n",
    "CSYS/1,0,0,0,0,1,0,0,0,0,1,0\n",
    "TRNTYP/WORLD,0,0,0\n",
    "$$-> CSYS / 1.0, 0.0, 0.0, 0.0,  $\n 0.0, 1.0, 0.0, 0.0, $\n 0.0, 0.0, 1.0, 0.0\n",
    "$$*CATIA0\n$$ Axis\n$$ 1 0 0 5\n$$ 0 1 0 0\n$$ 0 0 1 0\n",
    "CUTTER/10.0,1.0,4.0,1.0,0.0,0.0,40.0\n",
    "TLDATA/DRILL,MILL,8.0,0.0,80.0,118.0,35.0\n",
    "LOADTL/7,LENGTH,200,ADJUST,17\n",
    "LOADTL/3, 0, 40.000000, 3\n",
    "LOAD/TOOL,4,ADJUST,4\n",
    "SPINDL/8000,RPM,CLW\n",
    "SPINDL/60,SMM,CLW,MAXRPM,9000\n",
    "COOLNT/ON,THRU,70\n",
    "CALSUB/START_PROG\n",
    "ZERO/1\n",
    "FROM/50,-20,200,0,0,1\n",
    "RAPID\n",
    "GOTO/1.5,2.5,10.125,0.0,0.6,0.8\n",
    "GOTO/1.5,2.5,9.25\n",
    "GOTO/10,0,0,0,0,1\n",
    "GODLTA/0,0,1\n",
    "FEDRAT/1200,MMPM\n",
    "FEDRAT/IPM,40\n",
    "LINTOL/0.01\n",
    "TLAXIS/0.6,0,0.8\n",
    "CIRCLE/0,0,0,0,0,-1,10,0.06,0.5,20,1\nGOTO/0,10,0\n",
    "CIRCLE/0,0,0,0,0,1\nGOTO/0,10,0\n",
    "CIRCLE/0,0,-2,0,0,-1,10,0.06,0.5,20,1,TIMES,2\nGOTO/10,0,-2\n",
    "MOVARC/0,0,0,0,0,1,10,ANGLE,90\nGOTO/0,10,0\n",
    "INDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/0.,0.,0.,10.),ON,(LINE/0.,0.,0.,0.,10.,0.)\n",
    "CYCLE/DRILL,FEDTO,2.75,MMPM,731.5,RAPTO,3.,RTRCTO,10.,DWELL,0\nGOTO/1,2,3,0.6,0,0.8\nCYCLE/OFF\n",
    "CYCLE/DEEP2,FEDTO,10.,1STPECK,5.,SUBPECK,2.,MMPM,60,RAPTO,3.,RTRCTO,AUTO\nGOTO/0,0,0\nCYCLE/OFF\n",
    "CYCLE/DRILL,3.,5.\nGOTO/0,0,0\nCYCLE/OFF\n",
    "NURBS/\nKNOT/0.25,0.75,1.0\nCNTRL/1,0,0\nCNTRL/2,1,0\nCNTRL/3,0,0\nCNTRL/4,0,0\nCNTRL/5,1,0\n",
    "CLEARP/XYPLAN,50\nRETRCT\n",
    "GOHOME/50,-20,200,0,0,1\n",
    "GOHOME\n",
    "PPRINT 'text', $$ of all kinds\n",
    "SYN/'ZOOM','RAPID'\nZOOM\n",
    "FINI\n"};

// NCI: a code and its values.
constexpr std::array kNciRecords = {"1050\n9 1 1 1 2020 1 1 1 PART.NCI\n",
                                    "1013\n0 10. 5.\n",
                                    "1002\n1 2 0 7 17 27 0 3000. 100. 1\n",
                                    "1008\nFINISH BLADE\n",
                                    "1014\n1 0 0 0 1 0 0 0 1\n",
                                    "1027\n1 0 0 0 1 0 0 0 1 0 0 0\n",
                                    "4\n1.5\n",
                                    "0\n0 10. 0. 5. -2. 0\n",
                                    "1\n0 10. 0. 0. 60. 0\n",
                                    "3\n0 0 0. 10. 0. 0. 0. -1. 0\n",
                                    "2\n0 0 10. 0. 0. 0. 0. -1. 0\n",
                                    "11\n1. 2. 3. 1. 2. 103. -2. 0 0\n",
                                    "11\n1. 2. 0. 61. 2. 80. 600. 0 0\n",
                                    "1003\n0\n"};

// A number by another one, a field out, twice or empty: what stands between commas, blanks and line ends.
std::string with_fields_changed(std::string text, std::mt19937_64& random) {
  static constexpr std::array kFields = {
      "0", "-0",    "-1",  "1e-12", "0.0000000000001", "1e300",  "1e6", "-1e6", "4294967295", "1e999", "NAN",
      "",  "99999", "0.5", "2",     "-90.25",          "1e-300", "'"};
  for (auto n = random() % 3; n > 0; --n) {
    const std::size_t from = text.find_first_of(",/ \n", random() % text.size());
    if (from == std::string::npos) continue;
    const std::size_t to = std::min(text.find_first_of(", \n", from + 1), text.size());
    switch (random() % 4) {
      case 0:
        text.erase(from, to - from);
        break;
      case 1:
        text.insert(from, text.substr(from, to - from));
        break;
      default:
        text.replace(from + 1, to - from - 1, kFields[random() % kFields.size()]);
    }
  }
  return text;
}

template <std::size_t N>
std::string composed(const std::array<const char*, N>& pieces, std::mt19937_64& random) {
  std::string text;
  for (auto n = 2 + random() % 24; n > 0; --n) {
    std::string piece = pieces[random() % N];
    if (random() % 6 == 0) piece = with_fields_changed(piece, random);
    text += piece;
  }
  return text;
}

// Records that a text may become: those of its statements, and what its largest arcs and holes may be.
constexpr std::size_t kMostRecords = 2000000;

TEST(Fuzz, StatementsInAnyOrderWithAnyNumbersAreReadSoundly) {
  std::mt19937_64 random(20261122);
  std::size_t good = 0, motions = 0;
  constexpr int kRounds = 6000;
  for (int round = 0; round < kRounds; ++round) {
    const std::string text = composed(kStatements, random);
    const auto reading = test::read(text, {});
    expect_sound(reading, text);
    ASSERT_LT(reading.records.size(), kMostRecords) << text;
    std::size_t in_runs = 0;
    const auto again = test::read_in_runs(text, 1 + random() % 40, in_runs, {});
    ASSERT_EQ(again.findings, reading.findings) << text;
    ASSERT_EQ(again.records.size(), reading.records.size()) << text;
    motions += reading.motions().size();
    const bool faulty =
        std::any_of(reading.findings.begin(), reading.findings.end(),
                    [](const std::string& f) { return f.find(" error: ") != std::string::npos; });
    if (!faulty) ++good;
  }
  EXPECT_GT(good, 20U);  // whole files without a fault are among them
  EXPECT_GT(motions, 10U * kRounds);
}

TEST(Fuzz, NciRecordsInAnyOrderWithAnyNumbersAreReadSoundly) {
  std::mt19937_64 random(20261123);
  ReaderOptions options;
  options.dialect = ReaderOptions::Dialect::nci;
  std::size_t motions = 0;
  constexpr int kRounds = 10000;
  for (int round = 0; round < kRounds; ++round) {
    std::string text = composed(kNciRecords, random);
    if (round % 3 == 0) text = mutated(text, random);
    const auto reading = test::read(text, options);
    expect_sound(reading, text);
    ASSERT_LT(reading.records.size(), kMostRecords) << text;
    motions += reading.motions().size();
  }
  EXPECT_GT(motions, 1000U);
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

std::string laid_out(const char* form, std::mt19937_64& random) {
  std::uniform_real_distribution<double> coordinate(-999.0, 9999.0);
  std::normal_distribution<double> component;
  const Vec3 axis = Vec3(component(random), component(random), component(random)).normalized();
  char line[400];
  std::snprintf(line, sizeof(line), form, coordinate(random), 0.01 * coordinate(random),
                coordinate(random) - 9000.0, axis.x(), axis.y(), axis.z());
  return line;
}

void expect_same(const test::Reading& at_once, const test::Reading& one_by_one) {
  ASSERT_EQ(at_once.findings, one_by_one.findings);
  ASSERT_EQ(at_once.records.size(), one_by_one.records.size());
  ASSERT_EQ(at_once.resolution.axis, one_by_one.resolution.axis);
  ASSERT_EQ(at_once.resolution.coordinate_mm, one_by_one.resolution.coordinate_mm);
  for (std::size_t i = 0; i < one_by_one.records.size(); ++i) {
    const Record& a = at_once.records[i];
    const Record& b = one_by_one.records[i];
    ASSERT_EQ(a.where, b.where) << i;
    ASSERT_EQ(a.data.index(), b.data.index()) << i;
    const auto* motion = std::get_if<Motion>(&b.data);
    if (motion == nullptr) continue;
    const auto& other = std::get<Motion>(a.data);
    ASSERT_EQ(other.tip_P, motion->tip_P) << i;
    ASSERT_EQ(other.axis_P, motion->axis_P) << i;
    for (Eigen::Index k = 0; k < 3; ++k)
      ASSERT_EQ(std::signbit(other.tip_P[k]), std::signbit(motion->tip_P[k])) << i;
    ASSERT_EQ(other.feed, motion->feed) << i;
    ASSERT_EQ(other.rapid, motion->rapid) << i;
  }
}

// Files in columns, and ones that are not, with words and faults in between.
TEST(Fuzz, RunsOfPlainMotionsAreReadAsOneByOne) {
  constexpr std::array kForms = {"GOTO/%10.4f,%10.4f,%10.4f,%10.6f,%10.6f,%10.6f\n",
                                 "GOTO/%11.4f,%11.4f,%11.4f,%9.6f,%9.6f,%9.6f\r\n",
                                 "GOTO / %9.3f, %9.3f, %9.3f, %10.7f, %10.7f, %10.7f \n",
                                 "  goto/%8.1f,%8.2f,%8.3f,%8.4f,%8.5f,%10.7f\n",
                                 "GOTO/%.4f,%.4f,%.4f,%.7f,%.7f,%.7f\n",
                                 "GOTO/%14.4f,%14.4f,%14.4f,%11.8f,%11.7f,%11.6f\n",
                                 "GOTO/%14.4f,%14.4f,%14.4f,%11.7f,%11.7f,%11.7f\n",
                                 "GOTO/%9.2f,%9.2f,%9.2f,%4.1f,%4.1f,%4.1f\n"};
  constexpr std::array kWords = {"RAPID\n",        "FEDRAT/800,MMPM\n",
                                 "UNITS/INCHES\n", "UNITS/MM\n",
                                 "$$ said\n",      "TLAXIS/0,0.6,0.8\n",
                                 "GODLTA/1,2,3\n", "GOTO/1,2,3\n",
                                 "CYCLE/OFF\n",    "GOTO/1.0,2.0,3.0,0.5,0.5,0.5\n"};
  // Behind them the file is read motion by motion.
  constexpr std::array kHeavy = {"CYCLE/DRILL,2,MMPM,100,1\n", "MSYS/1,2,3,0,1,0,1,0,0\n"};
  std::mt19937_64 random(9);
  std::size_t in_runs_of_all = 0, motions_of_all = 0;
  for (int round = 0; round < 400; ++round) {
    std::string text;
    const std::size_t forms = 1 + random() % 3;
    std::array<std::size_t, 3> form{};
    for (std::size_t& f : form) f = random() % kForms.size();
    for (std::size_t line = 0; line < 300; ++line) {
      if (random() % 40 == 0) text += kWords[random() % kWords.size()];
      if (random() % 1000 == 0) text += kHeavy[random() % kHeavy.size()];
      text += laid_out(kForms[form[line / 50 % forms]], random);
    }
    if (round % 2 == 0) {
      for (int k = 0; k < round % 24; ++k)
        text[random() % text.size()] = "0123456789.,-+ $/\nG"[random() % 19];
    }
    if (round % 5 == 0) text.pop_back();
    std::size_t in_runs = 0;
    const auto one_by_one = test::read(text);
    const auto at_once = test::read_in_runs(text, 1 + random() % 40, in_runs);
    in_runs_of_all += in_runs;
    motions_of_all += one_by_one.motions().size();
    expect_same(at_once, one_by_one);
    if (HasFatalFailure()) return;
  }
  // Without AVX2 no line is read by its layout, and there are none to count.
  if (lanes::four_at_a_time()) {
    EXPECT_GT(2.5 * static_cast<double>(in_runs_of_all), static_cast<double>(motions_of_all));
  }
}

// Every character of a line in columns, each by every other that may mean something there.
TEST(Fuzz, AnotherCharacterInALineOfTheLayoutReadsAsAlone) {
  // In the second one a number begins before the 64th character and ends behind it.
  for (const std::string line :
       {"GOTO/    19.9640,    -1.1993,    60.0000, 0.107253,  -0.412865,   0.904455\n",
        "GOTO/   19.9640,   -1.1993,   60.0000,    0.1073,   -0.4129,     0.9045\n"}) {
    for (std::size_t at = 0; at < line.size(); ++at) {
      for (const char c : std::string("07 -+.,\t$/GE\r\n\x7f")) {
        std::string other = line;
        other[at] = c;
        std::size_t in_runs = 0;
        const std::string text = line + line + line + other + line + line;
        const auto at_once = test::read_in_runs(text, 32, in_runs);
        EXPECT_GE(in_runs, 1U);
        expect_same(at_once, test::read(text));
        ASSERT_FALSE(HasFatalFailure()) << text;
      }
    }
  }
}

}  // namespace
}  // namespace trunnion::cl
