#include "diagnosis/search/structure.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <set>

#include "trunnion/base/units.hpp"
#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/fit_core.hpp"
#include "diagnosis/search/covariates.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr int kCoarseDegree = 2;
constexpr int kRoughDegree = 24;  // 12 waves along the range: steps, kinks, saw teeth
constexpr int kPairDegree = 4;    // of each of two axes; two harmonics of a rotary one

// The components of the deviation that the readings see, machine axes: displacement x y z or rotation x y z.
std::shared_ptr<const MatrixXd> components(const Observations& o, Quantity quantity) {
  MatrixXd all = MatrixXd::Zero(o.size(), 3);
  for (Eigen::Index i = 0; i < o.size(); ++i)
    if (o.reading(i).quantity == quantity) all.row(i) = o.n_M(i).transpose();
  Eigen::Index seen = 0;
  for (Eigen::Index k = 0; k < 3; ++k)
    if (all.col(k).norm() > 1e-3 * std::sqrt(static_cast<double>(o.size()))) all.col(seen++) = all.col(k);
  return std::make_shared<const MatrixXd>(all.leftCols(seen));
}

MatrixXd direction_column(const Observations& o, AxisId axis) {
  MatrixXd out(o.size(), 1);
  for (Eigen::Index i = 0; i < o.size(); ++i) out(i, 0) = o.state(i).direction[axis];
  return out;
}

class Builder {
 public:
  explicit Builder(const Observations& o)
      : seen_{components(o, Quantity::displacement), components(o, Quantity::rotation)},
        ones_(std::make_shared<const MatrixXd>(MatrixXd::Ones(o.size(), 1))) {}
  void add(const std::string& name, MatrixXd f, int degree, bool pair = false) {
    if (f.cols() == 0) return;
    const auto functions = std::make_shared<const MatrixXd>(std::move(f));
    for (const auto& weights : seen_) {
      const Eigen::Index count = weights->cols();
      if (count > 0) blocks.push_back({name, pair, degree, false, functions, weights, 0, count});
      if (count > 1 && functions->cols() >= kWideEnough) add_each(name, pair, degree, functions, weights);
    }
  }
  /// Blocks of single components only.
  void add_singly(const std::string& name, MatrixXd f, int degree) {
    if (f.cols() == 0) return;
    const auto functions = std::make_shared<const MatrixXd>(std::move(f));
    for (const auto& weights : seen_) add_each(name, false, degree, functions, weights);
  }
  void scalar(const std::string& name, MatrixXd f, int degree) {
    if (f.cols() > 0)
      blocks.push_back(
          {name, false, degree, false, std::make_shared<const MatrixXd>(std::move(f)), ones_, 0, 1});
  }
  std::vector<StructureBlock> blocks;

 private:
  void add_each(const std::string& name, bool pair, int degree,
                const std::shared_ptr<const MatrixXd>& functions,
                const std::shared_ptr<const MatrixXd>& weights) {
    for (Eigen::Index k = 0; k < weights->cols(); ++k)
      blocks.push_back({name, pair, degree, true, functions, weights, k, 1});
  }
  static constexpr Eigen::Index kWideEnough = 4;  // functions: below, a block of all components is as sharp
  std::array<std::shared_ptr<const MatrixXd>, 2> seen_;
  std::shared_ptr<const MatrixXd> ones_;
};

void add_directions(const Observations& o, const std::vector<Covariate>& positions, Builder& out) {
  const auto& axes = o.machine().axes;
  for (AxisId a = 0; a < axes.size(); ++a) {
    const MatrixXd dir = direction_column(o, a);
    if (dir.col(0).cwiseAbs().maxCoeff() == 0.0 || distinct_values(dir.col(0), 4) < 2) continue;
    out.add("direction of " + axes[a].name, dir, 1);
    const Covariate speed =
        covariate(o, "speed", [a](const MachineState& s) { return std::abs(s.velocity[a]); });
    if (speed.distinct > 1)
      out.add("direction of " + axes[a].name + " x velocity",
              column_products(dir, functions(speed, kCoarseDegree)), kCoarseDegree, true);
    for (const Covariate& c : positions)
      if (c.name == axes[a].name)
        out.add("direction of " + c.name + " x " + c.name, column_products(dir, functions(c, 2)), 2, true);
  }
}

// Runs: a level of each (beside the set-up), and a drift of each.
void add_runs(const Observations& o, Builder& out) {
  const std::size_t runs = o.runs().size();
  if (runs * 6 > static_cast<std::size_t>(o.size())) return;
  MatrixXd level = MatrixXd::Zero(o.size(), static_cast<Eigen::Index>(runs)), drift = level;
  for (std::size_t r = 0; r < runs; ++r) {
    const double duration = std::max(o.data().context.runs[r].duration_s, 1e-9);
    for (const Eigen::Index i : o.runs()[r]) {
      level(i, static_cast<Eigen::Index>(r)) = 1.0;
      drift(i, static_cast<Eigen::Index>(r)) = 2.0 * o.state(i).time_s / duration - 1.0;
    }
  }
  if (runs > 1) out.add("run", level, 1);
  if (runs > 1) out.add("time in each run", drift, 1, true);
}

// Lobes of a probe: harmonics of the direction of sensitivity in each coordinate plane of M.
void add_lobes(const Observations& o, Builder& out) {
  for (int k = 0; k < 3; ++k) {
    Covariate angle{"direction of sensitivity", VectorXd::Zero(o.size()), true, 0};
    VectorXd weight = VectorXd::Zero(o.size());
    for (Eigen::Index i = 0; i < o.size(); ++i) {
      if (o.reading(i).quantity != Quantity::displacement) continue;
      const double x = o.n_M(i)[(k + 1) % 3], y = o.n_M(i)[(k + 2) % 3];
      weight[i] = x * x + y * y;
      angle.values[i] = weight[i] > 0.01 ? std::atan2(y, x) : 0.0;
    }
    angle.distinct = distinct_values(angle.values, 40);
    if (angle.distinct < 8) continue;
    MatrixXd f = functions(angle, kFullDegree);
    for (Eigen::Index c = 0; c < f.cols(); ++c) f.col(c) = f.col(c).cwiseProduct(weight);
    out.scalar("direction of sensitivity about " + std::string(1, static_cast<char>('X' + k)), f,
               kFullDegree);
  }
}

}  // namespace

std::vector<StructureBlock> structure_blocks(const Observations& o) {
  Builder out(o);
  const auto positions = axis_covariates(o);
  auto covariates = positions;
  for (Covariate& c : state_covariates(o)) covariates.push_back(std::move(c));
  for (const Covariate& c : covariates) {
    if (c.distinct > 3) out.add(c.name, functions(c, kCoarseDegree), kCoarseDegree);
    out.add(c.name, functions(c, kFullDegree), kFullDegree);
  }
  for (const Covariate& c : positions)
    if (c.periodic && c.distinct > 5)
      for (int k = 3; k <= kHarmonics; ++k) out.add(c.name, harmonic(c, k), k);
  for (const Covariate& c : covariates)
    if (c.distinct > std::size_t{2} * kFullDegree)
      out.add_singly(c.name, waves(c, kRoughDegree), kRoughDegree);
  add_directions(o, positions, out);
  add_runs(o, out);
  add_lobes(o, out);
  for (std::size_t i = 0; i < positions.size(); ++i)
    for (std::size_t k = i + 1; k < positions.size(); ++k)
      out.add(positions[i].name + " x " + positions[k].name,
              column_products(functions(positions[i], kCoarseDegree), functions(positions[k], kCoarseDegree)),
              kCoarseDegree, true);
  for (std::size_t i = 0; i < positions.size(); ++i)
    for (std::size_t k = i + 1; k < positions.size(); ++k)
      if (joint_variation(positions[i].values, positions[k].values) >= kPairDegree)
        out.add(positions[i].name + " x " + positions[k].name,
                column_products(functions(positions[i], kPairDegree), functions(positions[k], kPairDegree)),
                kPairDegree, true);
  return std::move(out.blocks);
}

int joint_variation(const VectorXd& a, const VectorXd& b) {
  constexpr int kBins = 8;
  const auto bins = [](const VectorXd& v) {
    const double low = v.minCoeff(), range = v.maxCoeff() - low;
    std::vector<int> out(static_cast<std::size_t>(v.size()), 0);
    for (Eigen::Index i = 0; range > 0.0 && i < v.size(); ++i)
      out[static_cast<std::size_t>(i)] = std::min(kBins - 1, static_cast<int>((v[i] - low) / range * kBins));
    return out;
  };
  const std::vector<int> in_a = bins(a), in_b = bins(b);
  // Rows and columns of bins as nodes of a graph, occupied bins as its edges: a sum of one function each has
  // as many free values as nodes less parts; every further edge shows something of a product.
  std::array<int, std::size_t{2} * kBins> parent{};
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&parent](int k) {
    while (parent[static_cast<std::size_t>(k)] != k) k = parent[static_cast<std::size_t>(k)];
    return k;
  };
  std::set<std::pair<int, int>> places;
  for (std::size_t i = 0; i < in_a.size(); ++i) places.emplace(in_a[i], kBins + in_b[i]);
  int cycles = 0;
  for (const auto& [x, y] : places) {
    const int from = root(x), to = root(y);
    if (from == to)
      ++cycles;
    else
      parent[static_cast<std::size_t>(from)] = to;
  }
  return cycles;
}

MatrixXd StructureBlock::columns() const {
  return column_products(weights->middleCols(first, count), *functions);
}

MatrixXd smooth_surrogate(const Observations& o, const FitCore& fit, Eigen::Index limit) {
  return smooth_surrogate(structure_blocks(o), fit, limit);
}

MatrixXd smooth_surrogate(std::vector<StructureBlock> blocks, const FitCore& fit, Eigen::Index limit) {
  std::stable_sort(blocks.begin(), blocks.end(), [](const StructureBlock& a, const StructureBlock& b) {
    return std::pair(a.pair, a.degree) < std::pair(b.pair, b.degree);
  });
  MatrixXd out(fit.white.size(), limit);
  Eigen::Index at = 0;
  for (const StructureBlock& block : blocks) {
    if (block.single || at + block.width() > limit) continue;
    const MatrixXd columns = fit.projected(block.columns());
    std::vector<Eigen::Index> left;  // levels of runs, for one, are in the set-ups mostly
    for (Eigen::Index k = 0; k < columns.cols(); ++k)
      if (columns.col(k).squaredNorm() > 0.0) left.push_back(k);
    const auto width = static_cast<Eigen::Index>(left.size());
    out.middleCols(at, width) = columns(Eigen::all, left);
    at += width;
  }
  return out.leftCols(at);
}

}  // namespace trunnion::diagnosis
