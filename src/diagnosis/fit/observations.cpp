#include "diagnosis/fit/observations.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <unordered_map>
#include <utility>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/failure.hpp"

namespace trunnion::diagnosis {
namespace {

using Rows = oneapi::tbb::blocked_range<Eigen::Index>;
constexpr Eigen::Index kGrain = 4096;  // readings for one thread: a few milliseconds of them

double component(const Reading& reading, const Vec3& n_M, const Deviation& d) {
  return n_M.dot(reading.quantity == Quantity::displacement ? d.displacement_mm : d.rotation_rad);
}

struct Place {
  JointVector q;
  Vec3 tool_mm;
  bool operator==(const Place& o) const { return q == o.q && tool_mm == o.tool_mm; }
};
struct PlaceHash {
  std::size_t operator()(const Place& p) const {
    std::uint64_t out = 0;
    const auto add = [&out](double x) {
      out = (std::rotl(out, 23) ^ std::bit_cast<std::uint64_t>(x)) * 0x9e3779b97f4a7c15;
    };
    for (AxisId a = 0; a < kMaxAxes; ++a) add(p.q[a]);
    for (const double x : p.tool_mm) add(x);
    return out ^ (out >> 32);
  }
};

// What these decide is the same wherever the axes are in the same place.
bool of_place(DependsOn what, const std::vector<std::vector<double>>& lags) {
  return what <= DependsOn::position && lags.empty();
}

}  // namespace

Observations::Observations(const Machine& machine, const Dataset& data)
    : machine_(&machine), data_(&data), readings_(data.readings) {
  const auto count = static_cast<Eigen::Index>(readings_.size());
  values_.resize(count);
  runs_.resize(data.context.runs.size());
  groups_.resize(data.group_count);
  response_.assign(machine.axes.size() + 2, MatrixXd::Zero(count, 6));
  std::vector<std::array<Deviation, 6>> of_link(response_.size());  // by the components of its twist
  std::unordered_map<Place, std::size_t, PlaceHash> known;
  for (Eigen::Index i = 0; i < count; ++i) {
    const Reading& r = reading(i);
    values_[i] = r.value;
    states_.push_back(data.track.state(r.row));
    as_before_.push_back(taken_as_before(i));
    if (as_before_.back()) {
      places_.of.push_back(places_.of.back());
    } else {
      const Place place{states_.back().q, data.rows[r.row].tool_mm};
      const auto [at, fresh] = known.try_emplace(place, places_.maps.size());
      if (fresh) {
        places_.maps.emplace_back(machine, place.q, place.tool_mm);
        places_.first.push_back(i);
      }
      const bool moved = places_.of.empty() || places_.of.back() != at->second;
      places_.of.push_back(at->second);
      for (std::size_t link = 0; moved && link < of_link.size(); ++link)
        of_link[link] = unit_twists(places_.maps[at->second], link);
    }
    const DeviationMap& map = places_.maps[places_.of.back()];
    n_M_.push_back(r.frame == SensitivityFrame::part ? Vec3(map.R_MP() * r.n) : r.n);
    setup_rows_.emplace_back(r.quantity == Quantity::rotation
                                 ? Vec3(Vec3::Zero())
                                 : Vec3(-(map.R_MP().transpose() * n_M_.back())));
    runs_[states_.back().run].push_back(i);
    groups_[r.group].push_back(i);
    for (std::size_t link = 0; link < response_.size(); ++link)
      for (std::size_t k = 0; k < 6; ++k)
        response_[link](i, static_cast<Eigen::Index>(k)) = component(r, n_M_.back(), of_link[link][k]);
  }
}

// What a pose makes of a unit of each component of a link's twist.
std::array<Deviation, 6> Observations::unit_twists(const DeviationMap& map, std::size_t link) const {
  const std::size_t axes = machine_->axes.size();
  const Link at = link < axes    ? Link{Link::Kind::joint, link}
                  : link == axes ? Link{Link::Kind::spindle, 0}
                                 : Link{Link::Kind::part, 0};
  std::array<Deviation, 6> out;
  for (std::size_t k = 0; k < 3; ++k) {
    Twist d, turn;
    d.trans_mm[static_cast<Eigen::Index>(k)] = 1.0;
    turn.rot_rad[static_cast<Eigen::Index>(k)] = 1.0;
    out[k] = map.linear_M(at, d);
    out[k + 3] = map.linear_M(at, turn);
  }
  return out;
}

// The three components of one reading stand in three rows: what the model says of the state is the same.
bool Observations::taken_as_before(Eigen::Index i) const {
  if (i == 0) return false;
  const MachineState &a = state(i - 1), &b = state(i);
  return a.time_s == b.time_s && a.run == b.run && a.q == b.q && a.direction == b.direction &&
         a.velocity == b.velocity && a.spindle_rpm == b.spindle_rpm &&
         std::ranges::equal(a.temperature_K, b.temperature_K) && std::ranges::equal(a.state, b.state) &&
         data_->rows[reading(i - 1).row].tool_mm == data_->rows[reading(i).row].tool_mm;
}

Observations::Observations(std::shared_ptr<const Observations> whole, const Bins& bins)
    : machine_(whole->machine_), data_(whole->data_), whole_(std::move(whole)) {
  const auto count = static_cast<Eigen::Index>(bins.members.size());
  bins_.of.assign(static_cast<std::size_t>(whole_->size()), -1);
  bins_.share.resize(count);
  bins_.scatter.resize(count);
  runs_.resize(whole_->runs_.size());
  for (Eigen::Index b = 0; b < count; ++b) {
    const auto& members = bins.members[static_cast<std::size_t>(b)];
    bins_.share[b] = 1.0 / static_cast<double>(members.size());
    for (const Eigen::Index i : members) bins_.of[static_cast<std::size_t>(i)] = b;
    take_together(members);
    runs_[states_.back().run].push_back(b);
    bins_.scatter[b] = (1.0 - bins_.share[b]) / bins_.share[b] * std::pow(readings_.back().u_random, 2);
  }
  groups_.resize(whole_->groups_.size());
  for (Eigen::Index b = 0; b < count; ++b) groups_[reading(b).group].push_back(b);
  values_ = means(whole_->values_);
  for (Eigen::Index b = 0; b < count; ++b) readings_[static_cast<std::size_t>(b)].value = values_[b];
  for (const MatrixXd& response : whole_->response_) response_.push_back(means(response));
}

// State and reading that stand for a bin, but for its value.
void Observations::take_together(const std::vector<Eigen::Index>& members) {
  const double share = 1.0 / static_cast<double>(members.size());
  const Eigen::Index middle = members[members.size() / 2];
  MachineState state = whole_->state(middle);
  Reading reading = whole_->reading(middle);
  state.q = state.velocity = JointVector();
  state.time_s = state.spindle_rpm = 0.0;
  Vec3 n_M = Vec3::Zero(), setup = Vec3::Zero();
  double variance = 0.0, common = 0.0;
  bool of_one_group = true;
  for (const Eigen::Index i : members) {
    const MachineState& s = whole_->state(i);
    const Reading& r = whole_->reading(i);
    for (AxisId a = 0; a < machine_->axes.size(); ++a) {
      state.q[a] += share * s.q[a];
      state.velocity[a] += share * s.velocity[a];
    }
    state.time_s += share * s.time_s;
    state.spindle_rpm += share * s.spindle_rpm;
    n_M += share * whole_->n_M(i);
    setup += share * whole_->setup_row(i);
    variance += share * share * r.u_random * r.u_random;
    common += share * r.u_common.value_or(0.0);
    of_one_group = of_one_group && r.group == reading.group;
  }
  reading.u_random = std::sqrt(variance);
  // Offsets of several groups are independent.
  if (reading.u_common) reading.u_common = common * (of_one_group ? 1.0 : std::sqrt(share));
  states_.push_back(state);
  readings_.push_back(reading);
  n_M_.push_back(n_M);
  setup_rows_.push_back(setup);
}

MatrixXd Observations::means(MatrixXd of_all) const {
  if (!whole_) return of_all;
  MatrixXd out = MatrixXd::Zero(bins_.share.size(), of_all.cols());
  for (Eigen::Index c = 0; c < of_all.cols(); ++c)
    for (std::size_t i = 0; i < bins_.of.size(); ++i)
      if (bins_.of[i] >= 0) out(bins_.of[i], c) += of_all(static_cast<Eigen::Index>(i), c);
  return bins_.share.asDiagonal() * out;
}

std::size_t Observations::link_index(const Link& link) const {
  if (link.kind == Link::Kind::joint) return link.axis;
  return machine_->axes.size() + (link.kind == Link::Kind::part ? 1 : 0);
}

std::vector<std::vector<double>> Observations::lagged(const Effect& effect,
                                                      std::span<const double> shape) const {
  std::vector<std::vector<double>> out;
  for (const LagRequest& request : effect.lags(shape)) out.push_back(data_->track.lag(request));
  return out;
}

bool Observations::repeats(Eigen::Index i, const std::vector<std::vector<double>>& lags) const {
  return as_before_[static_cast<std::size_t>(i)] &&
         std::all_of(lags.begin(), lags.end(), [&](const std::vector<double>& lag) {
           return lag[reading(i - 1).row] == lag[reading(i).row];
         });
}

MatrixXd Observations::linear_columns(const Effect& effect, std::span<const double> shape) const {
  if (whole_) return means(whole_->linear_columns(effect, shape));
  const std::size_t count = effect.info().linear_count();
  const auto lags = lagged(effect, shape);
  const MatrixXd& response = response_[link_index(effect.link())];
  struct Scratch {
    std::vector<double> at;
    std::vector<Twist> twists;
  };
  MatrixXd out = MatrixXd::Zero(size(), static_cast<Eigen::Index>(count));
  const auto put = [&](Eigen::Index i, std::span<const Twist> twists) {
    for (std::size_t k = 0; k < count; ++k)
      out(i, static_cast<Eigen::Index>(k)) = response.row(i).head<3>().dot(twists[k].trans_mm) +
                                             response.row(i).tail<3>().dot(twists[k].rot_rad);
  };
  // `last`: the reading before this one of the same scratch, -1: none.
  const auto add = [&](Eigen::Index i, Eigen::Index last, Scratch& scratch) {
    auto& [at, twists] = scratch;
    if (last + 1 != i || last < 0 || !repeats(i, lags)) {
      for (std::size_t k = 0; k < lags.size(); ++k) at[k] = lags[k][reading(i).row];
      effect.columns(state(i), at, shape, twists);
    }
    put(i, twists);
  };
  const Scratch empty{std::vector<double>(lags.size()), std::vector<Twist>(count)};
  if (const auto run = run_of(effect)) {
    Scratch scratch = empty;
    Eigen::Index last = -1;
    for (const Eigen::Index i : runs_[*run]) add(i, std::exchange(last, i), scratch);
  } else if (of_place(effect.depends_on(), lags)) {
    std::vector<Twist> by_place(count * places_.first.size());
    const auto of = [&](std::size_t place) { return std::span(by_place).subspan(count * place, count); };
    oneapi::tbb::parallel_for(Rows(0, std::ssize(places_.first), kGrain), [&](const Rows& places) {
      for (Eigen::Index p = places.begin(); p < places.end(); ++p)
        effect.columns(state(places_.first[static_cast<std::size_t>(p)]), {}, shape,
                       of(static_cast<std::size_t>(p)));
    });
    oneapi::tbb::parallel_for(Rows(0, size(), kGrain), [&](const Rows& rows) {
      for (Eigen::Index i = rows.begin(); i < rows.end(); ++i)
        put(i, of(places_.of[static_cast<std::size_t>(i)]));
    });
  } else {
    oneapi::tbb::parallel_for(Rows(0, size(), kGrain), [&](const Rows& rows) {
      Scratch scratch = empty;
      for (Eigen::Index i = rows.begin(); i < rows.end(); ++i)
        add(i, i == rows.begin() ? -1 : i - 1, scratch);
    });
  }
  for (Eigen::Index i = 0; !out.allFinite() && i < size(); ++i)
    if (!out.row(i).allFinite()) refuse(effect, i);
  return out;
}

// An effect of one run is nothing in the others.
std::optional<std::size_t> Observations::run_of(const Effect& effect) const {
  for (const auto& part : effect.info().variant) {
    if (part.first != "run") continue;
    const auto& runs = data_->context.runs;
    const auto found =
        std::find_if(runs.begin(), runs.end(), [&](const auto& run) { return run.id == part.second; });
    if (found != runs.end()) return static_cast<std::size_t>(found - runs.begin());
  }
  return std::nullopt;
}

void Observations::refuse(const Effect& effect, Eigen::Index i) const {
  const RowOrigin& row = data_->rows[reading(i).row];
  throw Failure({ErrorCode::wrong_input, "effect '" + effect.info().id + "' gives no number for this reading",
                 data_->files[row.file], SourceRef{row.line, 0}});
}

VectorXd Observations::twist_response(const Effect& effect, std::span<const double> parameters) const {
  if (whole_) return means(whole_->twist_response(effect, parameters));
  const auto lags = lagged(effect, parameters.subspan(effect.info().linear_count()));
  const MatrixXd& response = response_[link_index(effect.link())];
  std::vector<double> at(lags.size());
  VectorXd out(size());
  Twist twist;
  for (Eigen::Index i = 0; i < size(); ++i) {
    if (!repeats(i, lags)) {
      for (std::size_t k = 0; k < lags.size(); ++k) at[k] = lags[k][reading(i).row];
      twist = effect.twist(state(i), at, parameters);
    }
    out[i] = response.row(i).head<3>().dot(twist.trans_mm) + response.row(i).tail<3>().dot(twist.rot_rad);
    if (!std::isfinite(out[i])) refuse(effect, i);
  }
  return out;
}

MatrixXd Observations::columns(const ModelEffect& effect) const {
  const auto& info = effect.effect->info();
  const std::size_t linear = info.linear_count();
  const std::vector<double> values = effect.values();
  MatrixXd out(size(), static_cast<Eigen::Index>(values.size()));
  out.leftCols(static_cast<Eigen::Index>(linear)) = linear_columns(*effect.effect, effect.shape());
  for (std::size_t k = linear; k < values.size(); ++k) {
    // A thousandth of the value: truncation and rounding errors of the difference are both far below 1e-3 of
    // it.
    const double h =
        1e-3 * std::max(std::abs(values[k]), 1e-3 * (info.parameters[k].max - info.parameters[k].min));
    std::vector<double> high = values, low = values;
    high[k] += h;
    low[k] -= h;
    out.col(static_cast<Eigen::Index>(k)) =
        h > 0.0 ? VectorXd((twist_response(*effect.effect, high) - twist_response(*effect.effect, low)) /
                           (2.0 * h))
                : VectorXd::Zero(size());
  }
  return out;
}

VectorXd Observations::predicted(const Model& model) const {
  if (whole_) return means(whole_->predicted(model));
  const ModelEvaluator evaluator(model, ModelEvaluator::Sizes::any);
  std::vector<std::vector<double>> lags;
  for (const LagRequest& request : evaluator.lags()) lags.push_back(data_->track.lag(request));
  VectorXd out(size());
  if (of_place(evaluator.depends_on(), lags)) {
    std::vector<Deviation> by_place(places_.first.size());
    oneapi::tbb::parallel_for(Rows(0, std::ssize(places_.first), kGrain), [&](const Rows& places) {
      for (Eigen::Index p = places.begin(); p < places.end(); ++p) {
        const auto at = static_cast<std::size_t>(p);
        by_place[at] = places_.maps[at].exact_M(evaluator.errors(state(places_.first[at])));
      }
    });
    for (Eigen::Index i = 0; i < size(); ++i)
      out[i] = component(reading(i), n_M(i), by_place[places_.of[static_cast<std::size_t>(i)]]);
    return out;
  }
  oneapi::tbb::parallel_for(Rows(0, size(), kGrain), [&](const Rows& rows) {
    std::vector<double> at(lags.size());
    Deviation d;
    for (Eigen::Index i = rows.begin(); i < rows.end(); ++i) {
      if (i == rows.begin() || !repeats(i, lags)) {
        for (std::size_t k = 0; k < lags.size(); ++k) at[k] = lags[k][reading(i).row];
        const std::size_t place = places_.of[static_cast<std::size_t>(i)];
        d = places_.maps[place].exact_M(evaluator.errors(state(i), at));
      }
      out[i] = component(reading(i), n_M(i), d);
    }
  });
  return out;
}

}  // namespace trunnion::diagnosis
