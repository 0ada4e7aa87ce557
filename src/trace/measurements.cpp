#include "trunnion/trace/measurements.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"

namespace trunnion::trace {
namespace {

constexpr int kPlaces = 6;
constexpr double kLeastUncertainty = 0.02;  // um, urad: digits of a trace

struct Channel {
  bool rotation = false;
  Vec3 n = Vec3::UnitX();
  AxisId axis = 0;             // of a rotation
  std::vector<double> values;  // um, urad, one a row
};

// By which a reading may be wrong beside the scatter, um or urad.
double unsure_of(const Channel& channel, const FollowedSample& sample, const Machine& machine) {
  constexpr double kLever_mm = 100.0;
  if (channel.rotation) return sample.unsure[channel.axis] / kRadPerUrad;
  double sum2 = 0.0;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const double lever = machine.axes[id].kind == AxisKind::linear ? 1.0 : kLever_mm;
    sum2 += lever * sample.unsure[id] * lever * sample.unsure[id];
  }
  return std::sqrt(sum2) / kMmPerUm;
}

// The rotation vector of a small rotation.
Vec3 rotation_of(const Mat3& R) {
  return 0.5 * Vec3(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
}

std::vector<Channel> channels_of(const Machine& machine) {
  constexpr std::size_t kLinear = 3;
  std::vector<Channel> out;
  out.reserve(kLinear + machine.rotary_axes().size());
  for (int i = 0; i < 3; ++i) out.push_back({false, Vec3::Unit(i), 0, {}});
  for (const AxisId id : machine.rotary_axes()) out.push_back({true, machine.axes[id].direction, id, {}});
  return out;
}

double scatter_of(const std::vector<double>& values) {
  if (values.size() < 3) return kLeastUncertainty;
  std::vector<double> d;
  for (std::size_t i = 1; i + 1 < values.size(); ++i)
    d.push_back(std::abs(values[i] - 0.5 * (values[i - 1] + values[i + 1])));
  const auto middle = d.begin() + static_cast<std::ptrdiff_t>(d.size() / 2);
  std::nth_element(d.begin(), middle, d.end());
  constexpr double kMedianOfNormal = 0.67449;
  return std::max(*middle / kMedianOfNormal / std::sqrt(1.5), kLeastUncertainty);
}

std::string axis_fields(const FollowedSample& sample, const Machine& machine) {
  std::string out;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const double unit = machine.axes[id].kind == AxisKind::linear ? 1.0 : kDegreePerRad;
    out += fixed_text(sample.commanded[id] * unit, kPlaces) + "," +
           std::to_string(static_cast<int>(sample.direction[id])) + "," +
           fixed_text(sample.velocity[id] * unit * kSecondsPerMinute, 3) + ",";
  }
  return out;
}

std::string header(const Machine& machine) {
  std::string out = "run_id,time_s,";
  for (const Axis& axis : machine.axes) {
    const std::string unit = axis.kind == AxisKind::linear ? "_mm" : "_deg";
    out += axis.name + unit + ",dir_" + axis.name + ",vel_" + axis.name + unit + "_min,";
  }
  return out + "tool_x_mm,tool_y_mm,tool_z_mm,quantity,n_x,n_y,n_z,value,unit,u_random\n";
}

// Rows evenly over the trace, and where an axis has reversed those that show what it does then: the first one
// with the new sense in any case (what remembers the reversal counts from it), and ever fewer behind it.
std::vector<std::size_t> chosen_rows(const std::vector<FollowedSample>& samples, std::size_t most) {
  constexpr double kBehind_s = 0.06, kNearest_s = 0.0005, kThinner = 0.3;
  constexpr std::size_t kRowsEach = 14;  // behind a reversal, about
  std::vector<std::size_t> reversals;
  for (std::size_t i = 1; i < samples.size(); ++i)
    if (samples[i].cut == samples[i - 1].cut && !(samples[i].direction == samples[i - 1].direction))
      reversals.push_back(i);
  const std::size_t each = 1 + 2 * kRowsEach * reversals.size() / std::max<std::size_t>(1, most);
  std::vector<bool> chosen(samples.size(), false);
  std::size_t count = 0;
  for (std::size_t k = 0; k < reversals.size(); ++k) {
    const std::size_t first = reversals[k];
    count += chosen[first] ? 0U : 1U;
    chosen[first] = true;
    if (k % each != 0) continue;
    double next_s = kNearest_s;
    for (std::size_t i = first + 1; i < samples.size(); ++i) {
      const double t = samples[i].time_s - samples[first].time_s;
      if (t > kBehind_s) break;
      if (t < next_s) continue;
      next_s = t + std::max(kNearest_s, kThinner * t);
      count += chosen[i] ? 0U : 1U;
      chosen[i] = true;
    }
  }
  const std::size_t left = std::max<std::size_t>(most / 2, most - std::min(most, count));
  const std::size_t every = std::max<std::size_t>(1, (samples.size() + left - 1) / left);
  for (std::size_t i = 0; i < samples.size(); i += every) chosen[i] = true;
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < samples.size(); ++i)
    if (chosen[i]) out.push_back(i);
  return out;
}

}  // namespace

Result<std::string> measurements_of(const Trace& trace, const Machine& machine, const Plan& plan,
                                    const AsMeasurements& how) {
  const auto samples = follow(trace, machine, plan);
  if (!samples) return tl::unexpected(samples.error());
  std::vector<Channel> channels = channels_of(machine);
  for (const FollowedSample& sample : *samples) {
    const Vec3 tool(0.0, 0.0, -sample.length_mm);
    const Pose wanted = forward(machine, sample.commanded, tool),
               actual = forward(machine, sample.actual, tool);
    const Mat3 R_MP = part_in_machine(machine, sample.commanded).R;
    const Vec3 d_M = R_MP * (actual.p - wanted.p);
    const Vec3 r_M = R_MP * rotation_of(actual.R * wanted.R.transpose());
    for (Channel& channel : channels)
      channel.values.push_back(channel.rotation ? channel.n.dot(r_M) / kRadPerUrad
                                                : channel.n.dot(d_M) / kMmPerUm);
  }
  std::vector<double> uncertainty;
  uncertainty.reserve(channels.size());
  for (const Channel& channel : channels) uncertainty.push_back(scatter_of(channel.values));
  std::string out = "# trace " + trace.file +
                    " along its program; the delay that all axes share is not seen\n" + header(machine);
  for (const std::size_t i : chosen_rows(*samples, how.most_rows)) {
    const FollowedSample& sample = (*samples)[i];
    const std::string head = how.run_id + "-" + std::to_string(sample.cut) + "," +
                             fixed_text(sample.time_s - samples->front().time_s, kPlaces) + "," +
                             axis_fields(sample, machine) + "0,0," + fixed_text(-sample.length_mm, kPlaces) +
                             ",";
    for (std::size_t c = 0; c < channels.size(); ++c) {
      const Channel& channel = channels[c];
      out += head + (channel.rotation ? "rotation," : "displacement,") + fixed_text(channel.n.x(), 9) + "," +
             fixed_text(channel.n.y(), 9) + "," + fixed_text(channel.n.z(), 9) + "," +
             fixed_text(channel.values[i], 4) + (channel.rotation ? ",urad," : ",um,") +
             fixed_text(std::hypot(uncertainty[c], unsure_of(channel, sample, machine)), 4) + "\n";
    }
  }
  return out;
}

}  // namespace trunnion::trace
