#include "report/residual_figures.hpp"

#include <algorithm>
#include <array>
#include <boost/math/distributions/normal.hpp>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <random>

#include "trunnion/effects/deviation.hpp"

#include "report/svg.hpp"

namespace trunnion::report {
namespace {

using diagnosis::Quantity;
using diagnosis::Reading;

constexpr std::size_t kFewRuns = 8;  // as many as the palette has colours
constexpr double kUm = 1e3;          // per mm
constexpr double kUrad = 1e6;        // per rad

double um_of(const Reading& r, double value) {
  return value * (r.quantity == Quantity::displacement ? kUm : kUrad);
}

// A quantity against which residuals are drawn.
struct Covariate {
  std::string name;
  Scale scale;
  std::vector<double> values;  // of each reading
  std::optional<AxisId> axis;
};

std::vector<Covariate> covariates(const Residuals& r) {
  std::vector<Covariate> out;
  const auto add = [&](std::string name, Scale scale, std::optional<AxisId> axis, const auto& value) {
    Covariate c{std::move(name), std::move(scale), {}, axis};
    for (const Reading& reading : r.data->readings)
      c.values.push_back(value(r.data->track.state(reading.row)));
    const auto [low, high] = std::minmax_element(c.values.begin(), c.values.end());
    if (*high - *low > 1e-9) out.push_back(std::move(c));
  };
  const Machine& machine = *r.machine;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const bool rotary = machine.axes[id].kind == AxisKind::rotary;
    add(machine.axes[id].name, {machine.axes[id].name, rotary ? "°" : "mm"}, id,
        [&](const MachineState& s) { return s.q[id] * (rotary ? kDegreePerRad : 1.0); });
  }
  add("time", {"time within the run", "min"}, std::nullopt,
      [](const MachineState& s) { return s.time_s / kSecondsPerMinute; });
  add("spindle", {"spindle speed", "1/min"}, std::nullopt,
      [](const MachineState& s) { return s.spindle_rpm; });
  const auto& sensors = r.data->context.names.temperatures;
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    add("T_" + sensors[i], {sensors[i] + " above reference", "K"}, std::nullopt,
        [i](const MachineState& s) { return s.temperature(i); });
  }
  return out;
}

// Local straight lines, weighted by a normal density whose width is an eighth of the range (Cleveland's
// local regression with a fixed width): follows a bend, and has no bias at the ends.
Series smooth(const std::vector<double>& x, const std::vector<double>& y) {
  constexpr std::size_t kPlaces = 60;
  constexpr double kWidth = 0.125 / 2.0;  // standard deviation, in the range of x
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  const double range = *high - *low;
  Series out;
  out.name = "smooth";
  out.colour = 7;
  for (std::size_t p = 0; p <= kPlaces; ++p) {
    const double at = static_cast<double>(p) / kPlaces;
    std::array<double, 5> sum{};  // w, w t, w t^2, w y, w t y
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double t = (x[i] - *low) / range - at;
      const double w = std::exp(-0.5 * t * t / (kWidth * kWidth));
      sum[0] += w;
      sum[1] += w * t;
      sum[2] += w * t * t;
      sum[3] += w * y[i];
      sum[4] += w * t * y[i];
    }
    constexpr double kAny = 0.5;  // less than half a reading's weight: a gap in the data
    const double det = sum[0] * sum[2] - sum[1] * sum[1];
    if (sum[0] < kAny) continue;
    out.x.push_back(*low + at * range);
    // All readings at one place: their mean.
    const bool sloped = det > 1e-9 * sum[0] * sum[0] * kWidth * kWidth;
    out.y.push_back(sloped ? (sum[2] * sum[3] - sum[1] * sum[4]) / det : sum[3] / sum[0]);
  }
  return out;
}

Figure against(const Residuals& r, const Covariate& c, std::size_t number, const std::string& what) {
  XyPlot plot{c.scale, {what, "µm"}, {}, {}, {}, false};
  const auto& runs = r.data->context.runs;
  const bool by_run = runs.size() > 1 && runs.size() <= kFewRuns;
  std::map<int, Series> groups;
  for (std::size_t i = 0; i < r.um.size(); ++i) {
    const MachineState state = r.data->track.state(r.data->readings[i].row);
    const int direction = c.axis ? state.direction.at(*c.axis) : 0;
    const int key = by_run ? static_cast<int>(state.run) : direction;
    Series& s = groups[key];
    s.mark = Mark::points;
    s.x.push_back(c.values[i]);
    s.y.push_back(r.um[i]);
  }
  for (auto& [key, s] : groups) {
    if (by_run) {
      s.name = runs[static_cast<std::size_t>(key)].id;
      s.colour = key;
    } else {
      s.name = groups.size() == 1 ? "" : key > 0 ? "moving up" : key < 0 ? "moving down" : "at rest";
      s.colour = key > 0 ? 0 : key < 0 ? 1 : 2;
    }
    plot.series.push_back(std::move(s));
  }
  plot.series.push_back(smooth(c.values, r.um));
  std::string title = what;
  title.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(title.front())));
  return {"covariate-" + std::to_string(number), title + " against " + c.scale.label,
          std::string("Coloured by ") + (by_run ? "run" : "direction of motion") +
              "; the line is a local straight-line fit.",
          std::move(plot)};
}

}  // namespace

Residuals residuals_of(const Machine& machine, const diagnosis::Dataset& data, const diagnosis::Fit& fit) {
  Residuals out{&machine, &data, {}, fit.normalised};
  for (std::size_t i = 0; i < data.readings.size(); ++i)
    out.um.push_back(um_of(data.readings[i], fit.residual[i]));
  return out;
}

Residuals readings_of(const Machine& machine, const diagnosis::Dataset& data) {
  Residuals out{&machine, &data, {}, {}};
  for (const Reading& reading : data.readings) out.um.push_back(um_of(reading, reading.value));
  return out;
}

namespace {

struct RowVector {
  Vec3 place_M = Vec3::Zero();
  Vec3 residual_M_um = Vec3::Zero();
};

std::map<std::size_t, RowVector> row_vectors(const Residuals& r) {
  std::map<std::size_t, RowVector> out;
  for (std::size_t i = 0; i < r.um.size(); ++i) {
    const Reading& reading = r.data->readings[i];
    if (reading.quantity != Quantity::displacement) continue;
    const MachineState state = r.data->track.state(reading.row);
    const Pose X_MP = part_in_machine(*r.machine, state.q);
    RowVector& v = out[reading.row];
    v.place_M = X_MP * forward(*r.machine, state.q, r.data->rows[reading.row].tool_mm).p;
    const Vec3 n_M =
        reading.frame == diagnosis::SensitivityFrame::part ? Vec3(X_MP.R * reading.n) : reading.n;
    v.residual_M_um += r.um[i] * n_M;
  }
  return out;
}

}  // namespace

VectorScale vector_scale(const Residuals& residuals) {
  constexpr double kLongest = 0.12;  // of the measured volume's diagonal
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 high = -low;
  VectorScale out;
  for (const auto& [row, v] : row_vectors(residuals)) {
    low = low.cwiseMin(v.place_M);
    high = high.cwiseMax(v.place_M);
    out.largest_um = std::max(out.largest_um, v.residual_M_um.norm());
  }
  if (out.largest_um <= 0.0) return out;
  const double raw = kLongest * std::max((high - low).norm(), 10.0) / (out.largest_um / kUm);
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  out.magnification = power * (raw / power >= 5 ? 5 : raw / power >= 2 ? 2 : 1);
  return out;
}

SpacePlot residual_vectors(const Residuals& residuals, const VectorScale& scale) {
  SpacePlot plot;
  plot.kind = SpacePlot::Kind::vectors;
  plot.frame = "machine frame M";
  plot.colour = {"residual", "µm"};
  plot.value_max = scale.largest_um;
  plot.magnification = scale.magnification;
  for (const auto& [row, v] : row_vectors(residuals)) {
    plot.x.push_back(v.place_M.x());
    plot.y.push_back(v.place_M.y());
    plot.z.push_back(v.place_M.z());
    plot.u.push_back(v.residual_M_um.x() / kUm);
    plot.v.push_back(v.residual_M_um.y() / kUm);
    plot.w.push_back(v.residual_M_um.z() / kUm);
    plot.value.push_back(v.residual_M_um.norm());
    plot.labels.push_back(short_number(v.residual_M_um.norm(), 3) + " µm");
  }
  return plot;
}

std::vector<Figure> residual_against_covariates(const Residuals& residuals,
                                                const std::vector<std::string>& first,
                                                const std::string& what) {
  std::vector<Covariate> all = covariates(residuals);
  const auto rank = [&](const Covariate& c) {
    return std::find_if(first.begin(), first.end(), [&](const std::string& f) { return f == c.name; }) -
           first.begin();
  };
  std::stable_sort(all.begin(), all.end(), [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
  constexpr std::size_t kMost = 8;
  std::vector<Figure> out;
  for (std::size_t i = 0; i < all.size() && i < kMost; ++i)
    out.push_back(against(residuals, all[i], i + 1, what));
  return out;
}

BoxPlot residual_by_run(const Residuals& residuals) {
  BoxPlot plot;
  plot.y = {"residual", "µm"};
  const auto& data = *residuals.data;
  for (const auto& run : data.context.runs) plot.samples.push_back({run.id, {}});
  for (std::size_t i = 0; i < residuals.um.size(); ++i) {
    const std::size_t run = data.run_of(data.readings[i]);
    if (run < plot.samples.size()) plot.samples[run].values.push_back(residuals.um[i]);
  }
  std::erase_if(plot.samples, [](const auto& s) { return s.values.empty(); });
  return plot;
}

XyPlot normal_quantiles(const Residuals& residuals) {
  constexpr std::size_t kPlaces = 300;
  constexpr std::size_t kSamples = 400;
  XyPlot plot{{"quantile of the normal distribution", ""}, {"normalised residual", ""}, {}, {}, {}, false};
  std::vector<double> sorted;
  for (const double v : residuals.normalised) {
    if (std::isfinite(v)) sorted.push_back(v);
  }
  std::sort(sorted.begin(), sorted.end());
  const auto n = static_cast<double>(sorted.size());
  if (sorted.size() < 3) return plot;
  const boost::math::normal normal;
  std::mt19937_64 random(1);
  Series band{.name = "95 of 100 normal samples",
              .mark = Mark::band,
              .x = {},
              .y = {},
              .y2 = {},
              .labels = {},
              .colour = 7};
  Series points{
      .name = "readings", .mark = Mark::points, .x = {}, .y = {}, .y2 = {}, .labels = {}, .colour = 0};
  Series line{.name = "normal", .mark = Mark::line, .x = {}, .y = {}, .y2 = {}, .labels = {}, .colour = 7};
  const std::size_t places = std::min(kPlaces, sorted.size());
  for (std::size_t p = 0; p < places; ++p) {
    const std::size_t k = places == 1 ? 0 : p * (sorted.size() - 1) / (places - 1);
    const auto rank = static_cast<double>(k) + 1.0;
    const double x = boost::math::quantile(normal, (rank - 0.5) / n);
    // The k-th of n uniform numbers is Beta(k, n + 1 - k): a ratio of two gamma variables.
    std::gamma_distribution<> below(rank);
    std::gamma_distribution<> above(n + 1.0 - rank);
    std::vector<double> drawn(kSamples);
    for (double& d : drawn) {
      const double a = below(random);
      d = a / (a + above(random));
    }
    std::sort(drawn.begin(), drawn.end());
    const auto at = [&](double share) {
      constexpr double kEdge = 1e-12;
      return boost::math::quantile(
          normal, std::clamp(drawn[static_cast<std::size_t>(share * (kSamples - 1))], kEdge, 1 - kEdge));
    };
    band.x.push_back(x);
    band.y.push_back(at(0.025));
    band.y2.push_back(at(0.975));
    points.x.push_back(x);
    points.y.push_back(sorted[k]);
    line.x.push_back(x);
    line.y.push_back(x);
  }
  plot.series = {std::move(band), std::move(line), std::move(points)};
  return plot;
}

std::vector<std::vector<double>> contributions_um(const Machine& machine, const diagnosis::Dataset& data,
                                                  const Model& model) {
  std::vector<std::vector<double>> out;
  for (const ModelEffect& effect : model.effects) {
    Model alone = model;
    alone.effects = {effect};
    const ModelEvaluator evaluator(alone, ModelEvaluator::Sizes::any);
    std::vector<std::vector<double>> lags;
    for (const LagRequest& request : evaluator.lags()) lags.push_back(data.track.lag(request));
    std::vector<double> values;
    for (const Reading& reading : data.readings) {
      const MachineState state = data.track.state(reading.row);
      std::vector<double> lagged;
      lagged.reserve(lags.size());
      for (const auto& lag : lags) lagged.push_back(lag[reading.row]);
      const DeviationMap map(machine, state.q, data.rows[reading.row].tool_mm);
      const Deviation d_P = map.exact_P(evaluator.errors(state, lagged));
      const Deviation d = reading.frame == diagnosis::SensitivityFrame::part ? d_P : map.to_M(d_P);
      const Vec3& v = reading.quantity == Quantity::displacement ? d.displacement_mm : d.rotation_rad;
      values.push_back(um_of(reading, reading.n.dot(v)));
    }
    out.push_back(std::move(values));
  }
  return out;
}

std::vector<double> shapley_shares(const std::vector<std::vector<double>>& contributions) {
  std::vector<double> out;
  if (contributions.empty()) return out;
  std::vector<double> whole(contributions.front().size());
  for (const auto& c : contributions) {
    for (std::size_t i = 0; i < whole.size(); ++i) whole[i] += c[i];
  }
  for (const auto& c : contributions)
    out.push_back(std::inner_product(c.begin(), c.end(), whole.begin(), 0.0) /
                  static_cast<double>(whole.size()));
  return out;
}

}  // namespace trunnion::report
