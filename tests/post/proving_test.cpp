// The proving program, walked by an interpreter of this file's own: where the axes go from wherever they
// stand.
#include "trunnion/post/proving.hpp"

#include <gtest/gtest.h>
#include <map>
#include <optional>
#include <random>
#include <regex>
#include <set>
#include <sstream>

#include "trunnion/machine/table_kinematics.hpp"

#include "support/controllers.hpp"
#include "support/machines.hpp"

namespace trunnion::post {
namespace {

struct Move {
  std::string axis;
  double by = 0.0;           // mm, degrees
  std::optional<double> to;  // of a retract, machine coordinate
  double feed = 0.0;         // per minute; 0: rapid
  std::string comment;       // last one before it
  bool stopped = false;      // the operator has started it
};

/// The moves of a program; throws at any line that it does not know.
std::vector<Move> moves_of(const std::string& text) {
  static const std::regex kNumber("^(N\\d+|\\d+) ");
  static const std::regex kHarmless(
      "^(%\\d*|O\\d+|BEGIN PGM \\w+ MM|END PGM \\w+ MM|M30|M2|M126|M129|RTLION|TRAFOOF|CYCLE800\\(\\)|CYCL "
      "DEF "
      "7\\.(0 DATUM SHIFT|1 X\\+0|2 Y\\+0|3 Z\\+0)|PLANE RESET STAY|G(17|21|40|49|61|69|80|90|94|710)( "
      "G(17|21|40|49|61|80|90|94|710))*)$");
  static const std::vector<std::regex> kSteps = {
      std::regex(R"(^G91 G94 G1 ([XYZABC])([-+]?[\d.]+) F([\d.]+)$)"),
      std::regex(R"(^G94 G1 ([XYZABC])=IC\(([-+]?[\d.]+)\) F([\d.]+)$)"),
      std::regex(R"(^L I([XYZABC])([-+]?[\d.]+) R0 F([\d.]+)$)")};
  static const std::vector<std::regex> kRetracts = {std::regex(R"(^G53 G0 Z([-+]?[\d.]+)$)"),
                                                    std::regex(R"(^SUPA G0 Z([-+]?[\d.]+) D0$)"),
                                                    std::regex(R"(^L Z([-+]?[\d.]+) R0 FMAX M91$)")};
  std::vector<Move> out;
  std::string comment;
  bool stopped = false;
  bool wants_absolute = false;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    line = std::regex_replace(line, kNumber, "");
    std::smatch found;
    if (line == "G90") wants_absolute = false;
    if (wants_absolute) throw std::runtime_error("not absolute again before: " + line);
    if (std::regex_match(line, kHarmless) || line.empty()) continue;
    if (line.front() == '(' || line.front() == ';') {
      comment += line;
      continue;
    }
    if (line == "M0") {
      stopped = true;
      continue;
    }
    Move move;
    for (const auto& step : kSteps) {
      if (!std::regex_match(line, found, step)) continue;
      move = {found[1], std::stod(found[2]), std::nullopt, std::stod(found[3]), comment, stopped};
      wants_absolute = line.starts_with("G91");
    }
    for (const auto& retract : kRetracts) {
      if (std::regex_match(line, found, retract))
        move = {"Z", 0.0, std::stod(found[1]), 0.0, comment, stopped};
    }
    if (move.axis.empty()) throw std::runtime_error("unknown line: " + line);
    out.push_back(move);
    comment.clear();
    stopped = false;
  }
  return out;
}

Machine machine_of(const std::string& z, const std::string& chain) {
  const std::string text =
      "[machine]\nname = \"M\"\n[tool]\nlength_mm = 120.0\n[part]\nzero_mm = [20, 10, 5]\n"
      "[[axis]]\nname = \"X\"\ntype = \"linear\"\ndirection = [1, 0, 0]\nmin_mm = -300\nmax_mm = 300\n"
      "[[axis]]\nname = \"Y\"\ntype = \"linear\"\ndirection = [0, -1, 0]\nmin_mm = -250\nmax_mm = 200\n"
      "[[axis]]\nname = \"Z\"\ntype = \"linear\"\n" +
      z +
      "[[axis]]\nname = \"B\"\ntype = \"rotary\"\ndirection = [0, -1, 0]\npoint_mm = [0, 0, "
      "-50]\nmin_deg = -35\nmax_deg = 110\nrapid_deg_min = 100\n"
      "[[axis]]\nname = \"C\"\ntype = \"rotary\"\ndirection = [0, 0, 1]\npoint_mm = [0, 0, 0]\n"
      "cyclic = true\n" +
      chain;
  Diagnostics d;
  auto machine = parse_machine(text, "m.toml", d);
  if (!machine) throw std::runtime_error(machine.error().text());
  return *machine;
}

std::vector<Machine> machines() {
  const std::string table = "[chain]\ntool = [\"X\", \"Y\", \"Z\"]\npart = [\"B\", \"C\"]\n";
  const std::string moving_table = "[chain]\ntool = [\"X\", \"Y\"]\npart = [\"Z\", \"B\", \"C\"]\n";
  std::vector<Machine> out;
  for (const auto& name : test::shipped_machines()) out.push_back(test::shipped_machine(name));
  out.push_back(machine_of("direction = [0, 0, 1]\nmin_mm = -500\nmax_mm = 0\n", table));
  out.push_back(machine_of("direction = [0, 0, -1]\nmin_mm = -300\nmax_mm = 400\n", table));
  out.push_back(machine_of("direction = [0, 0, 1]\nmin_mm = 0\nmax_mm = 500\n", moving_table));
  out.push_back(machine_of("direction = [0, 0, -1]\nmin_mm = -100\nmax_mm = 500\n", moving_table));
  return out;
}

// How far the tool rises from the part along its axis for one millimetre of Z.
double rises_by(const Machine& machine) {
  const TableKinematics kinematics(machine, machine.tool_vector());
  JointVector q;
  const ToolPose before = kinematics.pose(q);
  q[*machine.axis("Z")] = 1.0;
  return (kinematics.pose(q).tip_P - before.tip_P).dot(before.axis_P);
}

void walk(const Machine& machine, const std::string& control, std::mt19937_64& random) {
  const auto controller = test::shipped_controller(control);
  const auto text = proving_program(machine, controller);
  ASSERT_TRUE(text) << text.error().text();
  for (const char* word :
       {"G43", "G54", " T1", "M6", "H1", "TRAORI", "M128", "TOOL CALL", " D1", "G0 X", "M3\n"})
    EXPECT_EQ(text->find(word), std::string::npos) << word;
  const std::vector<Move> moves = moves_of(*text);
  ASSERT_GT(moves.size(), 2 * machine.axes.size());
  // Anywhere with the room that the program asks for.
  std::map<std::string, double> at, start;
  for (const Axis& axis : machine.axes) {
    const double unit = axis.kind == AxisKind::rotary ? kDegreePerRad : 1.0;
    const double min = axis.has_limits() ? axis.min * unit + 10.0 : -720.0;
    const double max = axis.has_limits() ? axis.max * unit - 10.0 : 720.0;
    at[axis.name] = start[axis.name] = std::uniform_real_distribution<double>(min, max)(random);
  }
  const double rises = rises_by(machine);
  EXPECT_EQ(moves[0].axis, "Z");
  EXPECT_GT(moves[0].by * rises, 0.0) << "the first move must take the tool away from the part";
  std::optional<double> safe;
  std::set<std::string> moved;
  for (const Move& move : moves) {
    EXPECT_TRUE(move.stopped) << move.comment;
    EXPECT_NE(move.comment.find(move.axis), std::string::npos) << "what is to be seen: " << move.comment;
    const auto id = machine.axis(move.axis);
    ASSERT_TRUE(id);
    const Axis& axis = machine.axes[*id];
    const bool rotary = axis.kind == AxisKind::rotary;
    const double unit = rotary ? kDegreePerRad : 1.0;
    if (move.to) {
      safe = at["Z"] = *move.to;
    } else {
      EXPECT_LE(std::abs(move.by), 5.0);
      EXPECT_GT(move.feed, 0.0);
      EXPECT_LE(move.feed, rotary ? 180.0 : 200.0);
      EXPECT_LE(move.feed / unit, axis.rapid.value_or(1e9) * 60.0 * (1.0 + 1e-9));
      at[move.axis] += move.by;
    }
    if (axis.has_limits()) {
      EXPECT_GE(at[move.axis], axis.min * unit - 1e-6) << control << " " << move.comment;
      EXPECT_LE(at[move.axis], axis.max * unit + 1e-6) << control << " " << move.comment;
    }
    if (!move.to && move.axis != "Z") moved.insert(move.axis);
    if (!rotary) continue;
    // Rotary axes turn at the safe height only, or where the operator was told to go there.
    const bool has_words = !controller.retract[2].empty();
    EXPECT_EQ(safe.has_value(), has_words);
    if (safe) {
      EXPECT_NEAR(at["Z"], *safe, 1e-9);
    } else {
      EXPECT_GE((at["Z"] - start["Z"]) * rises, 0.0);
      EXPECT_NE(text->find("JOG Z TO THE SAFE HEIGHT"), std::string::npos) << *text;
    }
  }
  EXPECT_EQ(moved.size(), machine.axes.size() - 1);
  for (const auto& name : moved) EXPECT_NEAR(at[name], start[name], 1e-9) << name;
}

TEST(LongProving, MovesALittleFromWhereTheOperatorStandsOnEveryControl) {
  std::mt19937_64 random(20);
  for (const Machine& machine : machines()) {
    for (const std::string& control : test::shipped_controllers()) {
      SCOPED_TRACE(machine.name + " " + control);
      for (int i = 0; i < 20; ++i) walk(machine, control, random);
    }
  }
}

TEST(Proving, RefusesAControlWithoutWordsForIt) {
  auto controller = test::shipped_controller("iso");
  controller.incremental.move.clear();
  const auto text = proving_program(test::shipped_machine("paper"), controller);
  ASSERT_FALSE(text);
  EXPECT_NE(text.error().message.find("[incremental] move in "), std::string::npos) << text.error().message;
}

}  // namespace
}  // namespace trunnion::post
