#include "thermal/sigma.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace trunnion::thermal {
namespace {

constexpr double kTwoSided95 = 1.959964;  // quantile of the normal distribution
constexpr double kCovered = 0.95;

using Terms = std::array<double, 6>;

Terms terms_of(const Causes& c) {
  return {1.0, c.age_s, c.change_mm * c.change_mm, c.moved, c.unsettled * c.unsettled, c.swing_K * c.swing_K};
}

SigmaModel model_of(const Terms& variance) {
  SigmaModel out;
  out.floor_mm = std::sqrt(variance[0]);
  out.growth_mm_per_sqrt_s = std::sqrt(variance[1]);
  out.per_change = std::sqrt(variance[2]);
  out.per_move_mm = std::sqrt(variance[3]);
  out.per_krpm_mm = std::sqrt(variance[4]);
  out.per_swing_mm = std::sqrt(variance[5]);
  return out;
}

// Variances of the terms by multiplicative steps: each lowers -log of the likelihood and keeps every
// variance above zero (the divergence is that of Itakura and Saito).
Terms fit_variances(const HeldOutRuns& runs, std::size_t without) {
  struct Row {
    Terms z;
    double e2, known2, weight;
  };
  std::vector<Row> rows;
  double mean2 = 0.0;
  double total = 0.0;
  Terms mean_z{};
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if (r == without) continue;
    for (const HeldOut& h : runs[r]) {
      if (h.causes.held) continue;
      const double weight = 1.0 / static_cast<double>(runs[r].size());
      const Terms z = terms_of(h.causes);
      rows.push_back({z, h.error_mm * h.error_mm, std::pow(h.causes.unknown_mm, 2), weight});
      mean2 += weight * rows.back().e2;
      total += weight;
      for (std::size_t k = 0; k < z.size(); ++k) mean_z[k] += weight * z[k];
    }
  }
  Terms out{};
  if (!(mean2 > 0.0)) return out;
  for (std::size_t k = 0; k < out.size(); ++k) out[k] = mean_z[k] > 0.0 ? 0.25 * mean2 / mean_z[k] : 0.0;
  // Not below a hundredth of the whole: no error was ever nothing.
  const double least = 0.01 * mean2 / total;
  constexpr int kSteps = 60;
  for (int step = 0; step < kSteps; ++step) {
    Terms up{};
    Terms down{};
    for (const Row& row : rows) {
      double s2 = row.known2;
      for (std::size_t k = 0; k < out.size(); ++k) s2 += out[k] * row.z[k];
      for (std::size_t k = 0; k < out.size(); ++k) {
        up[k] += row.weight * row.z[k] * row.e2 / (s2 * s2);
        down[k] += row.weight * row.z[k] / s2;
      }
    }
    for (std::size_t k = 0; k < out.size(); ++k) out[k] *= down[k] > 0.0 ? std::sqrt(up[k] / down[k]) : 0.0;
    out[0] = std::max(out[0], least);
  }
  return out;
}

// Sigma of each row of a run, which knows the run's measurements so far; NaN where the last one is held.
std::vector<double> sigmas_of(const std::vector<HeldOut>& run, const SigmaModel& model) {
  RunScale scale;
  std::vector<double> out;
  for (const HeldOut& h : run) {
    out.push_back(h.causes.held ? std::nan("") : model.sigma_mm(h.causes, scale));
    if (h.made_known && !h.causes.held) scale.add(h.error_mm / model.before_run_mm(h.causes));
  }
  return out;
}

// An error in units of sigma, how lively it was, and how much it counts: every run alike.
struct Rated {
  double liveliness = 0.0, in_sigmas = 0.0, weight = 0.0;
};

double weight_of(const std::vector<Rated>& rows) {
  double out = 0.0;
  for (const Rated& row : rows) out += row.weight;
  return out;
}

// The value below which this share of all lies.
double quantile_of(std::vector<Rated> rows, double share) {
  std::sort(rows.begin(), rows.end(),
            [](const Rated& a, const Rated& b) { return a.in_sigmas < b.in_sigmas; });
  const double wanted = share * weight_of(rows);
  double sum = 0.0;
  for (const Rated& row : rows) {
    sum += row.weight;
    if (sum >= wanted) return row.in_sigmas;
  }
  return rows.empty() ? kTwoSided95 : rows.back().in_sigmas;
}

// The errors of a run.
std::vector<Rated> rated(const std::vector<HeldOut>& run, const SigmaModel& model) {
  const auto sigma_mm = sigmas_of(run, model);
  std::vector<Rated> out;
  for (std::size_t i = 0; i < run.size(); ++i) {
    if (run[i].causes.held) continue;
    out.push_back({model.liveliness(run[i].causes), std::abs(run[i].error_mm) / sigma_mm[i], 1.0});
  }
  for (Rated& row : out) row.weight = 1.0 / static_cast<double>(out.size());
  return out;
}

std::vector<Rated> all_but(const std::vector<std::vector<Rated>>& runs, std::size_t without) {
  std::vector<Rated> out;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if (r != without) out.insert(out.end(), runs[r].begin(), runs[r].end());
  }
  return out;
}

double mean_liveliness(const std::vector<Rated>& rows) {
  double sum = 0.0;
  for (const Rated& row : rows) sum += row.weight * row.liveliness;
  return sum / weight_of(rows);
}

// One factor for the quieter half of the rows and one for the livelier: what holds for both together need not
// hold for either ("Mondrian" conformal prediction, Vovk, Gammerman and Shafer 2005, with two classes).
CoverageFactor coverage_factor(std::vector<Rated> rows) {
  CoverageFactor out;
  out.quiet = out.lively = quantile_of(rows, kCovered) / kTwoSided95;
  std::sort(rows.begin(), rows.end(),
            [](const Rated& a, const Rated& b) { return a.liveliness < b.liveliness; });
  const double half = 0.5 * weight_of(rows);
  double sum = 0.0;
  auto middle = rows.begin();
  for (; middle != rows.end() && sum < half; ++middle) sum += middle->weight;
  const std::vector<Rated> quiet(rows.begin(), middle), lively(middle, rows.end());
  if (quiet.empty() || lively.empty()) return out;
  // Halves that hardly differ are one.
  constexpr double kApart = 0.05;
  const double quiet_at = mean_liveliness(quiet), lively_at = mean_liveliness(lively);
  if (lively_at - quiet_at < kApart) return out;
  return {quantile_of(quiet, kCovered) / kTwoSided95, quantile_of(lively, kCovered) / kTwoSided95, quiet_at,
          lively_at};
}

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

// Sigma of each run by the variances of the others, and the prior that fits all of them best.
struct Crossed {
  std::vector<SigmaModel> without;       // [run]
  std::vector<std::vector<Rated>> rows;  // [run], with that prior
  double prior = 0.0;
};

Crossed cross(const HeldOutRuns& runs) {
  Crossed out;
  for (std::size_t r = 0; r < runs.size(); ++r) out.without.push_back(model_of(fit_variances(runs, r)));
  double best = std::numeric_limits<double>::infinity();
  for (const double prior : {2.0, 4.0, 8.0, 16.0, 64.0}) {
    double cost = 0.0;
    std::vector<std::vector<Rated>> scaled;
    for (std::size_t r = 0; r < runs.size(); ++r) {
      SigmaModel model = out.without[r];
      model.prior_measurements = prior;
      scaled.push_back(rated(runs[r], model));
    }
    // Width and misses of the interval that covers as much as is asked for, in sigmas of before the run.
    const double q = quantile_of(all_but(scaled, kNone), kCovered);
    for (std::size_t r = 0; r < runs.size(); ++r) {
      SigmaModel model = out.without[r];
      model.prior_measurements = prior;
      RunScale scale;
      double sum = 0.0;
      for (const HeldOut& h : runs[r]) {
        if (h.causes.held) continue;
        const double half = q * model.sigma_mm(h.causes, scale);
        sum += half + std::max(0.0, std::abs(h.error_mm) - half) / (1.0 - kCovered);
        if (h.made_known) scale.add(h.error_mm / model.before_run_mm(h.causes));
      }
      if (!runs[r].empty()) cost += sum / static_cast<double>(runs[r].size());
    }
    if (cost < best) {
      best = cost;
      out.prior = prior;
      out.rows = std::move(scaled);
    }
  }
  for (SigmaModel& model : out.without) model.prior_measurements = out.prior;
  return out;
}

}  // namespace

SigmaModel fit_sigma(const HeldOutRuns& runs) {
  SigmaModel out = model_of(fit_variances(runs, kNone));
  if (runs.size() < 3) return out;
  const Crossed crossed = cross(runs);
  out.prior_measurements = crossed.prior;
  out.coverage = coverage_factor(all_but(crossed.rows, kNone));
  return out;
}

std::vector<std::vector<double>> held_out_sigmas(const HeldOutRuns& runs) {
  if (runs.size() < 3) return {};
  Crossed crossed = cross(runs);
  std::vector<std::vector<double>> out;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    crossed.without[r].coverage = coverage_factor(all_but(crossed.rows, r));
    out.push_back(sigmas_of(runs[r], crossed.without[r]));
  }
  return out;
}

std::vector<double> coverage_of(const HeldOutRuns& runs, const std::vector<std::vector<double>>& sigma_mm) {
  std::vector<double> out;
  for (std::size_t r = 0; r < sigma_mm.size(); ++r) {
    double within = 0.0;
    double count = 0.0;
    for (std::size_t i = 0; i < runs[r].size(); ++i) {
      if (runs[r][i].causes.held) continue;
      count += 1.0;
      // The limit itself is an error of another run: rounding must not decide.
      constexpr double kRounding = 1e-12;
      if (std::abs(runs[r][i].error_mm) <= (kTwoSided95 + kRounding) * sigma_mm[r][i]) within += 1.0;
    }
    out.push_back(count > 0.0 ? within / count : std::nan(""));
  }
  return out;
}

}  // namespace trunnion::thermal
