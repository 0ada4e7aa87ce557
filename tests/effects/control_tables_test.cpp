#include "trunnion/effects/control_tables.hpp"

#include <cmath>
#include <cstdlib>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <sstream>

#include "trunnion/base/files.hpp"
#include "trunnion/base/units.hpp"

#include "support/machines.hpp"

namespace trunnion {
namespace {

constexpr const char* kThreeAxes = R"(
[machine]
name = "three axes"
[tool]
length_mm = 100
[[axis]]
name = "X"
type = "linear"
direction = [1, 0, 0]
min_mm = -300
max_mm = 300
[[axis]]
name = "Y"
type = "linear"
direction = [0, 1, 0]
min_mm = -300
max_mm = 300
[[axis]]
name = "Z"
type = "linear"
direction = [0, 0, 1]
min_mm = -300
max_mm = 300
[chain]
)";

// Y' X' tables under a moving spindle (their directions opposite to the tool's motion), or all axes under the
// tool.
Machine machine_of(bool tables_move) {
  std::string text = kThreeAxes;
  if (tables_move) {
    for (const std::string& d : {std::string("[1, 0, 0]"), std::string("[0, 1, 0]")}) {
      const auto at = text.find(d);
      text.replace(at, d.size(), d == "[1, 0, 0]" ? "[-1, 0, 0]" : "[0, -1, 0]");
    }
    text += "tool = [\"Z\"]\npart = [\"Y\", \"X\"]\n";
  } else {
    text += "tool = [\"X\", \"Y\", \"Z\"]\npart = []\n";
  }
  Diagnostics diagnostics;
  auto machine = parse_machine(text, "m.toml", diagnostics);
  if (!machine) throw std::runtime_error(machine.error().text());
  return *machine;
}

std::vector<double> steps(double from, double to, int count) {
  std::vector<double> out(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) out[static_cast<std::size_t>(i)] = from + (to - from) * i / (count - 1);
  return out;
}

ErrorTable table_over(
    const std::vector<std::string>& arguments, const std::vector<std::vector<double>>& nodes,
    const std::vector<std::pair<std::string, std::function<double(double, double)>>>& components) {
  ErrorTable table;
  table.file = "t.csv";
  table.arguments = arguments;
  table.nodes = nodes;
  for (const auto& [name, f] : components) {
    ErrorTable::Component component{name, {}};
    for (const double u : nodes[0]) {
      if (nodes.size() == 1)
        component.values.push_back(f(u, 0.0));
      else
        for (const double v : nodes[1]) component.values.push_back(f(u, v));
    }
    table.components.push_back(std::move(component));
  }
  return table;
}

JointVector at(const Machine& machine, double x, double y, double z) {
  JointVector q;
  q[*machine.axis("X")] = x;
  q[*machine.axis("Y")] = y;
  q[*machine.axis("Z")] = z;
  return q;
}

// Distance of the tool from where it was commanded when the control moves by `trim` more than commanded.
Vec3 miss(const Machine& machine, const std::vector<ErrorTable>& truth, const JointVector& q,
          const JointVector& trim) {
  JointVector moved = q;
  for (std::size_t k = 0; k < machine.axes.size(); ++k) moved[k] += trim[k];
  const auto errors = TableErrors::create(machine, truth);
  return forward(machine, moved, machine.tool_vector(), errors->at(q)).p - forward(machine, q).p;
}

std::string written(const char* format, const ControlTables& tables, const Machine& machine,
                    const FormatOptions& options = {}) {
  const auto text = table_format(format)->write(tables, machine, options);
  if (!text) throw std::runtime_error(text.error().text());
  return *text;
}

ControlTables read_back(const char* format, const std::string& text, const Machine& machine,
                        const FormatOptions& options = {}) {
  Diagnostics diagnostics;
  auto tables = table_format(format)->read(text, "f", machine, options, diagnostics);
  if (!tables) throw std::runtime_error(tables.error().text());
  return *tables;
}

double bump(double u, double) {
  return 0.010 * std::sin(u / 70.0) + 0.00003 * u;
}

class Controls : public ::testing::TestWithParam<bool> {
 protected:
  Machine machine_ = machine_of(GetParam());
  // Positioning and straightness of X, positioning of Y.
  std::vector<ErrorTable> truth_ = {
      table_over({"X"}, {steps(-250, 250, 21)},
                 {{"EXX", bump}, {"EYX", [](double u, double) { return 0.004 * std::cos(u / 90.0); }}}),
      table_over({"Y"}, {steps(-200, 200, 17)},
                 {{"EYY", [](double u, double) { return -0.006 * std::sin(u / 50.0); }}})};
  CorrectionMap corrections(const std::string& input, const std::vector<std::string>& outputs,
                            const ErrorTable& of) {
    auto map = corrections_of(machine_, {of},
                              {{input}, {of.nodes[0]}, outputs, JointVector{}, machine_.tool_vector()});
    if (!map) throw std::runtime_error(map.error().text());
    return *map;
  }
};

// Small models of the controls, written from their manuals or source without the code under test: they parse
// the exported text themselves and say by how much each axis moves beyond its command.

double interpolated(const std::map<double, double>& table, double x) {  // linear, end value held
  if (x <= table.begin()->first) return table.begin()->second;
  if (x >= table.rbegin()->first) return table.rbegin()->second;
  const auto upper = table.upper_bound(x);
  const auto lower = std::prev(upper);
  return lower->second + (upper->second - lower->second) * (x - lower->first) / (upper->first - lower->first);
}

// LinuxCNC: type 0 stores nominal - forward, the trim is added to the commanded position.
double comp_file_control(const std::string& text, int type, double position, bool upwards) {
  std::map<double, double> trims;
  std::istringstream in(text);
  double nominal = 0, forward_value = 0, reverse_value = 0;
  while (in >> nominal >> forward_value >> reverse_value) {
    const double value = upwards ? forward_value : reverse_value;
    trims[nominal] = type == 0 ? nominal - value : value;
  }
  return interpolated(trims, position);
}

TEST_P(Controls, CompFileOfBothTypesBringsTheScrewHome) {
  const CorrectionMap map = corrections("X", {"X"}, truth_[0]);
  std::vector<ErrorTable> screw = {truth_[0]};
  screw[0].components.pop_back();
  for (const int type : {0, 1}) {
    FormatOptions options;
    options.file_type = type;
    options.input_axis = "X";
    const std::string text =
        written("linuxcnc", {.errors = {}, .location = {}, .corrections = {map}}, machine_, options);
    for (const double x : truth_[0].nodes[0]) {
      JointVector trim;
      trim[*machine_.axis("X")] = comp_file_control(text, type, x, true);
      const JointVector q = at(machine_, x, 30, -20);
      EXPECT_LT(miss(machine_, screw, q, trim).norm(), 2e-6) << "type " << type << " at " << x;
      EXPECT_NEAR(miss(machine_, screw, q, JointVector{}).norm(), std::abs(bump(x, 0)), 1e-9);
    }
    const auto again = read_back("linuxcnc", text, machine_, options);
    for (std::size_t i = 0; i < map.nodes[0].size(); ++i)
      EXPECT_NEAR(again.corrections[0].outputs[0].up[i], map.outputs[0].up[i], 1e-8);
  }
  FormatOptions type0;
  type0.input_axis = "X";
  // The same numbers read as the other type are no small mistake: actual positions are taken for trims.
  const std::string text =
      written("linuxcnc", {.errors = {}, .location = {}, .corrections = {map}}, machine_, type0);
  EXPECT_GT(std::abs(comp_file_control(text, 1, 100.0, true)), 50.0);
}

// $AN_CEC: tables over the base axis add to the set position of the compensation axis; products add f * g.
std::map<std::string, double> cec_control(const std::string& text,
                                          const std::vector<std::string>& axis_of_number,
                                          const std::map<std::string, double>& position, int direction) {
  struct Table {
    std::map<int, double> values;
    double step = 0, min = 0;
    int in = 0, out = 0, direction = 0, times = 0;
  };
  std::map<int, Table> tables;
  std::istringstream in(text);
  std::string line;
  while (std::getline(in, line)) {
    int t = 0, n = 0;
    double v = 0;
    if (std::sscanf(line.c_str(), "$AN_CEC[%d,%d]=%lf", &t, &n, &v) == 3)
      tables[t].values[n] = v;
    else if (std::sscanf(line.c_str(), "$AN_CEC_INPUT_AXIS[%d]=(AX%d)", &t, &n) == 2)
      tables[t].in = n;
    else if (std::sscanf(line.c_str(), "$AN_CEC_OUTPUT_AXIS[%d]=(AX%d)", &t, &n) == 2)
      tables[t].out = n;
    else if (std::sscanf(line.c_str(), "$AN_CEC_STEP[%d]=%lf", &t, &v) == 2)
      tables[t].step = v;
    else if (std::sscanf(line.c_str(), "$AN_CEC_MIN[%d]=%lf", &t, &v) == 2)
      tables[t].min = v;
    else if (std::sscanf(line.c_str(), "$AN_CEC_DIRECTION[%d]=%d", &t, &n) == 2)
      tables[t].direction = n;
    else if (std::sscanf(line.c_str(), "$AN_CEC_MULT_BY_TABLE[%d]=%d", &t, &n) == 2)
      tables[t].times = n;
  }
  const auto value = [&](const Table& table) {
    std::map<double, double> points;
    for (const auto& [n, v] : table.values) points[table.min + n * table.step] = v;
    return interpolated(points, position.at(axis_of_number[static_cast<std::size_t>(table.in - 1)]));
  };
  std::map<int, bool> factor;
  for (const auto& [t, table] : tables)
    if (table.times > 0) factor[table.times - 1] = true;
  std::map<std::string, double> trim;
  for (const auto& [t, table] : tables) {
    if (table.direction != 0 && table.direction != direction) continue;
    const std::string& out = axis_of_number[static_cast<std::size_t>(table.out - 1)];
    if (table.times > 0)
      trim[out] += value(table) * value(tables.at(table.times - 1));
    else if (!factor.contains(t))
      trim[out] += value(table);
  }
  return trim;
}

TEST_P(Controls, CecTablesBringTheToolHome) {
  ControlTables tables;
  tables.corrections = {corrections("X", {"X", "Y"}, truth_[0]), corrections("Y", {"Y"}, truth_[1])};
  const std::string text = written("siemens", tables, machine_);
  for (const double x : {-250.0, -100.0, 25.0, 250.0})
    for (const double y : {-200.0, 50.0}) {
      const auto trims = cec_control(text, {"X", "Y", "Z"}, {{"X", x}, {"Y", y}, {"Z", 0}}, 1);
      JointVector trim;
      for (const auto& [axis, value] : trims) trim[*machine_.axis(axis)] = value;
      EXPECT_LT(miss(machine_, truth_, at(machine_, x, y, 10), trim).norm(), 2e-6);
    }
  const auto again = read_back("siemens", text, machine_);
  ASSERT_EQ(again.corrections.size(), 3u);
  for (std::size_t i = 0; i < 21; ++i)
    EXPECT_NEAR(again.corrections[1].outputs[0].up[i], tables.corrections[0].outputs[1].up[i], 1e-9);
}

TEST_P(Controls, CecProductsCarryTheYawOfAStackedAxis) {
  // Yaw of X with the lever of Y: the correction of X is a product of a function of X and one of Y, exactly.
  const auto yaw = table_over({"X"}, {steps(-250, 250, 21)},
                              {{"ECX", [](double u, double) { return 40e-6 * std::sin(u / 80.0); }}});
  const auto map = corrections_of(machine_, {yaw},
                                  {{"X", "Y"},
                                   {yaw.nodes[0], steps(-200, 200, 9)},
                                   {"X", "Y"},
                                   at(machine_, 0, 0, 40),
                                   machine_.tool_vector()});
  ASSERT_TRUE(map.has_value()) << map.error().text();
  const std::string text =
      written("siemens", {.errors = {}, .location = {}, .corrections = {*map}}, machine_);
  for (const double x : {-250.0, -125.0, 50.0})
    for (const double y : {-200.0, -50.0, 150.0}) {
      const auto trims = cec_control(text, {"X", "Y", "Z"}, {{"X", x}, {"Y", y}, {"Z", 40}}, 1);
      JointVector trim;
      for (const auto& [axis, value] : trims) trim[*machine_.axis(axis)] = value;
      const JointVector q = at(machine_, x, y, 40);
      EXPECT_LT(miss(machine_, {yaw}, q, trim).norm(), 0.3e-3);  // two products leave below 0.1 um an axis
      EXPECT_LT(miss(machine_, {yaw}, q, trim).norm(),
                0.1 * miss(machine_, {yaw}, q, JointVector{}).norm() + 0.3e-3);
    }
  EXPECT_NE(text.find("MULT_BY_TABLE[2]=4"),
            std::string::npos);  // table index 2 times table number 4 (index 3)
}

TEST_P(Controls, CecKeepsTheDirectionsApart) {
  CorrectionMap map = corrections("X", {"X"}, truth_[0]);
  map.outputs[0].down = map.outputs[0].up;
  for (double& v : map.outputs[0].down) v += 0.003;
  const std::string text = written("siemens", {.errors = {}, .location = {}, .corrections = {map}}, machine_);
  const std::map<std::string, double> here = {{"X", 100.0}, {"Y", 0.0}, {"Z", 0.0}};
  const auto up = cec_control(text, {"X", "Y", "Z"}, here, 1),
             down = cec_control(text, {"X", "Y", "Z"}, here, -1);
  EXPECT_NEAR(down.at("X") - up.at("X"), 0.003, 1e-8);
  const auto again = read_back("siemens", text, machine_);
  ASSERT_EQ(again.corrections.size(), 2u);  // they add up
  EXPECT_NEAR(again.corrections[0].outputs[0].up[3] + again.corrections[1].outputs[0].up[3],
              map.outputs[0].up[3], 1e-9);
  EXPECT_NEAR(again.corrections[0].outputs[0].down[3] + again.corrections[1].outputs[0].down[3],
              map.outputs[0].down[3], 1e-9);
}

// Errors: positive when the travel is too long; the control takes them away.
TEST_P(Controls, ComTableHoldsErrorsThatTheControlTakesAway) {
  const CorrectionMap map = corrections("X", {"X", "Y"}, truth_[0]);
  const std::string text =
      written("heidenhain", {.errors = {}, .location = {}, .corrections = {map}}, machine_);
  std::istringstream in(text);
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line, "BEGIN X.COM MM");
  std::getline(in, line);
  EXPECT_EQ(line, "NR\tAXISPOS\tBACKLASH\tX\tY");
  std::map<double, double> error_x, error_y;
  double nr = 0, position = 0, backlash = 0, ex = 0, ey = 0;
  while (in >> nr >> position >> backlash >> ex >> ey) {
    error_x[position] = ex;
    error_y[position] = ey;
  }
  ASSERT_EQ(error_x.size(), 21u);
  for (const double x : truth_[0].nodes[0]) {
    JointVector trim;
    trim[*machine_.axis("X")] = -interpolated(error_x, x);
    trim[*machine_.axis("Y")] = -interpolated(error_y, x);
    EXPECT_LT(miss(machine_, {truth_[0]}, at(machine_, x, 0, 0), trim).norm(), 2e-6);
  }
  const auto again = read_back("heidenhain", text, machine_);
  EXPECT_NEAR(again.corrections[0].outputs[1].up[4], map.outputs[1].up[4], 1e-9);
}

TEST_P(Controls, IncrementsAddUpToTheCorrection) {
  CorrectionMap map = corrections("X", {"X"}, truth_[0]);
  FormatOptions options;
  options.input_axis = "X";
  options.interval_mm = 25.0;
  options.reference_number = 40;
  options.reference_mm = 0.0;
  const std::string text =
      written("fanuc", {.errors = {}, .location = {}, .corrections = {map}}, machine_, options);
  // The control: a counter that passes from the reference point adds P at each interval it goes through, and
  // takes it away on the way back.
  std::map<int, int> increments;
  std::istringstream in(text);
  std::string line;
  while (std::getline(in, line)) {
    int n = 0, p = 0;
    if (std::sscanf(line.c_str(), "N%d P%d", &n, &p) == 2 && n >= 10000) increments[n - 10000] = p;
  }
  ASSERT_EQ(increments.size(), 20u);
  const double zero = map.value(map.outputs[0].up, 0.0);
  for (int k = -10; k <= 10; ++k) {
    int sum = 0;
    for (int i = 1; i <= k; ++i) sum += increments.at(40 + i);
    for (int i = 0; i > k; --i) sum -= increments.at(40 + i);
    EXPECT_NEAR(sum * 1e-3, map.value(map.outputs[0].up, 25.0 * k) - zero, 0.5e-3 + 1e-9)
        << k;  // half a unit, not summed up
  }
  const auto again = read_back("fanuc", text, machine_, options);
  EXPECT_EQ(written("fanuc", again, machine_, options), text);
}

TEST_P(Controls, TwoAxisTableBringsTheToolHome) {
  const auto cross =
      table_over({"X", "Y"}, {steps(-250, 250, 11), steps(-200, 200, 9)},
                 {{"EXX", [](double u, double v) { return 0.02 * std::sin((u + v) / 100.0); }},
                  {"EYY", [](double u, double v) { return 0.01 * std::cos((u - v) / 60.0); }}});
  const auto map = corrections_of(
      machine_, {cross},
      {{"Y", "X"}, {cross.nodes[1], cross.nodes[0]}, {"X", "Y"}, JointVector{}, machine_.tool_vector()});
  ASSERT_TRUE(map.has_value());
  const std::string text =
      written("aerotech", {.errors = {}, .location = {}, .corrections = {*map}}, machine_);
  EXPECT_EQ(text.substr(0, text.find('\n')), ":START2D 2 1 1 2 50 50 11");
  // The control: row by row along the row axis, pairs along the column axis, added to the command (um).
  std::istringstream in(text.substr(text.find("\n\n") + 2));
  for (int row = 0; row < 9; ++row)
    for (int column = 0; column < 11; ++column) {
      double dx = 0, dy = 0;
      in >> dx >> dy;
      JointVector trim;
      trim[*machine_.axis("X")] = dx * 1e-3;
      trim[*machine_.axis("Y")] = dy * 1e-3;
      EXPECT_LT(miss(machine_, {cross}, at(machine_, -250 + 50 * column, -200 + 50 * row, 0), trim).norm(),
                1e-6);
    }
  const auto again = read_back("aerotech", text, machine_);
  EXPECT_NEAR(again.corrections[0].value(again.corrections[0].outputs[1].up, 50.0, -150.0),
              map->value(map->outputs[1].up, 50.0, -150.0), 1e-7);
  // Back to error tables: the same machine again.
  const auto errors = errors_of(machine_, again.corrections[0]);
  ASSERT_TRUE(errors.has_value());
  EXPECT_LT((miss(machine_, *errors, at(machine_, 40, 20, 0), JointVector{}) -
             miss(machine_, {cross}, at(machine_, 40, 20, 0), JointVector{}))
                .norm(),
            1e-6);
}

TEST_P(Controls, ErrorParameterFormatsGiveBackTheirTables) {
  ControlTables tables;
  tables.errors = truth_;
  tables.location = {{"C0Y", 12e-6}, {"X0C", 0.013}};
  for (const char* format : {"isg", "etalon"}) {
    const auto again = read_back(format, written(format, tables, machine_), machine_);
    EXPECT_EQ(again.location, tables.location) << format;
    std::map<std::string, std::vector<double>> before, after;
    for (const auto& t : tables.errors)
      for (const auto& c : t.components) before[c.name] = c.values;
    for (const auto& t : again.errors)
      for (const auto& c : t.components) after[c.name] = c.values;
    EXPECT_EQ(before, after) << format;
  }
  tables.errors = {table_over({"Z", "X"}, {steps(0, 100, 2), steps(0, 10, 3)},
                              {{"EXX", [](double z, double x) { return z + 1e-3 * x; }}})};
  const auto again = read_back("isg", written("isg", tables, machine_), machine_);
  EXPECT_EQ(again.errors[0].components[0].values, tables.errors[0].components[0].values);
  EXPECT_FALSE(table_format("etalon")->write(tables, machine_, {}).has_value());
}

INSTANTIATE_TEST_SUITE_P(Machines, Controls, ::testing::Values(false, true), [](const auto& which) {
  return std::string(which.param ? "TablesMove" : "ToolMoves");
});

TEST(ControlTables, ReadsThePublishedExampleOfTwoBlocks) {
  const Machine machine = machine_of(false);
  const auto tables = read_back("isg",
                                "// comment\nZ X EXX EYX\n0.0 0.0 0.02 0.01\n0.0 10.0 0.00 -0.1\n100.0 0.0 "
                                "0.01 0.02 // row\n100.0 10.0 0.03 -0.09\n#\nC0Y EX0C\n"
                                "0.00001 0.2\n",
                                machine);
  ASSERT_EQ(tables.errors.size(), 1u);
  EXPECT_EQ(tables.errors[0].arguments, (std::vector<std::string>{"Z", "X"}));
  EXPECT_DOUBLE_EQ(tables.errors[0].components[1].values[3], -0.09);
  EXPECT_EQ(tables.location[1].first, "X0C");
}

TEST(ControlTables, FaultsNameTheirPlace) {
  const Machine machine = machine_of(false);
  const auto fault = [&](const char* format, const std::string& text) {
    Diagnostics diagnostics;
    FormatOptions options;
    options.input_axis = "X";
    const auto r = table_format(format)->read(text, "f", machine, options, diagnostics);
    return r ? std::string("accepted") : r.error().text();
  };
  EXPECT_EQ(fault("linuxcnc", "0 0 0\n1 1 1\nend\n"), "f:3:1: error: 'end' is not a number");
  EXPECT_EQ(fault("linuxcnc", "0 0 0\n0 1 1\n"), "f:2:1: error: positions must ascend");
  EXPECT_NE(fault("linuxcnc", "0 0.01 0.01\n100 0.012 0.011\n200 -0.004 0\n")
                .find("read as type 0 (COMP_FILE_TYPE) its corrections change by 1.000 mm in each mm"),
            std::string::npos);
  EXPECT_EQ(fault("linuxcnc", "0 0.01 0.01\n100 100.012 100.011\n200 199.9 200\n"), "accepted");
  EXPECT_EQ(fault("isg", "X EXX\n0 1\n1 x\n"), "f:3:1: error: 'x' is not a number");
  EXPECT_EQ(fault("isg", "X Y EXX\n0 0 1\n1 1 2\n"),
            "f:1:1: error: parameter values are not on a grid: 2 rows, the grid has 4 nodes");
  EXPECT_EQ(fault("siemens", "$AN_CEC[0,0]=1\n$AN_CEC_INPUT_AXIS[0]=(AX9)\n"),
            "f:2:1: error: '(AX9)' is no axis of this machine (axis numbers: give --axes)");
  EXPECT_EQ(fault("etalon", "[EXX]\nGridpoints = {\n0 0\n0 1\n}\n"), "f:4:1: error: positions must ascend");
}

std::string heidenhain_rows(const std::string& rows) {
  return "BEGIN X.COM MM\nNR AXISPOS BACKLASH X\n" + rows + "[END]\n";
}

// Whatever the format: positions rise, corrections are numbers, axes are the machine's.
TEST(ControlTables, RefusesTablesThatNobodyCouldInterpolate) {
  const Machine machine = machine_of(false);
  const auto fault = [&](const char* format, const std::string& text) {
    Diagnostics diagnostics;
    const auto r = table_format(format)->read(text, "f", machine, {}, diagnostics);
    return r ? std::string("accepted") : r.error().text();
  };
  EXPECT_EQ(fault("heidenhain", heidenhain_rows("0 -100 0 0\n1 0 0 1\n2 0 0 2\n")),
            "f: error: positions over X must rise: number 3 does not");
  EXPECT_EQ(fault("heidenhain", heidenhain_rows("0 -100 0 0\n1 0 0 1\n2 1 0 2\n")), "accepted");
  const std::string table =
      "$AN_CEC[0,0]=1\n$AN_CEC[0,1]=2\n$AN_CEC_INPUT_AXIS[0]=(AX1)\n$AN_CEC_OUTPUT_AXIS[0]=(AX2)\n";
  EXPECT_EQ(fault("siemens", table + "$AN_CEC_STEP[0]=10\n"), "accepted");
  EXPECT_EQ(fault("siemens", table + "$AN_CEC_STEP[0]=1e-9\n$AN_CEC_MIN[0]=100000000\n"),
            "f: error: positions over X must rise: number 2 does not");
  EXPECT_EQ(fault("siemens", table + "$AN_CEC_STEP[0]=10\n$AN_CEC_MULT_BY_TABLE[0]=2\n$AN_CEC[1,0]=1\n"),
            "f:7:1: error: the table lacks its axes");
  const auto plate = [&](const std::string& head) {
    return fault("aerotech",
                 ":START2D " + head + "\n:START2D POSUNIT=METRIC CORUNIT=METRIC/1000\n0 1\n2 3\n:END\n");
  };
  EXPECT_EQ(plate("1 2 3 10 10 2"), "accepted");
  EXPECT_EQ(plate("1 2 3 10 0 2"), "f: error: positions over Y must rise: number 2 does not");
  EXPECT_EQ(plate("1 2 3 10 10 1002000001"),
            "f: error: the table has 2 rows of 1002000001 columns: 2 and more, at most 1000000, expected");
  EXPECT_EQ(plate("1 2 3 10 10 -2"),
            "f: error: the table has 2 rows of -2 columns: 2 and more, at most 1000000, expected");
  EXPECT_EQ(plate("1 2 3.5 10 10 2"),
            "f: error: an axis number of the file is no axis of this machine: give --axes");
}

// What is missing would count as nothing: an error of 13 um became 1.
TEST(ControlTables, RefusesTablesThatAreCutOff) {
  const Machine machine = machine_of(false);
  FormatOptions options;
  options.input_axis = "X";
  options.interval_mm = 50.0;
  const auto fault = [&](const char* format, const std::string& text) {
    Diagnostics diagnostics;
    const auto r = table_format(format)->read(text, "f", machine, options, diagnostics);
    return r ? std::string("accepted") : r.error().text();
  };
  const std::string points = "%\nN3620 P100\nN3621 P99\nN3622 P102\nN10099 P1\nN10100 P2\nN10101 P3\n";
  EXPECT_EQ(
      fault("fanuc", points),
      "f: error: the points go from 99 to 102 (3621, 3622), and N10102 is missing: the table is cut off");
  EXPECT_EQ(fault("fanuc", points + "N10102 P0\n%\n"), "accepted");
  EXPECT_EQ(fault("fanuc", "N10100 P2\nN10102 P0\n"), "accepted");  // it does not say how many
  const std::string com = "BEGIN X.COM MM\nNR AXISPOS BACKLASH X\n0 -100 0 0\n1 0 0 1\n";
  EXPECT_EQ(fault("heidenhain", com), "f: error: the table ends without [END]: it is cut off");
  EXPECT_EQ(fault("heidenhain", com + "[END]\n"), "accepted");
  const std::string plate = ":START2D 1 2 3 10 10 2\n:START2D POSUNIT=METRIC CORUNIT=METRIC/1000\n0 1\n2 3\n";
  EXPECT_EQ(fault("aerotech", plate), "f: error: the table ends without :END: it is cut off");
  EXPECT_EQ(fault("aerotech", plate + ":END\n"), "accepted");
  const std::string cec =
      "$AN_CEC_INPUT_AXIS[0]=(AX1)\n$AN_CEC_OUTPUT_AXIS[0]=(AX2)\n$AN_CEC_STEP[0]=10\n$AN_CEC_MIN[0]=0\n"
      "$AN_CEC_MAX[0]=20\n$AN_CEC[0,0]=1\n$AN_CEC[0,1]=2\n";
  EXPECT_EQ(fault("siemens", cec),
            "f:1:1: error: the table has 2 values and goes to $AN_CEC_MAX with 3: it is cut off");
  EXPECT_EQ(fault("siemens", cec + "$AN_CEC[0,2]=0\n"), "accepted");
}

// Units of the axis itself, no offsets, comments behind ', a third output: as public files have them.
// A punch-out of a control holds the points of all its axes in one row.
TEST(ControlTables, PointsOfAnotherFanucAxisAreNoneOfThisOne) {
  const Machine machine = machine_of(false);
  const std::string points = "N10100P-3\nN10101P-5\nN10102P-7\nN10103P20\nN10104P20\nN10105P20\n%\n";
  const std::string all = "%\nN03620A1P100A2P104\nN03621A1P100A2P103\nN03622A1P102A2P105\n" + points;
  const auto values = [&](const std::string& axis, const std::string& text) {
    Diagnostics diagnostics;
    FormatOptions options;
    options.input_axis = axis;
    options.interval_mm = 100.0;
    const auto r = table_format("fanuc")->read(text, "f", machine, options, diagnostics);
    std::vector<double> out;
    if (r)
      for (const double v : r->corrections[0].outputs[0].up) out.push_back(std::round(v / kMmPerUm));
    return out;
  };
  EXPECT_EQ(values("X", all), (std::vector<double>{3, 0, -5, -12}));
  EXPECT_EQ(values("Y", all), (std::vector<double>{-40, -20, 0, 20}));
  EXPECT_EQ(values("X", "%\nN3620 P100\nN3621 P100\nN3622 P102\n" + points),
            (std::vector<double>{3, 0, -5, -12}));
  // Points have numbers from 0 on.
  CorrectionMap map;
  map.inputs = {"X"};
  map.nodes = {{-200.0, -100.0, 0.0, 100.0}};
  map.outputs = {{.axis = "X", .up = {0.003, 0.002, 0.0, 0.001}, .down = {}}};
  for (const int number : {0, 1}) {
    FormatOptions options;
    options.input_axis = "X";
    options.reference_number = number;
    const auto text =
        table_format("fanuc")->write({.errors = {}, .location = {}, .corrections = {map}}, machine, options);
    EXPECT_EQ(text.has_value(), number == 1) << number;
  }
  EXPECT_TRUE(values("Z", all).empty());  // no value of the third axis: whose points are they?
}

// Corrections of an axis that turns on close, and the control is told to go on from where they begin.
TEST(ControlTables, CorrectionsAroundATurnClose) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  CorrectionMap map;
  map.inputs = {"C"};
  map.nodes = {{0.0, 0.5 * kPi, kPi, 1.5 * kPi}};
  map.outputs = {{.axis = "X", .up = {0.001, 0.002, 0.003, 0.004}, .down = {}}};
  CorrectionMap open = map;
  open.nodes = {{0.0, 0.3, 0.6, 0.9}};
  close_turns(machine, map);
  close_turns(machine, open);
  EXPECT_EQ(map.outputs[0].up, (std::vector<double>{0.001, 0.002, 0.003, 0.004, 0.001}));
  EXPECT_NEAR(map.nodes[0].back(), kTwoPi, 1e-15);
  EXPECT_EQ(open.nodes[0].size(), 4U);
  const auto once = map;
  close_turns(machine, map);
  EXPECT_EQ(map.nodes, once.nodes);
  const auto modulo = [&](const CorrectionMap& m) {
    return written("siemens", {.errors = {}, .location = {}, .corrections = {m}}, machine)
               .find("IS_MODULO[0]=1") != std::string::npos;
  };
  EXPECT_TRUE(modulo(map));
  EXPECT_FALSE(modulo(open));
  // Over two axes each row, or the whole first column, stands once more.
  CorrectionMap two;
  two.inputs = {"A", "C"};
  two.nodes = {{0.0, 1.0}, {0.0, kPi}};
  two.outputs = {{.axis = "X", .up = {1, 2, 3, 4}, .down = {}}};
  close_turns(machine, two);
  EXPECT_EQ(two.outputs[0].up, (std::vector<double>{1, 2, 1, 3, 4, 3}));
}

TEST(ControlTables, AerotechTablesInTheUnitsOfTheAxes) {
  const Machine machine = machine_of(false);
  const std::string head = "'  RowAxis ColumnAxis OutputAxis1 OutputAxis2 ...\n:START2D 2 1 1 2 10 5 2\n";
  const auto tables = read_back(
      "aerotech",
      head + ":START2D OUTAXIS3=3 POSUNIT=PRIMARY CORUNIT=PRIMARY/1000\n0 0 0\t1 -2 3\n4 5 6\t7 8 9\n:END\n",
      machine);
  const CorrectionMap& map = tables.corrections[0];
  ASSERT_EQ(map.outputs.size(), 3U);
  EXPECT_EQ(map.nodes[0], (std::vector<double>{0.0, 10.0}));  // Y, from 0
  EXPECT_EQ(map.nodes[1], (std::vector<double>{0.0, 5.0}));
  EXPECT_NEAR(map.value(map.output("X")->up, 0.0, 5.0), 1e-3, 1e-15);
  EXPECT_NEAR(map.value(map.output("Y")->up, 0.0, 5.0), -2e-3, 1e-15);
  EXPECT_NEAR(map.value(map.output("Z")->up, 10.0, 5.0), 9e-3, 1e-15);
  const auto fault = [&](const std::string& text) {
    Diagnostics diagnostics;
    const auto r = table_format("aerotech")->read(text, "f", machine, {}, diagnostics);
    return r ? std::string("accepted") : r.error().text();
  };
  EXPECT_NE(fault(head + ":START2D POSUNIT=PRIMARY CORUNIT=PRIMARY NEGCOR\n0 0 0 0\n0 0 0 0\n")
                .find("f:3:1: error: NEGCOR is not read"),
            std::string::npos);
  // Axis 4 is A.
  Diagnostics diagnostics;
  const auto rotary =
      table_format("aerotech")
          ->read(
              ":START2D 4 1 1 2 10 5 2\n:START2D POSUNIT=PRIMARY CORUNIT=PRIMARY\n0 0 0 0\n0 0 0 0\n:END\n",
              "f", test::shipped_machine("trunnion_offset"), {}, diagnostics);
  ASSERT_FALSE(rotary);
  EXPECT_NE(rotary.error().text().find("of rotary axes it is not read"), std::string::npos)
      << rotary.error().text();
}

// A real stage: its map of deviations and the control's table that was made from it.
TEST(ControlTablesReal, StageTableIsMinusItsMapFromTheFirstCorner) {
  const char* folder = std::getenv("TRUNNION_REFERENCE_DATA");
  if (folder == nullptr) GTEST_SKIP() << "TRUNNION_REFERENCE_DATA is not set";
  const std::string base = std::string(folder) + "/geometric/stage_642583/642583-1-1-2";
  const auto table_text = read_file(base + "D.cal"), map_text = read_file(base + "dcal_stitched.dat");
  ASSERT_TRUE(table_text && map_text);
  FormatOptions options;
  options.axis_numbers = {"X", "Z", "Y"};  // the stage's axis 3 is its Y
  const auto tables = read_back("aerotech", *table_text, machine_of(false), options);
  const CorrectionMap& map = tables.corrections[0];
  EXPECT_EQ(map.inputs, (std::vector<std::string>{"Y", "X"}));
  std::istringstream in(*map_text);
  std::string line;
  double worst = 0.0, first[2] = {0, 0};
  int count = 0;
  while (std::getline(in, line)) {
    double x = 0, y = 0, e1 = 0, e2 = 0;
    if (std::sscanf(line.c_str(), "%lf, %lf, %lf, %lf", &x, &y, &e1, &e2) != 4) continue;
    if (count++ == 0) first[0] = e1, first[1] = e2;
    worst = std::max({worst, std::abs(map.value(map.output("X")->up, y, x) * 1e3 + e1 - first[0]),
                      std::abs(map.value(map.output("Y")->up, y, x) * 1e3 + e2 - first[1])});
  }
  EXPECT_EQ(count, 2601);
  EXPECT_LT(worst, 2e-4);  // um: the files print four decimals
}

}  // namespace
}  // namespace trunnion
