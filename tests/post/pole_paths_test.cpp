// Programs of paths that come near the pole, as a CAM system writes them, are right and verified.
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <string_view>
#include <utility>
#include <vector>

#include "post/posting.hpp"
#include "support/cases.hpp"
#include "support/cl_text.hpp"
#include "support/machines.hpp"
#include "support/without_a_stop.hpp"

namespace trunnion {
namespace {

using post::PostOptions;

struct PolePath {
  const char* name;
  const char* machine;
  const char* control;
  const char* cl;
  double tolerance_mm;
  double pole_tolerance_deg;
  path::ChoiceMethod choice = path::ChoiceMethod::global;
};

// What random paths have shown, as short as it can be.
constexpr std::array kShown = {
    // The choice goes on to the other branch at a point that is put on the pole. With the tilt that its
    // tolerance allows the axes passed beside the pole, where none follow: C jumped by half a turn.
    PolePath{"TiltedBesideThePole", "xyzbc_trt_sample", "iso",
             "GOTO/9.8982,-9.2880,4.7453,0.018820578,-0.340820301,0.939940056\n"
             "GOTO/9.8539,-9.9996,6.8155,-0.003139528,-0.003694743,0.999988246\n"
             "GOTO/12.2915,-9.9676,6.8204,0.062280378,0.073294458,0.995363791\n",
             0.05, 2.0, path::ChoiceMethod::sum},
    // A word of the post-processor ends what is chosen together: the point before counts all the same.
    PolePath{"GoesOnBehindAWord", "xyzac_trt_sample", "fanuc_30i",
             "GOTO/23.2441,-16.4062,12.0534,0.139043501,0.144308624,0.979715227\nMAXDPM/2000\n"
             "GOTO/22.4678,-21.5542,12.0494,0.015530124,0.015992671,0.999751494\n"
             "GOTO/22.3754,-32.1395,12.0738,-0.062131811,0.072805609,0.995408952\n",
             0.002, 2.0},
    // The run begins on the branch on which the one before has ended, not on the first.
    PolePath{"BeginsOnItsBranch", "xyzac_trt", "iso",
             "GOTO/25.6668,4.4489,2.1332,0.013461900,0.109002659,0.993950299\n"
             "GOTO/1.0310,-19.0062,-10.7700,0.031257353,0.061896951,0.997592976\n"
             "GOTO/0.4459,-22.8879,-9.2171,0.009116106,0.018052045,0.999795489\nMAXDPM/2000\n"
             "GOTO/-0.1393,-26.7696,-7.6641,-0.013155375,-0.026050753,0.999574056\n",
             0.002, 0.5},
    // At the pole C is to turn by less than 5 degrees, which one block does not do within the tolerance.
    PolePath{"TurnsALittleAtThePole", "trunnion_offset", "siemens_840d_sl",
             "GOTO/-19.4895,-14.1668,-2.4343,-0.140010004,0.257613768,0.956050389\n"
             "GOTO/-18.7869,-13.7804,-8.2077,0.,0.,1.\n"
             "GOTO/-18.5103,-13.7814,-7.8511,0.144563937,0.014096312,0.989395049\n",
             0.01, 2.0},
    PolePath{"StaysAtThePole", "paper", "heidenhain_tnc640",
             "GOTO/20.4389,-15.2748,-4.2151,0.051620636,0.043470492,0.997720214\nMAXDPM/2000\n"
             "GOTO/20.4389,-15.5329,-4.4693,0.,0.,1.\n"
             "GOTO/20.2680,-15.5329,-4.0007,0.000000023,-0.000000109,1.\n"
             "GOTO/19.0998,-15.4981,-0.0501,-0.012485865,0.057816277,0.998249158\n",
             0.01, 0.1, path::ChoiceMethod::largest},
    // A rapid to where the tool stands has no words; those of the point before have three decimals.
    PolePath{"RapidToWhereItStands", "xyzac_trt_sample", "iso",
             "GOTO/13.3459,7.0415,-12.8346,-0.000121060,-0.000992645,0.999999500\n"
             "GOTO/13.3821,6.6865,-12.8587,0.002340654,0.019192376,0.999813070\nRAPID\n"
             "GOTO/13.3821,6.6865,-12.8587,0.002340654,0.019192376,0.999813070\n"
             "GOTO/12.1878,6.8558,-13.1251,-0.000000263,-0.000000965,1.\n",
             0.01, 0.0, path::ChoiceMethod::largest},
    // A rapid that turns the tool by less than the tolerance of the pole, the tip in its place.
    PolePath{"RapidInTheCone", "xyzac_trt_sample", "linuxcnc",
             "GOTO/-4.7554,-6.7772,0.3313,0.027761764,-0.002938464,0.999610249\n"
             "GOTO/-4.7554,-6.7776,0.3313,0.026555122,-0.002810746,0.999643399\nRAPID\n"
             "GOTO/-4.7554,-6.7780,0.3313,0.025348407,-0.002683020,0.999675077\n"
             "GOTO/-4.7554,-6.7784,0.3313,0.024141625,-0.002555287,0.999705283\n",
             0.01, 0.1},
    // C turns early at a rapid to where the tool stands, in two blocks.
    PolePath{"TurnsEarlyWhereItStands", "paper", "heidenhain_tnc640",
             "GOTO/-25.9084,25.2769,8.4392,0.,0.,1.\nRAPID\nGOTO/-25.9084,25.2769,8.4392,0.,0.,1.\n"
             "GOTO/-25.9084,25.2727,8.4287,0.000541053,-0.001126835,0.999999219\n",
             0.002, 0.0, path::ChoiceMethod::largest},
    // The tool axis goes back the way it came; words stand where it has.
    PolePath{"StopsWhereTheAxisGoesBack", "xyzac_trt", "iso",
             "GOTO/4.2501,7.7541,-1.3817,-0.135864761,0.070759287,0.988197293\n"
             "GOTO/4.8274,1.8577,-6.4184,0.388450444,-0.202307621,0.898987141\n"
             "GOTO/4.8274,1.8757,-6.4093,0.374365217,-0.195011627,0.906543518\nOPSTOP\n"
             "GOTO/4.8274,1.8937,-6.4001,0.360057433,-0.187600011,0.913873558\n",
             0.05, 0.0},
    // Where C is too slow for its share of the time that FEDRAT/INVERS gives, the whole takes longer.
    PolePath{"SlowAxisInGivenTime", "xyzac_trt_sample", "linuxcnc",
             "GOTO/33.7751,31.9120,-11.6736,0.006822062,-0.184662384,0.982778339\nFEDRAT/INVERS,20\n"
             "GOTO/16.7711,50.3784,4.5355,0.002571449,-0.004288058,0.999987500\n",
             0.01, 0.0},
    PolePath{"SlowedAxisInGivenTime", "trunnion_offset", "heidenhain_tnc640",
             "MAXDPM/2000\nGOTO/-43.7699,-10.0731,-24.6535,0.001480354,-0.001701752,0.999997456\n"
             "FEDRAT/INVERS,20\nGOTO/-74.6529,-46.8543,-13.5646,0.062300614,0.141634743,0.987956595\n",
             0.05, 0.1},
    // A rapid from the pole that turns in several blocks, of which the first is near.
    PolePath{"TurnsAtARapidFromARepeatedPoint", "paper", "iso",
             "GOTO/45.110,9.056,45.194,0.,0.,1.\nRAPID\nGOTO/45.110,9.056,45.194,0.,0.,1.\nRAPID\n"
             "GOTO/45.110,9.056,45.194,-0.036554,0.020565,0.999120\n",
             0.002, 0.2},
    // The speed that the spindle has already is not said again, and nothing stops for it.
    PolePath{"SaysTheSameSpeed", "xyzac_trt_sample", "siemens_840d_sl",
             "FEDRAT/MMPM,2000\nGOTO/6.2858,6.5168,-3.1248,-0.017553265,0.000754375,0.999845645\n"
             "SPINDL/RPM,6000,CLW\nGOTO/7.7118,10.8989,-11.6785,-0.008045527,0.000345767,0.999967574\n"
             "SPINDL/RPM,6000,CLW\nGOTO/7.8215,11.2360,-12.3365,-0.007314107,0.000314333,0.999973202\n",
             0.01, 0.0},
};

class ShownPolePath : public ::testing::TestWithParam<PolePath> {};

TEST_P(ShownPolePath, IsMadeWithinItsTolerance) {
  const PolePath& path = GetParam();
  PostOptions options;
  options.tolerance_mm = path.tolerance_mm;
  options.pole.tolerance = Angle::degrees(path.pole_tolerance_deg);
  options.choice = path.choice;
  const auto p = test::posted(std::string("LOADTL/1\n") + path.cl + "FINI\n",
                              test::shipped_machine(path.machine), options, path.control);
  ASSERT_TRUE(p.report) << p.report.error().text();
  const post::VerifyReport& v = *p.report->verification;
  EXPECT_TRUE(v.passed()) << "tip " << v.certified_tip_deviation_mm << " mm, missed " << v.points_missed
                          << "\n"
                          << p.nc;
}

INSTANTIATE_TEST_SUITE_P(Shown, ShownPolePath, ::testing::ValuesIn(kShown),
                         [](const auto& shown) { return std::string(shown.param.name); });

// Legs through the pole, to it, near it and past it, with the words of a program between the points. Those
// that the machine reaches come out, and are within their tolerance.
class PolePaths {
 public:
  explicit PolePaths(std::uint64_t seed) : random_(seed) {}

  void expect_right(int cases) {
    int made = 0;
    int stops = 0;
    const auto machines = test::shipped_machines();
    for (int i = 0; i < cases; ++i) {
      const std::string cl = path();
      const std::string machine = machines[random_() % machines.size()];
      constexpr std::array kControls = {"linuxcnc", "fanuc_30i", "siemens_840d_sl", "heidenhain_tnc640",
                                        "iso"};
      const std::string control = kControls[random_() % kControls.size()];
      const PostOptions options = some_options();
      const auto p = test::posted(cl, test::shipped_machine(machine), options, control);
      if (!p.report) continue;  // out of reach, or half a turn of C in one block
      ++made;
      const post::VerifyReport& v = *p.report->verification;
      EXPECT_TRUE(v.passed()) << i << " " << machine << " " << control << " tolerance "
                              << options.tolerance_mm << " pole " << options.pole.tolerance.deg() << ": tip "
                              << v.certified_tip_deviation_mm << " mm, missed " << v.points_missed << "\n"
                              << cl;
      const std::string edited = test::without_a_stop(p.nc, random_);
      if (edited.empty()) continue;
      ++stops;
      EXPECT_FALSE(passes(edited, cl, machine, control, options)) << i << "\n" << cl << edited;
    }
    EXPECT_GT(made, cases * 9 / 10);
    EXPECT_GT(stops, cases / 20);
  }

 private:
  static bool passes(const std::string& nc, const std::string& cl, const std::string& machine_name,
                     const std::string& control, const PostOptions& options) {
    const Machine machine = test::shipped_machine(machine_name);
    const nc::Controller c = post::with_axes_of(machine, test::shipped_controller(control));
    post::VerifyOptions verify;
    verify.tolerance_mm = options.tolerance_mm;
    verify.pole = options.pole;
    Diagnostics d;
    const auto report =
        post::verify({std::make_unique<test::TextOf>(cl), "part.cls"},
                     {std::make_unique<test::TextOf>(nc), "part.nc"}, {machine, c, verify}, d);
    EXPECT_TRUE(report) << report.error().text();
    return report && report->passed();
  }
  double uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random_); }
  template <class T, std::size_t n>
  T one_of(const std::array<T, n>& of) {
    return of[random_() % n];
  }

  PostOptions some_options() {
    PostOptions options;
    options.tolerance_mm = one_of(std::array{0.002, 0.01, 0.05});
    if (random_() % 4 != 0) options.pole.tolerance = Angle::degrees(one_of(std::array{0.1, 0.5, 2.0}));
    if (random_() % 3 == 0)
      options.choice = one_of(
          std::array{path::ChoiceMethod::combined, path::ChoiceMethod::sum, path::ChoiceMethod::largest});
    if (random_() % 6 == 0) options.nonlinear.one_sided = true;
    if (random_() % 6 == 0) options.nonlinear.method = path::Method::adaptive;
    return options;
  }

  std::string path() {
    std::string cl = "LOADTL/1\nSPINDL/RPM,5000,CLW\nFEDRAT/MMPM," +
                     std::string(one_of(std::array{"200", "600", "2000"})) + "\nRAPID\n";
    const double widest = one_of(std::array{0.05, 0.3, 0.6});
    const bool has_words = random_() % 5 < 2;
    Vec3 tip(uniform(-30.0, 30.0), uniform(-30.0, 30.0), uniform(-5.0, 5.0));
    double tilt = widest * uniform(0.0, 1.0);
    double turn = uniform(0.0, kTwoPi);
    bool is_first = true;
    for (int leg = one_of(std::array{2, 3, 5}); leg > 0; --leg) {
      const Vec3 from = test::tilted(tilt, turn);
      go_on(widest, tilt, turn);
      const Vec3 to = test::tilted(tilt, turn);
      const double length_mm = one_of(std::array{3.0, 10.0, 30.0});
      Vec3 way;
      for (double& w : way) w = length_mm * (random_() % 2 == 0 ? 1.0 : -1.0) * uniform(0.5, 1.0);
      const int points = one_of(std::array{2, 4, 9, 25});
      for (int k = 1; k <= points; ++k) {
        const double share = static_cast<double>(k) / points;
        if (!is_first && has_words && random_() % 7 == 0) cl += some_word();
        if (!is_first && random_() % 25 == 0) cl += "RAPID\n";
        cl += test::point_text(tip + share * way, (from + share * (to - from)).normalized());
        is_first = false;
      }
      tip += way;
    }
    return cl + "FINI\n";
  }

  void go_on(double widest, double& tilt, double& turn) {
    switch (random_() % 5) {
      case 0:  // through the pole
        tilt = widest * uniform(0.0, 1.0);
        turn += kPi;
        break;
      case 1:
        tilt = 0.0;
        break;
      case 2:
        tilt = one_of(std::array{1e-6, 1e-4, 1e-3, 5e-3});
        turn += uniform(-3.0, 3.0);
        break;
      case 3:
        tilt = widest * uniform(0.0, 1.0);
        turn += uniform(-3.1, 3.1);
        break;
      default:  // the axis stays
        break;
    }
  }

  std::string some_word() {
    constexpr std::array kWords = {
        "COOLNT/ON", "OPSTOP",          "SPINDL/RPM,6000,CLW", "LINTOL/0.02", "LINTOL/0.005",
        "DELAY/0.5", "FEDRAT/MMPM,900", "FEDRAT/MMPM,300",     "MAXDPM/2000", "COOLNT/OFF",
        "STOP",      "FEDRAT/INVERS,20"};
    return std::string(one_of(kWords)) + "\n";
  }

  std::mt19937_64 random_;
};

TEST(PolePathsAtRandom, AreMadeWithinTheirTolerance) {
  PolePaths(1).expect_right(test::cases(300));
}

TEST(LongPolePathsAtRandom, AreMadeWithinTheirTolerance) {
  PolePaths(2).expect_right(test::cases(6000));
}

}  // namespace
}  // namespace trunnion
