#include <cmath>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/config/section.hpp"
#include "trunnion/diagnosis/plan.hpp"
#include "trunnion/geom/direction.hpp"

namespace trunnion::diagnosis {
namespace {

using config::Section;
using config::Value;

constexpr double kDefaultMinutesPerPose = 0.25;
constexpr std::int64_t kMaxPoints = 100000;
constexpr double kMostPoses = 1e6;  // of one run: days of measuring

std::string axis_key(const Axis& axis) {
  return axis.name + (axis.kind == AxisKind::linear ? "_mm" : "_deg");
}

std::optional<double> plain(const Value& value) {
  if (const auto* v = std::get_if<double>(&value.data)) return *v;
  if (const auto* v = std::get_if<std::int64_t>(&value.data)) return static_cast<double>(*v);
  return std::nullopt;
}

// A list of lists of numbers, each with `width` of them.
std::vector<std::vector<double>> rows_of(Section& section, std::string_view key, std::size_t width) {
  std::vector<std::vector<double>> out;
  const Value* value = section.raw(key);
  const auto* rows = value ? value->as_array() : nullptr;
  if (rows == nullptr) return out;
  for (const Value& row : *rows) {
    std::vector<double> numbers;
    if (const auto* items = row.as_array())
      for (const Value& item : *items)
        if (const auto number = plain(item); number && std::isfinite(*number)) numbers.push_back(*number);
    if (numbers.size() != width || row.as_array()->size() != width) {
      section.diagnostics().error(
          section.file(), row.where,
          "'" + std::string(key) + "' wants " + std::to_string(width) + " numbers here");
      return {};
    }
    out.push_back(std::move(numbers));
  }
  return out;
}

class RunReader {
 public:
  RunReader(Section section, const Machine& machine) : s_(std::move(section)), machine_(machine) {}

  PlanRun read() {
    run_.id = s_.text("id");
    s_.takes("quantity", {"displacement", "rotation"});
    s_.takes("frame", {"machine", "part"});
    const std::string quantity = s_.find_text("quantity").value_or("displacement");
    if (quantity == "rotation")
      run_.quantity = Quantity::rotation;
    else if (quantity != "displacement")
      s_.error("quantity", "'quantity' must be 'displacement' or 'rotation'");
    const std::string frame = s_.find_text("frame").value_or("machine");
    if (frame == "part")
      run_.frame = SensitivityFrame::part;
    else if (frame != "machine")
      s_.error("frame", "'frame' must be 'machine' or 'part'");
    run_.tool_mm = {0.0, 0.0, s_.quantity_or("tool_z_mm", -machine_.tool_length_mm)};
    run_.feed_mm_s = s_.quantity_or("feed_mm_min", 0.0);
    read_uncertainty();
    run_.repeat = count("repeat", s_, 1);
    run_.both_directions = s_.flag_or("both_directions", false);
    read_path();
    read_directions();
    read_profiles();
    if (pose_count() > kMostPoses)
      s_.error("id", "a run has at most " + shortest_text(kMostPoses) + " poses; this one has " +
                         shortest_text(pose_count()));
    run_.minutes = s_.find_number("minutes").value_or(kDefaultMinutesPerPose * pose_count());
    if (!(run_.minutes > 0.0)) s_.error("minutes", "'minutes' must be greater than 0");
    s_.finish();
    return run_;
  }

 private:
  double unit() const { return run_.quantity == Quantity::displacement ? kMmPerUm : kRadPerUrad; }
  std::size_t count(std::string_view key, Section& section, std::int64_t fallback) {
    const auto value = section.find_integer(key).value_or(fallback);
    if (value >= 1 && value <= kMaxPoints) return static_cast<std::size_t>(value);
    section.error(key, "'" + std::string(key) + "' must be from 1 to " + std::to_string(kMaxPoints));
    return 1;
  }

  void read_uncertainty() {
    const auto u = s_.find_number("u_random");
    if (!u || !(*u > 0.0))
      s_.error("u_random", "'u_random' (um or urad, as the quantity) must be given and be greater than 0");
    run_.u_random = u.value_or(1.0) * unit();
    run_.u_common = s_.find_number("u_common").value_or(0.0) * unit();
    if (run_.u_common < 0.0) s_.error("u_common", "'u_common' must not be negative");
    run_.u_common_known = s_.flag_or("u_common_known", true);
  }

  JointVector position(Section* section) {
    JointVector q;
    if (section == nullptr) return q;
    for (AxisId a = 0; a < machine_.axes.size(); ++a)
      q[a] = section->quantity_or(axis_key(machine_.axes[a]), 0.0);
    return q;
  }
  JointVector position_at(std::string_view key) {
    auto section = s_.find_section(key);
    const JointVector q = position(section ? &*section : nullptr);
    if (section) section->finish();
    return q;
  }
  AxisId axis(Section& section, std::string_view key, const std::string& name) {
    const auto id = machine_.axis(name);
    if (!id) section.error(key, "machine '" + machine_.name + "' has no axis '" + name + "'");
    return id.value_or(0);
  }

  void read_path() {
    int paths = 0;
    const JointVector base = position_at("at");
    if (s_.has("poses")) ++paths, read_poses();
    if (auto section = s_.find_section("sweep")) ++paths, read_sweep(*section, base);
    if (auto section = s_.find_section("line")) ++paths, read_line(*section);
    if (auto section = s_.find_section("circle")) ++paths, read_circle(*section, base);
    if (auto section = s_.find_section("grid")) ++paths, read_grid(*section, base);
    if (paths != 1) s_.error("poses", "a run has exactly one of 'poses', 'sweep', 'line', 'circle', 'grid'");
  }
  void read_poses() {
    PlanPoses path;
    for (const auto& row : rows_of(s_, "poses", machine_.axes.size())) {
      JointVector q;
      for (AxisId a = 0; a < row.size(); ++a)
        q[a] = row[a] * (machine_.axes[a].kind == AxisKind::linear ? 1.0 : kRadPerDegree);
      path.poses.push_back(q);
    }
    if (path.poses.empty())
      s_.error("poses", "'poses' is empty: give one list [X, Y, Z, ...] a pose, mm and deg");
    run_.path = std::move(path);
  }
  void read_sweep(Section& section, const JointVector& base) {
    PlanSweep path;
    path.axis = axis(section, "axis", section.text("axis"));
    const std::string unit = machine_.axes[path.axis].kind == AxisKind::linear ? "_mm" : "_deg";
    path.from = section.quantity("from" + unit);
    path.to = section.quantity("to" + unit);
    path.points = count("points", section, 0);
    path.base = base;
    section.finish();
    run_.path = path;
  }
  void read_line(Section& section) {
    PlanLine path;
    for (const auto& [key, q] : {std::pair{"from", &path.from}, std::pair{"to", &path.to}}) {
      auto end = section.find_section(key);
      if (!end) section.error(key, std::string("'line' wants '") + key + "', a table of axis positions");
      *q = position(end ? &*end : nullptr);
      if (end) end->finish();
    }
    path.points = count("points", section, 0);
    section.finish();
    run_.path = path;
  }
  void read_circle(Section& section, const JointVector& base) {
    PlanCircle path;
    const auto axes = section.texts("axes");
    if (axes.size() != 2)
      section.error("axes", "'axes' of a circle must name two linear axes");
    else
      path.first = axis(section, "axes", axes[0]), path.second = axis(section, "axes", axes[1]);
    path.radius_mm = section.quantity("radius_mm");
    path.points = count("points", section, 0);
    path.base = base;
    section.finish();
    run_.path = path;
  }
  void read_grid(Section& section, const JointVector& base) {
    PlanGrid path;
    path.base = base;
    for (AxisId a = 0; a < machine_.axes.size(); ++a)
      if (auto values = section.find_numbers(axis_key(machine_.axes[a])))
        path.values.emplace_back(a, std::move(*values));
    if (path.values.empty()) section.error("grid", "'grid' names no axis of the machine");
    section.finish();
    path.ball_P = s_.find_vector("ball_mm");
    run_.path = std::move(path);
  }

  void read_directions() {
    if (const Value* value = s_.raw("n"); value != nullptr && value->as_string() != nullptr) {
      run_.radial = *value->as_string() == "radial" && std::holds_alternative<PlanCircle>(run_.path);
      if (!run_.radial) s_.error("n", "'n' is one direction or a list of them; 'radial' for a circle only");
      return;
    }
    const Value* value = s_.raw("n");
    const auto* items = value ? value->as_array() : nullptr;
    const bool several = items != nullptr && !items->empty() && items->front().as_array() != nullptr;
    std::vector<Vec3> given;
    if (several)
      for (const auto& row : rows_of(s_, "n", 3)) given.emplace_back(row[0], row[1], row[2]);
    else
      given.push_back(s_.vector("n"));
    for (const Vec3& n : given) {
      const auto direction = Direction::normalised(n);
      if (!direction)
        s_.error("n", "a direction 'n' must not be zero");
      else
        run_.n.push_back(direction->vec());
    }
  }

  PlanProfile profile(std::string_view key, double offset) {
    PlanProfile out;
    for (const auto& row : rows_of(s_, key, 2)) out.emplace_back(row[0] * kSecondsPerMinute, row[1] - offset);
    if (out.empty()) s_.error(key, "'" + std::string(key) + "' wants a list of [minute, value]");
    return out;
  }
  void read_profiles() {
    if (const Value* value = s_.raw("spindle_rpm")) {
      if (const auto rpm = plain(*value))
        run_.spindle_rpm = {{0.0, *rpm}};
      else
        run_.spindle_rpm = profile("spindle_rpm", 0.0);
    }
    const auto keys =
        Section(s_).keys("^(T_.+_degC|s_.+)$");  // a copy: only those taken below count as asked for
    for (const std::string& key : keys) {
      if (key.starts_with("T_") && key.ends_with("_degC"))
        run_.temperatures_K[key.substr(2, key.size() - 7)] = profile(key, machine_.reference_degC);
      else if (key.starts_with("s_"))
        run_.states[key.substr(2)] = profile(key, 0.0);
    }
  }

  double pose_count() const {
    const double passes = static_cast<double>(run_.repeat) * (run_.both_directions ? 2.0 : 1.0);
    const auto once = [](const auto& path) -> double {
      using T = std::decay_t<decltype(path)>;
      if constexpr (std::is_same_v<T, PlanPoses>)
        return static_cast<double>(path.poses.size());
      else if constexpr (std::is_same_v<T, PlanGrid>) {
        double count = 1.0;
        for (const auto& [axis, values] : path.values) count *= static_cast<double>(values.size());
        return count;
      } else
        return static_cast<double>(path.points);
    };
    return passes * std::visit(once, run_.path);
  }

  Section s_;
  const Machine& machine_;
  PlanRun run_;
};

SimulationNoise read_noise(Section& s) {
  SimulationNoise noise;
  noise.setup_mm = s.quantity_or("setup_um", noise.setup_mm);
  noise.resolution_mm = s.quantity_or("resolution_um", 0.0);
  noise.resolution_rad = s.quantity_or("resolution_urad", 0.0);
  noise.noise_factor = s.find_number("noise_factor").value_or(1.0);
  noise.outlier_fraction = s.find_number("outlier_fraction").value_or(0.0);
  noise.outlier_scale = s.find_number("outlier_scale").value_or(noise.outlier_scale);
  noise.autocorrelation = s.find_number("autocorrelation").value_or(0.0);
  noise.drift_mm_per_s =
      s.find_number("drift_um_per_h").value_or(0.0) * kMmPerUm / (kSecondsPerMinute * kSecondsPerMinute);
  if (!(std::abs(noise.autocorrelation) < 1.0))
    s.error("autocorrelation", "'autocorrelation' must be between -1 and 1");
  if (noise.outlier_fraction < 0.0 || noise.outlier_fraction > 1.0)
    s.error("outlier_fraction", "'outlier_fraction' must be from 0 to 1");
  if (noise.setup_mm < 0.0 || noise.noise_factor < 0.0 || noise.resolution_mm < 0.0 ||
      noise.resolution_rad < 0.0)
    s.error("setup_um", "set-up, noise factor and resolutions must not be negative");
  s.finish();
  return noise;
}

}  // namespace

Result<Plan> parse_plan(std::string_view toml, const std::string& file, const Machine& machine,
                        Diagnostics& diagnostics) {
  const std::size_t errors_before = diagnostics.error_count();
  const auto root = config::parse_toml(toml, file);
  if (!root) {
    diagnostics.error(root.error().file, root.error().where, root.error().message);
    return tl::unexpected(root.error());
  }
  Plan plan;
  Section top(*root, "plan", file, diagnostics);
  top.find_text("name");
  std::set<std::string> ids;
  for (Section& section : top.sections("run")) {
    const SourceRef where = section.where();
    plan.runs.push_back(RunReader(section, machine).read());
    if (!ids.insert(plan.runs.back().id).second)
      diagnostics.error(file, where, "two runs have the id '" + plan.runs.back().id + "'");
  }
  if (auto section = top.find_section("simulation")) plan.noise = read_noise(*section);
  if (plan.runs.empty()) diagnostics.error(file, {1, 1}, "the plan has no [[run]]");
  top.finish();
  if (diagnostics.error_count() > errors_before) return tl::unexpected(diagnostics.first_error());
  return plan;
}

Result<Plan> load_plan(const std::string& path, const Machine& machine, Diagnostics& diagnostics) {
  const auto text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  return parse_plan(*text, path, machine, diagnostics);
}

}  // namespace trunnion::diagnosis
