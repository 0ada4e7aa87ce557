#include "trunnion/probe/reading.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/median.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/kinematics.hpp"

#include "probe/lobes.hpp"
#include "probe/log_match.hpp"

namespace trunnion::probe {
namespace {

constexpr double kLeastLimit_mm = 0.005;
// Of the radius that a pose has by itself: errors of a machine of some 30 um change it by this much, and the
// scatter of a dozen radii is known to a third only.
constexpr double kLeastRadius_mm = 0.010;
constexpr double kTimesScatter = 8.0;
constexpr double kLeastPair_mm =
    0.012;  // of a fast and a slow touch: both scatter, and the fast one by its speed
constexpr double kLeastU_mm = 1e-5;  // of one touch: no log has more digits that mean something

// Standard deviation by the median distance from the median.
double scatter_of(std::vector<double> values) {
  const double middle = median(values);
  for (double& v : values) v = std::abs(v - middle);
  return kMadToSigma * median(std::move(values));
}

double limit_of(double scatter_mm) {
  return std::max(kLeastLimit_mm, kTimesScatter * scatter_mm);
}

std::string mm(double value) {
  return fixed_text(value, 4) + " mm";
}

// Checks and fits of one log.
class LogReader {
 public:
  LogReader(const Machine& machine, const Strokes& strokes, std::vector<MatchedTouch> touches,
            std::string file)
      : machine_(machine), strokes_(strokes), touches_(std::move(touches)), file_(std::move(file)) {}

  Result<ProbeReading> read(const ReadingOptions& options) {
    for (const auto check : {&LogReader::check_pairs, &LogReader::check_radius_of_each, &LogReader::fit}) {
      if (auto done = (this->*check)(options); !done) return tl::unexpected(done.error());
    }
    fill();
    if (auto done = check_places(); !done) return tl::unexpected(done.error());
    return std::move(out_);
  }

 private:
  tl::unexpected<Error> refuse(std::size_t pose, std::uint32_t line, const std::string& what) const {
    return fail(ErrorCode::wrong_input, strokes_.pose_text(machine_, pose) + ": " + what, file_, {line, 0});
  }

  // A touch goes on for the time that the control takes to see it: a faster one farther, all of them alike.
  Result<void> check_pairs(const ReadingOptions&) {
    struct Pair {
      std::size_t fast, slow;
      double later_mm, per_feed;
    };
    std::vector<Pair> pairs;
    std::vector<double> rates;
    for (std::size_t i = 0; i < touches_.size(); ++i) {
      if (strokes_.touches[i].measures) continue;
      std::size_t slow = i + 1;
      while (!strokes_.touches[slow].measures) ++slow;
      // The way back from the end of the stroke is the same for both, wherever they began.
      const double later = touches_[slow].left_mm - touches_[i].left_mm;
      const auto faster = static_cast<double>(strokes_.touches[i].feed - strokes_.touches[slow].feed);
      if (!(faster > 0.0)) continue;
      pairs.push_back({i, slow, later, faster});
      rates.push_back(later / faster);
    }
    const double rate = median(rates);
    std::vector<double> off, ways;
    double usual = 0.0;
    for (const Pair& p : pairs) {
      off.push_back(p.later_mm - rate * p.per_feed);
      ways.push_back(rate * p.per_feed);
      usual = std::max(usual, static_cast<double>(strokes_.touches[p.fast].feed));
    }
    out_.fast_less_slow_mm = median(ways);
    const double scatter = scatter_of(off);
    // What a faster touch goes on scatters with its speed.
    const double feed_of_most = median([&] {
      std::vector<double> feeds;
      feeds.reserve(pairs.size());
      for (const Pair& p : pairs) feeds.push_back(static_cast<double>(strokes_.touches[p.fast].feed));
      return feeds;
    }());
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const double faster =
          std::max(1.0, static_cast<double>(strokes_.touches[pairs[k].fast].feed) / feed_of_most);
      const double limit = faster * std::max(kLeastPair_mm, limit_of(scatter));
      if (std::abs(off[k]) <= limit) continue;
      return refuse(strokes_.touches[pairs[k].slow].pose, touches_[pairs[k].slow].line,
                    "the fast and the slow touch (lines " + std::to_string(touches_[pairs[k].fast].line) +
                        " and " + std::to_string(touches_[pairs[k].slow].line) + ") are " +
                        mm(pairs[k].later_mm) + " apart, all touches " + mm(rate * pairs[k].per_feed) +
                        " with a limit of " + mm(limit) + ": one of the two is wrong");
    }
    return {};
  }

  std::vector<std::vector<Vec3>> measured() const {
    std::vector<std::vector<Vec3>> out(strokes_.poses.size());
    for (std::size_t i = 0; i < touches_.size(); ++i) {
      if (strokes_.touches[i].measures) out[strokes_.touches[i].pose].push_back(touches_[i].at_mm);
    }
    return out;
  }

  std::uint32_t last_line_of(std::size_t pose) const {
    std::uint32_t line = 0;
    for (std::size_t i = 0; i < touches_.size(); ++i) {
      if (strokes_.touches[i].pose == pose) line = touches_[i].line;
    }
    return line;
  }

  // The radius that each pose has by itself.
  Result<void> check_radius_of_each(const ReadingOptions& options) {
    std::vector<double> radii;
    for (std::size_t pose = 0; const auto& points : measured()) {
      const auto sphere = fit_sphere(points);
      if (!sphere) return refuse(pose, last_line_of(pose), "its touches lie on no sphere");
      radii.push_back(sphere->radius_mm);
      ++pose;
    }
    const double middle = median(radii);
    const double expected = strokes_.ball.reach_mm();
    for (std::size_t pose = 0; pose < radii.size(); ++pose) {
      if (std::abs(radii[pose] - expected) > options.radius_tolerance_mm + limit_of(scatter_of(radii)))
        return refuse(pose, last_line_of(pose),
                      "its touches lie on a sphere of radius " + mm(radii[pose]) + "; ball and stylus have " +
                          mm(expected) + " together: another ball or stylus, or touches that are wrong");
      if (std::abs(radii[pose] - middle) > std::max(kLeastRadius_mm, limit_of(scatter_of(radii))))
        return refuse(pose, last_line_of(pose),
                      "its touches lie on a sphere of radius " + mm(radii[pose]) +
                          ", those of the other poses on " + mm(middle) +
                          ": another ball, or a touch that is wrong");
    }
    radius_ = middle;
    return {};
  }

  // One radius for all poses.
  Result<void> fit(const ReadingOptions& options) {
    auto sets = measured();
    std::vector<double> residuals;
    std::vector<Sphere> held;
    for (std::size_t pose = 0; pose < sets.size(); ++pose) {
      const auto one = fit_sphere(sets[pose], radius_);
      if (!one) return refuse(pose, last_line_of(pose), "its touches lie on no sphere");
      residuals.insert(residuals.end(), one->residuals_mm.begin(), one->residuals_mm.end());
      held.push_back(*one);
    }
    const double limit = limit_of(scatter_of(residuals));
    std::size_t worst = 0;
    double most = 0.0;
    for (std::size_t pose = 0; pose < held.size(); ++pose) {
      for (const double r : held[pose].residuals_mm) {
        if (std::abs(r) <= most) continue;
        most = std::abs(r);
        worst = pose;
      }
    }
    if (most > limit)
      return refuse(worst, last_line_of(worst),
                    "a touch is " + mm(most) + " off the sphere of the others, with a limit of " + mm(limit));
    auto common = fit_common_radius(sets);
    if (common) out_.lobes = find_lobes(sets, *common);
    if (!out_.lobes.empty()) {
      sets = without_lobes(std::move(sets), *common, out_.lobes);
      common = fit_common_radius(sets);
    }
    if (!common) return refuse(0, last_line_of(0), "its touches lie on no sphere");
    out_.radius_mm = common->radius_mm;
    if (std::abs(out_.radius_mm - strokes_.ball.reach_mm()) > options.radius_tolerance_mm)
      return refuse(0, last_line_of(0),
                    "the touches of all poses lie on spheres of radius " + mm(out_.radius_mm) +
                        "; ball and stylus have " + mm(strokes_.ball.reach_mm()) + " together, and " +
                        mm(options.radius_tolerance_mm) + " are allowed for the probe");
    double sum = 0.0;
    double across = 0.0;
    std::size_t count = 0;
    Vec3 shift = Vec3::Zero();
    for (std::size_t pose = 0; pose < sets.size(); ++pose) {
      const Sphere& sphere = common->spheres[pose];
      Vec3 towards = Vec3::Zero();
      for (const Vec3& p : sets[pose]) towards += (p - sphere.center_mm).normalized();
      for (const double r : sphere.residuals_mm) sum += r * r;
      count += sphere.residuals_mm.size();
      // What the centre takes of a change of the radius, and what is left of it in the residuals.
      const Vec3 by = sphere.center_cofactor * towards;
      shift += by / static_cast<double>(sets.size());
      across += static_cast<double>(sphere.residuals_mm.size()) - towards.dot(by);
    }
    const auto freedom = static_cast<double>(count) - 3.0 * static_cast<double>(sets.size()) - 1.0 -
                         2.0 * static_cast<double>(out_.lobes.size());
    out_.scatter_mm = std::max(kLeastU_mm, std::sqrt(sum / std::max(freedom, 1.0)));
    out_.u_radius_mm = out_.scatter_mm / std::sqrt(std::max(across, 1e-9));
    out_.u_common_z_mm = std::abs(shift.z()) * out_.u_radius_mm;
    for (std::size_t pose = 0; pose < sets.size(); ++pose) {
      PoseReading one;
      one.sphere = common->spheres[pose];
      one.free_radius_mm = fit_sphere(sets[pose])->radius_mm;
      one.u_mm = out_.scatter_mm * one.sphere.center_cofactor.diagonal().cwiseSqrt();
      out_.poses.push_back(std::move(one));
    }
    return {};
  }

  // The ball's real place is where the tool really is in the part; the machine file has the tool elsewhere.
  void fill() {
    EffectContext context;
    context.runs.emplace_back();
    context.runs.back().id = "probe";
    std::vector<MachineState> states;
    std::vector<diagnosis::RowOrigin> rows;
    std::vector<diagnosis::Reading> readings;
    const Vec3 tool_mm(0.0, 0.0, -strokes_.ball.stylus_length_mm);
    for (std::size_t pose = 0; pose < out_.poses.size(); ++pose) {
      PoseReading& one = out_.poses[pose];
      one.q = with_linear(machine_, strokes_.poses[pose], one.sphere.center_mm);
      const Vec3 d_P = strokes_.ball.place_P - forward(machine_, one.q, tool_mm).p;
      one.deviation_M = part_in_machine(machine_, one.q).R * d_P;
      MachineState state;
      state.q = one.q;
      state.direction = strokes_.senses[pose];
      state.run = 0;
      state.time_s = static_cast<double>(pose);
      states.push_back(state);
      rows.push_back({0, 0, tool_mm});
      for (Eigen::Index i = 0; i < 3; ++i) {
        diagnosis::Reading reading;
        reading.row = pose;
        reading.n = Vec3::Unit(i);
        reading.value = one.deviation_M[i];
        reading.u_random = one.u_mm[i];
        reading.u_common = i == 2 ? out_.u_common_z_mm : 0.0;
        readings.push_back(reading);
      }
    }
    out_.data = diagnosis::make_dataset(std::move(context), states, std::move(rows), std::move(readings));
    out_.data.files = {file_};
  }

  // The ball was met where the program looked for it, so the machine file that made the program has it there.
  Result<void> check_places() const {
    const double most = 2.0 * strokes_.ball.within_mm + 1.0;
    for (std::size_t pose = 0; pose < out_.poses.size(); ++pose) {
      const double off = out_.poses[pose].deviation_M.norm();
      if (off <= most) continue;
      return refuse(pose, last_line_of(pose),
                    "by this machine file the ball is " + mm(off) +
                        " from where the program looked for it, within " + mm(strokes_.ball.within_mm) +
                        ": was the program made with another machine file?");
    }
    return {};
  }

  const Machine& machine_;
  const Strokes& strokes_;
  std::vector<MatchedTouch> touches_;
  std::string file_;
  double radius_ = 0.0;
  ProbeReading out_;
};

}  // namespace

Result<ProbeReading> read_touches(const Machine& machine, const Strokes& strokes, std::string_view log,
                                  const std::string& file, const ReadingOptions& options) {
  auto touches = match_log(machine, strokes, log, file);
  if (!touches) return tl::unexpected(touches.error());
  return LogReader(machine, strokes, std::move(*touches), file).read(options);
}

}  // namespace trunnion::probe
