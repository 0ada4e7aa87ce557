// The program of a scene: block by block what the page colours, shows and plays.
#include <algorithm>
#include <cmath>
#include <map>

#include "trunnion/machine/kinematics.hpp"

#include "report/nc_figures.hpp"
#include "report/svg.hpp"

namespace trunnion::report {
namespace {

// Beyond this the blocks are thinned, extremes kept: a page of a million is as large as one of these.
constexpr std::size_t kMostBlocks = 200'000;
constexpr std::size_t kAboutWorst = 500;       // blocks on either side of a worst place, which all stay
constexpr std::size_t kMostText = 12'000'000;  // bytes of a file that a page holds beside its blocks
constexpr double kFineLength_mm = 1e-4;        // as words are rounded
constexpr double kFineAngle_deg = 1e-4;
constexpr double kFineDeviation_um = 1e-3;
constexpr double kFineTime_s = 1e-4;

// As far as the feed moves go from the axis of the table.
double reach(const Machine& machine, const post::VerifyReport& report) {
  double out = 10.0;
  const Pose X_MP = part_in_machine(machine, JointVector{});
  const auto rotary = machine.rotary_axes();
  const Vec3 up = rotary.empty() ? Vec3::UnitZ() : machine.axes[rotary.back()].direction;
  const Vec3 point = rotary.empty() ? X_MP.p : machine.axes[rotary.back()].point_mm;
  for (const auto& block : report.blocks) {
    if (block.rapid) continue;
    const Vec3 from = X_MP * block.tip_P - point;
    out = std::max(out, (from - from.dot(up) * up).norm());
  }
  return 1.25 * out;
}

// Under the lowest feed move: the table of a machine file without one.
void lower_table(const Machine& machine, const post::VerifyReport& report, Machine& out) {
  if (machine.safe.table) return;
  const auto rotary = machine.rotary_axes();
  if (rotary.empty()) return;
  const Axis& inner = machine.axes[rotary.back()];
  const Vec3 up = inner.direction.z() < 0.0 ? Vec3(-inner.direction) : inner.direction;
  const Pose X_MP = part_in_machine(machine, JointVector{});
  double low = std::numeric_limits<double>::infinity();
  for (const auto& block : report.blocks)
    if (!block.rapid) low = std::min(low, (X_MP * block.tip_P - inner.point_mm).dot(up));
  if (std::isfinite(low))
    out.safe.table = TableExtent{reach(machine, report), low - 0.12 * reach(machine, report)};
}

// The blocks of a page: all, or the extremes of every stretch and everything about the worst places.
std::vector<std::size_t> kept_blocks(const post::VerifyReport& report) {
  const auto& blocks = report.blocks;
  std::vector<double> deviation;
  deviation.reserve(blocks.size());
  for (const auto& block : blocks) deviation.push_back(block.tip_deviation_mm);
  std::vector<std::size_t> kept = thinned(deviation, kMostBlocks);
  if (kept.size() == blocks.size()) return kept;
  for (const auto& w : report.worst) {
    const std::size_t at = block_of(report, w);
    for (std::size_t i = at - std::min(at, kAboutWorst); i < std::min(at + kAboutWorst, blocks.size()); ++i)
      kept.push_back(i);
  }
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  return kept;
}

// The whole file, or, where it is longer than `most`, the line of each block.
Scene::Text text_on_page(std::string_view file, const std::vector<std::uint32_t>& line_of_block,
                         std::size_t most) {
  if (file.size() <= most) return {std::string(file), false};
  std::vector<std::size_t> begins = {0};
  for (std::size_t at = file.find('\n'); at != std::string_view::npos; at = file.find('\n', at + 1))
    begins.push_back(at + 1);
  begins.push_back(file.size() + 1);
  Scene::Text out{"", true};
  for (const std::uint32_t line : line_of_block) {
    if (line > 0 && line < begins.size()) {
      std::string_view text = file.substr(begins[line - 1], begins[line] - begins[line - 1] - 1);
      if (text.ends_with('\r')) text.remove_suffix(1);
      out.lines += text;
    }
    out.lines += '\n';
  }
  return out;
}

// Of a CL file only where that is short: its lines are a help, those of the program are what is asked for.
Scene::Text cl_on_page(std::string_view file, const std::vector<std::uint32_t>& line_of_block) {
  constexpr std::size_t kMostCl = kMostText / 4;
  Scene::Text out = text_on_page(file, line_of_block, kMostCl);
  return out.lines.size() <= kMostCl ? out : Scene::Text{};
}

/// Fills the columns of a scene of which only some blocks are kept.
class SceneBuilder {
 public:
  SceneBuilder(const ProgramSceneInput& input, Scene& scene)
      : input_(input), scene_(scene), kept_(kept_blocks(input.report)) {}

  void add_program() {
    const auto& blocks = input_.report.blocks;
    for (const auto& w : input_.report.worst) {
      const auto at = std::lower_bound(kept_.begin(), kept_.end(), block_of(input_.report, w));
      scene_.worst.push_back(static_cast<std::size_t>(at - kept_.begin()));
    }
    add("nc_line", "", 1.0, [&](std::size_t i) { return static_cast<double>(blocks[i].nc_line); });
    add("cl_line", "", 1.0, [&](std::size_t i) { return static_cast<double>(blocks[i].cl_line); });
    add("rapid", "", 1.0, [&](std::size_t i) { return blocks[i].rapid ? 1.0 : 0.0; });
    add("path_mm", "mm", 1e-3, [&](std::size_t i) { return blocks[i].path_mm; });
    add_seconds();
    const auto& axes = input_.machine.axes;
    for (AxisId id = 0; id < axes.size(); ++id) {
      const bool rotary = axes[id].kind == AxisKind::rotary;
      add(axes[id].name, rotary ? "°" : "mm", rotary ? kFineAngle_deg : kFineLength_mm,
          [&](std::size_t i) { return blocks[i].q[id] * (rotary ? kDegreePerRad : 1.0); });
    }
  }

  void add_texts() {
    std::vector<std::uint32_t> nc, cl;
    for (const std::size_t i : kept_) {
      nc.push_back(input_.report.blocks[i].nc_line);
      cl.push_back(input_.report.blocks[i].cl_line);
    }
    scene_.texts.nc = text_on_page(input_.nc_text, nc, kMostText);
    scene_.texts.cl = cl_on_page(input_.cl_text, cl);
  }

  void add_deviations() {
    const post::VerifyReport& r = input_.report;
    const bool flute = r.flute_mm > 0.0;
    const std::string on = r.on_truth ? " on the machine with its errors" : "";
    const auto tip_um = [&](std::size_t i) { return r.blocks[i].tip_deviation_mm * kUmPerMm; };
    const auto flute_um = [&](std::size_t i) { return r.blocks[i].flute_deviation_mm * kUmPerMm; };
    colour("tip_um", "tip deviation" + on, "µm", tip_um);
    if (flute) colour("flute_um", "deviation of tip and flute" + on, "µm", flute_um);
    colour("axis_deg", "tool axis deviation", "°", [&](std::size_t i) {
      return static_cast<double>(r.blocks[i].axis_deviation_rad) * kDegreePerRad;
    });
    if (r.tolerance_mm > 0.0) {
      constexpr double kWhole = 100.0;  // per cent: the scale never ends below the tolerance
      const double per_um = kWhole / (r.tolerance_mm * kUmPerMm);
      colour("share", "share of the tolerance", "%",
             [&](std::size_t i) { return per_um * (flute ? std::max(tip_um(i), flute_um(i)) : tip_um(i)); });
      scene_.colourings.back().largest = std::max(scene_.colourings.back().largest, kWhole);
    }
    if (input_.segments.empty()) return;
    std::vector<double> straight(r.blocks.size(), 0.0);
    std::vector<double> of_flute(r.blocks.size(), 0.0);
    for (const auto& segment : input_.segments) {
      for (std::size_t i = segment.from + 1; i <= segment.to; ++i) {
        straight[i] = segment.straight_um;
        of_flute[i] = segment.flute_um;
      }
    }
    colour("straight_um", "error without inserted points", "µm", [&](std::size_t i) { return straight[i]; });
    if (flute)
      colour("straight_flute_um", "error without inserted points, tip and flute", "µm",
             [&](std::size_t i) { return of_flute[i]; });
  }

  // What the machine's errors would do to the tool at each block if nothing were compensated.
  void add_machine_errors() {
    if (input_.errors == nullptr) return;
    const Machine& machine = input_.machine;
    const auto& blocks = input_.report.blocks;
    const double flute_mm = input_.report.flute_mm;
    std::vector<double> tip(blocks.size(), 0.0);
    std::vector<double> flute(blocks.size(), 0.0);
    for (const std::size_t i : kept_) {
      MachineState state;
      state.q = blocks[i].q;
      for (AxisId id = 0; i > 0 && id < machine.axes.size(); ++id) {
        const double way = blocks[i].q[id] - blocks[i - 1].q[id];
        state.direction[id] = static_cast<std::int8_t>((way > 0.0) - (way < 0.0));
      }
      const ChainErrors e = input_.errors->errors(state);
      const auto off_um = [&](const Vec3& tool_mm) {
        return (forward(machine, state.q, tool_mm, e).p - forward(machine, state.q, tool_mm).p).norm() *
               kUmPerMm;
      };
      tip[i] = off_um(machine.tool_vector());
      flute[i] = std::max(tip[i], off_um(machine.tool_vector() + flute_mm * Vec3::UnitZ()));
    }
    colour("machine_um", "machine error before compensation", "µm", [&](std::size_t i) { return tip[i]; });
    if (flute_mm > 0.0)
      colour("machine_flute_um", "machine error before compensation, tip and flute", "µm",
             [&](std::size_t i) { return flute[i]; });
  }

  // Of the kept feed blocks; rapids cut nothing.
  template <class Value>
  void colour(const char* column, std::string label, const char* unit, const Value& value) {
    constexpr double kFineAngleError_deg = 1e-6;
    const bool angle = std::string_view(unit) == "°";
    add(column, unit, angle ? kFineAngleError_deg : kFineDeviation_um,
        [&](std::size_t i) { return input_.report.blocks[i].rapid ? 0.0 : value(i); });
    const auto& values = scene_.columns.back().values;
    const double largest = values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
    scene_.colourings.push_back({column, std::move(label), unit, largest});
  }

 private:
  template <class Value>
  void add(std::string name, std::string unit, double step, const Value& value) {
    BlockColumn column{std::move(name), std::move(unit), step, {}};
    column.values.reserve(kept_.size());
    for (const std::size_t i : kept_) column.values.push_back(value(i));
    scene_.columns.push_back(std::move(column));
  }
  // Blocks that are left out give their time to the next one that stays.
  void add_seconds() {
    std::size_t next = 0;
    add("seconds", "s", kFineTime_s, [&](std::size_t i) {
      double sum = 0.0;
      for (; next <= i; ++next) sum += input_.report.blocks[next].seconds;
      return sum;
    });
  }

  const ProgramSceneInput& input_;
  Scene& scene_;
  std::vector<std::size_t> kept_;
};

// Feed blocks that end on the way to one CL point, one after the other.
struct Group {
  std::size_t first = 0, last = 0;  // indices of blocks
};

std::vector<Group> groups_of(const post::VerifyReport& report) {
  std::vector<Group> out;
  const auto& blocks = report.blocks;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (blocks[i].rapid) continue;
    const bool goes_on =
        !out.empty() && out.back().last + 1 == i && i > 0 && blocks[i - 1].cl_line == blocks[i].cl_line;
    if (goes_on)
      out.back().last = i;
    else
      out.push_back({i, i});
  }
  return out;
}

// How far along its group a block ends, 0 to 1.
double share_at(const post::VerifyReport& report, const Group& group, std::size_t block) {
  const auto& blocks = report.blocks;
  const double from = group.first > 0 ? blocks[group.first - 1].path_mm : 0.0;
  const double way = blocks[group.last].path_mm - from;
  if (way > 0.0) return (blocks[block].path_mm - from) / way;
  return static_cast<double>(block + 1 - group.first) / static_cast<double>(group.last + 1 - group.first);
}

}  // namespace

Scene program_scene(const ProgramSceneInput& input) {
  Machine drawn = input.machine;
  lower_table(input.machine, input.report, drawn);
  Scene out = machine_solids(drawn, reach(input.machine, input.report));
  SceneBuilder builder(input, out);
  builder.add_program();
  builder.add_texts();
  builder.add_deviations();
  builder.add_machine_errors();
  for (const auto& laid : input.beside)
    builder.colour(laid.column.c_str(), laid.label, "µm", [&](std::size_t i) { return laid.um[i]; });
  return out;
}

std::vector<double> laid_onto(const post::VerifyReport& carrier, const post::VerifyReport& other) {
  constexpr double kSamePlace = 1e-6;  // of a group
  std::vector<double> out(carrier.blocks.size(), 0.0);
  std::multimap<std::uint32_t, Group> of_line;  // those of a line in the order of the program
  for (const Group& group : groups_of(other)) of_line.emplace(other.blocks[group.last].cl_line, group);
  for (const Group& group : groups_of(carrier)) {
    const std::uint32_t line = carrier.blocks[group.last].cl_line;
    const auto found = of_line.lower_bound(line);
    if (found == of_line.end() || found->first != line) continue;
    const Group there = found->second;
    of_line.erase(found);
    std::size_t j = there.first;
    for (std::size_t i = group.first; i <= group.last; ++i) {
      const double end = share_at(carrier, group, i);
      for (;; ++j) {
        out[i] = std::max(out[i], static_cast<double>(other.blocks[j].tip_deviation_mm));
        if (j == there.last || share_at(other, there, j) >= end - kSamePlace) break;
      }
      // A block that ends here is none of the next one.
      if (j < there.last && share_at(other, there, j) <= end + kSamePlace) ++j;
    }
  }
  return out;
}

}  // namespace trunnion::report
