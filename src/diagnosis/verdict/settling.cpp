#include "diagnosis/verdict/settling.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/fit_core.hpp"
#include "diagnosis/fit/statistics.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kBesideSettling = 0.7, kOfSettling = 0.9;
// From what a spindle or a clamp takes to what a casting takes, by factors of 1.65.
constexpr double kShortest_s = 60.0, kLongest_s = 15000.0;
constexpr int kTimeConstants = 12;

bool is_steady_drift(const ModelEffect& effect) {
  return effect.id() == "time_drift";
}

// The tool displaced by a drift that begins with each run, as a steady one does, and comes to an end.
MatrixXd settling(const Observations& o, double tau_s) {
  const MatrixXd& spindle = o.response(o.link_count() - 2);
  MatrixXd out = MatrixXd::Zero(o.size(), 3);
  for (const auto& rows : o.runs()) {
    double start = INFINITY;
    for (const Eigen::Index i : rows) start = std::min(start, o.state(i).time_s);
    for (const Eigen::Index i : rows)
      out.row(i) = spindle.block(i, 0, 1, 3) * (1.0 - std::exp((start - o.state(i).time_s) / tau_s));
  }
  return out;
}

// Whether an axis goes one way only with time, in every run in which it moves.
bool goes_with_time(const Observations& o, AxisId axis) {
  for (auto rows : o.runs()) {
    std::stable_sort(rows.begin(), rows.end(),
                     [&](Eigen::Index a, Eigen::Index b) { return o.state(a).time_s < o.state(b).time_s; });
    bool up = false, down = false;
    for (std::size_t k = 1; k < rows.size(); ++k) {
      const double by = o.state(rows[k]).q[axis] - o.state(rows[k - 1]).q[axis];
      up = up || by > 1e-9;
      down = down || by < -1e-9;
    }
    if (up && down) return false;
  }
  return true;
}

// What a drift that settles does without.
struct Settling {
  double ahead = -INFINITY;  // of what was named, in -2 ln
  double tau_s = 0.0;
  std::vector<std::string> without;
  const ModelEffect* of_position = nullptr;
};

class Settled {
 public:
  Settled(const Observations& whole, const Model& model, std::vector<bool> flags)
      : o_(whole), model_(model), flags_(std::move(flags)) {}

  // In place of the drift and `dropped`.
  Settling instead_of(const std::vector<ModelEffect>& named, const ModelEffect& dropped) const {
    Model with_all = model_, rest = model_;
    double parameters = 0.0;
    Settling out;
    out.of_position = &dropped;
    for (const ModelEffect& effect : named) {
      with_all.effects.push_back(effect);
      if (is_steady_drift(effect) || &effect == &dropped) {
        parameters += static_cast<double>(effect.parameters.size());
        out.without.push_back(effect.id());
      } else {
        rest.effects.push_back(effect);
      }
    }
    const FitCore all = fit_core(o_, with_all, {.robust = false}, flags_);
    const FitCore plain = fit_core(o_, rest, {.robust = false}, flags_);
    double left = INFINITY, parameters_of_it = 0.0;
    const auto try_it = [&](double tau_s) {
      const MatrixXd q = pivoted_qr(plain.projected(settling(o_, tau_s)), 1e-6).Q;
      const double now = plain.chi2() - (q.transpose() * plain.white).squaredNorm();
      if (now >= left) return;
      left = now;
      parameters_of_it = 1.0 + static_cast<double>(q.cols());  // and the time constant
      out.tau_s = tau_s;
    };
    // By a factor each, then by the square root of it to either side of the best, five times: to a hundredth.
    double factor = std::pow(kLongest_s / kShortest_s, 1.0 / (kTimeConstants - 1));
    for (int k = 0; k < kTimeConstants; ++k) try_it(kShortest_s * std::pow(factor, k));
    constexpr int kHalvings = 5;
    for (int k = 0; k < kHalvings; ++k) {
      factor = std::sqrt(factor);
      const double best_s = out.tau_s;
      try_it(best_s / factor);
      try_it(best_s * factor);
    }
    const double noise = std::max(1.0, std::min(left, all.chi2()) / std::max(all.dof(), 1.0));
    out.ahead = (all.chi2() - left) / noise +
                (parameters - parameters_of_it) * std::log(static_cast<double>(o_.size()));
    return out;
  }

 private:
  const Observations& o_;
  const Model& model_;
  std::vector<bool> flags_;
};

std::string in_another_order(const Observations& o, const ModelEffect& effect) {
  const Link link = effect.effect->link();
  const bool turns = link.kind == Link::Kind::joint && goes_with_time(o, link.axis);
  return (turns ? o.machine().axes[link.axis].name + " goes one way with time in every run: measure"
                : std::string("Measure")) +
         " the same poses in another order, or when all has settled.";
}

}  // namespace

void doubt_beside_settling(const Observations& whole, const Model& model, const std::vector<bool>& left_out,
                           Diagnosis& d) {
  if (d.verdict != Verdict::named && d.verdict != Verdict::ambiguous &&
      d.verdict != Verdict::named_but_incomplete)
    return;
  if (std::none_of(d.additions.begin(), d.additions.end(), is_steady_drift)) return;
  const bool alike = left_out.size() == static_cast<std::size_t>(whole.size());
  const Settled settled(whole, model, alike ? left_out : std::vector<bool>{});
  Settling best;
  for (const ModelEffect& effect : d.additions) {
    if (is_steady_drift(effect)) continue;
    if (Settling one = settled.instead_of(d.additions, effect); one.ahead > best.ahead) best = std::move(one);
  }
  if (best.ahead < -kThousandToOne) return;
  const std::string what = "a drift that settles in each run, with a time constant of about " +
                           std::to_string(std::llround(best.tau_s)) + " s";
  const std::string order = in_another_order(whole, *best.of_position);
  if (best.ahead > kThousandToOne) {
    d.verdict = Verdict::not_in_library;
    d.confidence = kOfSettling;
    d.imitators = best.without;
    d.effects.clear();
    d.sets.clear();
    d.additions.clear();
    d.next.reset();
    d.leftover = d.depends_on;
    d.paragraph = "The model misses something real that is none of the effects known here: " + what +
                  ", explains the readings better than " + best.without.front() + " and " +
                  best.without.back() + " together. Let machine and instrument settle first. " + order;
    return;
  }
  std::vector<std::string> others = d.effects;
  std::erase(others, best.of_position->id());
  d.sets.push_back(std::move(others));
  d.verdict = Verdict::ambiguous;
  d.confidence = std::min(d.confidence, kBesideSettling);
  d.paragraph += " Or no " + best.of_position->id() + " is missing, but " + what +
                 ", instead of a steady one: these readings hardly tell the two apart. " + order;
}

}  // namespace trunnion::diagnosis
