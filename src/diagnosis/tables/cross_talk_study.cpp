#include "trunnion/diagnosis/cross_talk_study.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <random>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/statistics.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr std::string_view kComponents = "XYZABC";

// Two of the axes carry cross-talk (X and Y), the third has tables over itself.
class Campaign {
 public:
  Campaign(const Machine& machine, const Model& truth, const CrossTalkPlan& plan)
      : machine_(machine), truth_(truth), plan_(plan), random_(plan.seed) {
    for (std::size_t k = 0; k < 3; ++k) axis_[k] = *machine.axis(std::string_view("XYZ").substr(k, 1));
  }

  const Axis& axis(std::size_t k) const { return machine_.axes[axis_[k]]; }
  AxisId id(std::size_t k) const { return axis_[k]; }
  double middle(std::size_t k) const { return 0.5 * (axis(k).min + axis(k).max); }
  double travel(std::size_t k) const { return axis(k).max - axis(k).min; }

  JointVector pose(double x, double y, double z) const {
    JointVector q;
    q[axis_[0]] = x;
    q[axis_[1]] = y;
    q[axis_[2]] = z;
    return q;
  }
  ChainErrors errors(const JointVector& q) const {
    MachineState state;
    state.q = q;
    return truth_.errors(state);
  }
  // True displacement of the tool (M) when the control commands `q` and stands at `moved`.
  Vec3 miss(const JointVector& q, const JointVector& moved) const {
    return forward(machine_, moved, tool(), errors(moved)).p - forward(machine_, q, tool()).p;
  }
  Vec3 tool() const { return machine_.tool_vector(); }

  // Mean of the runs of one reading.
  double noise(double s) {
    double sum = 0.0;
    for (std::size_t r = 0; r < plan_.runs; ++r) sum += normal_(random_);
    return s * sum / static_cast<double>(plan_.runs);
  }
  double uniform() { return uniform_(random_); }
  const CrossTalkPlan& plan() const { return plan_; }
  const Machine& machine() const { return machine_; }

 private:
  const Machine& machine_;
  ModelEvaluator truth_;
  const CrossTalkPlan& plan_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_{0.0, 1.0};
  std::uniform_real_distribution<double> uniform_{0.0, 1.0};
  std::array<AxisId, 3> axis_{};
};

double component_of(const Twist& twist, std::size_t c) {
  const auto k = static_cast<Eigen::Index>(c % 3);
  return c < 3 ? twist.trans_mm[k] : twist.rot_rad[k];
}

std::vector<double> equal_nodes(const Axis& axis, std::size_t count) {
  std::vector<double> out;
  for (std::size_t i = 0; i < count; ++i)
    out.push_back(axis.min + (axis.max - axis.min) * static_cast<double>(i) / static_cast<double>(count - 1));
  return out;
}

// What was measured on one size of grid.
struct Maps {
  ErrorTable table_x, table_y;  // components of joints X and Y over (X, Y)
  ErrorTable table_z;           // of joint Z over Z
};

Maps measure(Campaign& campaign, std::size_t nodes) {
  Maps maps;
  const auto x = equal_nodes(campaign.axis(0), nodes), y = equal_nodes(campaign.axis(1), nodes),
             z = equal_nodes(campaign.axis(2), nodes);
  const auto prepare = [&](ErrorTable& table, std::size_t axis, std::vector<std::string> arguments,
                           std::vector<std::vector<double>> at) {
    table.arguments = std::move(arguments);
    table.nodes = std::move(at);
    for (const char c : kComponents)
      table.components.push_back({std::string("E") + c + campaign.axis(axis).name, {}});
  };
  const std::string &X = campaign.axis(0).name, &Y = campaign.axis(1).name, &Z = campaign.axis(2).name;
  prepare(maps.table_x, 0, {X, Y}, {x, y});
  prepare(maps.table_y, 1, {X, Y}, {x, y});
  prepare(maps.table_z, 2, {Z}, {z});
  const auto read = [&](ErrorTable& table, std::size_t axis, const ChainErrors& errors) {
    for (std::size_t c = 0; c < 6; ++c)
      table.components[c].values.push_back(
          component_of(errors.joint[campaign.id(axis)], c) +
          campaign.noise(c < 3 ? campaign.plan().s_displacement_mm : campaign.plan().s_rotation_rad));
  };
  for (const double xi : x)
    for (const double yj : y) {
      const ChainErrors errors = campaign.errors(campaign.pose(xi, yj, campaign.middle(2)));
      read(maps.table_x, 0, errors);
      read(maps.table_y, 1, errors);
    }
  for (const double zk : z)
    read(maps.table_z, 2, campaign.errors(campaign.pose(campaign.middle(0), campaign.middle(1), zk)));
  return maps;
}

// The middle line of a grid along the joint's own axis.
ErrorTable middle_line(const ErrorTable& grid, std::size_t argument) {
  ErrorTable line;
  line.arguments = {grid.arguments[argument]};
  line.nodes = {grid.nodes[argument]};
  const std::size_t width = grid.nodes[1].size(), middle = grid.nodes[1 - argument].size() / 2;
  for (const auto& component : grid.components) {
    ErrorTable::Component along{component.name, {}};
    for (std::size_t i = 0; i < line.nodes[0].size(); ++i)
      along.values.push_back(component.values[argument == 0 ? i * width + middle : middle * width + i]);
    line.components.push_back(std::move(along));
  }
  return line;
}

// Once per screw turn, from a line with steps that run through all phases of the pitch: sine and cosine
// beside a smooth error.
struct Periodic {
  double pitch_mm = 0.0, sine = 0.0, cosine = 0.0;
  double at(double x) const {
    return sine * std::sin(kTwoPi * x / pitch_mm) + cosine * std::cos(kTwoPi * x / pitch_mm);
  }
};

Periodic measure_periodic(Campaign& campaign, std::size_t axis) {
  constexpr double kStep = 0.381966;  // of the pitch: the golden section meets every phase
  constexpr int kSmooth = 16;         // Legendre terms that take up the rest of the line
  Periodic out;
  out.pitch_mm = campaign.axis(axis).screw_pitch_mm.value_or(0.0);
  if (out.pitch_mm <= 0.0) return out;
  constexpr int n = kSmooth + 2;
  Eigen::Matrix<double, n, n> N = Eigen::Matrix<double, n, n>::Zero();
  Eigen::Matrix<double, n, 1> right = Eigen::Matrix<double, n, 1>::Zero();
  const int steps = static_cast<int>(campaign.travel(axis) / (kStep * out.pitch_mm));
  for (int i = 0; i <= steps; ++i) {
    const double x = campaign.axis(axis).min + i * kStep * out.pitch_mm;
    JointVector q = campaign.pose(campaign.middle(0), campaign.middle(1), campaign.middle(2));
    q[campaign.id(axis)] = x;
    const double y = component_of(campaign.errors(q).joint[campaign.id(axis)], axis) +
                     campaign.noise(campaign.plan().s_displacement_mm);
    Eigen::Matrix<double, n, 1> row;
    const double t = 2.0 * (x - campaign.axis(axis).min) / campaign.travel(axis) - 1.0;
    row[0] = 1.0;
    row[1] = t;
    for (int k = 2; k < kSmooth; ++k) row[k] = ((2 * k - 1) * t * row[k - 1] - (k - 1) * row[k - 2]) / k;
    row[kSmooth] = std::sin(kTwoPi * x / out.pitch_mm);
    row[kSmooth + 1] = std::cos(kTwoPi * x / out.pitch_mm);
    N += row * row.transpose();
    right += row * y;
  }
  const Eigen::Matrix<double, n, 1> z = solve_positive(N, right);
  out.sine = z[kSmooth];
  out.cosine = z[kSmooth + 1];
  return out;
}

// Takes the periodic part out of the nodes of the positioning component of joint `axis`.
void subtract(const Periodic& periodic, ErrorTable& table, std::size_t axis) {
  if (periodic.pitch_mm <= 0.0) return;
  const std::size_t width = table.nodes.size() > 1 ? table.nodes[1].size() : 1;
  auto& values = table.components[axis].values;
  for (std::size_t k = 0; k < values.size(); ++k)
    values[k] -= periodic.at(axis == 1 && table.nodes.size() > 1 ? table.nodes[1][k % width]
                                                                 : table.nodes[0][k / width]);
}

// The periodic part as a table of its own, fine enough that linear interpolation leaves 0.1 % of it.
ErrorTable periodic_table(const Campaign& campaign, const Periodic& periodic, std::size_t axis) {
  constexpr double kStepsPerPitch = 64.0;
  ErrorTable table;
  table.arguments = {campaign.axis(axis).name};
  const auto count =
      static_cast<std::size_t>(std::ceil(campaign.travel(axis) / periodic.pitch_mm * kStepsPerPitch)) + 1;
  table.nodes = {equal_nodes(campaign.axis(axis), count)};
  ErrorTable::Component component{std::string("E") + "XYZ"[axis] + campaign.axis(axis).name, {}};
  for (const double x : table.nodes[0]) component.values.push_back(periodic.at(x));
  table.components = {component};
  return table;
}

// A table over one axis through its spline, so fine that straight lines between the nodes follow it.
ErrorTable refined(const ErrorTable& table, double smoothing = 0.0) {
  constexpr std::size_t kNodes = 401;
  ErrorTable out;
  out.arguments = table.arguments;
  out.nodes = {{}};
  for (std::size_t i = 0; i < kNodes; ++i)
    out.nodes[0].push_back(table.nodes[0].front() + (table.nodes[0].back() - table.nodes[0].front()) *
                                                        static_cast<double>(i) / (kNodes - 1));
  InterpolationOptions options;
  options.method = Interpolation::spline;
  options.smoothing = smoothing;
  for (const auto& component : table.components) {
    ErrorTable::Component fine{component.name, {}};
    const auto spline = make_interpolant(table.grid(component.name), options);
    TRUNNION_EXPECTS(spline.has_value());  // the nodes come from `measure`
    for (const double x : out.nodes[0]) fine.values.push_back((*spline)->value(x, 0.0));
    out.components.push_back(std::move(fine));
  }
  return out;
}

// Splits a grid table: components that vary with the other axis beyond the noise of a mean stay on the grid,
// the others become lines along the joint's own axis, averaged over the other (their noise falls with the
// root of the nodes).
std::vector<ErrorTable> split_by_evidence(const Campaign& campaign, const ErrorTable& table,
                                          std::size_t own) {
  constexpr double kSigmas = 4.0;  // of the mean square's own scatter
  const std::size_t n = table.nodes[own].size(), m = table.nodes[1 - own].size(),
                    width = table.nodes[1].size();
  ErrorTable grid = table, line;
  grid.components.clear();
  line.arguments = {table.arguments[own]};
  line.nodes = {table.nodes[own]};
  for (std::size_t c = 0; c < 6; ++c) {
    const auto& component = table.components[c];
    const double s = c < 3 ? campaign.plan().s_displacement_mm : campaign.plan().s_rotation_rad;
    ErrorTable::Component along{component.name, {}};
    double squares = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const auto at = [&](std::size_t j) {
        return component.values[own == 0 ? i * width + j : j * width + i];
      };
      double mean = 0.0;
      for (std::size_t j = 0; j < m; ++j) mean += at(j) / static_cast<double>(m);
      for (std::size_t j = 0; j < m; ++j) squares += (at(j) - mean) * (at(j) - mean);
      along.values.push_back(mean);
    }
    const auto dof = static_cast<double>(n * (m - 1));
    const double ratio = squares / dof / (s * s / static_cast<double>(campaign.plan().runs));
    if (ratio > 1.0 + kSigmas * std::sqrt(2.0 / dof))
      grid.components.push_back(component);
    else
      line.components.push_back(std::move(along));
  }
  std::vector<ErrorTable> out;
  if (!grid.components.empty()) out.push_back(grid);
  if (!line.components.empty()) out.push_back(refined(line, 0.01));
  return out;
}

std::vector<TableCandidate> candidates_of(const Campaign& campaign, const Maps& maps,
                                          const std::array<Periodic, 3>& periodic) {
  std::vector<TableCandidate> out;
  const auto add = [&](std::string name, std::vector<ErrorTable> tables, Interpolation one, Interpolation two,
                       double smoothing) {
    TableCandidate candidate;
    candidate.name = std::move(name);
    candidate.tables = std::move(tables);
    candidate.one.method = one;
    candidate.two.method = two;
    candidate.two.smoothing = smoothing;
    out.push_back(std::move(candidate));
  };
  add("single", {middle_line(maps.table_x, 0), middle_line(maps.table_y, 1), maps.table_z},
      Interpolation::linear, Interpolation::bilinear, 0.0);
  const std::vector<ErrorTable> plain = {maps.table_x, maps.table_y, maps.table_z};
  add("bilinear", plain, Interpolation::linear, Interpolation::bilinear, 0.0);
  add("nurbs", plain, Interpolation::nurbs, Interpolation::nurbs, 0.0);
  add("spline", plain, Interpolation::spline, Interpolation::spline, 0.0);
  add("spline smoothed", plain, Interpolation::spline, Interpolation::spline, 0.01);
  Maps clean = maps;
  subtract(periodic[0], clean.table_x, 0);
  subtract(periodic[1], clean.table_y, 1);
  subtract(periodic[2], clean.table_z, 2);
  std::vector<ErrorTable> with = {clean.table_x, clean.table_y, refined(clean.table_z)};
  for (std::size_t k = 0; k < 3; ++k)
    if (periodic[k].pitch_mm > 0.0) with.push_back(periodic_table(campaign, periodic[k], k));
  add("nurbs + periodic", with, Interpolation::linear, Interpolation::nurbs, 0.0);
  add("spline + periodic", with, Interpolation::linear, Interpolation::spline, 0.0);
  add("spline smoothed + periodic", with, Interpolation::linear, Interpolation::spline, 0.01);
  std::vector<ErrorTable> selected = split_by_evidence(campaign, clean.table_x, 0);
  for (ErrorTable& table : split_by_evidence(campaign, clean.table_y, 1))
    selected.push_back(std::move(table));
  selected.insert(selected.end(), with.begin() + 2, with.end());
  add("nurbs selected + periodic", selected, Interpolation::linear, Interpolation::nurbs, 0.0);
  add("spline selected + periodic", selected, Interpolation::linear, Interpolation::spline, 0.01);
  add("smooth selected + periodic", selected, Interpolation::linear, Interpolation::spline, 0.03);
  return out;
}

struct Diagonal {
  std::string name;
  std::vector<JointVector> poses;
  Vec3 n = Vec3::Zero();
  std::vector<double> before;  // measured, mean of the runs
};

std::vector<Diagonal> diagonals(Campaign& campaign) {
  std::vector<Diagonal> out;
  const auto add = [&](std::string name, double sy, double sz) {
    Diagonal line;
    line.name = std::move(name);
    line.n = Vec3(campaign.travel(0), sy * campaign.travel(1), sz * campaign.travel(2)).normalized();
    for (std::size_t i = 0; i < campaign.plan().line_points; ++i) {
      // Unequal steps (ISO 230-2), which keep off the nodes too.
      const double t = (static_cast<double>(i) + 0.1 + 0.8 * campaign.uniform()) /
                           static_cast<double>(campaign.plan().line_points) -
                       0.5;
      line.poses.push_back(campaign.pose(campaign.middle(0) + t * campaign.travel(0),
                                         campaign.middle(1) + sy * t * campaign.travel(1),
                                         campaign.middle(2) + sz * t * campaign.travel(2)));
    }
    for (const JointVector& q : line.poses)
      line.before.push_back(line.n.dot(campaign.miss(q, q)) +
                            campaign.noise(campaign.plan().s_displacement_mm));
    out.push_back(std::move(line));
  };
  add("T1 face +X+Y", 1, 0);
  add("T2 face +X-Y", -1, 0);
  for (const double sy : {1.0, -1.0})
    for (const double sz : {1.0, -1.0})
      add(std::string("body +X") + (sy > 0 ? "+Y" : "-Y") + (sz > 0 ? "+Z" : "-Z"), sy, sz);
  return out;
}

struct Checks {
  std::vector<Diagonal> lines;
  std::vector<JointVector> random;
  std::vector<CheckReading> held_out;
};

Checks make_checks(Campaign& campaign) {
  Checks checks;
  checks.lines = diagonals(campaign);
  const auto anywhere = [&] {
    JointVector q;
    for (std::size_t k = 0; k < 3; ++k)
      q[campaign.id(k)] = campaign.axis(k).min + campaign.uniform() * campaign.travel(k);
    return q;
  };
  for (std::size_t i = 0; i < campaign.plan().random_points; ++i) checks.random.push_back(anywhere());
  for (std::size_t i = 0; i < campaign.plan().held_out_points; ++i) {
    const JointVector q = anywhere();
    const Vec3 d = campaign.miss(q, q);
    for (Eigen::Index k = 0; k < 3; ++k)
      checks.held_out.push_back(
          {q, campaign.tool(), Vec3::Unit(k), d[k] + campaign.noise(campaign.plan().s_displacement_mm)});
  }
  return checks;
}

Result<StudiedModel> study_model(Campaign& campaign, const TableCandidate& candidate, std::size_t nodes,
                                 const Checks& checks) {
  StudiedModel out;
  out.name = candidate.name;
  out.nodes = nodes;
  const auto score = held_out(campaign.machine(), candidate, checks.held_out, false);
  if (!score) return tl::unexpected(score.error());
  out.held_out_rms = score->rms_after;
  out.held_out_before = score->rms_before;
  const auto model = TableErrors::create(campaign.machine(), candidate.tables, candidate.one, candidate.two);
  if (!model) return tl::unexpected(model.error());
  const auto corrected = [&](const JointVector& q) {
    return corrected_position(campaign.machine(), q, campaign.tool(), model->at(q));
  };
  for (const Diagonal& line : checks.lines) {
    std::vector<double> predicted, measured;
    for (std::size_t i = 0; i < line.poses.size(); ++i) {
      const JointVector& q = line.poses[i];
      const DeviationMap deviation(campaign.machine(), q, campaign.tool());
      predicted.push_back(line.before[i] - line.n.dot(deviation.exact_M(model->at(q)).displacement_mm));
      measured.push_back(line.n.dot(campaign.miss(q, corrected(q))) +
                         campaign.noise(campaign.plan().s_displacement_mm));
    }
    out.diagonals.push_back(
        {line.name, peak_to_valley(line.before), peak_to_valley(predicted), peak_to_valley(measured)});
  }
  double before = 0.0, after = 0.0, with_noise = 0.0;
  std::vector<JointVector> moved(checks.random.size());
  const auto count = static_cast<double>(checks.random.size());
  // The least of many short stretches: what the work takes when nothing else runs.
  constexpr std::size_t kStretch = 50;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < checks.random.size(); i += kStretch) {
    const std::size_t end = std::min(i + kStretch, checks.random.size());
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t k = i; k < end; ++k) moved[k] = corrected(checks.random[k]);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    least = std::min(least, took.count() / static_cast<double>(end - i));
  }
  out.evaluation_s = least;
  for (std::size_t i = 0; i < checks.random.size(); ++i) {
    const JointVector& q = checks.random[i];
    before += campaign.miss(q, q).squaredNorm();
    const Vec3 left = campaign.miss(q, moved[i]);
    after += left.squaredNorm();
    const double s = campaign.plan().s_displacement_mm;
    const double nx = campaign.noise(s), ny = campaign.noise(s), nz = campaign.noise(s);
    with_noise += (left + Vec3(nx, ny, nz)).squaredNorm();
  }
  out.random_before = std::sqrt(before / count);
  out.random_after = std::sqrt(after / count);
  out.random_after_measured = std::sqrt(with_noise / count);
  return out;
}

}  // namespace

Result<CrossTalkStudy> study_cross_talk(const Machine& machine, const Model& truth,
                                        const CrossTalkPlan& plan) {
  for (const char* name : {"X", "Y", "Z"}) {
    const auto id = machine.axis(name);
    if (!id || machine.axes[*id].kind != AxisKind::linear || !machine.axes[*id].has_limits())
      return fail(ErrorCode::wrong_input,
                  std::string("the study wants a linear axis ") + name + " with limits", machine.file);
  }
  Campaign campaign(machine, truth, plan);
  CrossTalkStudy out;
  out.floor = std::sqrt(3.0 / static_cast<double>(plan.runs)) * plan.s_displacement_mm;
  const Checks checks = make_checks(campaign);
  std::array<Periodic, 3> periodic;
  for (std::size_t k = 0; k < 3; ++k) periodic[k] = measure_periodic(campaign, k);
  std::vector<std::size_t> sizes = {plan.main_nodes};
  for (const std::size_t n : plan.nodes)
    if (n != plan.main_nodes) sizes.push_back(n);
  for (const std::size_t n : sizes) {
    const Maps maps = measure(campaign, n);
    if (n == plan.main_nodes) {
      out.position_x = peak_to_valley(middle_line(maps.table_x, 0).components[0].values);
      out.position_y = peak_to_valley(middle_line(maps.table_y, 1).components[1].values);
    }
    for (const TableCandidate& candidate : candidates_of(campaign, maps, periodic)) {
      auto model = study_model(campaign, candidate, n, checks);
      if (!model) return tl::unexpected(model.error());
      if (!(model->random_before > 0.0))
        return fail(
            ErrorCode::wrong_input,
            "the true errors (--truth) are nothing at these points: there is nothing to compensate for",
            truth.file);
      if (!out.models.empty() && model->held_out_rms < out.models[out.best].held_out_rms)
        out.best = out.models.size();
      out.models.push_back(std::move(*model));
    }
  }
  return out;
}

}  // namespace trunnion::diagnosis
