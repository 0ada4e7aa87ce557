#include <algorithm>
#include <cmath>

#include "trunnion/diagnosis/bookkeeping.hpp"
#include "trunnion/effects/deviation.hpp"

#include "diagnosis/fit/observations.hpp"
#include "diagnosis/verdict/bookkeeping.hpp"

namespace trunnion::diagnosis {
namespace {

// A dataset taken apart, so that states can be changed.
struct Parts {
  std::vector<MachineState> states;
  std::vector<std::vector<double>> temperatures, free_states;
  std::vector<RowOrigin> rows;
  std::vector<Reading> readings;

  explicit Parts(const Dataset& data) : rows(data.rows), readings(data.readings) {
    states.reserve(data.track.size());
    for (std::size_t i = 0; i < data.track.size(); ++i) {
      states.push_back(data.track.state(i));
      temperatures.emplace_back(states[i].temperature_K.begin(), states[i].temperature_K.end());
      free_states.emplace_back(states[i].state.begin(), states[i].state.end());
    }
  }
  Dataset joined(const Dataset& data) {
    for (std::size_t i = 0; i < states.size(); ++i) {
      states[i].temperature_K = temperatures[i];
      states[i].state = free_states[i];
    }
    Dataset out = make_dataset(data.context, states, std::move(rows), std::move(readings));
    out.files = data.files;
    return out;
  }
};

bool of_its_run(const Parts& parts, std::size_t row, const Convention& c) {
  return (!c.run || parts.states[row].run == *c.run) && (!c.file || parts.rows[row].file == *c.file);
}

void turn_axis(MachineState& s, AxisId a) {
  s.q[a] = -s.q[a];
  s.velocity[a] = -s.velocity[a];
  s.direction[a] = static_cast<std::int8_t>(-s.direction[a]);
}

void swap_axes(MachineState& s, AxisId a, AxisId b, bool positions_only) {
  std::swap(s.q[a], s.q[b]);
  if (positions_only) return;
  std::swap(s.velocity[a], s.velocity[b]);
  std::swap(s.direction[a], s.direction[b]);
}

// The direction of sensitivity in M.
Vec3 n_in_machine(const DeviationMap& map, const Reading& r) {
  return r.frame == SensitivityFrame::part ? Vec3(map.R_MP() * r.n) : r.n;
}

void move_tool(Parts& parts, const Machine& machine, const Convention& c) {
  if (c.in_readings)
    for (Reading& r : parts.readings) {
      if (r.quantity != Quantity::displacement || !of_its_run(parts, r.row, c)) continue;
      const DeviationMap map(machine, parts.states[r.row].q, parts.rows[r.row].tool_mm);
      r.value -= n_in_machine(map, r).dot(c.by_mm);
    }
  for (std::size_t i = 0; i < parts.rows.size(); ++i)
    if (of_its_run(parts, i, c)) parts.rows[i].tool_mm += c.by_mm;
}

void move_positions(Parts& parts, const Convention& c) {
  for (std::size_t i = 0; i < parts.states.size(); ++i)
    for (std::size_t k = 0; of_its_run(parts, i, c) && k < c.axes.size(); ++k)
      parts.states[i].q[c.axes[k]] += c.by_position[k];
}

void move_part(Parts& parts, const Machine& machine, const Dataset& data, const Convention& c) {
  for (Reading& r : parts.readings) {
    if (r.quantity != Quantity::displacement || !concerns(data, r, c)) continue;
    const DeviationMap map(machine, parts.states[r.row].q, parts.rows[r.row].tool_mm);
    r.value -= n_in_machine(map, r).dot(map.setup_translation_M(c.by_mm).displacement_mm);
  }
}

// The sense of the last step of the positions, in the order of time. A place that was read again before the
// axis went back was approached from beyond it.
void take_senses_from_positions(Parts& parts, const Convention& c) {
  const AxisId axis = c.axes.front();
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < parts.states.size(); ++i)
    if (of_its_run(parts, i, c)) rows.push_back(i);
  std::stable_sort(rows.begin(), rows.end(), [&](std::size_t a, std::size_t b) {
    return parts.states[a].time_s < parts.states[b].time_s;
  });
  const auto at = [&](std::size_t k) -> MachineState& { return parts.states[rows[k]]; };
  const auto sense = [](double by) { return static_cast<std::int8_t>((by > 0.0) - (by < 0.0)); };
  for (std::size_t k = 1; k < rows.size(); ++k) {
    std::size_t next = k;
    while (next < rows.size() && at(next).q[axis] == at(k - 1).q[axis]) ++next;
    const bool again = next > k && at(k).time_s > at(k - 1).time_s;
    at(k).direction[axis] = next == k                     ? sense(at(k).q[axis] - at(k - 1).q[axis])
                            : again && next < rows.size() ? sense(at(next).q[axis] - at(k).q[axis])
                                                          : at(k - 1).direction[axis];
  }
}

// What the control took out, by the model's values as they are given, is put back.
void put_compensation_back(Parts& parts, const Machine& machine, const Model& model, const Dataset& data,
                           const Convention& c) {
  Model of_control = model;
  of_control.effects.resize(c.effects);
  const VectorXd taken_out = Observations(machine, data).predicted(of_control);
  for (std::size_t i = 0; i < parts.readings.size(); ++i)
    if (concerns(data, parts.readings[i], c))
      parts.readings[i].value += taken_out[static_cast<Eigen::Index>(i)];
}

// Temperatures between two rows are in between; speeds and free states hold. Beyond the run's ends the last
// ones stay.
void shift_clock(Parts& parts, std::size_t runs, const Convention& c) {
  const double by_s = c.clock.by_s;
  std::vector<std::vector<std::size_t>> by_time(runs);
  for (std::size_t i = 0; i < parts.states.size(); ++i) by_time[parts.states[i].run].push_back(i);
  const auto temperatures = parts.temperatures;
  const auto free_states = parts.free_states;
  const auto states = parts.states;
  for (auto& rows : by_time) {
    std::stable_sort(rows.begin(), rows.end(),
                     [&](std::size_t a, std::size_t b) { return states[a].time_s < states[b].time_s; });
    for (const std::size_t i : rows) {
      const double t = states[i].time_s + by_s;
      const auto after = std::upper_bound(rows.begin(), rows.end(), t,
                                          [&](double x, std::size_t k) { return x < states[k].time_s; });
      const std::size_t low = after == rows.begin() ? rows.front() : *(after - 1);
      const std::size_t high = after == rows.end() ? rows.back() : *after;
      const double span = states[high].time_s - states[low].time_s;
      const double share = span > 0.0 ? std::clamp((t - states[low].time_s) / span, 0.0, 1.0) : 0.0;
      parts.states[i].spindle_rpm = states[low].spindle_rpm;
      const std::size_t run = states[i].run;
      if (after == rows.begin() && run < c.clock.speed_before_rpm.size() && c.clock.speed_before_rpm[run])
        parts.states[i].spindle_rpm = *c.clock.speed_before_rpm[run];
      parts.free_states[i] = free_states[low];
      for (std::size_t k = 0; k < parts.temperatures[i].size(); ++k)
        parts.temperatures[i][k] =
            temperatures[low][k] + share * (temperatures[high][k] - temperatures[low][k]);
    }
  }
}

// Effects know the machine's axes; on another machine they are others.
void read_model_again(PutRight& out) {
  Diagnostics none;  // the model's own text
  auto model = parse_model(model_text(out.model), out.model.file, out.machine, out.data.context, none);
  if (model) out.model = std::move(*model);
}

void scale_readings(Parts& parts, const Dataset& data, const Convention& c) {
  for (Reading& r : parts.readings) {
    if (!concerns(data, r, c)) continue;
    if (!c.only_uncertainty) r.value *= c.factor;
    if (!c.with_uncertainty && !c.only_uncertainty) continue;
    r.u_random *= c.factor;
    if (r.u_common) *r.u_common *= c.factor;
  }
}

}  // namespace

bool concerns(const Dataset& data, const Reading& r, const Convention& c) {
  return (!c.run || data.run_of(r) == *c.run) && (!c.file || data.rows[r.row].file == *c.file) &&
         (!c.quantity || r.quantity == *c.quantity);
}

PutRight put_right(const Machine& machine, const Model& model, const Dataset& data, const Convention& c) {
  PutRight out{machine, model, data};
  if (c.kind == ConventionKind::axis_sense && !c.in_file) {
    Vec3& direction = out.machine.axes[c.axes.front()].direction;
    direction = -direction;
    read_model_again(out);
    return out;
  }
  if (c.kind == ConventionKind::stacking_order) {
    auto& chain = out.machine.part_chain;
    std::iter_swap(std::find(chain.begin(), chain.end(), c.axes[0]),
                   std::find(chain.begin(), chain.end(), c.axes[1]));
    read_model_again(out);
    return out;
  }
  Parts parts(data);
  switch (c.kind) {
    case ConventionKind::axis_sense:
      for (std::size_t i = 0; i < parts.states.size(); ++i)
        if (of_its_run(parts, i, c)) turn_axis(parts.states[i], c.axes.front());
      break;
    case ConventionKind::reading_sense:
      for (Reading& r : parts.readings)
        if (concerns(data, r, c)) r.value = -r.value;
      break;
    case ConventionKind::swapped_columns:
      if (c.axes.size() == 2)
        for (std::size_t i = 0; i < parts.states.size(); ++i) {
          if (of_its_run(parts, i, c)) swap_axes(parts.states[i], c.axes[0], c.axes[1], c.in_file);
        }
      else
        for (Reading& r : parts.readings)
          if (concerns(data, r, c)) std::swap(r.n[c.components[0]], r.n[c.components[1]]);
      break;
    case ConventionKind::unit:
      if (c.axes.empty()) scale_readings(parts, data, c);
      for (std::size_t i = 0; i < parts.states.size(); ++i)
        for (const AxisId a : c.axes) {
          if (!of_its_run(parts, i, c)) break;
          parts.states[i].q[a] *= c.factor;
          parts.states[i].velocity[a] *= c.factor;
        }
      break;
    case ConventionKind::tool_length:
    case ConventionKind::tool_offset:
      move_tool(parts, machine, c);
      break;
    case ConventionKind::ball_offset:
      move_part(parts, machine, data, c);
      break;
    case ConventionKind::time_shift:
      shift_clock(parts, data.context.runs.size(), c);
      break;
    case ConventionKind::component_sense:
      for (Reading& r : parts.readings)
        if (concerns(data, r, c)) r.n[c.components.front()] = -r.n[c.components.front()];
      break;
    case ConventionKind::frame:
      for (Reading& r : parts.readings) {
        if (!concerns(data, r, c)) continue;
        r.frame = r.frame == SensitivityFrame::part ? SensitivityFrame::machine : SensitivityFrame::part;
      }
      break;
    case ConventionKind::motion_sense:
      take_senses_from_positions(parts, c);
      break;
    case ConventionKind::position_offset:
      move_positions(parts, c);
      break;
    case ConventionKind::compensated:
      put_compensation_back(parts, machine, model, data, c);
      break;
    case ConventionKind::stacking_order:  // in the machine alone, above
      break;
  }
  out.data = parts.joined(data);
  return out;
}

}  // namespace trunnion::diagnosis
