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
  std::vector<double> values;  // um, urad, one a row
};

// The rotation vector of a small rotation.
Vec3 rotation_of(const Mat3& R) {
  return 0.5 * Vec3(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
}

std::vector<Channel> channels_of(const Machine& machine) {
  constexpr std::size_t kLinear = 3;
  std::vector<Channel> out;
  out.reserve(kLinear + machine.rotary_axes().size());
  for (int i = 0; i < 3; ++i) out.push_back({false, Vec3::Unit(i), {}});
  for (const AxisId id : machine.rotary_axes()) out.push_back({true, machine.axes[id].direction, {}});
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
  const std::size_t every = std::max<std::size_t>(1, (samples->size() + how.most_rows - 1) / how.most_rows);
  for (std::size_t i = 0; i < samples->size(); i += every) {
    const FollowedSample& sample = (*samples)[i];
    const std::string head = how.run_id + "," + fixed_text(sample.time_s - samples->front().time_s, kPlaces) +
                             "," + axis_fields(sample, machine) + "0,0," +
                             fixed_text(-sample.length_mm, kPlaces) + ",";
    for (std::size_t c = 0; c < channels.size(); ++c) {
      const Channel& channel = channels[c];
      out += head + (channel.rotation ? "rotation," : "displacement,") + fixed_text(channel.n.x(), 9) + "," +
             fixed_text(channel.n.y(), 9) + "," + fixed_text(channel.n.z(), 9) + "," +
             fixed_text(channel.values[i], 4) + (channel.rotation ? ",urad," : ",um,") +
             fixed_text(uncertainty[c], 4) + "\n";
    }
  }
  return out;
}

}  // namespace trunnion::trace
