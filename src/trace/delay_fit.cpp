#include "trace/delay_fit.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/geom/linear_algebra.hpp"

#include "trace/program_senses.hpp"

namespace trunnion::trace {
namespace {

constexpr std::size_t kRowsAside = 4;
constexpr std::size_t kMostRows = 60000;
constexpr std::size_t kLeastFitRows = 60;
constexpr std::size_t kStretches = 60;
constexpr int kIterations = 5;
constexpr double kHuber = 2.0;
constexpr double kRidge = 1e-9;
constexpr double kSame = 1e-3;
constexpr double kApart = 0.15;  // of the largest delay: what differs by less is the same
constexpr double kLeastOfLeft = 0.2;
constexpr double kLeastOfAll = 0.002;
constexpr double kSure = 3.0;  // sigmas
// Of -2 log of a likelihood. Neighbours are means of the same rows: so many count as one.
constexpr double kSameRows = 2.0 * kRowsAside + 1.0;
constexpr double kMuchLess = kSure * kSure * kSameRows;
// A mean is inside of a curve by a sixth of what the command at both ends of its time is off from going on
// straight; of a corner anywhere in it by a seventh, root mean square.
constexpr double kUnseenBend = 1.0 / 6.0;
// Of what is off the path beyond its scatter a delay of all axes leaves less. A lag leaves a 200th and less
// of the simulated traces, a control that blends (the mean of its command over 8 to 30 ms) a sixth and more.
constexpr double kMostLeft = 0.05;
constexpr double kAcross = 4.0;         // coordinates across the path
constexpr double kUnknown = kLever_mm;  // a bend, as if anything were possible

// After the last reversal of each axis: how much of a spike is left, with the sign of the new sense.
Scaled left_of_spikes(const ProgramSenses& senses, double time_s) {
  constexpr double kGone = 12.0;
  Scaled out = Scaled::Zero();
  for (int c = 0; c < out.size(); ++c) {
    const double t = (time_s - senses.reversed_s()[c]) / DelayFit::kSpike_s;
    if (t < kGone) out[c] = senses.sign()[c] * std::exp(-std::max(t, 0.0));
  }
  return out;
}

}  // namespace

DelayFit::DelayFit(const Followed& followed, const JointPath& path, const Machine& machine, const Plan& plan)
    : followed_(followed), path_(path), machine_(machine), plan_(plan), row_of_(followed.x.size(), 0) {}

void DelayFit::run() {
  collect();
  if (rows_.size() < kLeastFitRows) return;
  choose_terms();
  iterate();
  select();
  iterate();
  judge();
  has_run_ = true;
}

void DelayFit::collect() {
  const auto& at = followed_.at;
  ProgramSenses senses(path_);
  const std::size_t every = std::max<std::size_t>(1, (at.last - at.first) / kMostRows);
  for (std::size_t i = at.first; i <= at.last; ++i) {
    if (std::isnan(at.s[i])) continue;
    senses.go_to(at.forward[i], followed_.time_s[i]);
    if (i % every != 0 || plan_.blocks[path_.segment(path_.segment_at(at.s[i])).block].rapid) continue;
    Row row;
    row.sample = i;
    if (!motion_at(followed_, i, kRowsAside, row.v, row.a)) continue;
    row.x = followed_.x[i];
    row.sign = senses.sign();
    row.reversed = left_of_spikes(senses, followed_.time_s[i]);
    rows_.push_back(row);
    row_of_[i] = rows_.size();
  }
}

void DelayFit::choose_terms() {
  Scaled way = Scaled::Zero();
  Scaled plus = Scaled::Zero(), minus = Scaled::Zero(), spikes = Scaled::Zero();
  for (const Row& row : rows_) {
    way += row.v.cwiseAbs();
    plus += row.sign.cwiseMax(0.0);
    minus -= row.sign.cwiseMin(0.0);
    spikes += row.reversed.cwiseAbs();
  }
  const double most = way.maxCoeff();
  const auto count = static_cast<double>(rows_.size());
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    const int c = static_cast<int>(id);
    const bool moves = way[c] > 1e-4 * most && way[c] > 1e-3 * count;
    if (moves) moving_.push_back(id);
    if (moves) terms_.push_back({Kind::lag, id});
    terms_.push_back({Kind::offset, id});
    // Both senses, each for a while.
    if (moves && std::min(plus[c], minus[c]) > 0.02 * count) terms_.push_back({Kind::backlash, id});
    if (moves && spikes[c] > 10.0) terms_.push_back({Kind::spike, id});
  }
  terms_.push_back({Kind::curve, 0});
}

Scaled DelayFit::column(const Row& row, const Term& term) const {
  Scaled out = Scaled::Zero();
  const int c = static_cast<int>(term.axis);
  switch (term.kind) {
    case Kind::lag:
      out[c] = row.v[c];
      break;
    case Kind::shared:
      return row.v;
    case Kind::curve:
      return row.a;
    case Kind::offset:
      out[c] = 1.0;
      break;
    case Kind::backlash:
      out[c] = row.sign[c];
      break;
    case Kind::spike:
      out[c] = row.reversed[c];
      break;
  }
  return out;
}

Scaled DelayFit::added(const Row& row, bool all) const {
  Scaled out = Scaled::Zero();
  for (const Term& term : terms_) {
    if (term.value == 0.0 || (!all && (term.kind == Kind::curve || term.kind == Kind::spike))) continue;
    out += term.value * column(row, term);
  }
  return out + between_rows(row.smooth);
}

// Where the command's speed jumps, x = c - tau v + tau v exp(-t / tau): of the sum over rows and the integral
// of the exponential function the difference is this share of its limit for long delays.
Scaled DelayFit::between_rows(const Scaled& smooth) const {
  Scaled out = Scaled::Zero();
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    const double tau_s = found(Kind::shared, 0).value + found(Kind::lag, id).value;
    const double rows = 0.5 * followed_.period_s / std::max(tau_s, 1e-9);
    const double share = rows < 0.01 ? 1.0 : 3.0 / (rows * rows) * (rows / std::tanh(rows) - 1.0);
    out[static_cast<int>(id)] = share * smooth[static_cast<int>(id)];
  }
  return out;
}

Scaled DelayFit::off(const Row& row, const Scaled& by, Scaled& tangent) const {
  const double s = followed_.at.s[row.sample];
  const double around = 0.02 + 2.0 * by.norm() + followed_.at.distance[row.sample];
  const Scaled c = row.x + by;
  const auto place = path_.nearest(c, std::max(s - around, 0.0), std::min(s + around, path_.length()));
  tangent = path_.tangent(place.segment);
  return across(c - path_.at(place.s), tangent) - row.inside;
}

// Normal equations of what must be added beside what is added already. `of_nothing`: the squared deviation
// with nothing added, on the same straight pieces.
DelayFit::Normal DelayFit::normal_equations(bool weighted) {
  const auto n = static_cast<Eigen::Index>(terms_.size());
  Normal out{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n), 0.0, 0.0};
  Eigen::VectorXd values(n);
  for (Eigen::Index k = 0; k < n; ++k) values[k] = terms_[static_cast<std::size_t>(k)].value;
  std::vector<double> sizes;
  Eigen::MatrixXd j(static_cast<Eigen::Index>(kMaxAxes), n);
  for (const Row& row : rows_) {
    Scaled tangent;
    const Scaled r = off(row, added(row, true), tangent);
    const double size = r.norm();
    sizes.push_back(size);
    const double weight = weighted ? this->weight(row, size) : 1.0;
    for (Eigen::Index k = 0; k < n; ++k)
      j.col(k) = across(column(row, terms_[static_cast<std::size_t>(k)]), tangent);
    out.matrix += weight * j.transpose() * j;
    out.right -= weight * j.transpose() * r;
    out.left2 += size * size;
    out.of_nothing += weight * (r - j * values).squaredNorm();
  }
  const auto at = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() * 3 / 4);
  std::nth_element(sizes.begin(), at, sizes.end());
  rounding_ = std::max(*at, 1e-6);
  return out;
}

void DelayFit::iterate() {
  for (int round = 0; round < kIterations && !terms_.empty(); ++round) {
    const Normal normal = normal_equations(round > 0);
    if (before2_ == 0.0) before2_ = normal.left2;
    const Eigen::VectorXd scale = normal.matrix.diagonal().cwiseMax(1e-12).cwiseSqrt().cwiseInverse();
    Eigen::MatrixXd unit = scale.asDiagonal() * normal.matrix * scale.asDiagonal();
    unit.diagonal().array() += kRidge;
    const Eigen::VectorXd step = scale.cwiseProduct(solve_positive(unit, scale.cwiseProduct(normal.right)));
    for (std::size_t k = 0; k < terms_.size(); ++k) terms_[k].value += step[static_cast<Eigen::Index>(k)];
  }
}

// Of means of rows with the delays as they are found, mean squares.
Scaled DelayFit::scatter2() const {
  const double shared_s = found(Kind::shared, 0).value;
  Scaled out = Scaled::Zero();
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    const double tau_s = shared_s + found(Kind::lag, id).value;
    const int c = static_cast<int>(id);
    out[c] = std::hypot(scatter_[c] * scatter_of_mean(followed_, kRowsAside, 0.0),
                        speed_scatter_[c] * tau_s * scatter_of_velocity(followed_, kRowsAside));
  }
  return out.cwiseAbs2();
}

// Calls `take` with the squared distance from the path of every row, and what of a coordinate's square is
// expected: axes scatter unlike each other, and of one that moves along the path it is not seen.
template <class Take>
void DelayFit::each_off(const Take& take) const {
  constexpr double kFloor2 = 1e-12;
  const Scaled scatter2 = this->scatter2();
  for (const Row& row : rows_) {
    if (row.bend == kUnknown) continue;
    Scaled tangent;
    const double off2 = off(row, added(row, true), tangent).squaredNorm();
    const double across2 = scatter2.sum() - scatter2.dot(tangent.cwiseAbs2());
    take(off2, (across2 + row.bend * row.bend) / kAcross + kFloor2);
  }
}

// -2 log of the likelihood of what is left across the path, of means of rows; what is far off counts less.
// Positions and velocities both scatter, by known amounts, and where an axis truly was is not known: then
// each row counts as its distance over what is expected of it, and no more (errors in variables; Fuller
// 1987). The logarithm of what is expected, as of a regression, would speak for short delays: 1.25 ms were
// found for 1.44.
double DelayFit::unlikeliness() const {
  constexpr double kFar = 4.0;  // for the length of four
  double sum = 0.0;
  each_off([&](double off2, double sigma2) {
    const double size2 = off2 / sigma2;
    sum += size2 <= kFar * kFar ? size2 : kFar * (2.0 * std::sqrt(size2) - kFar);
  });
  return sum;
}

// Sum of squares of what is off the path beyond what is expected of the scatter, and its standard deviation:
// a square of k coordinates scatters by 2 k sigma^4, sums of neighbours, which are means of the same rows, by
// more.
DelayFit::Excess DelayFit::excess() const {
  double sum = 0.0, variance = 0.0;
  each_off([&](double off2, double sigma2) {
    sum += off2 - kAcross * sigma2;
    variance += 2.0 * kAcross * sigma2 * sigma2;
  });
  return {sum, std::sqrt(kSameRows * variance)};
}

// What is left at most rows is their scatter, in which four coordinates are: of their length three in four
// are below 2.3 of its standard deviations.
double DelayFit::weight(const Row& row, double size) const {
  constexpr double kOfFour = 2.32;
  const double bend = kOfFour * row.bend / rounding_;
  const double limit = kHuber * rounding_;
  return (size <= limit ? 1.0 : limit / size) / (1.0 + bend * bend);
}

// The mean of the command over the rows beside a row is inside of its corners and curves. A delay would be
// found to make up for that, so it is taken out: the command at each of these rows is where the mean of the
// fewest rows that tell a speed is on the path.
void DelayFit::find_bends() {
  std::vector<Scaled> commands(rows_.size());
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    Row near = rows_[k];
    near.inside = Scaled::Zero();
    if (const auto mean = mean_at(followed_, near.sample, 1)) {
      near.x = mean->x;
      near.v = mean->v;
      near.smooth = mean->smooth;
    }
    Scaled tangent;
    const Scaled by = added(near, true);
    commands[k] = near.x + by - off(near, by, tangent);
  }
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    Row& row = rows_[k];
    const std::size_t before = row_of_[row.sample - kRowsAside], behind = row_of_[row.sample + kRowsAside];
    row.inside = Scaled::Zero();
    // Towards a rapid the way may turn sharply, and nobody has looked: such a row says nothing.
    row.bend = kUnknown;
    if (before == 0 || behind == 0) continue;
    Scaled tangent;
    const Scaled by = added(row, true);
    const Scaled place = row.x + by - off(row, by, tangent);
    const Scaled turn = commands[before - 1] - 2.0 * commands[k] + commands[behind - 1];
    const auto mean = mean_command(k, commands);
    if (mean) row.inside = across(*mean - place, tangent);
    row.bend = (mean ? kBend : kUnseenBend) * across(turn, tangent).norm();
  }
}

// Over the time of the rows beside a row; nothing where not all of them are fitted.
std::optional<Scaled> DelayFit::mean_command(std::size_t k, const std::vector<Scaled>& commands) const {
  const auto& t = followed_.time_s;
  const std::size_t first = rows_[k].sample - kRowsAside, last = rows_[k].sample + kRowsAside;
  Scaled out = Scaled::Zero();
  for (std::size_t i = first; i < last; ++i) {
    const std::size_t here = row_of_[i], next = row_of_[i + 1];
    if (here == 0 || next == 0) return std::nullopt;
    out += 0.5 * (t[i + 1] - t[i]) / (t[last] - t[first]) * (commands[here - 1] + commands[next - 1]);
  }
  return out;
}

void DelayFit::refine() {
  // Over some rows most ways have a corner, which is not smooth.
  constexpr double kMiddle = 0.5, kSmallest = 0.2;
  scatter_ = scatter_of(followed_, 1, kMiddle);
  // Neighbours that scatter against each other make less of a velocity's scatter than of theirs, and a delay
  // that is blamed for too much of it is found too long.
  speed_scatter_ = scatter_.cwiseMin(scatter_of(followed_, kRowsAside, kSmallest));
  if (!has_run_) return;
  for (Row& row : rows_) {
    const auto mean = mean_at(followed_, row.sample, kRowsAside);
    if (!mean) continue;
    row.x = mean->x;
    row.v = mean->v;
    row.smooth = mean->smooth;
  }
  find_bends();
  iterate();
  judge();
  // Two ways: delays of single axes and a curve, or these and a delay of all.
  const std::vector<Term> found_before = terms_;
  add_smaller_lags();
  const std::vector<Term> single = terms_;
  const double of_single = unlikeliness();
  terms_ = found_before;
  std::erase_if(terms_, [](const Term& term) { return term.kind == Kind::curve; });
  find_bends();
  const double without = excess().sum;
  terms_.push_back({Kind::shared, 0});
  find_shared();
  judge();
  if (add_smaller_lags()) {
    find_shared();
    judge();
  }
  const Term shared = found(Kind::shared, 0);
  const Excess left = excess();
  if (unlikeliness() < of_single - kMuchLess && shared.value > kSure * shared.sigma &&
      left.sum < kMostLeft * without + kSure * left.sigma)
    return;
  terms_ = single;
  find_bends();
}

// What is small beside the largest delay is no cause to be named first, but would be read as other errors.
// Delays are those against what most axes share: half of them have none. False: none is added.
bool DelayFit::add_smaller_lags() {
  const std::size_t terms = terms_.size();
  const auto lags = [&] {
    const auto is_lag = [](const Term& term) { return term.kind == Kind::lag; };
    return static_cast<std::size_t>(std::count_if(terms_.begin(), terms_.end(), is_lag));
  };
  double least = unlikeliness();
  bool more = true;
  while (more && 2 * lags() + 1 < moving_.size()) {
    const std::vector<Term> before = terms_;
    std::vector<Term> best = before;
    for (const AxisId id : moving_) {
      if (found(Kind::lag, id).value != 0.0) continue;
      terms_ = before;
      terms_.push_back({Kind::lag, id});
      iterate_beside_shared();
      find_bends();
      iterate_beside_shared();
      judge();
      const double now = unlikeliness();
      if (now >= least - kMuchLess || std::abs(terms_.back().value) <= kSure * terms_.back().sigma) continue;
      least = now;
      best = terms_;
    }
    more = best.size() > before.size();
    terms_ = best;
    find_bends();
  }
  return terms_.size() > terms;
}

DelayFit::Term* DelayFit::shared() {
  const auto is_shared = [](const Term& term) { return term.kind == Kind::shared; };
  const auto at = std::find_if(terms_.begin(), terms_.end(), is_shared);
  return at == terms_.end() ? nullptr : &*at;
}

// Other terms as they are beside the delay of all axes, which least squares find too small.
void DelayFit::iterate_beside_shared() {
  const double held_s = found(Kind::shared, 0).value;
  iterate();
  if (Term* const term = shared()) term->value = held_s;
}

// Velocities scatter, and what is left scatters with them: least squares find the delay of all axes too
// small. It is where the likelihood is largest, which knows of that.
void DelayFit::find_shared() {
  constexpr double kLongest_s = 0.02, kStep_s = 0.002, kLast_s = kStep_s / 32.0;
  const auto at = [&](double tau_s) {
    shared()->value = tau_s;
    find_bends();  // of where the commands are by this delay
    return unlikeliness();
  };
  double best_s = 0.0, least = at(0.0);
  const auto look_at = [&](double tau_s) {
    const double now = at(tau_s);
    if (now >= least) return false;
    least = now;
    best_s = tau_s;
    return true;
  };
  for (double tau_s = kStep_s; tau_s <= kLongest_s; tau_s += kStep_s) look_at(tau_s);
  for (double step_s = 0.5 * kStep_s; step_s >= kLast_s; step_s *= 0.5) {
    const double from_s = best_s;
    if (!look_at(from_s + step_s) && from_s >= step_s) look_at(from_s - step_s);
    // Other delays as they are beside this one.
    at(best_s);
    iterate_beside_shared();
    least = at(best_s);
  }
  // Between the steps, by the parabola through three of them.
  if (best_s > kLast_s) {
    const double before = at(best_s - kLast_s), behind = at(best_s + kLast_s);
    const double bend = before - 2.0 * least + behind;
    if (bend > 0.0) best_s += 0.5 * kLast_s * std::clamp((before - behind) / bend, -1.0, 1.0);
  }
  at(best_s);
  iterate_beside_shared();
}

// The fewest terms that account for the deviation: each the one that takes most of what is left, and a fifth
// of it.
void DelayFit::select() {
  const auto n = static_cast<Eigen::Index>(terms_.size());
  const Normal normal = normal_equations(true);
  Eigen::VectorXd values(n);
  for (Eigen::Index k = 0; k < n; ++k) values[k] = terms_[static_cast<std::size_t>(k)].value;
  const Eigen::VectorXd right = normal.right + normal.matrix * values;
  const auto left = [&](const std::vector<Eigen::Index>& with) {
    const auto m = static_cast<Eigen::Index>(with.size());
    Eigen::MatrixXd matrix(m, m);
    Eigen::VectorXd b(m);
    for (Eigen::Index i = 0; i < m; ++i) {
      const Eigen::Index k = with[static_cast<std::size_t>(i)];
      const double size = std::sqrt(std::max(normal.matrix(k, k), 1e-12));
      b[i] = right[k] / size;
      for (Eigen::Index l = 0; l < m; ++l) {
        const Eigen::Index other = with[static_cast<std::size_t>(l)];
        matrix(i, l) =
            normal.matrix(k, other) / size / std::sqrt(std::max(normal.matrix(other, other), 1e-12));
      }
      matrix(i, i) += kRidge;
    }
    const Eigen::VectorXd solved = solve_positive(matrix, b);
    return std::pair(normal.of_nothing - b.dot(solved), solved[m - 1]);
  };
  std::vector<Eigen::Index> chosen;
  double now = normal.of_nothing;
  std::vector<Term> terms;
  while (static_cast<Eigen::Index>(chosen.size()) < n) {
    Eigen::Index best = -1;
    double least = now;
    for (Eigen::Index k = 0; k < n; ++k) {
      if (std::find(chosen.begin(), chosen.end(), k) != chosen.end()) continue;
      auto with = chosen;
      with.push_back(k);
      // Of two axes that are apart the one behind is named: both say the same.
      const auto [e, value] = left(with);
      const bool as_good = best >= 0 && e < least + kSame * normal.of_nothing;
      if (e < least - kSame * normal.of_nothing || (as_good && value > 0.0)) {
        least = std::min(e, least);
        best = k;
      }
    }
    const double gain = now - least;
    if (best < 0 || gain < kLeastOfLeft * now || gain < kLeastOfAll * normal.of_nothing) break;
    chosen.push_back(best);
    terms.push_back(terms_[static_cast<std::size_t>(best)]);
    terms.back().share = gain / normal.of_nothing;
    terms.back().value = 0.0;
    now = least;
  }
  const std::vector<Term> all = std::exchange(terms_, std::move(terms));
  name_fewest_lags(all);
}

// Delays are told up to one that all axes share: it is taken so that the most axes have none, and of two ways
// that are as short the one in which axes are behind.
void DelayFit::name_fewest_lags(const std::vector<Term>& all) {
  iterate();
  std::vector<Term> lags, others;
  double share = 0.0, largest = 0.0;
  for (const Term& term : terms_) {
    if (term.kind == Kind::lag) share += term.share;
    (term.kind == Kind::lag ? lags : others).push_back(term);
  }
  if (lags.empty()) return;
  for (const Term& term : all) {
    if (term.kind != Kind::lag) continue;
    const auto same = [&](const Term& lag) { return lag.axis == term.axis; };
    if (std::none_of(lags.begin(), lags.end(), same)) lags.push_back({Kind::lag, term.axis});
  }
  for (const Term& lag : lags) largest = std::max(largest, std::abs(lag.value));
  const auto apart = [&](double value) { return std::abs(value) > kApart * largest; };
  double best = 0.0;
  std::size_t fewest = lags.size() + 1;
  bool behind = false;
  for (const Term& from : lags) {
    std::size_t count = 0;
    bool all_behind = true;
    for (const Term& lag : lags) {
      const double value = lag.value - from.value;
      count += apart(value) ? 1U : 0U;
      all_behind = all_behind && (!apart(value) || value > 0.0);
    }
    if (count > fewest || (count == fewest && (behind || !all_behind))) continue;
    best = from.value;
    fewest = count;
    behind = all_behind;
  }
  terms_ = std::move(others);
  for (const Term& lag : lags) {
    if (!apart(lag.value - best)) continue;
    Term term{Kind::lag, lag.axis};
    term.value = lag.value - best;
    term.share = share / static_cast<double>(fewest);
    terms_.push_back(term);
  }
}

void DelayFit::judge() {
  const auto n = static_cast<Eigen::Index>(terms_.size());
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n), meat = normal;
  Eigen::MatrixXd j(static_cast<Eigen::Index>(kMaxAxes), n);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(n), most = sum, own2 = sum;
  const std::size_t stretch = std::max<std::size_t>(1, rows_.size() / kStretches);
  Eigen::VectorXd of_stretch = sum;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    Scaled tangent;
    const Scaled r = off(rows_[i], added(rows_[i], true), tangent);
    const double size = r.norm();
    const double weight = this->weight(rows_[i], size);
    for (Eigen::Index k = 0; k < n; ++k) {
      Term& term = terms_[static_cast<std::size_t>(k)];
      j.col(k) = across(column(rows_[i], term), tangent);
      const Scaled part = term.value * j.col(k);
      own2[k] += part.squaredNorm();
      if (part.norm() > most[k]) {
        most[k] = part.norm();
        term.worst = rows_[i].sample;
      }
    }
    normal += weight * j.transpose() * j;
    of_stretch += weight * j.transpose() * r;
    if ((i + 1) % stretch == 0 || i + 1 == rows_.size()) {
      meat += of_stretch * of_stretch.transpose();
      of_stretch.setZero();
    }
  }
  const Eigen::VectorXd scale = normal.diagonal().cwiseMax(1e-12).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd unit = scale.asDiagonal() * normal * scale.asDiagonal();
  unit.diagonal().array() += 1e-9;
  const Eigen::MatrixXd inverse = scale.asDiagonal() * inverse_of(unit) * scale.asDiagonal();
  const Eigen::MatrixXd covariance = inverse * meat * inverse;
  const auto count = static_cast<double>(rows_.size());
  for (Eigen::Index k = 0; k < n; ++k) {
    Term& term = terms_[static_cast<std::size_t>(k)];
    // No better than 1e-6 mm everywhere.
    constexpr double kFloor = 1e-6;
    term.sigma = std::sqrt(std::max(covariance(k, k), 0.0) + kFloor * kFloor * std::max(inverse(k, k), 0.0));
    term.rms = std::sqrt(own2[k] / count);
  }
}

DelayFit::Row DelayFit::row_at(std::size_t sample, const Scaled& velocity) const {
  Row row;
  if (row_of_[sample] > 0) row = rows_[row_of_[sample] - 1];
  row.v = velocity;
  return row;
}

// What is sure, and known at a sample.
bool DelayFit::is_added(const Term& term, std::size_t sample) const {
  if (term.kind == Kind::curve || std::abs(term.value) <= kSure * term.sigma) return false;
  return row_of_[sample] > 0 || term.kind == Kind::lag || term.kind == Kind::shared;
}

Scaled DelayFit::to_program(std::size_t sample, const Scaled& velocity) const {
  const Row row = row_at(sample, velocity);
  Scaled out = Scaled::Zero();
  for (const Term& term : terms_)
    if (is_added(term, sample)) out += term.value * column(row, term);
  return out;
}

Scaled DelayFit::sigma_to_program(std::size_t sample, const Scaled& velocity) const {
  const Row row = row_at(sample, velocity);
  Scaled sum2 = Scaled::Zero();
  for (const Term& term : terms_)
    if (term.kind != Kind::shared && is_added(term, sample))
      sum2 += (term.sigma * column(row, term)).cwiseAbs2();
  return sum2.cwiseSqrt();
}

Scaled DelayFit::spikes_at(std::size_t sample) const {
  const Row row = row_at(sample, Scaled::Zero());
  Scaled out = Scaled::Zero();
  for (const Term& term : terms_)
    if (term.kind == Kind::spike && is_added(term, sample)) out += term.value * column(row, term);
  return out;
}

DelayFit::Term DelayFit::found(Kind kind, AxisId axis) const {
  for (const Term& term : terms_)
    if (term.kind == kind && term.axis == axis) return term;
  return {kind, axis};
}

Scaled DelayFit::left_at(std::size_t sample) const {
  Scaled tangent;
  if (has_run_ && row_of_[sample] > 0) {
    const Row& row = rows_[row_of_[sample] - 1];
    return off(row, added(row, false), tangent);
  }
  Row row;
  row.sample = sample;
  row.x = followed_.x[sample];
  return off(row, Scaled::Zero(), tangent);
}

}  // namespace trunnion::trace
