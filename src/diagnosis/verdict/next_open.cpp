#include <algorithm>
#include <cmath>

#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/usual_size.hpp"
#include "diagnosis/verdict/next_measurement.hpp"
#include "diagnosis/verdict/verdict_text.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr int kMostRuns = 2;

// What readings say of the parameters, each in its usual size: products of whitened columns, set-ups out.
class Information {
 public:
  explicit Information(const FitCore& fit) : fit_(fit), usual_(usual_sizes(fit)) {}

  MatrixXd of(const Observations& o, const Whitening& whitening) const {
    MatrixXd columns(o.size(), usual_.size());
    std::size_t block_of = fit_.model.effects.size();
    MatrixXd block;
    for (std::size_t k = 0; k < fit_.free.size(); ++k) {
      const FreeParameter& p = fit_.free[k];
      if (p.effect != block_of) block = o.columns(fit_.model.effects[block_of = p.effect]);
      const auto i = static_cast<Eigen::Index>(k);
      columns.col(i) = usual_[i] * block.col(static_cast<Eigen::Index>(p.index));
    }
    whitening.apply(columns);
    return columns.transpose() * columns;
  }

  /// Combinations that are known to better than their usual size.
  static Eigen::Index decided(const MatrixXd& information) {
    const SymmetricEigen eigen = symmetric_eigen(information);
    return std::count_if(eigen.values.begin(), eigen.values.end(), [](double v) { return v > 1.0; });
  }
  /// Beside what is usual: grows with every combination that is told better.
  static double gain(const MatrixXd& information) {
    const SymmetricEigen eigen = symmetric_eigen(information);
    return eigen.values.cwiseMax(0.0).array().log1p().sum();
  }

 private:
  const FitCore& fit_;
  VectorXd usual_;
};

// A ball, a probe: displacements at more than one position of a rotary axis.
bool measured_on_the_table(const Observations& o) {
  for (const AxisId a : o.machine().rotary_axes())
    for (Eigen::Index i = 1; i < o.size(); ++i)
      if (o.reading(i).quantity == Quantity::displacement && o.state(i).run == o.state(i - 1).run &&
          std::abs(o.state(i).q[a] - o.state(i - 1).q[a]) > 1e-9)
        return true;
  return false;
}

struct Choice {
  PlanRun run;
  MatrixXd information;
  Eigen::Index decided = 0;
  double gain = 0.0;
};

}  // namespace

std::optional<NextMeasurement> next_for_open_parameters(const Observations& o, const FitCore& fit) {
  const auto candidates = menu(o);
  const Information information(fit);
  const bool free_setup = fit.model.setup_translation == SetupTranslation::free;
  const double factor = sigma_factor(fit.chi2(), fit.dof());
  MatrixXd sum = information.of(o, *fit.whitening) / (factor * factor);
  const Eigen::Index before = Information::decided(sum);
  const auto open = static_cast<Eigen::Index>(undecided(fit).cols() + fit.null_vectors.cols());
  const bool with_ball = measured_on_the_table(o);
  NextMeasurement out;
  Eigen::Index now = before;
  for (int step = 0; step < kMostRuns && now - before < open; ++step) {
    const auto best_of = [&](bool ball_only) {
      std::optional<Choice> best;
      for (const PlanRun& run : candidates) {
        if (ball_only && !run.id.starts_with("R-test")) continue;
        const auto data = expand({run}, o.machine(), o.data().context);
        if (!data) continue;
        const Observations planned(o.machine(), *data);
        const Whitening whitening(planned, stated_noise(planned, 0.0, 0.0), free_setup);
        Choice c{run, sum + information.of(planned, whitening)};
        c.decided = Information::decided(c.information);
        c.gain = Information::gain(c.information) - 0.01 * run.minutes;
        if (c.decided > now && (!best || std::pair(c.decided, c.gain) > std::pair(best->decided, best->gain)))
          best = std::move(c);
      }
      return best;
    };
    std::optional<Choice> best = with_ball ? best_of(true) : std::nullopt;
    if (!best) best = best_of(false);
    if (!best) break;
    out.why += (out.runs.empty() ? "'" : " and '") + best->run.id + "'";
    best->run.id.insert(0, "next " + std::to_string(step + 1) + ": ");
    out.minutes += best->run.minutes;
    out.runs.push_back(std::move(best->run));
    sum = std::move(best->information);
    now = best->decided;
  }
  if (out.runs.empty()) return std::nullopt;
  out.why += ", " + short_number(out.minutes) + " min: determines " + std::to_string(now - before) + " of " +
             std::to_string(open) +
             " combinations of parameters that these runs leave open (null directions); until then they are "
             "assumed to be as small as the readings allow.";
  out.wrong_before = out.wrong_after = 0.0;
  return out;
}

}  // namespace trunnion::diagnosis
