#include "trunnion/path/study.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "path/insertion/run_refiner.hpp"

namespace trunnion::path {
namespace {

const std::array kPredictors{Predictor{Predictor::Kind::harmonic, 1}, Predictor{Predictor::Kind::harmonic, 3},
                             Predictor{Predictor::Kind::parabola, 1}, Predictor{Predictor::Kind::skew, 1},
                             Predictor{Predictor::Kind::quartic, 1}};
constexpr int kTruthSamples = 32;    // of the truth along a segment
constexpr std::size_t kMany = 8;     // pieces on the chord from which counts follow the law
constexpr int kGreedyHalvings = 40;  // of the longest step: to the last digit

template <class Visit>
void each_segment(std::span<const StudyRun> runs, bool links, Visit&& visit) {
  for (const StudyRun& run : runs) {
    if (run.link != links) continue;
    for (std::size_t i = 0; i + 1 < run.points.size(); ++i) visit(run.points[i], run.points[i + 1]);
  }
}

double quantile(const std::vector<double>& sorted, double share) {
  if (sorted.empty()) return 0.0;
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

PredictorStudy study_predictor(const TableKinematics& kinematics, std::span<const StudyRun> runs,
                               const Predictor& predictor) {
  PredictorStudy out;
  out.predictor = predictor;
  std::vector<double> shares;
  double sum2 = 0.0;
  each_segment(runs, false, [&](const Point& from, const Point& to) {
    const Station a = station(kinematics, from.q);
    const Station b = station(kinematics, to.q);
    const ErrorModel exact(kinematics, a, b, {Predictor::Kind::exact, 1});
    const ErrorModel model(kinematics, a, b, predictor);
    double error = 0.0;
    double left = 0.0;
    for (int i = 1; i < kTruthSamples; ++i) {
      const double k = static_cast<double>(i) / kTruthSamples;
      const Vec3 e = exact.at(k);
      error = std::max(error, e.norm());
      left = std::max(left, (e - model.at(k)).norm());
    }
    out.worst_left_mm = std::max(out.worst_left_mm, left);
    if (error <= kStudiedError_mm) return;
    const double share = left / error;
    if (share > out.worst) {
      out.worst = share;
      out.worst_line = to.where.line;
    }
    sum2 += share * share;
    shares.push_back(share);
  });
  std::sort(shares.begin(), shares.end());
  out.segments = shares.size();
  if (!shares.empty()) out.rms = std::sqrt(sum2 / static_cast<double>(shares.size()));
  out.median = quantile(shares, 0.5);
  out.p99 = quantile(shares, 0.99);
  return out;
}

std::vector<SegmentStudy> study_segments(const TableKinematics& kinematics, std::span<const StudyRun> runs,
                                         const StudyOptions& options) {
  const Certifier certifier(kinematics);
  constexpr double kHarmonicDegrees = 60.0;
  std::vector<SegmentStudy> out;
  const auto add = [&](const Point& from, const Point& to) {
    const Station a = station(kinematics, from.q);
    const Station b = station(kinematics, to.q);
    SegmentStudy s;
    s.where = to.where;
    s.certified_mm = certifier.tip(a, b, {from.tip_P, to.tip_P, from.axis_P, to.axis_P}).upper;
    for (const Predictor& predictor : kPredictors) {
      s.predicted_mm.push_back(ErrorModel(kinematics, a, b, predictor).largest_distance());
    }
    double turn = 0.0;
    for (std::size_t k = 0; k < 2; ++k) {
      turn = std::max(turn, std::abs(kinematics.angle(to.q, k) - kinematics.angle(from.q, k)));
    }
    s.largest_turn = Angle::radians(turn);
    s.harmonic_fails = s.certified_mm > kStudiedError_mm && (s.largest_turn.deg() > kHarmonicDegrees ||
                                                             s.predicted_mm.front() < 0.9 * s.certified_mm);
    out.push_back(std::move(s));
  };
  each_segment(runs, false, add);
  each_segment(runs, true, add);
  std::stable_sort(out.begin(), out.end(), [](const SegmentStudy& x, const SegmentStudy& y) {
    return x.certified_mm > y.certified_mm;
  });
  if (out.size() > options.listed) out.resize(options.listed);
  return out;
}

NonlinearOptions placement_options(bool one_sided, bool moves) {
  NonlinearOptions options;
  options.method = Method::adaptive;
  options.one_sided = one_sided;
  options.move_programmed_points = moves;
  return options;
}

// Points of the longest steps on the chord, each proved: no placement on the chord with the same kind of
// nodes needs fewer. Nothing where no step leads on, at a pole that C has to be turned at first.
std::optional<std::size_t> greedy_points(SegmentRefiner& segment, const Point& from, const Point& to,
                                         NodeAxis how, std::size_t limit) {
  const NodeMaker& maker = segment.maker();
  const Station end = station(segment.kinematics(), to.q);
  Station at = station(segment.kinematics(), from.q);
  double t = 0.0;
  std::size_t points = 0;
  double step = 1.0;
  while (!segment.judge().within(at, end) && points < limit) {
    const auto within = [&](double to_t) {
      return segment.judge().within(at, maker.node(to_t, {}, how, false).station);
    };
    double good = t;
    double bad = std::min(1.0, t + 2.0 * step);
    for (int i = 0; i < kGreedyHalvings && bad - good > 1e-9; ++i) {
      const double middle = 0.5 * (good + bad);
      (within(middle) ? good : bad) = middle;
    }
    if (!(good > t)) return std::nullopt;
    step = good - t;
    t = good;
    at = maker.node(t, {}, how, false).station;
    ++points;
  }
  return points;
}

class Tolerances {
 public:
  Tolerances(const Machine& machine, const Vec3& tool_mm, const Tolerance& tolerance)
      : tolerance_(tolerance),
        on_chord_(machine, tool_mm, {}, placement_options(true, false)),
        two_sided_(machine, tool_mm, {}, placement_options(false, false)),
        moved_(machine, tool_mm, {}, placement_options(false, true)) {}

  ToleranceStudy study(std::span<const StudyRun> runs, bool links) {
    out_ = {};
    out_.tolerance_mm = tolerance_.tip_mm;
    out_.links = links;
    for (const char* name : {"on_chord", "two_sided", "moved"}) {
      PlacementStudy placement;
      placement.placement = name;
      out_.placements.push_back(placement);
    }
    each_segment(runs, links, [&](const Point& a, const Point& b) { segment(a, b); });
    for (const StudyRun& run : runs) {
      if (run.link == links) move(run.points);
    }
    return out_;
  }

 private:
  SegmentReport refined(RunRefiner& refiner, const Point& a, const Point& b, PlacementStudy& sum) {
    points_.clear();
    const Station at_a = station(refiner.segment().kinematics(), a.q);
    const Station at_b = station(refiner.segment().kinematics(), b.q);
    const SegmentReport report = refiner.segment().refine({&a, &b, &at_a, &at_b, false}, tolerance_, points_);
    add(report, sum);
    return report;
  }

  static void add(const SegmentReport& report, PlacementStudy& sum) {
    sum.inserted += report.inserted;
    sum.unconverged += report.converged ? 0 : 1;
    sum.largest_certified_mm = std::max({sum.largest_certified_mm, report.tip_mm, report.flute_mm});
    sum.largest_axis = std::max(sum.largest_axis, report.axis);
  }

  void segment(const Point& a, const Point& b) {
    ++out_.segments;
    const SegmentReport chord = refined(on_chord_, a, b, out_.placements[0]);
    const SegmentReport sides = refined(two_sided_, a, b, out_.placements[1]);
    if (sides.inserted > chord.inserted) ++out_.placements[1].more_than_on_chord;
    if (chord.inserted == 0 && chord.converged) return;
    ++out_.over;
    if (chord.inserted + 1 >= kMany) {
      out_.placements[0].inserted_many += chord.inserted;
      out_.placements[1].inserted_many += sides.inserted;
    }
    const NodeAxis how = chord.linear_nodes ? NodeAxis::joint_linear : NodeAxis::great_circle;
    const auto greedy = greedy_points(on_chord_.segment(), a, b, how, std::size_t{4} * (chord.inserted + 2));
    out_.greedy += greedy.value_or(chord.inserted);
    const Station at_a = station(on_chord_.segment().kinematics(), a.q);
    const Station at_b = station(on_chord_.segment().kinematics(), b.q);
    const double length = on_chord_.segment().spacing_of({&a, &b, &at_a, &at_b, false}, tolerance_).total();
    // Fixed ends: each costs 4 - (2 + sqrt 2) of I-length.
    const double pieces = std::ceil((length + 2.0 * (2.0 - std::sqrt(2.0))) / 4.0);
    // The law knows no turn at the pole either.
    out_.two_sided_law += greedy ? static_cast<std::size_t>(std::max(2.0, pieces)) - 1 : sides.inserted;
  }

  void move(std::span<const Point> run) {
    points_.clear();
    reports_.clear();
    moved_.refine(run, tolerance_, points_, reports_);
    for (const SegmentReport& report : reports_) add(report, out_.placements[2]);
  }

  Tolerance tolerance_;
  RunRefiner on_chord_, two_sided_, moved_;
  std::vector<Point> points_;
  std::vector<SegmentReport> reports_;
  ToleranceStudy out_;
};

}  // namespace

StudyResult study_nonlinear(const Machine& machine, const Vec3& tool_mm, std::span<const StudyRun> runs,
                            const StudyOptions& options) {
  const TableKinematics kinematics(machine, tool_mm);
  StudyResult out;
  for (const Predictor& predictor : kPredictors)
    out.predictors.push_back(study_predictor(kinematics, runs, predictor));
  for (const double tolerance_mm : options.tolerances_mm) {
    Tolerances study(machine, tool_mm,
                     {tolerance_mm, options.axis_tolerance, {options.flute_mm, tolerance_mm}});
    for (const bool links : {false, true}) out.tolerances.push_back(study.study(runs, links));
  }
  out.worst = study_segments(kinematics, runs, options);
  return out;
}

}  // namespace trunnion::path
