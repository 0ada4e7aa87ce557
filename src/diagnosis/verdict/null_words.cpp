#include <array>
#include <charconv>
#include <cmath>

#include "diagnosis/fit/usual_size.hpp"

namespace trunnion::diagnosis {
namespace {

std::string two_digits(double value) {
  std::array<char, 32> buffer;
  const auto r =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::general, 3);
  return {buffer.data(), r.ptr};
}

std::string amount(double value, const Parameter& p) {
  const std::string_view unit = unit_suffix(p.unit);
  return (value < 0.0 ? "" : "+") + two_digits(value / unit_factor(p.unit)) +
         (unit.empty() ? "" : " " + std::string(unit)) + " of " + p.name;
}

// Largest translation of the set-ups that makes up for the combination, if any.
std::string setup_part(const Observations& o, const FitCore& fit, const VectorXd& change) {
  std::array<double, 3> worst{};
  for (const Vec3& t : fit.whitening->setup_of(change))
    for (std::size_t k = 0; k < 3; ++k)
      if (const double v = t[static_cast<Eigen::Index>(k)]; std::abs(v) > std::abs(worst[k])) worst[k] = v;
  std::string out;
  const double all = std::max({std::abs(worst[0]), std::abs(worst[1]), std::abs(worst[2])});
  for (std::size_t k = 0; k < 3; ++k)
    if (all > 1e-9 && std::abs(worst[k]) > 1e-3 * all)
      out += (out.empty() ? "" : ", ") + std::string(1, "XYZ"[k]);
  static_cast<void>(o);
  return out;
}

// Scaled so that the largest part is its parameter's usual magnitude; parts below `least` of theirs left out.
VectorXd to_usual(const FitCore& fit, VectorXd v, double least) {
  VectorXd usual(v.size());
  for (std::size_t k = 0; k < fit.free.size(); ++k) {
    const auto& p = fit.model.effects[fit.free[k].effect].effect->info().parameters[fit.free[k].index];
    usual[static_cast<Eigen::Index>(k)] = std::max(std::abs(p.usual), 1e-12);
  }
  const double largest = v.cwiseAbs().cwiseQuotient(usual).maxCoeff();
  if (largest > 0.0) v /= largest;
  for (Eigen::Index k = 0; k < v.size(); ++k)
    if (std::abs(v[k]) < least * usual[k]) v[k] = 0.0;
  return v;
}

// Of a combination that the readings see, but not down to its usual size.
NullDirection hardly_seen(const FitCore& fit, const VectorXd& direction) {
  constexpr double kSmallPart = 0.1;
  const VectorXd v = to_usual(fit, direction, kSmallPart);
  NullDirection out;
  std::string parts;
  for (std::size_t k = 0; k < fit.free.size(); ++k) {
    const double share = v[static_cast<Eigen::Index>(k)];
    if (share == 0.0) continue;
    const ModelEffect& effect = fit.model.effects[fit.free[k].effect];
    const Parameter& p = effect.effect->info().parameters[fit.free[k].index];
    out.parts.push_back({effect.id(), p.name, share});
    parts += (parts.empty() ? "" : ", ") + amount(share, p) + " (" + effect.id() + ")";
  }
  out.words =
      (out.parts.size() == 1 ? "hardly excited by these runs: " + parts + " changes"
                             : "can hardly be separated by these readings: " + parts + " together change") +
      " the readings by no more than their uncertainty and residual";
  return out;
}

NullDirection describe(const Observations& o, const FitCore& fit, const VectorXd& direction) {
  NullDirection out;
  const VectorXd v = to_usual(fit, direction, 1e-3);
  VectorXd change = VectorXd::Zero(o.size());
  std::string parts;
  for (std::size_t k = 0; k < fit.free.size(); ++k) {
    const double share = v[static_cast<Eigen::Index>(k)];
    const ModelEffect& effect = fit.model.effects[fit.free[k].effect];
    const Parameter& p = effect.effect->info().parameters[fit.free[k].index];
    if (share == 0.0) continue;
    out.parts.push_back({effect.id(), p.name, share});
    parts += (parts.empty() ? "" : ", ") + amount(share, p) + " (" + effect.id() + ")";
    change += share * o.columns(effect).col(static_cast<Eigen::Index>(fit.free[k].index));
  }
  MatrixXd white = change;
  fit.whitening->whiten(white);
  const std::string setup = white.norm() > 1e-6 ? setup_part(o, fit, change) : "";
  if (out.parts.size() == 1 && setup.empty())
    out.words = out.parts[0].parameter + " of " + out.parts[0].effect +
                " is not excited by these runs: no reading changes with it";
  else if (setup.empty())
    out.words = "cannot be told apart: " + parts + " together change no reading";
  else
    out.words = out.parts.size() == 1
                    ? out.parts[0].parameter + " of " + out.parts[0].effect +
                          " and the part's set-up along " + setup + " cannot be told apart: " + parts +
                          " with a shifted set-up changes no reading"
                    : "cannot be told apart from the part's set-up along " + setup + ": " + parts +
                          " with a shifted set-up change no reading";
  return out;
}

}  // namespace

std::vector<NullDirection> null_directions(const Observations& o, const FitCore& fit) {
  std::vector<NullDirection> out;
  for (Eigen::Index k = 0; k < fit.null_vectors.cols(); ++k)
    out.push_back(describe(o, fit, fit.null_vectors.col(k)));
  return out;
}

std::vector<NullDirection> open_directions(const Observations& o, const FitCore& fit) {
  std::vector<NullDirection> out = null_directions(o, fit);
  const MatrixXd hardly = undecided(fit);
  for (Eigen::Index k = 0; k < hardly.cols(); ++k) out.push_back(hardly_seen(fit, hardly.col(k)));
  return out;
}

}  // namespace trunnion::diagnosis
