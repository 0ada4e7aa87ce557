// The kinematics that LinuxCNC runs for a tilting rotary table (module xyzac-trt-kins of Debian's
// linuxcnc-uspace), loaded at run time, against ours: an independent check of every sign and order. Nothing
// of LinuxCNC is in this file: the module's interface is two functions, and pins that it asks its host for by
// name.
#include <cstdarg>
#include <cstdio>
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <sstream>

#include "trunnion/base/units.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/machine/new_machine.hpp"
#include "trunnion/nc/controller.hpp"
#include "trunnion/probe/control_numbers.hpp"

#include "support/folders.hpp"
#include "support/machines.hpp"

namespace {

// Pins by name; the module holds pointers to the values.
std::map<std::string, double>& pins() {
  static std::map<std::string, double> values;
  return values;
}

// Memory that the module keeps for ever.
void* room(std::size_t bytes) {
  alignas(16) static std::array<char, 1U << 16U> pool;
  static std::size_t used = 0;
  void* const p = pool.data() + used;
  used += (bytes + 15U) / 16U * 16U;
  return used <= pool.size() ? p : nullptr;
}

}  // namespace

// NOLINTBEGIN(cert-dcl50-cpp): C functions with variable arguments are what the module calls.
extern "C" {
int hal_init(const char*) {
  return 1;
}
int hal_ready(int) {
  return 0;
}
int hal_exit(int) {
  return 0;
}
void* hal_malloc(long bytes) {
  return room(static_cast<std::size_t>(bytes));
}
int hal_pin_float_newf(int, double** pin, int, const char* format, ...) {
  std::array<char, 256> name{};
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(name.data(), name.size(), format, arguments);
  va_end(arguments);
  *pin = &pins()[name.data()];
  return 0;
}
int hal_pin_bit_new(const char*, int, bool** pin, int) {
  *pin = static_cast<bool*>(room(1));
  return 0;
}
int hal_pin_bit_newf(int, bool** pin, int, const char*, ...) {
  *pin = static_cast<bool*>(room(1));
  return 0;
}
int hal_pin_s32_new(const char*, int, int** pin, int) {
  *pin = static_cast<int*>(room(4));
  return 0;
}
void rtapi_print(const char*, ...) {}
void rtapi_print_msg(int, const char*, ...) {}
}
// NOLINTEND(cert-dcl50-cpp)

namespace trunnion {
namespace {

/// Position of the tool tip (mm) and rotary axes (degrees) in LinuxCNC's order.
struct World {
  double x = 0, y = 0, z = 0, a = 0, b = 0, c = 0, u = 0, v = 0, w = 0;
};

class Module {
 public:
  explicit Module(const std::string& name = "xyzac-trt-kins")
      : name_(name), handle_(dlopen(path().c_str(), RTLD_NOW | RTLD_LOCAL)) {
    if (handle_ == nullptr) return;
    const auto start = reinterpret_cast<int (*)()>(dlsym(handle_, "rtapi_app_main"));
    forward_ = reinterpret_cast<Forward>(dlsym(handle_, "kinematicsForward"));
    inverse_ = reinterpret_cast<Inverse>(dlsym(handle_, "kinematicsInverse"));
    ready_ = start != nullptr && forward_ != nullptr && inverse_ != nullptr && start() == 0;
  }
  bool ready() const { return ready_; }
  std::string path() const { return "/usr/lib/linuxcnc/modules/" + name_ + ".so"; }

  void set(const std::string& pin, double value) { pins().at(name_ + "." + pin) = value; }

  World forward(const std::array<double, 16>& joints) const {
    World world;
    unsigned long flags = 0;
    unsigned long more = 0;
    if (forward_(joints.data(), &world, &flags, &more) != 0)
      throw std::runtime_error("kinematicsForward failed");
    return world;
  }
  std::array<double, 16> inverse(const World& world) const {
    std::array<double, 16> joints{};
    unsigned long flags = 0;
    unsigned long more = 0;
    if (inverse_(&world, joints.data(), &flags, &more) != 0)
      throw std::runtime_error("kinematicsInverse failed");
    return joints;
  }

 private:
  using Forward = int (*)(const double*, World*, const unsigned long*, unsigned long*);
  using Inverse = int (*)(const World*, double*, const unsigned long*, unsigned long*);
  std::string name_;
  void* handle_ = nullptr;
  Forward forward_ = nullptr;
  Inverse inverse_ = nullptr;
  bool ready_ = false;
};

// LinuxCNC counts joints so that the part's coordinates are the machine's at A = C = 0; our linear words are
// positions of the tip in M.
std::array<double, 16> their_joints(const Machine& machine, const JointVector& words) {
  std::array<double, 16> joints{};
  const std::array names = {"X", "Y", "Z", "A", "C"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const AxisId id = *machine.axis(names[i]);
    joints[i] = i < 3 ? words[id] : words[id] * kDegreePerRad;
  }
  return joints;
}

class TrtKinematics : public ::testing::Test {
 protected:
  void SetUp() override {
    static Module module;
    if (!module.ready()) GTEST_SKIP() << module.path() << " (linuxcnc-uspace) is not there";
    module_ = &module;
    // The values of LinuxCNC's sample configuration, which postconfigs/machines/xyzac_trt.toml describes.
    // Tool offset 0: the words are then the tip, as with G43.
    module.set("y-offset", 20.0);
    module.set("z-offset", 10.0);
  }
  JointVector random_words(const Machine& machine) {
    JointVector words;
    std::uniform_real_distribution<double> mm(-300.0, 300.0);
    std::uniform_real_distribution<double> tilt(-120.0, 120.0);
    std::uniform_real_distribution<double> turn(-720.0, 720.0);
    for (const char* name : {"X", "Y", "Z"}) words[*machine.axis(name)] = mm(random_);
    words[*machine.axis("A")] = tilt(random_) * kRadPerDegree;
    words[*machine.axis("C")] = turn(random_) * kRadPerDegree;
    return words;
  }
  static constexpr int kPoses = 100000;
  Module* module_ = nullptr;
  std::mt19937_64 random_{20240611};
};

// Both add a few rotations of vectors below 1e3 mm: 1e-9 mm is some hundred times the rounding of that.
constexpr double kTolerance_mm = 1e-9;

TEST_F(TrtKinematics, ForwardAgreesOnEveryPose) {
  const Machine machine = test::shipped_machine("xyzac_trt");
  const Vec3 tool = machine.tool_vector();
  double worst_mm = 0.0;
  double worst_axis = 0.0;
  for (int i = 0; i < kPoses; ++i) {
    const JointVector words = random_words(machine);
    const auto joints = their_joints(machine, words);
    const World tip = module_->forward(joints);
    auto raised = joints;
    raised[2] += 1.0;  // one mm along the tool
    const World above = module_->forward(raised);
    const ToolPose ours = tool_pose(forward(machine, joints_of_words(machine, words, tool), tool));
    worst_mm = std::max(worst_mm, (ours.tip_P - Vec3(tip.x, tip.y, tip.z)).norm());
    worst_axis =
        std::max(worst_axis, (ours.axis_P - Vec3(above.x - tip.x, above.y - tip.y, above.z - tip.z)).norm());
  }
  EXPECT_LT(worst_mm, kTolerance_mm);
  EXPECT_LT(worst_axis, 1e-9);
}

TEST_F(TrtKinematics, OurInverseGivesTheJointsThatTheirsGives) {
  const Machine machine = test::shipped_machine("xyzac_trt");
  const Vec3 tool = machine.tool_vector();
  double worst_mm = 0.0;
  double worst_deg = 0.0;
  for (int i = 0; i < kPoses; ++i) {
    const JointVector words = random_words(machine);
    const JointVector seed = joints_of_words(machine, words, tool);
    const ToolPose pose = tool_pose(forward(machine, seed, tool));
    const auto solutions = inverse(machine, pose, seed);
    ASSERT_FALSE(solutions.empty());
    const auto ours = their_joints(machine, words_of(machine, solutions.front().q, tool));
    // Theirs takes the rotary angles as given and finds the linear axes.
    const auto theirs =
        module_->inverse({pose.tip_P.x(), pose.tip_P.y(), pose.tip_P.z(), ours[3], 0.0, ours[4], 0, 0, 0});
    for (std::size_t k = 0; k < 3; ++k) worst_mm = std::max(worst_mm, std::abs(ours[k] - theirs[k]));
    // The solution nearest to the seed is the pose that we came from.
    const auto programmed = their_joints(machine, words);
    for (std::size_t k = 3; k < 5; ++k) worst_deg = std::max(worst_deg, std::abs(ours[k] - programmed[k]));
  }
  EXPECT_LT(worst_mm, kTolerance_mm);
  EXPECT_LT(worst_deg, 1e-9);
}

// What `machine new --ini` makes of an ini: the machine that the module named there drives, at random
// offsets.
class MachineOfIni : public ::testing::TestWithParam<const char*> {};

TEST_P(MachineOfIni, IsTheOneThatTheModuleDrives) {
  const std::string outer = GetParam();  // "A" or "B"
  const std::string name = outer == "A" ? "xyzac-trt-kins" : "xyzbc-trt-kins";
  Module module(name);
  if (!module.ready()) GTEST_SKIP() << module.path() << " (linuxcnc-uspace) is not there";
  std::mt19937_64 random(20261123);
  std::uniform_real_distribution<double> mm(-200.0, 200.0);
  const std::string along = outer == "A" ? "y-offset" : "x-offset";
  std::string ini = "[KINS]\nKINEMATICS = " + name + " sparm=identityfirst\n[HAL]\n";
  for (const std::string pin : {"x-rot-point", "y-rot-point", "z-rot-point"}) {
    const double value = std::stod(std::to_string(mm(random)));
    module.set(pin, value);
    ini += "HALCMD = setp " + name + "." + pin + " " + std::to_string(value) + "\n";
  }
  for (const std::string& pin : {along, std::string("z-offset")}) {
    const double value = std::stod(std::to_string(mm(random)));
    module.set(pin, value);
    ini += "HALCMD = net :" + pin + " " + name + "." + pin + " gui." + pin + "\nHALCMD = sets :" + pin + " " +
           std::to_string(value) + "\n";
  }
  for (const std::string& axis :
       {std::string("X"), std::string("Y"), std::string("Z"), outer, std::string("C")})
    ini += "[AXIS_" + axis + "]\nMIN_LIMIT = -720\nMAX_LIMIT = 720\nMAX_VELOCITY = 20\n";
  Diagnostics diagnostics;
  const auto draft = machine_of_ini(ini, "machine.ini", diagnostics);
  ASSERT_TRUE(draft) << draft.error().text();
  const auto machine = parse_machine(machine_file_text(*draft, "test"), "machine.toml", diagnostics);
  ASSERT_TRUE(machine) << machine.error().text();

  std::uniform_real_distribution<double> deg(-180.0, 180.0);
  double worst_mm = 0.0;
  for (int i = 0; i < 10000; ++i) {
    std::array<double, 16> joints{};
    for (std::size_t k = 0; k < 5; ++k) joints[k] = k < 3 ? mm(random) : deg(random);
    const World tip = module.forward(joints);
    JointVector words;
    const std::array<std::string, 5> names = {"X", "Y", "Z", outer, "C"};
    for (std::size_t k = 0; k < 5; ++k)
      words[*machine->axis(names[k])] = k < 3 ? joints[k] : joints[k] * kRadPerDegree;
    const ToolPose ours =
        tool_pose(forward(*machine, joints_of_words(*machine, words, machine->tool_vector())));
    worst_mm = std::max(worst_mm, (ours.tip_P - Vec3(tip.x, tip.y, tip.z)).norm());
  }
  EXPECT_LT(worst_mm, kTolerance_mm);
}
INSTANTIATE_TEST_SUITE_P(Modules, MachineOfIni, ::testing::Values("A", "B"));

// What `machine calibrate --parameters linuxcnc` prints for a machine makes the module drive that machine.
class NumbersOfCalibrate : public ::testing::TestWithParam<const char*> {};

TEST_P(NumbersOfCalibrate, MakeTheModuleDriveTheMachine) {
  const std::string outer = GetParam();
  Module module(outer == "A" ? "xyzac-trt-kins" : "xyzbc-trt-kins");
  if (!module.ready()) GTEST_SKIP() << module.path() << " (linuxcnc-uspace) is not there";
  Machine machine = test::shipped_machine(outer == "A" ? "xyzac_trt" : "xyzbc_trt_sample");
  Diagnostics diagnostics;
  const auto control =
      nc::load_controller(test::source_folder() + "/postconfigs/controllers/linuxcnc.toml", diagnostics);
  ASSERT_TRUE(control);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> mm(-100.0, 100.0);
  for (const AxisId id : machine.rotary_axes()) {
    for (Eigen::Index i = 0; i < 3; ++i) machine.axes[id].point_mm[i] = std::round(mm(random) * 1e4) / 1e4;
  }
  const auto lines = probe::control_numbers(machine, *control);
  ASSERT_TRUE(lines) << lines.error().text();
  for (const std::string& line : *lines) {
    std::istringstream words(line);
    std::string setp, pin;
    double value = 0.0;
    if (!(words >> setp >> pin >> value) || setp != "setp") continue;
    module.set(pin.substr(pin.find('.') + 1), value);
  }
  std::uniform_real_distribution<double> deg(-180.0, 180.0);
  const std::array<std::string, 5> names = {"X", "Y", "Z", outer, "C"};
  // The part frame of the one is shifted in the other's: that of LinuxCNC is the machine's with both axes at
  // 0.
  double worst_mm = 0.0;
  for (int i = 0; i < 10000; ++i) {
    std::array<double, 16> joints{};
    JointVector words;
    for (std::size_t k = 0; k < 5; ++k) {
      joints[k] = k < 3 ? mm(random) : deg(random);
      words[*machine.axis(names[k])] = k < 3 ? joints[k] : joints[k] * kRadPerDegree;
    }
    const World tip = module.forward(joints);
    const ToolPose ours = tool_pose(forward(machine, joints_of_words(machine, words, machine.tool_vector())));
    worst_mm = std::max(worst_mm, (ours.tip_P - Vec3(tip.x, tip.y, tip.z)).norm());
  }
  EXPECT_LT(worst_mm, 1e-3);  // the pins have four decimals
}
INSTANTIATE_TEST_SUITE_P(Modules, NumbersOfCalibrate, ::testing::Values("A", "B"));

}  // namespace
}  // namespace trunnion
