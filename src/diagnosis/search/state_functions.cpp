#include "diagnosis/search/state_functions.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "trunnion/base/units.hpp"
#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/data/axis_history.hpp"
#include "diagnosis/search/structure.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr int kTurnHarmonics =
    6;                       // of a rotary axis: two are the library's, lobes of bearings and jaws the rest
constexpr int kPlaces = 15;  // of a step or a kink along a range
constexpr std::array kWidths = {0.045, 0.09};  // of a bump, of the range: a tenth and a fifth at half height
constexpr int kFewestReadings = 6;             // that carry a sharp function: what fewer show is an outlier

/// Collects the functions of one covariate.
class Collector {
 public:
  Collector(std::string covariate, Eigen::Index rows, std::size_t link)
      : rows_(rows), out_{std::move(covariate), {}, {}, link} {}
  /// Tested together.
  void block(const MatrixXd& f) {
    if (f.cols() == 0) return;
    out_.spans.push_back({static_cast<Eigen::Index>(columns_.size()), f.cols()});
    for (Eigen::Index k = 0; k < f.cols(); ++k) columns_.emplace_back(f.col(k));
  }
  /// Tested together, when enough readings carry each: whether they do.
  bool sharp(const MatrixXd& f) {
    for (Eigen::Index k = 0; k < f.cols(); ++k)
      if (!carried(f.col(k))) return false;
    block(f);
    return true;
  }
  /// Parts of a block that stands already.
  void again(Eigen::Index first, Eigen::Index count) { out_.spans.push_back({first, count}); }
  Eigen::Index size() const { return static_cast<Eigen::Index>(columns_.size()); }
  void finish(std::vector<StateFunctions>& to) {
    if (columns_.empty()) return;
    out_.values.resize(rows_, size());
    for (Eigen::Index k = 0; k < size(); ++k)
      out_.values.col(k) = columns_[static_cast<std::size_t>(k)].cast<float>();
    to.push_back(std::move(out_));
  }

 private:
  // Readings that differ from the most common value, in effect: (sum d^2)^2 / sum d^4.
  static bool carried(const VectorXd& f) {
    std::vector<double> sorted(f.begin(), f.end());
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    const VectorXd d = (f.array() - *middle).square().matrix();
    const double squares = d.sum(), fourth = d.squaredNorm();
    return fourth > 0.0 && squares * squares / fourth >= kFewestReadings;
  }
  Eigen::Index rows_;
  StateFunctions out_;
  std::vector<VectorXd> columns_;
};

VectorXd step_at(const VectorXd& v, double at) {
  return (v.array() > at).cast<double>().matrix();
}

void add_steps(const VectorXd& v, const VectorXd& weight, Collector& out) {
  for (const double at : places_between(v, kPlaces)) out.sharp(step_at(v, at).cwiseProduct(weight));
}

void add_kinks(const VectorXd& v, Collector& out) {
  for (const double at : places_between(v, kPlaces / 2)) out.sharp((v.array() - at).abs().matrix());
}

void add_bumps(const VectorXd& v, Collector& out) {
  const double low = v.minCoeff(), range = v.maxCoeff() - low;
  for (const double width : kWidths)
    for (double at = 0.0; at <= 1.0; at += width)
      out.sharp((-0.5 * ((v.array() - low - at * range) / (width * range)).square()).exp().matrix());
}

void add_waves(const VectorXd& v, const VectorXd& weight, double fastest, Collector& out) {
  const double low = v.minCoeff(), range = v.maxCoeff() - low;
  for (double cycles = kSlowestWave; cycles <= fastest; cycles += kWaveStep) {
    MatrixXd f(v.size(), 2);
    const auto phase = kTwoPi * cycles / range * (v.array() - low);
    f.col(0) = phase.cos().matrix().cwiseProduct(weight);
    f.col(1) = phase.sin().matrix().cwiseProduct(weight);
    out.sharp(f);
  }
}

// Smooth functions of a covariate: any twist may follow them.
void add_smooth(const Observations& o, const Covariate& c, bool rotary, std::vector<StateFunctions>& to) {
  Collector out(c.name, o.size(), StateFunctions::kAnyLink);
  if (c.periodic) {
    MatrixXd turns(o.size(), Eigen::Index{2} * kTurnHarmonics);
    for (int k = 0; k < kTurnHarmonics; ++k) turns.middleCols(Eigen::Index{2} * k, 2) = harmonic(c, k + 1);
    out.block(turns);
    for (int k = 0; k < kTurnHarmonics; ++k) out.again(Eigen::Index{2} * k, 2);
  } else {
    const MatrixXd f = functions(c, kFullDegree);
    out.block(f);
    if (f.cols() > 2) out.again(0, 2);
    if (rotary && c.distinct > std::size_t{2} * kTurnHarmonics)
      for (int k = 3; k <= kTurnHarmonics; ++k) out.block(harmonic(c, k));
  }
  out.finish(to);
}

// Steps, kinks, bumps, waves along a covariate, for the twists of one link.
void add_sharp(const Observations& o, const Covariate& c, std::size_t link, std::vector<StateFunctions>& to) {
  if (c.distinct < 5) return;
  Collector out(c.name, o.size(), link);
  const VectorXd ones = VectorXd::Ones(o.size());
  add_steps(c.values, ones, out);
  add_kinks(c.values, out);
  if (!c.periodic) add_bumps(c.values, out);
  add_waves(c.values, ones, std::min(kFastestWave, 0.5 * static_cast<double>(c.distinct)), out);
  out.finish(to);
}

// What follows the sense of an axis' motion: along its position and with its feed.
void add_senses(const Observations& o, AxisId axis, const AxisHistory& history,
                std::vector<StateFunctions>& to) {
  const std::string& name = o.machine().axes[axis].name;
  const VectorXd& sense = history.sense;
  if (distinct_values(sense, 4) < 2) return;
  const Covariate at = covariate(o, name, [axis](const MachineState& s) { return s.q[axis]; });
  const Covariate feed =
      covariate(o, name, [axis](const MachineState& s) { return std::abs(s.velocity[axis]); });
  {
    Collector out("direction of " + name, o.size(), axis);
    out.block(sense);
    out.finish(to);
  }
  if (at.distinct > 2) {
    Collector out("direction of " + name + " x " + name, o.size(), axis);
    out.block(column_products(sense, functions(at, 4)));
    add_steps(at.values, sense, out);
    add_waves(at.values, sense, std::min(kFastestWave, 0.5 * static_cast<double>(at.distinct)), out);
    out.finish(to);
  }
  if (feed.distinct > 1) {
    Collector out("direction of " + name + " x velocity", o.size(), axis);
    const MatrixXd f = column_products(sense, functions(feed, 3));
    out.block(f);
    if (f.cols() > 2) out.again(0, 2), out.again(0, 1);
    add_steps(feed.values, sense, out);
    out.finish(to);
  }
}

// What an axis did before the reading: lost motion that fades, what is left of the last step.
void add_history(const Observations& o, AxisId axis, const AxisHistory& history,
                 std::vector<StateFunctions>& to) {
  const double range = history.since_turn_distance.maxCoeff(),
               longest = history.last_step.cwiseAbs().maxCoeff();
  if (!(range > 0.0) || !(longest > 0.0)) return;
  Collector out("history of " + o.machine().axes[axis].name, o.size(), axis);
  for (const double tau : {10.0, 30.0, 90.0, 300.0})
    out.sharp(history.sense.cwiseProduct((-history.since_turn_s.array() / tau).exp().matrix()));
  for (const double share : {0.05, 0.2, 0.5})
    out.sharp(
        history.sense.cwiseProduct((-history.since_turn_distance.array() / (share * range)).exp().matrix()));
  const VectorXd step = history.last_step / longest;
  MatrixXd steps(o.size(), 2);
  steps.col(0) = step;
  steps.col(1) = step.cwiseProduct(step.cwiseAbs());
  if (out.sharp(steps)) out.again(out.size() - 2, 1);
  out.finish(to);
}

// Low functions of one factor of a product: harmonics of a rotary axis, also where it makes no full turn.
std::vector<MatrixXd> factor(const Covariate& c, bool rotary, int degree) {
  if (!rotary) return {functions(c, degree)};
  return {harmonic(c, 1), harmonic(c, 2)};
}

MatrixXd with_factors(const MatrixXd& f, const MatrixXd& g) {
  MatrixXd out(f.rows(), f.cols() * g.cols() + f.cols() + g.cols());
  out << column_products(f, g), f, g;
  return out;
}

void add_product(const Observations& o, const Covariate& a, bool a_rotary, int a_degree, const Covariate& b,
                 bool b_rotary, int b_degree, std::vector<StateFunctions>& to) {
  if (joint_variation(a.values, b.values) < 1) return;
  Collector out(a.name + " x " + b.name, o.size(), StateFunctions::kAnyLink);
  const auto fa = factor(a, a_rotary, a_degree), fb = factor(b, b_rotary, b_degree);
  for (const MatrixXd& f : fa)
    for (const MatrixXd& g : fb) out.block(column_products(f, g));
  if (fa.size() * fb.size() > 1) out.again(0, out.size());
  // With each factor alone, as in t (1 + x): the two together may be much more than either.
  out.block(with_factors(fa.front(), fb.front()));
  out.finish(to);
}

// A plane with a kink beyond a corner: loose feet, half-supported tables.
void add_corners(const Observations& o, const Covariate& a, const Covariate& b,
                 std::vector<StateFunctions>& to) {
  if (joint_variation(a.values, b.values) < 4) return;
  Collector out(a.name + " x " + b.name, o.size(), o.link_count() - 2);
  const auto scaled = [](const VectorXd& v) {
    return VectorXd((2.0 * (v.array() - v.minCoeff()) / (v.maxCoeff() - v.minCoeff()) - 1.0).matrix());
  };
  const VectorXd x = scaled(a.values), y = scaled(b.values);
  for (const double sx : {-1.0, 1.0})
    for (const double sy : {-1.0, 1.0})
      for (const double from : {-0.4, 0.0, 0.4, 0.8})
        out.sharp((sx * x + sy * y).array().max(from).matrix() - VectorXd::Constant(x.size(), from));
  out.finish(to);
}

void add_products(const Observations& o, const std::vector<Covariate>& positions,
                  const std::vector<Covariate>& states, std::vector<StateFunctions>& to) {
  const auto rotary = [&](const Covariate& c) {
    const auto& axes = o.machine().axes;
    const auto found =
        std::find_if(axes.begin(), axes.end(), [&](const Axis& a) { return a.name == c.name; });
    return found != axes.end() && found->kind == AxisKind::rotary;
  };
  for (std::size_t i = 0; i < positions.size(); ++i)
    for (std::size_t k = i + 1; k < positions.size(); ++k) {
      const bool first = rotary(positions[i]), second = rotary(positions[k]);
      add_product(o, positions[i], first, 2, positions[k], second, 2, to);
      if (!first && !second) add_corners(o, positions[i], positions[k], to);
    }
  for (const Covariate& s : states) {
    if (s.name.starts_with("velocity")) continue;
    for (const Covariate& p : positions) add_product(o, s, false, 1, p, rotary(p), 2, to);
  }
  for (std::size_t i = 0; i < states.size(); ++i)
    for (std::size_t k = i + 1; k < states.size(); ++k)
      if (states[i].name.starts_with("T_") && states[k].name.starts_with("T_"))
        add_product(o, states[i], false, 1, states[k], false, 1, to);
  std::vector<const Covariate*> linear;
  for (const Covariate& p : positions)
    if (!rotary(p)) linear.push_back(&p);
  if (linear.size() == 3) {
    Collector out("X x Y x Z", o.size(), StateFunctions::kAnyLink);
    out.block(column_products(column_products(functions(*linear[0], 1), functions(*linear[1], 1)),
                              functions(*linear[2], 1)));
    out.finish(to);
  }
}

// Within each run alone: a creep that is different every time.
void add_runs(const Observations& o, std::vector<StateFunctions>& to) {
  for (std::size_t r = 0; r < o.runs().size(); ++r) {
    const auto& rows = o.runs()[r];
    Covariate time{"time", VectorXd::Zero(static_cast<Eigen::Index>(rows.size())), false, 0};
    for (std::size_t i = 0; i < rows.size(); ++i)
      time.values[static_cast<Eigen::Index>(i)] = o.state(rows[i]).time_s;
    if (rows.size() < 12) continue;
    time.distinct = distinct_values(time.values, 40);
    if (time.distinct < 8) continue;
    const MatrixXd f = functions(time, 4);
    MatrixXd all = MatrixXd::Zero(o.size(), f.cols());
    for (std::size_t i = 0; i < rows.size(); ++i) all.row(rows[i]) = f.row(static_cast<Eigen::Index>(i));
    Collector out("time in run " + o.data().context.runs[r].id, o.size(), o.link_count() - 1);
    out.block(all);
    out.finish(to);
  }
}

}  // namespace

std::vector<StateFunctions> state_functions(const Observations& o) {
  std::vector<StateFunctions> out;
  const auto positions = axis_covariates(o);
  const auto states = state_covariates(o);
  const auto& axes = o.machine().axes;
  const std::size_t spindle = o.link_count() - 2;
  for (const Covariate& c : positions) {
    const auto axis = static_cast<AxisId>(
        std::find_if(axes.begin(), axes.end(), [&](const Axis& a) { return a.name == c.name; }) -
        axes.begin());
    add_smooth(o, c, axes[axis].kind == AxisKind::rotary, out);
    add_sharp(o, c, axis, out);
  }
  for (const Covariate& c : states) {
    add_smooth(o, c, false, out);
    add_sharp(o, c, spindle, out);
  }
  const auto histories = axis_histories(o);
  for (AxisId a = 0; a < axes.size(); ++a) {
    add_senses(o, a, histories[a], out);
    add_history(o, a, histories[a], out);
  }
  add_runs(o, out);
  add_products(o, positions, states, out);  // last: of very many readings the last are left out
  return out;
}

}  // namespace trunnion::diagnosis
