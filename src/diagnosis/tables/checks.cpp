#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/table_models.hpp"

#include "diagnosis/fit/statistics.hpp"

namespace trunnion::diagnosis {
namespace {

std::vector<double> values_of(const std::vector<CheckReading>& readings) {
  std::vector<double> out;
  out.reserve(readings.size());
  for (const CheckReading& reading : readings) out.push_back(reading.value_mm);
  return out;
}

// Takes out the mean of each direction n.
void remove_offsets(const std::vector<CheckReading>& readings, std::vector<double>& values) {
  std::map<std::array<long long, 3>, std::pair<double, int>> sums;
  const auto key = [](const Vec3& n) {
    return std::array<long long, 3>{std::llround(n.x() * 1e6), std::llround(n.y() * 1e6),
                                    std::llround(n.z() * 1e6)};
  };
  for (std::size_t i = 0; i < values.size(); ++i) {
    auto& [sum, count] = sums[key(readings[i].n_M)];
    sum += values[i];
    ++count;
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto& [sum, count] = sums[key(readings[i].n_M)];
    values[i] -= sum / count;
  }
}

void statistics(const std::vector<double>& values, double& rms, double& most) {
  double squares = 0.0;
  for (const double v : values) {
    squares += v * v;
    most = std::max(most, std::abs(v));
  }
  rms = std::sqrt(squares / static_cast<double>(values.size()));
}

std::string um(double mm) {
  return fixed_text(mm / kMmPerUm, 2);
}

}  // namespace

Result<std::vector<double>> residuals(const Machine& machine, const TableCandidate& candidate,
                                      const std::vector<CheckReading>& readings) {
  const auto errors = TableErrors::create(machine, candidate.tables, candidate.one, candidate.two);
  if (!errors) return tl::unexpected(errors.error());
  std::vector<double> out;
  for (const CheckReading& reading : readings) {
    const DeviationMap deviation(machine, reading.q, reading.tool_mm);
    out.push_back(reading.value_mm -
                  reading.n_M.dot(deviation.exact_M(errors->at(reading.q)).displacement_mm));
  }
  return out;
}

Result<TableScore> held_out(const Machine& machine, const TableCandidate& candidate,
                            const std::vector<CheckReading>& readings, bool free_offset) {
  if (readings.empty()) return fail(ErrorCode::wrong_input, "no held-out readings");
  auto after = residuals(machine, candidate, readings);
  if (!after) return tl::unexpected(after.error());
  std::vector<double> before = values_of(readings);
  if (free_offset) {
    remove_offsets(readings, before);
    remove_offsets(readings, *after);
  }
  TableScore out;
  statistics(before, out.rms_before, out.max_before);
  statistics(*after, out.rms_after, out.max_after);
  return out;
}

namespace {

// Every other node (and the last) of a list.
std::vector<std::size_t> every_other(std::size_t count) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < count; i += 2) out.push_back(i);
  if (out.back() != count - 1) out.push_back(count - 1);
  return out;
}

// Splits a map in a coarser one and the readings between.
std::pair<PlanarMap, std::vector<CheckReading>> split(const Machine& machine, const PlanarMap& map) {
  const auto keep_u = every_other(map.u_nodes.size()), keep_v = every_other(map.v_nodes.size());
  const auto kept = [](const std::vector<std::size_t>& list, std::size_t i) {
    return std::find(list.begin(), list.end(), i) != list.end();
  };
  PlanarMap coarse = map;
  coarse.u_nodes.clear();
  coarse.v_nodes.clear();
  for (auto& values : coarse.displacement_M) values.clear();
  for (const std::size_t i : keep_u) coarse.u_nodes.push_back(map.u_nodes[i]);
  for (const std::size_t j : keep_v) coarse.v_nodes.push_back(map.v_nodes[j]);
  std::vector<CheckReading> between;
  for (std::size_t i = 0; i < map.u_nodes.size(); ++i)
    for (std::size_t j = 0; j < map.v_nodes.size(); ++j)
      for (int k = 0; k < 3; ++k) {
        if (map.displacement_M[static_cast<std::size_t>(k)].empty()) continue;
        if (kept(keep_u, i) && kept(keep_v, j)) {
          coarse.displacement_M[static_cast<std::size_t>(k)].push_back(map.at(k, i, j));
          continue;
        }
        JointVector q = map.rest;
        q[*machine.axis(map.u)] = map.u_nodes[i];
        q[*machine.axis(map.v)] = map.v_nodes[j];
        between.push_back({q, map.tool_mm, Vec3::Unit(k), map.at(k, i, j)});
      }
  return {std::move(coarse), std::move(between)};
}

}  // namespace

Result<TableChoice> choose_table(const Machine& machine, const PlanarMap& map,
                                 const std::vector<CheckReading>& others) {
  auto full = table_candidates(machine, map);
  if (!full) return tl::unexpected(full.error());
  TableChoice out;
  std::vector<TableCandidate> tried = *full;
  std::vector<CheckReading> readings = others;
  out.held_out_by = "readings of their own";
  if (others.empty()) {
    if (map.u_nodes.size() < 4 || map.v_nodes.size() < 4)
      return fail(ErrorCode::wrong_input, "a map of " + std::to_string(map.u_nodes.size()) + " x " +
                                              std::to_string(map.v_nodes.size()) +
                                              " nodes leaves none to hold out; give readings of their own");
    auto [coarse, between] = split(machine, map);
    auto half = table_candidates(machine, coarse);
    if (!half) return tl::unexpected(half.error());
    tried = std::move(*half);
    readings = std::move(between);
    out.held_out_by = "the nodes between every other node";
  }
  for (std::size_t c = 0; c < tried.size(); ++c) {
    const auto score = held_out(machine, tried[c], readings, true);
    if (!score) return tl::unexpected(score.error());
    if (c > 0 && score->rms_after < out.rows[out.best].score.rms_after) out.best = c;
    out.rows.push_back({std::move((*full)[c]), *score});
  }
  return out;
}

Result<Gate> gate(const Machine& machine, const TableCandidate& candidate,
                  const std::vector<NamedLine>& lines) {
  Gate out;
  for (const NamedLine& line : lines) {
    if (line.readings.size() < 3) continue;
    const auto after = residuals(machine, candidate, line.readings);
    if (!after) return tl::unexpected(after.error());
    out.lines.push_back({line.name, peak_to_valley(values_of(line.readings)), peak_to_valley(*after)});
  }
  if (out.lines.empty())
    return fail(ErrorCode::wrong_input, "no independent line with three readings or more");
  return out;
}

bool Gate::passed() const {
  return std::all_of(lines.begin(), lines.end(),
                     [](const LineCheck& line) { return line.after <= line.before; });
}

std::string Gate::text() const {
  std::string out;
  for (const LineCheck& line : lines)
    out += line.name + ": peak to valley " + um(line.before) + " um -> " + um(line.after) + " um" +
           (line.after > line.before ? "  WORSE" : "") + "\n";
  return out;
}

std::vector<NamedLine> named_lines(const Dataset& data) {
  std::map<std::pair<std::size_t, std::string>, NamedLine> lines;
  for (const Reading& reading : data.readings) {
    if (reading.quantity != Quantity::displacement || reading.frame != SensitivityFrame::machine) continue;
    const std::size_t run = data.run_of(reading);
    std::string n;
    for (int k = 0; k < 3; ++k) n += (k == 0 ? "" : " ") + fixed_text(reading.n[k], 3);
    NamedLine& line = lines[{run, n}];
    line.name = (run < data.context.runs.size() ? data.context.runs[run].id : std::string("run")) +
                ", n = (" + n + ")";
    line.readings.push_back(
        {data.track.state(reading.row).q, data.rows[reading.row].tool_mm, reading.n, reading.value});
  }
  std::vector<NamedLine> out;
  out.reserve(lines.size());
  for (auto& [key, line] : lines) out.push_back(std::move(line));
  return out;
}

std::optional<ReferenceLine> reference_line_of(std::string_view text) {
  if (text == "least-squares") return ReferenceLine::least_squares;
  if (text == "end-points") return ReferenceLine::end_points;
  if (text == "minimum-zone") return ReferenceLine::minimum_zone;
  return std::nullopt;
}

namespace {

struct FittedLine {
  double slope = 0.0, offset = 0.0;  // offset at argument 0
};

FittedLine through(const std::vector<double>& x, const std::vector<double>& y, std::size_t a, std::size_t b) {
  const double slope = (y[b] - y[a]) / (x[b] - x[a]);
  return {slope, y[a] - slope * x[a]};
}

FittedLine fit_line(const std::vector<double>& x, const std::vector<double>& y, ReferenceLine method) {
  if (method == ReferenceLine::end_points) return through(x, y, 0, x.size() - 1);
  if (method == ReferenceLine::least_squares) {
    double mx = 0.0, my = 0.0, sxy = 0.0, sxx = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      mx += x[i] / static_cast<double>(x.size());
      my += y[i] / static_cast<double>(x.size());
    }
    for (std::size_t i = 0; i < x.size(); ++i) {
      sxy += (x[i] - mx) * (y[i] - my);
      sxx += (x[i] - mx) * (x[i] - mx);
    }
    return {sxy / sxx, my - sxy / sxx * mx};
  }
  // Minimum zone: one side of the zone passes through two of the points, the other through one between them.
  FittedLine best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a + 1 < x.size(); ++a)
    for (std::size_t b = a + 1; b < x.size(); ++b) {
      FittedLine line = through(x, y, a, b);
      double low = 0.0, high = 0.0;
      for (std::size_t i = 0; i < x.size(); ++i) {
        const double r = y[i] - line.slope * x[i] - line.offset;
        low = std::min(low, r);
        high = std::max(high, r);
      }
      if (high - low < least) {
        least = high - low;
        line.offset += 0.5 * (high + low);
        best = line;
      }
    }
  return best;
}

}  // namespace

Result<ErrorTable> without_line(ErrorTable table, ReferenceLine method) {
  if (table.arguments.size() != 1)
    return fail(ErrorCode::wrong_input, "a line is removed from tables over one axis only", table.file);
  const char* name = method == ReferenceLine::least_squares ? "least-squares"
                     : method == ReferenceLine::end_points  ? "end-point"
                                                            : "minimum-zone";
  for (auto& component : table.components) {
    const FittedLine line = fit_line(table.nodes[0], component.values, method);
    for (std::size_t i = 0; i < component.values.size(); ++i)
      component.values[i] -= line.slope * table.nodes[0][i] + line.offset;
    const bool rotation = component.name[1] >= 'A' && component.name[1] <= 'C';
    const auto digits = [](double value) { return fixed_text(value, 6); };  // far below any measurement
    table.comments.push_back(" " + std::string(name) + " line removed from " + component.name + ": slope " +
                             digits(rotation ? line.slope / kRadPerUrad : line.slope / kMmPerUm * 1e3) +
                             (rotation ? " urad/mm" : " um/m") + ", offset at 0 " +
                             digits(line.offset / (rotation ? kRadPerUrad : kMmPerUm)) +
                             (rotation ? " urad" : " um"));
  }
  return table;
}

Result<ErrorTable> abbe_transferred(const Machine& machine, ErrorTable table, const Vec3& lever_mm) {
  // Per joint: where its components stand in the table.
  std::map<AxisId, std::array<std::optional<std::size_t>, 6>> joints;
  for (std::size_t c = 0; c < table.components.size(); ++c) {
    const auto place = place_of_component(machine, table.components[c].name);
    if (!place)
      return fail(ErrorCode::wrong_input,
                  "'" + table.components[c].name + "' is no component error of this machine", table.file);
    joints[place->joint][static_cast<std::size_t>(place->direction) + (place->rotation ? 3U : 0U)] = c;
  }
  for (const auto& [joint, components] : joints)
    for (std::size_t i = 0; i < table.components[0].values.size(); ++i) {
      Vec3 r = Vec3::Zero();
      for (std::size_t k = 0; k < 3; ++k)
        if (components[3 + k])
          r[static_cast<Eigen::Index>(k)] = table.components[*components[3 + k]].values[i];
      const Vec3 abbe = r.cross(lever_mm);
      for (std::size_t k = 0; k < 3; ++k)
        if (components[k]) table.components[*components[k]].values[i] -= abbe[static_cast<Eigen::Index>(k)];
    }
  table.comments.push_back(" Abbe transfer from " + shortest_text(lever_mm.x()) + ", " +
                           shortest_text(lever_mm.y()) + ", " + shortest_text(lever_mm.z()) +
                           " mm off the carriage point to it");
  return table;
}

}  // namespace trunnion::diagnosis
