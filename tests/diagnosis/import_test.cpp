#include "trunnion/diagnosis/import.hpp"

#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/diagnose.hpp"

#include "diagnosis/campaigns.hpp"

namespace trunnion::diagnosis {
namespace {

Machine machine_of(const std::string& axes, const std::string& chain) {
  std::string text = "[machine]\nname = \"test\"\n[tool]\nlength_mm = 100\n" + axes + "[chain]\n" + chain;
  Diagnostics diagnostics;
  auto machine = parse_machine(text, "test.toml", diagnostics);
  if (!machine) throw std::runtime_error(machine.error().text());
  return *machine;
}
std::string slide(const std::string& name, const std::string& direction) {
  return "[[axis]]\nname = \"" + name + "\"\ntype = \"linear\"\ndirection = " + direction +
         "\nmin_mm = -500\nmax_mm = 500\nrapid_mm_min = 30000\n";
}
std::string turning(const std::string& name, const std::string& direction, const std::string& range) {
  return "[[axis]]\nname = \"" + name + "\"\ntype = \"rotary\"\ndirection = " + direction +
         "\npoint_mm = [0, 0, 0]\n" + range;
}
const std::string kSlides = slide("X", "[1, 0, 0]") + slide("Y", "[0, 1, 0]") + slide("Z", "[0, 0, 1]");

Dataset read_back(const Result<std::string>& text, const Machine& machine) {
  if (!text) throw std::runtime_error(text.error().text());
  Diagnostics diagnostics;
  const NamedText file{"imported.csv", *text};
  auto data = parse_measurements(std::span(&file, 1), machine, diagnostics);
  if (!data) throw std::runtime_error(data.error().text());
  return *data;
}

// Another column of the time is not read: nobody is to believe that it was.
TEST(ImportLog, SaysWhatItTakesForTheTime) {
  const auto told = [](const std::string& column) {
    Diagnostics diagnostics;
    const auto csv =
        import_log(column + ",a_C,z_um\n0,20,1\n1000,21,2\n", "l.csv", {.channel = "z_um"}, diagnostics);
    if (!csv) return csv.error().text();
    return diagnostics.findings().empty() ? std::string() : diagnostics.findings().front().text();
  };
  EXPECT_EQ(told("time_s"), "");
  EXPECT_EQ(told("sample"), "");
  EXPECT_EQ(told("time_ms"),
            "l.csv:1:1: warning: no column 'time_s': rows are taken to be 60 s apart (--step-s), whatever "
            "other columns say of the time");
}

const std::string kLaserFile =
    "JobName : 1-X_Y\nAxisIndex : 2 ; 1\nConversionFactor : 1\nMotionDirection : 1 ; 1\n\nIgnored\n\n"
    "  Position1   LaserData1   Position2   LaserData2   AirTemp\n:START\n"
    "  0.0    -0.00038    0.0   -0.00028   21.15\n"
    "  5.0     4.99985   10.0   10.00200   21.15\n";

TEST(ImportStage, LaserPositionsBecomeErrorsAlongEachAxis) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  Diagnostics diagnostics;
  StageImport options;
  options.axes = {"X", "Y"};
  options.parts = 1;
  const Dataset data = read_back(import_stage(kLaserFile, "a.dat", machine, options, diagnostics), machine);
  ASSERT_EQ(data.readings.size(), 4U);
  const double expected_um[] = {-0.38, -0.28, -0.15, 2.00};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(data.readings[i].value / kMmPerUm, expected_um[i], 1e-9);
    EXPECT_EQ(data.readings[i].n, i % 2 == 0 ? Vec3::UnitX() : Vec3::UnitY());
  }
  EXPECT_DOUBLE_EQ(data.track.state(data.readings[2].row).q[0], 5.0);
  EXPECT_DOUBLE_EQ(data.track.state(data.readings[2].row).q[1], 10.0);
}

// Where X carries the part, and to -X, a table that goes too far is a tool that goes too far along +X.
TEST(ImportStage, TheDirectionFollowsFromTheMachine) {
  const Machine machine =
      machine_of(slide("X", "[-1, 0, 0]") + slide("Y", "[0, 1, 0]") + slide("Z", "[0, 0, 1]"),
                 "tool = [\"Z\", \"Y\"]\npart = [\"X\"]\n");
  Diagnostics diagnostics;
  StageImport options;
  options.axes = {"Y", "X"};
  options.parts = 1;
  const Dataset data = read_back(import_stage(kLaserFile, "a.dat", machine, options, diagnostics), machine);
  EXPECT_EQ(data.readings[0].n, Vec3::UnitY());
  EXPECT_EQ(data.readings[1].n, Vec3::UnitX());
  // Positioning along the axis' own positive sense, 0.4 mm/m: fitted to what the table does to the tool.
  for (const std::string axis : {"X", "Y"}) {
    std::string text =
        "%Ax1Name: X; Ax1Num: 1; Ax1Sign: 1\n%Ax2Name: Y; Ax2Num: 2; Ax2Sign: 1\n%UserUnits: MM\n"
        "% Ax1TestLoc Ax2TestLoc Ax1CmdPos Ax2CmdPos Ax1RelErr Ax2RelErr\n";
    for (int x = -400; x <= 400; x += 100)
      for (int y = -400; y <= 400; y += 100)
        text += "1.0\t1.0\t" + std::to_string(x) + "\t" + std::to_string(y) + "\t" +
                shortest_text(axis == "X" ? 4e-5 * x : 0.0) + "\t" +
                shortest_text(axis == "Y" ? 4e-5 * y : 0.0) + "\n";
    const Dataset read = read_back(import_stage(text, "b.dat", machine, {}, diagnostics), machine);
    const Fit f =
        fit(machine, read,
            test::model_for(machine, read,
                            "[model]\nname = \"m\"\n[[effect]]\nid = \"component:E" + axis + axis + "\"\n"));
    // Component errors are along M's axes, of what the axis carries: X carries the part to -X.
    EXPECT_NEAR(f.model.effects[0].parameters[0].value, (axis == "X" ? -1.0 : 1.0) * 4e-5 * 500, 1e-7)
        << axis;
  }
}

TEST(ImportStage, FaultsNameTheirPlace) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto message = [&](const std::string& text, const StageImport& options = {}) {
    Diagnostics diagnostics;
    const auto out = import_stage(text, "s.dat", machine, options, diagnostics);
    return out                        ? std::string("taken")
           : diagnostics.has_errors() ? diagnostics.findings().front().text()
                                      : out.error().text();
  };
  StageImport xy;
  xy.axes = {"X", "Y"};
  EXPECT_EQ(message(kLaserFile),
            "s.dat:8:1: error: the file does not name its axes: say with --axes which are its first and "
            "second, as in --axes X,Y");
  EXPECT_EQ(message(kLaserFile + "  1.0 x 2 3\n", xy), "s.dat:12:7: error: 'x' is not a number");
  EXPECT_EQ(message(kLaserFile + "1.0 2.0\n", xy), "s.dat:12:1: error: 2 numbers where 4 are expected");
  EXPECT_NE(message("a,b\n1,2\n", xy).find("no columns Position1"), std::string::npos);
  const std::string turned =
      "MotionDirection : -1 ; 1\nPosition1 LaserData1 Position2 LaserData2\n:START\n0 0 0 0\n";
  EXPECT_EQ(message(turned, xy), "s.dat:1:1: error: MotionDirection is '-1': only files with 1 are read");
  const std::string inch =
      "%Ax1Name: X; Ax1Sign: 1\n%Ax2Name: Y; Ax2Sign: 1\n%UserUnits: FOOT\n% Ax1CmdPos Ax2CmdPos Ax1RelErr "
      "Ax2RelErr\n";
  EXPECT_EQ(message(inch + "0 0 0 0\n"),
            "s.dat:3:1: error: UserUnits 'FOOT' is none of MM, METRIC, UM, ENGLISH");
  xy.axes = {"A", "Y"};
  EXPECT_NE(message(kLaserFile, xy).find("'A' is no linear axis"), std::string::npos);
}

// +Y is north, +X east: azimuth turns clockwise from above, altitude 90 deg is up.
Machine mount() {
  return machine_of(kSlides + turning("C", "[0, 0, -1]", "cyclic = true\n") +
                        turning("A", "[-1, 0, 0]", "min_deg = -5\nmax_deg = 90\n"),
                    "tool = [\"X\", \"Y\", \"Z\"]\npart = [\"C\", \"A\"]\n");
}

const std::string kHead = "! made for a test\nsome mount\n: ALTAZ\n32 46 49.3\n";

struct Pointed {
  double azimuth, altitude;  // deg
};

// Stars where `observed` is what the tube really looks at when the mount reads (azimuth, altitude).
template <class Observed>
std::string star_list(const Observed& observed) {
  std::string out = kHead;
  for (int azimuth = 5; azimuth < 360; azimuth += 24)
    for (int altitude = 20; altitude <= 75; altitude += 11) {
      const Pointed star = observed(Pointed{1.0 * azimuth, 1.0 * altitude});
      out += shortest_text(star.azimuth) + " " + shortest_text(star.altitude) + " " +
             std::to_string(azimuth) + " " + std::to_string(altitude) + " 0.0\n";
    }
  return out + "END\n";
}

double fitted(const std::string& list, const std::string& effect, const std::string& key) {
  const Machine machine = mount();
  Diagnostics diagnostics;
  const Dataset data = read_back(import_pointing(list, "p.dat", machine, {}, diagnostics), machine);
  const Fit f =
      fit(machine, data,
          test::model_for(machine, data, "[model]\nname = \"m\"\n[[effect]]\nid = \"" + effect + "\"\n"));
  EXPECT_LT(f.chi2, 1e-3 * f.dof);  // nothing else is left
  const auto& info = f.model.effects[0].effect->info();
  for (std::size_t k = 0; k < info.parameters.size(); ++k)
    if (info.parameters[k].name == key) return f.model.effects[0].parameters[k].value / kRadPerUrad;
  ADD_FAILURE() << "no parameter " << key;
  return 0.0;
}

constexpr double kArcsec_deg = 1.0 / 3600.0;

// The azimuth reads 30 seconds of arc more than the tube has turned, the altitude 20 less.
TEST(ImportPointing, OffsetsOfTheEncoders) {
  EXPECT_NEAR(fitted(star_list([](Pointed m) {
                       return Pointed{m.azimuth - 30 * kArcsec_deg, m.altitude};
                     }),
                     "zero_offset:C", "C0C"),
              -30 * 4.84813681, 1e-3);
  EXPECT_NEAR(fitted(star_list([](Pointed m) {
                       return Pointed{m.azimuth, m.altitude + 20 * kArcsec_deg};
                     }),
                     "zero_offset:A", "A0A"),
              -20 * 4.84813681, 1e-3);  // up is towards smaller positions
}

// The whole mount leans over to the east or to the south: what it looks at, turned by hand.
TEST(ImportPointing, ATiltedFoot) {
  constexpr double kTilt = 200e-6;
  const auto looks_at = [](const Vec3& d) {
    return Pointed{std::atan2(d.x(), d.y()) * kDegreePerRad, std::asin(d.z()) * kDegreePerRad};
  };
  const auto straight = [](Pointed m) {
    const double a = m.azimuth * kRadPerDegree, e = m.altitude * kRadPerDegree;
    return Vec3(std::sin(a) * std::cos(e), std::cos(a) * std::cos(e), std::sin(e));
  };
  const double c = std::cos(kTilt), s = std::sin(kTilt);
  const std::string about_x = star_list([&](Pointed m) {
    const Vec3 d = straight(m);
    return looks_at({d.x(), c * d.y() - s * d.z(), s * d.y() + c * d.z()});
  });
  EXPECT_NEAR(fitted(about_x, "location:C", "A0C"), 200.0, 0.05);
  EXPECT_NEAR(fitted(about_x, "location:C", "B0C"), 0.0, 0.05);
  const std::string about_y = star_list([&](Pointed m) {
    const Vec3 d = straight(m);
    return looks_at({c * d.x() + s * d.z(), d.y(), -s * d.x() + c * d.z()});
  });
  EXPECT_NEAR(fitted(about_y, "location:C", "B0C"), 200.0, 0.05);
}

TEST(ImportPointing, FaultsNameTheirPlace) {
  const auto message = [](const std::string& text, const Machine& machine) {
    Diagnostics diagnostics;
    const auto out = import_pointing(text, "p.dat", machine, {}, diagnostics);
    return out                        ? std::string("taken")
           : diagnostics.has_errors() ? diagnostics.findings().front().text()
                                      : out.error().text();
  };
  EXPECT_EQ(message(kHead + "10 20 10 20\n", mount()), "taken");
  EXPECT_EQ(message(kHead + "10 20 10\n", mount()),
            "p.dat:5:1: error: 3 numbers where azimuth and altitude, observed and of the mount, are expected "
            "(degrees)");
  EXPECT_EQ(message(kHead + "10 20 10 x\n", mount()), "p.dat:5:10: error: 'x' is not a number");
  EXPECT_NE(message(kHead + "10 20 30 20\n", mount()).find("p.dat:5:1: error: the mount points 18.78"),
            std::string::npos);
  EXPECT_NE(message("caption\n: EQUAT\n32 0 0\n1 2 3 4\n", mount())
                .find("p.dat:3:1: error: the list has no option ': ALTAZ'"),
            std::string::npos);
  EXPECT_NE(message(kHead, mount()).find("no line with a star"), std::string::npos);
  EXPECT_NE(message(kHead + "10 20 10 20\n", test::shipped_machine("trunnion_offset"))
                .find("does not carry its part by azimuth C"),
            std::string::npos);
}

}  // namespace
}  // namespace trunnion::diagnosis
