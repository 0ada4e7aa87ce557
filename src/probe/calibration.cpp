#include "trunnion/probe/calibration.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "trunnion/base/number_text.hpp"
#include "trunnion/geom/linear_algebra.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/probe/axis_lines.hpp"

#include "probe/small_errors.hpp"

namespace trunnion::probe {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

// What a machine file may be wrong by: so weak that readings of a hundredth of a millimetre outweigh it a
// million times, and enough to keep what the poses do not tell where it was.
constexpr double kPoint_mm = 20.0;
constexpr double kDirection_rad = 5.0 * kRadPerDegree;
constexpr double kBall_mm = 100.0;
// Of linear axes as machines have them: 50 urad of squareness, 30 um over a metre.
constexpr double kSquareness_rad = 50e-6;
constexpr double kScale = 30e-6;
// An offset that nobody knows anything of.
constexpr double kUnknownOffset_mm = 10.0;
// Share of what was not known before that is left of a number that the poses do not tell.
constexpr double kUnseenShare = 0.3;
constexpr int kMostSteps = 50;
constexpr Eigen::Index kStrains = 6;

// A state of the fit: the machine, and what is fitted beside it.
struct State {
  Machine machine;
  Vector beside;  // shifts of the balls, linear axes, offsets of groups
};

class Fit {
 public:
  Fit(const Machine& nominal, const diagnosis::Dataset& data) : nominal_(nominal), data_(data) {
    for (const auto& reading : data.readings) {
      if (reading.quantity == diagnosis::Quantity::displacement) readings_.push_back(&reading);
    }
    for (const auto* reading : readings_) {
      runs_.insert(data.run_of(*reading));
      if (!reading->u_common || *reading->u_common > 0.0) groups_.insert(reading->group);
      const Pose X = forward_at(nominal_, *reading);
      nominal_tips_.push_back(X.p);
      const JointVector q = data.track.state(reading->row).q;
      const Mat3 R_PM = part_in_machine(nominal_, q).R.transpose();
      n_P_.push_back(reading->frame == diagnosis::SensitivityFrame::part ? reading->n
                                                                         : Vec3(R_PM * reading->n));
      way_.push_back(linear_way(q));
    }
    Vec3 mean = Vec3::Zero();
    for (const Vec3& w : way_) mean += w / static_cast<double>(std::max<std::size_t>(way_.size(), 1));
    for (Vec3& w : way_) w -= mean;
  }

  std::size_t size() const { return readings_.size(); }
  Eigen::Index beside_count() const {
    return ball_count() + kStrains + static_cast<Eigen::Index>(groups_.size());
  }
  Eigen::Index ball_count() const { return 3 * static_cast<Eigen::Index>(runs_.size()); }
  const std::set<std::size_t>& runs() const { return runs_; }

  // Readings as they would be, less those that were taken, each over its standard uncertainty.
  Vector residuals(const State& state) const {
    Vector out(static_cast<Eigen::Index>(size()));
    for (std::size_t i = 0; i < size(); ++i) {
      const auto& reading = *readings_[i];
      out[static_cast<Eigen::Index>(i)] = (predicted(state, i) - reading.value) / reading.u_random;
    }
    return out;
  }

  double rms_mm(const State& state) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < size(); ++i) {
      const double r = predicted(state, i) - readings_[i]->value;
      sum += r * r;
    }
    return std::sqrt(sum / static_cast<double>(size()));
  }

  // The run whose readings are off by most of their uncertainties, and by how much they are off.
  std::pair<std::size_t, double> worst_run(const State& state) const {
    struct Sums {
      double squares = 0.0, in_sigmas = 0.0, readings = 0.0;
    };
    std::map<std::size_t, Sums> of_runs;
    for (std::size_t i = 0; i < size(); ++i) {
      const double r = predicted(state, i) - readings_[i]->value;
      Sums& sums = of_runs[data_.run_of(*readings_[i])];
      sums.squares += r * r;
      sums.in_sigmas += std::pow(r / readings_[i]->u_random, 2);
      sums.readings += 1.0;
    }
    const auto worst = std::max_element(of_runs.begin(), of_runs.end(), [](const auto& a, const auto& b) {
      return a.second.in_sigmas / a.second.readings < b.second.in_sigmas / b.second.readings;
    });
    return {worst->first, std::sqrt(worst->second.squares / worst->second.readings)};
  }

  // What is known beforehand of a number beside the lines.
  double sigma_beside(Eigen::Index i) const {
    if (i < ball_count()) return kBall_mm;
    if (i < ball_count() + kStrains) return i - ball_count() < 3 ? kSquareness_rad : kScale;
    auto group = groups_.begin();
    std::advance(group, i - ball_count() - kStrains);
    for (const auto* reading : readings_) {
      if (reading->group == *group) return reading->u_common.value_or(kUnknownOffset_mm);
    }
    return kUnknownOffset_mm;
  }

  struct Solved {
    State state;
    double cost = 0.0;  // of the readings and of what is known beforehand
    double chi2 = 0.0;  // of the readings
    Matrix covariance;  // of the lines, four an axis, then of what is beside them
    double freedom = 0.0;
    bool converged = false;
  };

  // From these senses of the rotary axes.
  Solved solve(const Machine& start) const {
    Solved out;
    out.state = {start, Vector::Zero(beside_count())};
    double cost = cost_of(out.state, start);
    double damping = 1e-6;
    for (int step = 0; step < kMostSteps; ++step) {
      const AxisLines lines(out.state.machine);
      const Matrix J = derivative(out.state, lines);
      Vector gradient = J.transpose() * residuals(out.state);
      Matrix normal = J.transpose() * J;
      add_knowledge(out.state, start, lines, normal, gradient);
      bool better = false;
      double by = 0.0;
      while (!better && damping < 1e12) {
        Matrix damped = normal;
        damped.diagonal() *= 1.0 + damping;
        const Vector move = -solve_positive(damped, gradient);
        State next{lines.moved(move.head(lines.count())), out.state.beside + move.tail(beside_count())};
        const double now = cost_of(next, start);
        if (std::isfinite(now) && now <= cost + 1e-12 * std::max(cost, 1.0)) {
          by = cost - now;
          out.state = std::move(next);
          cost = now;
          damping = std::max(damping * 0.1, 1e-12);
          better = true;
        } else {
          damping *= 10.0;
        }
      }
      if (!better || by < 1e-9 * std::max(cost, 1.0)) {
        out.converged = true;
        break;
      }
    }
    out.cost = cost;
    return out;
  }

  // What is said of the fit, with small errors of the machine in mind, and the last step that it makes.
  void finish(Solved& out, const Machine& start) const {
    const AxisLines lines(out.state.machine);
    LinearFit fit;
    fit.u = Vector(static_cast<Eigen::Index>(size()));
    for (std::size_t i = 0; i < size(); ++i) fit.u[static_cast<Eigen::Index>(i)] = readings_[i]->u_random;
    fit.J = fit.u.asDiagonal() * derivative(out.state, lines);
    fit.residuals = -fit.u.cwiseProduct(residuals(out.state));
    fit.precision = Vector(fit.J.cols());
    fit.expected = Vector(fit.J.cols());
    fit.expected << -moved_since(out.state, start, lines), -out.state.beside;
    for (Eigen::Index i = 0; i < fit.J.cols(); ++i) {
      const double sigma = i < lines.count() ? sigma_of_line(i) : sigma_beside(i - lines.count());
      fit.precision[i] = 1.0 / (sigma * sigma);
    }
    const Averaged averaged = average(fit, small_errors());
    out.state = {lines.moved(averaged.x.head(lines.count())),
                 out.state.beside + averaged.x.tail(beside_count())};
    out.covariance = averaged.covariance;
    out.chi2 = residuals(out.state).squaredNorm();
    Matrix normal = fit.J.transpose() * fit.u.cwiseAbs2().cwiseInverse().asDiagonal() * fit.J;
    const Matrix of_data = normal;
    normal.diagonal() += fit.precision;
    out.freedom = static_cast<double>(size()) - solve_positive_all(normal, of_data).trace();
  }

 private:
  Pose forward_at(const Machine& machine, const diagnosis::Reading& reading) const {
    return forward(machine, data_.track.state(reading.row).q, data_.rows[reading.row].tool_mm);
  }

  // Of the tool relative to the part, by the linear axes.
  Vec3 linear_way(const JointVector& q) const {
    Vec3 out = Vec3::Zero();
    for (AxisId id = 0; id < nominal_.axes.size(); ++id) {
      const Axis& axis = nominal_.axes[id];
      if (axis.kind == AxisKind::linear) out += (axis.carries_part ? -q[id] : q[id]) * axis.direction;
    }
    return out;
  }

  // Errors in each direction of M that are functions of one axis each.
  SmallErrors small_errors() const {
    constexpr std::array kLengths_mm = {25.0, 60.0, 150.0, 400.0};
    constexpr double kLength_rad = 0.8;
    SmallErrors out;
    const auto n = static_cast<Eigen::Index>(size());
    std::vector<Vec3> n_M;
    std::vector<JointVector> q;
    for (std::size_t i = 0; i < size(); ++i) {
      q.push_back(data_.track.state(readings_[i]->row).q);
      n_M.push_back(part_in_machine(nominal_, q.back()).R * n_P_[i]);
    }
    const auto sum = [&](AxisKind kind, double length) {
      Matrix K = Matrix::Zero(n, n);
      for (Eigen::Index i = 0; i < n; ++i) {
        for (Eigen::Index j = 0; j <= i; ++j) {
          const auto a = static_cast<std::size_t>(i);
          const auto b = static_cast<std::size_t>(j);
          double total = 0.0;
          for (AxisId id = 0; id < nominal_.axes.size(); ++id) {
            if (nominal_.axes[id].kind != kind) continue;
            const double by = q[a][id] - q[b][id];
            const double way = kind == AxisKind::rotary ? 2.0 * std::sin(0.5 * by) : by;
            total += std::exp(-0.5 * way * way / (length * length));
          }
          K(i, j) = K(j, i) = n_M[a].dot(n_M[b]) * total;
        }
      }
      return K;
    };
    for (const double length : kLengths_mm) out.of_linear_axes.push_back(sum(AxisKind::linear, length));
    out.of_rotary_axes = sum(AxisKind::rotary, kLength_rad);
    return out;
  }

  double predicted(const State& state, std::size_t i) const {
    const auto& reading = *readings_[i];
    const JointVector q = data_.track.state(reading.row).q;
    const Vector& b = state.beside;
    const Eigen::Index at = ball_count();
    // Squareness C0Y, B0Z, A0Z and scale as ISO 230-1 counts them: X as it is, the others beside it.
    const Vec3& w = way_[i];
    const Vec3 off_M(b[at + 3] * w.x() - b[at] * w.y() + b[at + 1] * w.z(),
                     b[at + 4] * w.y() - b[at + 2] * w.z(), b[at + 5] * w.z());
    const Vec3 tip_P =
        forward_at(state.machine, reading).p + part_in_machine(state.machine, q).R.transpose() * off_M;
    const auto run =
        static_cast<Eigen::Index>(std::distance(runs_.begin(), runs_.find(data_.run_of(reading))));
    double out = n_P_[i].dot(tip_P - b.segment<3>(3 * run) - nominal_tips_[i]);
    if (const auto group = groups_.find(reading.group); group != groups_.end())
      out += b[at + kStrains + static_cast<Eigen::Index>(std::distance(groups_.begin(), group))];
    return out;
  }

  Matrix derivative(const State& state, const AxisLines& lines) const {
    constexpr double kBy = 1e-5;
    Matrix out(static_cast<Eigen::Index>(size()), lines.count() + beside_count());
    Vector by = Vector::Zero(lines.count());
    for (Eigen::Index i = 0; i < lines.count(); ++i) {
      by[i] = kBy;
      const Vector ahead = residuals({lines.moved(by), state.beside});
      by[i] = -kBy;
      out.col(i) = (ahead - residuals({lines.moved(by), state.beside})) / (2.0 * kBy);
      by[i] = 0.0;
    }
    // What is beside the lines acts linearly.
    const Vector here = residuals(state);
    State other = state;
    for (Eigen::Index i = 0; i < beside_count(); ++i) {
      other.beside[i] += 1.0;
      out.col(lines.count() + i) = residuals(other) - here;
      other.beside[i] = state.beside[i];
    }
    return out;
  }

  // How far the lines have moved from where the fit began, across them.
  static Vector moved_since(const State& state, const Machine& start, const AxisLines& lines) {
    Vector out(lines.count());
    for (std::size_t k = 0; k < lines.axes().size(); ++k) {
      const Axis& now = state.machine.axes[lines.axes()[k]];
      const Axis& then = start.axes[lines.axes()[k]];
      const auto& [u, v] = lines.across(k);
      const Eigen::Index at = AxisLines::kEach * static_cast<Eigen::Index>(k);
      const Vec3 point = now.point_mm - then.point_mm;
      const Vec3 turn = now.direction - then.direction;
      out.segment<4>(at) << point.dot(u), point.dot(v), turn.dot(u), turn.dot(v);
    }
    return out;
  }
  static double sigma_of_line(Eigen::Index i) {
    return i % AxisLines::kEach < 2 ? kPoint_mm : kDirection_rad;
  }

  double cost_of(const State& state, const Machine& start) const {
    double sum = residuals(state).squaredNorm();
    const AxisLines lines(state.machine);
    const Vector moved = moved_since(state, start, lines);
    for (Eigen::Index i = 0; i < moved.size(); ++i) sum += std::pow(moved[i] / sigma_of_line(i), 2);
    for (Eigen::Index i = 0; i < beside_count(); ++i) sum += std::pow(state.beside[i] / sigma_beside(i), 2);
    return sum;
  }

  void add_knowledge(const State& state, const Machine& start, const AxisLines& lines, Matrix& normal,
                     Vector& gradient) const {
    const Vector moved = moved_since(state, start, lines);
    for (Eigen::Index i = 0; i < normal.rows(); ++i) {
      const bool of_line = i < lines.count();
      const double sigma = of_line ? sigma_of_line(i) : sigma_beside(i - lines.count());
      const double weight = 1.0 / (sigma * sigma);
      normal(i, i) += weight;
      gradient[i] += weight * (of_line ? moved[i] : state.beside[i - lines.count()]);
    }
  }

  const Machine& nominal_;
  const diagnosis::Dataset& data_;
  std::vector<const diagnosis::Reading*> readings_;
  std::set<std::size_t> runs_, groups_;
  std::vector<Vec3> nominal_tips_, n_P_, way_;
};

Machine with_senses(const Machine& machine, unsigned turned) {
  Machine out = machine;
  const auto axes = machine.rotary_axes();
  for (std::size_t k = 0; k < axes.size(); ++k) {
    if ((turned >> k & 1U) != 0) out.axes[axes[k]].direction *= -1.0;
  }
  return out;
}

std::string listed(const std::vector<std::string>& names) {
  std::string out;
  for (std::size_t i = 0; i < names.size(); ++i)
    out += (i == 0 ? "" : i + 1 < names.size() ? ", " : " and ") + names[i];
  return out;
}

std::string component_of(const Vec3& v) {
  Eigen::Index at = 0;
  return v.cwiseAbs().maxCoeff(&at) > 0.0 ? std::string(1, "xyz"[at]) : "x";
}

// Names, values and standard uncertainties of what was fitted.
void name_estimates(const Machine& nominal, const diagnosis::Dataset& data, const Fit& fit,
                    const Fit::Solved& best, Calibration& out) {
  const AxisLines lines(best.state.machine);
  const auto sigma = [&](Eigen::Index i) { return std::sqrt(best.covariance(i, i)); };
  for (std::size_t k = 0; k < lines.axes().size(); ++k) {
    const Axis& now = out.machine.axes[lines.axes()[k]];
    const Axis& was = nominal.axes[lines.axes()[k]];
    for (Eigen::Index j = 0; j < AxisLines::kEach; ++j) {
      const Eigen::Index i = AxisLines::kEach * static_cast<Eigen::Index>(k) + j;
      const bool point = j < 2;
      const Vec3& across = lines.across(k)[static_cast<std::size_t>(j % 2)];
      Eigen::Index component = 0;
      across.cwiseAbs().maxCoeff(&component);
      Estimate one;
      one.name = now.name + (point ? ".point_" : ".direction_") + component_of(across) + (point ? "_mm" : "");
      one.was = point ? was.point_mm[component] : was.direction[component];
      one.value = point ? now.point_mm[component] : now.direction[component];
      one.sigma = sigma(i);
      one.seen = std::sqrt(best.covariance(i, i)) < kUnseenShare * (point ? kPoint_mm : kDirection_rad);
      out.estimates.push_back(one);
    }
  }
  Eigen::Index at = lines.count();
  for (const std::size_t run : fit.runs()) {
    for (int k = 0; k < 3; ++k, ++at) {
      out.estimates.push_back({"ball." + data.context.runs[run].id + "." + "xyz"[k] + "_mm", 0.0,
                               best.state.beside[at - lines.count()], sigma(at),
                               std::sqrt(best.covariance(at, at)) < kUnseenShare * kBall_mm});
    }
  }
  static constexpr std::array kNames = {"C0Y_urad",         "B0Z_urad",         "A0Z_urad",
                                        "scale_X_um_per_m", "scale_Y_um_per_m", "scale_Z_um_per_m"};
  for (std::size_t k = 0; k < kNames.size(); ++k, ++at) {
    const double factor = 1.0 / kRadPerUrad;
    out.linear.push_back(
        {kNames[k], 0.0, factor * best.state.beside[at - lines.count()], factor * sigma(at), true});
  }
}

// Combinations of numbers that the poses leave as unknown as they were.
void name_unseen(const Fit::Solved& best, Calibration& out) {
  const auto n = static_cast<Eigen::Index>(out.estimates.size());
  Vector before(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::string& name = out.estimates[static_cast<std::size_t>(i)].name;
    before[i] = name.starts_with("ball.")                   ? kBall_mm
                : name.find(".point_") != std::string::npos ? kPoint_mm
                                                            : kDirection_rad;
  }
  const Matrix scaled = before.cwiseInverse().asDiagonal() * best.covariance.topLeftCorner(n, n) *
                        before.cwiseInverse().asDiagonal();
  const SymmetricEigen parts = symmetric_eigen(scaled);
  for (Eigen::Index i = n - 1; i >= 0; --i) {
    if (parts.values[i] < kUnseenShare * kUnseenShare) break;
    constexpr double kTakesPart = 0.3;
    std::vector<std::string> names;
    for (Eigen::Index k = 0; k < n; ++k) {
      if (std::abs(parts.vectors(k, i)) > kTakesPart)
        names.push_back(out.estimates[static_cast<std::size_t>(k)].name);
    }
    out.not_seen.push_back(names.size() == 1
                               ? names.front() + " is not told by these poses; it stays as it was"
                               : listed(names) + " cannot be told apart by these poses");
  }
}

// Whether chi-square is beyond chance: above 1.25 per degree, and by Wilson and Hilferty's cube root beyond
// 3.72 standard deviations, one of 10 000. As `model fit` has it.
bool beyond_chance(double chi2, double dof) {
  constexpr double kClearly = 1.25, kSigmas = 3.72;
  if (dof <= 0.0 || chi2 <= kClearly * dof) return false;
  const double spread = 2.0 / (9.0 * dof);
  return std::cbrt(chi2 / dof) - (1.0 - spread) > kSigmas * std::sqrt(spread);
}

void name_misfit(const Fit& fit, const Fit::Solved& best, const diagnosis::Dataset& data, Calibration& out) {
  if (!beyond_chance(out.chi2, out.freedom)) return;
  const auto [run, rms_mm] = fit.worst_run(best.state);
  const double factor = std::sqrt(out.chi2 / out.freedom);
  // The sigmas have the scatter already, as if it were noise or smooth errors, and up to this factor they are
  // right (README, "Misfit"). What is neither (a ball that moved half way) moves the lines by 2.6 of them
  // RMS, 8 at most: three times wider they are right again, and the whole factor of a hundred and more says
  // nothing.
  constexpr double kOfSmallErrors = 3.0, kWider = 3.0;
  const double wider = factor > kOfSmallErrors ? kWider : 1.0;
  out.misfit = Misfit{factor, wider, data.context.runs[run].id, rms_mm};
  for (auto* numbers : {&out.estimates, &out.linear})
    for (Estimate& one : *numbers) one.sigma *= out.misfit->sigma_factor;
}

void name_always_unseen(const Machine& machine, Calibration& out) {
  std::vector<std::string> names;
  for (const AxisId id : machine.rotary_axes()) names.push_back(machine.axes[id].name);
  out.not_seen.push_back(
      "the spindle's flange: where the centre of the stylus ball is from the spindle's gauge point (its "
      "length, and how far "
      "it is off the spindle's axis) moves the points of " +
      listed(names) +
      " all alike; the points hold for the stylus as its length was entered and where it ran true. Rotary "
      "axes that carry "
      "the part cannot tell more");
  out.not_seen.push_back(
      "the zero of a rotary axis: it is part of the axis lines and of the ball's position, since the part "
      "frame is that of the table with " +
      listed(names) + " at 0");
  out.not_seen.push_back(
      "the position of an axis' point along its axis, and a common rotation of the linear axes");
}

}  // namespace

Result<Calibration> calibrate(const Machine& machine, const diagnosis::Dataset& data) {
  const auto axes = machine.rotary_axes();
  if (axes.empty())
    return fail(ErrorCode::wrong_input, "the machine has no rotary axis: there is nothing to calibrate",
                machine.file);
  const Fit fit(machine, data);
  const Eigen::Index unknown = AxisLines::kEach * static_cast<Eigen::Index>(axes.size()) + fit.ball_count();
  if (static_cast<Eigen::Index>(fit.size()) <= unknown)
    return fail(ErrorCode::wrong_input,
                "there are " + std::to_string(fit.size()) + " displacements; the lines of " +
                    std::to_string(axes.size()) + " rotary axes and the balls have " +
                    std::to_string(unknown) + " numbers, and more readings than these are needed",
                data.files.empty() ? std::string() : data.files.front());
  std::optional<Fit::Solved> best;
  unsigned turned = 0;
  double as_it_was = 0.0;
  for (unsigned senses = 0; senses < (1U << axes.size()); ++senses) {
    auto solved = fit.solve(with_senses(machine, senses));
    if (senses == 0) as_it_was = solved.cost;
    // The file's own sense stays unless another explains far more.
    constexpr double kFarMore = 50.0;
    if (!best || solved.cost < std::min(best->cost, as_it_was - kFarMore)) {
      best = std::move(solved);
      turned = senses;
    }
  }
  if (!best->converged)
    return fail(ErrorCode::wrong_input, "the fit does not converge: are these readings of this machine?",
                data.files.empty() ? std::string() : data.files.front());
  fit.finish(*best, with_senses(machine, turned));
  Calibration out;
  out.machine = best->state.machine;
  out.readings = fit.size();
  out.rms_before_mm = fit.rms_mm({machine, Vector::Zero(fit.beside_count())});
  out.rms_after_mm = fit.rms_mm(best->state);
  // Small errors leave hundredths of a millimetre; more is another machine, or another convention.
  constexpr double kMostLeft_mm = 0.1;
  if (out.rms_after_mm > kMostLeft_mm)
    return fail(ErrorCode::check_failed,
                "no lines of the rotary axes explain these readings: " + fixed_text(out.rms_after_mm, 3) +
                    " mm RMS are left of " + fixed_text(out.rms_before_mm, 3) +
                    " mm; are they of this machine, and read with this machine file?",
                data.files.empty() ? std::string() : data.files.front());
  out.chi2 = best->chi2;
  out.freedom = best->freedom;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    if ((turned >> k & 1U) != 0) out.turned_round.push_back(machine.axes[axes[k]].name);
  }
  name_estimates(machine, data, fit, *best, out);
  name_unseen(*best, out);
  name_misfit(fit, *best, data, out);
  name_always_unseen(machine, out);
  return out;
}

std::string misfit_text(const Calibration& c) {
  if (!c.misfit) return "";
  return "no lines of the rotary axes explain these readings: chi-square " + fixed_text(c.chi2, 1) + " for " +
         fixed_text(c.freedom, 1) + " degrees of freedom, they scatter by " +
         fixed_text(c.misfit->factor, 1) + " times their stated uncertainty; run '" + c.misfit->worst_run +
         "' fits worst, " + fixed_text(c.misfit->worst_rms_mm / kMmPerUm, 2) +
         " um RMS. Did the ball move, or is the tool another one? `trunnion model diagnose` says what else "
         "it "
         "may be";
}

}  // namespace trunnion::probe
