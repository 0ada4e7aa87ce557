#include "probe/lobes.hpp"

#include <Eigen/Core>
#include <array>
#include <cmath>

#include "trunnion/geom/linear_algebra.hpp"

namespace trunnion::probe {
namespace {

constexpr std::array kLobeCounts = {2, 3, 4};
// Bayesian information criterion by which lobes must be better than none: odds of 150 to 1 (Kass and Raftery,
// 1995).
constexpr double kStrongEvidence = 10.0;
// A column of which the centres take more than this share is not told from a shifted centre.
constexpr double kLeastLeft = 0.2;
constexpr double kLobeTimesU = 3.0;

struct LobeFit {
  std::vector<Lobes> lobes;
  double criterion = 0.0;
};

double azimuth_of(const Vec3& n) {
  return std::atan2(n.y(), n.x());
}
double lean_of(const Vec3& n) {
  return std::hypot(n.x(), n.y());
}

// The residuals of all touches, and what a radius and lobes of some counts change of them, each without what
// the centre of its pose takes of it.
struct LobeRows {
  Eigen::VectorXd residuals;
  Eigen::MatrixXd left;   // 1, then cos and sin of each count
  Eigen::VectorXd whole;  // lengths of the columns before the centres took their part
};

LobeRows lobe_rows(const std::vector<std::vector<Vec3>>& sets, const CommonSpheres& common) {
  Eigen::Index count = 0;
  for (const auto& set : sets) count += static_cast<Eigen::Index>(set.size());
  constexpr Eigen::Index kColumns = 1 + 2 * static_cast<Eigen::Index>(kLobeCounts.size());
  LobeRows out{Eigen::VectorXd(count), Eigen::MatrixXd(count, kColumns), Eigen::VectorXd::Zero(kColumns)};
  Eigen::Index first = 0;
  for (std::size_t pose = 0; pose < sets.size(); ++pose) {
    const Sphere& sphere = common.spheres[pose];
    const auto size = static_cast<Eigen::Index>(sets[pose].size());
    Eigen::MatrixXd n(size, 3);
    Eigen::MatrixXd columns(size, kColumns);
    for (Eigen::Index i = 0; i < size; ++i) {
      const Vec3 d = (sets[pose][static_cast<std::size_t>(i)] - sphere.center_mm).normalized();
      n.row(i) = d.transpose();
      columns(i, 0) = 1.0;
      for (std::size_t k = 0; k < kLobeCounts.size(); ++k) {
        const double angle = kLobeCounts[k] * azimuth_of(d);
        columns(i, 1 + 2 * static_cast<Eigen::Index>(k)) = lean_of(d) * std::cos(angle);
        columns(i, 2 + 2 * static_cast<Eigen::Index>(k)) = lean_of(d) * std::sin(angle);
      }
      out.residuals[first + i] = sphere.residuals_mm[static_cast<std::size_t>(i)];
    }
    out.whole += columns.colwise().squaredNorm().transpose();
    out.left.middleRows(first, size) = columns - n * sphere.center_cofactor * (n.transpose() * columns);
    first += size;
  }
  out.whole = out.whole.cwiseSqrt();
  return out;
}

// With the lobes of `which`, a bit for each count; nothing where the centres take them.
std::optional<LobeFit> fit_of_lobes(const LobeRows& rows, unsigned which, std::size_t poses) {
  std::vector<Eigen::Index> columns = {0};
  for (std::size_t k = 0; k < kLobeCounts.size(); ++k) {
    if ((which >> k & 1U) == 0) continue;
    columns.push_back(1 + 2 * static_cast<Eigen::Index>(k));
    columns.push_back(2 + 2 * static_cast<Eigen::Index>(k));
  }
  Eigen::MatrixXd x(rows.left.rows(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (!(rows.whole[columns[i]] > 0.0)) return std::nullopt;
    x.col(static_cast<Eigen::Index>(i)) = rows.left.col(columns[i]) / rows.whole[columns[i]];
  }
  const Svd svd = thin_svd(x);
  const bool lobed = which != 0;
  // The radius alone is always told; what the centres leave of it is another matter.
  if (lobed && !(svd.s.tail<1>()[0] > kLeastLeft)) return std::nullopt;
  const Eigen::VectorXd by = svd.solve(rows.residuals);
  const double squares = (rows.residuals - x * by).squaredNorm();
  const auto count = static_cast<double>(rows.residuals.size()) - 3.0 * static_cast<double>(poses);
  const auto parameters = static_cast<double>(columns.size());
  if (!(count > parameters + 1.0) || !(squares > 0.0)) return std::nullopt;
  LobeFit out;
  out.criterion = count * std::log(squares / count) + parameters * std::log(count);
  const Eigen::MatrixXd cofactor = inverse_of(x.transpose() * x);
  const double variance = squares / (count - parameters);
  for (Eigen::Index i = 1, k = 0; i < static_cast<Eigen::Index>(columns.size()); i += 2) {
    while ((which >> k & 1U) == 0) ++k;
    Lobes one;
    one.count = kLobeCounts[static_cast<std::size_t>(k++)];
    const auto scale = [&](Eigen::Index at) { return rows.whole[columns[static_cast<std::size_t>(at)]]; };
    one.cos_mm = by[i] / scale(i);
    one.sin_mm = by[i + 1] / scale(i + 1);
    one.u_mm = std::sqrt(variance * std::max(cofactor(i, i) / (scale(i) * scale(i)),
                                             cofactor(i + 1, i + 1) / (scale(i + 1) * scale(i + 1))));
    if (!(one.size_mm() > kLobeTimesU * one.u_mm)) return std::nullopt;
    out.lobes.push_back(one);
  }
  return out;
}

}  // namespace

double lobes_mm(const std::vector<Lobes>& lobes, const Vec3& n) {
  double sum = 0.0;
  for (const Lobes& one : lobes) {
    const double angle = one.count * azimuth_of(n);
    sum += one.cos_mm * std::cos(angle) + one.sin_mm * std::sin(angle);
  }
  return sum * lean_of(n);
}

std::vector<Lobes> find_lobes(const std::vector<std::vector<Vec3>>& sets_mm, const CommonSpheres& common) {
  const LobeRows rows = lobe_rows(sets_mm, common);
  const auto none = fit_of_lobes(rows, 0, sets_mm.size());
  if (!none) return {};
  LobeFit best = *none;
  best.criterion -= kStrongEvidence;
  for (unsigned which = 1; which < 1U << kLobeCounts.size(); ++which) {
    const auto one = fit_of_lobes(rows, which, sets_mm.size());
    if (one && one->criterion < best.criterion) best = *one;
  }
  return best.lobes;
}

std::vector<std::vector<Vec3>> without_lobes(std::vector<std::vector<Vec3>> sets_mm,
                                             const CommonSpheres& common, const std::vector<Lobes>& lobes) {
  for (std::size_t pose = 0; pose < sets_mm.size(); ++pose) {
    for (Vec3& p : sets_mm[pose]) {
      const Vec3 n = (p - common.spheres[pose].center_mm).normalized();
      p -= lobes_mm(lobes, n) * n;
    }
  }
  return sets_mm;
}

}  // namespace trunnion::probe
