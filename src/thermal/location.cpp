#include "trunnion/thermal/location.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "trunnion/effects/deviation.hpp"
#include "trunnion/geom/linear_algebra.hpp"

namespace trunnion::thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Poses are set to some arc seconds at best: a direction a thousandfold weaker than the strongest is not
// measured.
constexpr double kWeakest = 1e-3;

struct Column {
  std::string name;
  Link link;
  Vec3 direction;  // of the translation, in the axes of the link
  bool of_axis = false;
  std::optional<AxisId> inner;  // the rotary axis that this one carries, which stays where it is
};

// Three translations of the tool, then two across each rotary axis: those of X, Y, Z that the axis is least
// along.
std::vector<Column> columns_of(const Machine& machine) {
  constexpr std::array kLetters = {"X", "Y", "Z"};
  constexpr std::array kSmall = {"x", "y", "z"};
  std::vector<Column> out;
  for (Index i = 0; i < 3; ++i)
    out.push_back({std::string("tool_") + kSmall[static_cast<std::size_t>(i)],
                   {Link::Kind::spindle, 0},
                   Vec3::Unit(i),
                   false,
                   {}});
  const auto rotary = machine.rotary_axes();
  for (std::size_t k = 0; k < rotary.size(); ++k) {
    const Axis& axis = machine.axes[rotary[k]];
    Index along = 0;
    axis.direction.cwiseAbs().maxCoeff(&along);
    for (Index i = 0; i < 3; ++i) {
      if (i == along) continue;
      Column column{kLetters[static_cast<std::size_t>(i)] + std::string("0") + axis.name,
                    {Link::Kind::joint, rotary[k]},
                    Vec3::Unit(i),
                    true,
                    {}};
      if (k + 1 < rotary.size()) column.inner = rotary[k + 1];
      out.push_back(std::move(column));
    }
  }
  return out;
}

// Deviation in M at q for a unit of the column, with the datum's part taken off.
Vec3 deviation(const Machine& machine, const Column& column, const JointVector& q,
               const std::optional<JointVector>& probed_at) {
  const Twist unit{column.direction, Vec3::Zero()};
  // Twists of the chain are relative to the axis before: an axis that moves alone takes its shift back at the
  // next one.
  const auto at = [&](const JointVector& pose) {
    const DeviationMap map(machine, pose, machine.tool_vector());
    Vec3 d_P = map.linear_P(column.link, unit).displacement_mm;
    if (column.inner) d_P -= map.linear_P({Link::Kind::joint, *column.inner}, unit).displacement_mm;
    return d_P;
  };
  Vec3 d_P = at(q);
  if (column.of_axis && probed_at) d_P -= at(*probed_at);
  return part_in_machine(machine, q).R * d_P;
}

// "tool_x, X0C": what a null vector mixes, largest first.
std::string in_words(const VectorXd& direction, const std::vector<Column>& columns) {
  constexpr double kPart = 0.1;
  std::vector<std::size_t> order;
  for (std::size_t j = 0; j < columns.size(); ++j) {
    if (std::abs(direction[static_cast<Index>(j)]) > kPart) order.push_back(j);
  }
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::abs(direction[static_cast<Index>(a)]) > std::abs(direction[static_cast<Index>(b)]);
  });
  std::string out;
  for (std::size_t i = 0; i < order.size(); ++i)
    out += (i == 0 ? "" : i + 1 == order.size() ? " and " : ", ") + columns[order[i]].name;
  return out + (order.size() > 1 ? " cannot be told apart at these poses" : " has no effect at these poses");
}

}  // namespace

const DriftParameter* DriftSplit::find(std::string_view name) const {
  const auto it = std::find_if(parameters.begin(), parameters.end(),
                               [&](const DriftParameter& p) { return p.name == name; });
  return it == parameters.end() ? nullptr : &*it;
}

std::optional<Vec3> DriftSplit::deviation_M(const Machine& machine, const JointVector& q,
                                            const std::optional<JointVector>& probed_at) const {
  const auto columns = columns_of(machine);
  MatrixXd X(3, static_cast<Index>(columns.size()));
  VectorXd value(X.cols());
  for (Index j = 0; j < X.cols(); ++j) {
    X.col(j) = deviation(machine, columns[static_cast<std::size_t>(j)], q, probed_at);
    value[j] = parameters[static_cast<std::size_t>(j)].value_mm;
  }
  // What the readings left open must not move the tool here.
  if (null_space.cols() > 0 && (X * null_space).norm() > kWeakest) return std::nullopt;
  return Vec3(X * value);
}

Result<DriftSplit> split_drift(const Machine& machine, const std::vector<DriftReading>& readings,
                               const std::optional<JointVector>& probed_at) {
  if (readings.empty()) return fail(ErrorCode::wrong_input, "no readings to split");
  const auto columns = columns_of(machine);
  MatrixXd X(static_cast<Index>(readings.size()), static_cast<Index>(columns.size()));
  VectorXd y(X.rows());
  for (Index i = 0; i < X.rows(); ++i) {
    const DriftReading& reading = readings[static_cast<std::size_t>(i)];
    if (!(reading.u_mm > 0.0))
      return fail(ErrorCode::wrong_input, "the uncertainty of a reading must be above zero");
    for (Index j = 0; j < X.cols(); ++j) {
      X(i, j) =
          reading.n_M.dot(deviation(machine, columns[static_cast<std::size_t>(j)], reading.q, probed_at)) /
          reading.u_mm;
    }
    y[i] = reading.value_mm / reading.u_mm;
  }
  const Svd svd = full_svd(X);
  const VectorXd& s = svd.s;
  // Poses are set to some arc seconds at best: a direction a thousandfold weaker than the strongest is not
  // measured.
  constexpr double kWeakest = 1e-3;
  DriftSplit out;
  while (out.rank < s.size() && s[out.rank] > kWeakest * s[0]) ++out.rank;
  out.condition = out.rank > 0 ? s[0] / s[out.rank - 1] : 0.0;
  const MatrixXd V = svd.V.leftCols(out.rank);
  const VectorXd inverse = s.head(out.rank).cwiseInverse();
  const VectorXd value = V * inverse.asDiagonal() * svd.U.leftCols(out.rank).transpose() * y;
  // A basis of the null space in which each vector mixes as few parameters as possible.
  const MatrixXd null = svd.V.rightCols(X.cols() - out.rank);
  for (Index j = 0; j < X.cols(); ++j) {
    DriftParameter p;
    p.name = columns[static_cast<std::size_t>(j)].name;
    p.identifiable = null.cols() == 0 || null.row(j).norm() < kWeakest;
    p.value_mm = value[j];
    p.sigma_mm = (V.row(j).transpose().cwiseProduct(inverse)).norm();
    out.parameters.push_back(std::move(p));
  }
  if (null.cols() > 0) {
    const MatrixXd reduced = row_echelon(null.transpose());
    for (Index k = 0; k < reduced.rows(); ++k)
      out.null_directions.push_back(in_words(reduced.row(k).transpose().normalized(), columns));
  }
  out.null_space = null;
  const VectorXd residual = y - X * value;
  double sum = 0.0;
  for (Index i = 0; i < residual.size(); ++i)
    sum += std::pow(residual[i] * readings[static_cast<std::size_t>(i)].u_mm, 2);
  out.rms_mm = std::sqrt(sum / static_cast<double>(residual.size()));
  return out;
}

PaperAngles paper_offset_to_angles(const Vec3& offset_mm) {
  const double across = std::hypot(offset_mm.x(), offset_mm.y());
  return {Angle::radians(std::atan2(across, offset_mm.z())),
          Angle::radians(std::atan2(offset_mm.x(), offset_mm.y()))};
}

}  // namespace trunnion::thermal
