#include "trunnion/path/even_run.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

#include "trunnion/geom/small_arc.hpp"
#include "trunnion/machine/rotary_solver.hpp"

#include "path/insertion/even_pieces.hpp"
#include "path/insertion/pieces_of.hpp"
#include "path/insertion/spacing.hpp"

namespace trunnion::path {
namespace {

template <class T>
void put(const StationOf<T>& at, const ChordOf<T>& chord, const lanes::Triple<T>& axis_P, StandOf<T>& out) {
  out.arm2_outer = at.arm2_outer;
  out.arm2_inner = at.arm2_inner;
  out.size_mm = at.size_mm;
  out.tip_P = at.tip_P;
  out.axis_P = at.axis_P;
  out.off_mm = chord.distance(at.tip_P);
  out.off2_axis = lanes::squared(at.axis_P - axis_P);
}

}  // namespace

struct EvenRun::Work {
  // What is prescribed on a few segments.
  template <class T>
  struct Prescribed {
    lanes::Triple<T> tip0_P, tip1_P, axis0_P, axis1_P;

    ToolSegmentOf<T> tool(double flute_mm) const { return {tip0_P, tip1_P, axis0_P, axis1_P, flute_mm}; }
  };

  // A few segments from end to end.
  template <class T>
  struct Load {
    Prescribed<T> prescribed;
    ChordOf<T> chord;
    StandOf<T> from, to;

    Load(const Work& work, const Few& few)
        : prescribed{vectors(few, [](const auto& s) -> const Vec3& { return s.from.prescribed->tip_P; }),
                     vectors(few, [](const auto& s) -> const Vec3& { return s.to.prescribed->tip_P; }),
                     vectors(few, [](const auto& s) -> const Vec3& { return s.from.prescribed->axis_P; }),
                     vectors(few, [](const auto& s) -> const Vec3& { return s.to.prescribed->axis_P; })},
          chord(prescribed.tip0_P, prescribed.tip1_P) {
      stand(
          work, few, [](const auto& s) -> const EvenRun::End& { return s.from; }, prescribed.axis0_P, from);
      stand(
          work, few, [](const auto& s) -> const EvenRun::End& { return s.to; }, prescribed.axis1_P, to);
    }

   private:
    template <class Of>
    static lanes::Triple<T> vectors(const Few& few, const Of& of) {
      return lanes::collect_vectors<T>([&](std::size_t n) -> const Vec3& { return of(*few[n]); });
    }
    template <class EndOf>
    void stand(const Work& work, const Few& few, const EndOf& end_of, const lanes::Triple<T>& axis_P,
               StandOf<T>& out) const {
      const auto& chain = work.of<T>().chain;
      const auto q = [&](AxisId id) {
        return lanes::collect<T>([&](std::size_t n) { return (*end_of(*few[n]).q)[id]; });
      };
      for (std::size_t k = 0; k < 2; ++k) {
        out.angle[k] = q(work.rotary[k]);
        out.sines.sin[k] = lanes::collect<T>([&](std::size_t n) { return end_of(*few[n]).sines->sin[k]; });
        out.sines.cos[k] = lanes::collect<T>([&](std::size_t n) { return end_of(*few[n]).sines->cos[k]; });
      }
      out.w = chain.w0 + lanes::Triple<T>{q(work.linear[0]), q(work.linear[1]), q(work.linear[2])};
      put(StationOf<T>(work.kinematics, chain, out.w, out.sines), chord, axis_P, out);
    }
  };

  template <class T>
  struct Of {
    ConstantsOf<T> chain;
    WordGridOf<T> grid;
    std::optional<Load<T>> load;  // the segments that are looked at
  };

  const TableKinematics& kinematics;
  RotarySolver solver;
  Of<Lanes> two;
  Of<Quads> four;
  std::array<AxisId, 2> rotary;
  std::array<AxisId, 3> linear;
  std::array<double, 2> min, max;  // of the rotary axes
  double word_error_mm, word_error_rad;
  EvenPieces even;
  bool straight_tip;

  Work(const Machine& machine, const TableKinematics& k, const Rounding& rounding,
       const NonlinearOptions& options)
      : kinematics(k),
        solver(machine),
        two{ConstantsOf<Lanes>(k), WordGridOf<Lanes>(rounding), {}},
        four{ConstantsOf<Quads>(k), WordGridOf<Quads>(rounding), {}},
        rotary{k.rotary(0), k.rotary(1)},
        linear{k.linear(0), k.linear(1), k.linear(2)},
        min{machine.axes[rotary[0]].min, machine.axes[rotary[1]].min},
        max{machine.axes[rotary[0]].max, machine.axes[rotary[1]].max},
        word_error_mm(rounding.tip_error_mm(machine)),
        word_error_rad(rounding.axis_error_rad(machine)),
        even(options.method == Method::adaptive && !options.one_sided),
        straight_tip(options.straight_tip) {}

  /// As SegmentRefiner has it.
  Tube tube(const Tolerance& tolerance) const {
    return Tube::within(tolerance, word_error_mm, word_error_rad);
  }
  template <class T>
  const Of<T>& of() const {
    return lanes::of_lanes<T>(two, four);
  }
  template <class T>
  void load(const Few& few) {
    lanes::of_lanes<T>(two, four).load.emplace(*this, few);
  }
};

namespace {

// Two searches for the nearest place find tools that are off by the same within this.
constexpr double kSearched_mm = 4e-6;

// As Tube::size_mm.
template <class T>
T size_mm(const Tube& tube, const ToolOffOf<T>& bow) {
  const auto length = [](const lanes::Triple<T>& v) { return lanes::sqrt(T(lanes::squared(v))); };
  return lanes::larger<T>(lanes::larger<T>(length(bow.tip_P), tube.end_share * length(bow.at(tube.flute_mm))),
                          tube.mm_per_axis * length(bow.axis_P));
}

}  // namespace

EvenRun::EvenRun(const Machine& machine, const TableKinematics& kinematics, const Rounding& rounding,
                 const NonlinearOptions& options)
    : way_(lanes::way()),
      exact_(options.predictor.kind == Predictor::Kind::exact),
      prediction_asks_(options.method == Method::reinsert),
      work_(std::make_unique<Work>(machine, kinematics, rounding, options)) {
  static_assert(static_cast<double>(kMostPieces) == kMostEvenPieces);
}
EvenRun::~EvenRun() = default;
EvenRun::EvenRun(EvenRun&&) noexcept = default;

std::span<const EvenRun::Settled> EvenRun::settle(const Tolerance& tolerance, double enough_mm,
                                                  double known_mm, std::vector<Point>& out) {
  tolerance_ = tolerance;
  enough_mm_ = enough_mm;
  known_mm_ = known_mm;
  settled_.clear();
  widest_.reset();
  double widest_mm = known_mm;
  // A tool is taken as the axes go.
  if (work_->straight_tip && tolerance.flute.length_mm > 0.0) return settled_;
  for (auto& segments : of_pieces_) segments.clear();
  midpoint_mm_.resize(segments_.size());
  predicted_mm_.resize(segments_.size());
  off_mm_.resize(segments_.size());
  const std::size_t together = lanes::count_of(way_);
  for (std::size_t i = 0; i < segments_.size(); i += together) {
    Few few;
    std::array<std::uint32_t, kMost> numbers;
    for (std::size_t k = 0; k < together; ++k)
      few[k] = &segments_[std::min(i + k, segments_.size() - 1)];  // the last stands for what is not there
    Count counted;
    lanes::at_a_time(way_, [&]<class T>() {
      work_->load<T>(few);
      count<T>(counted);
    });
    for (std::size_t k = 0; k < together && i + k < segments_.size(); ++k) {
      midpoint_mm_[i + k] = counted.midpoint_mm[k];
      predicted_mm_[i + k] = exact_ ? 0.0 : counted.bow_mm[k];
      off_mm_[i + k] = counted.off_mm[k];
      if (exact_ && counted.pieces[k] == 0 && counted.bow_mm[k] > widest_mm) {
        widest_mm = counted.bow_mm[k];
        widest_ = segments_[i + k].number;
      }
      numbers[k] = static_cast<std::uint32_t>(i + k);
    }
    // Neighbours mostly get the same number of pieces: they are loaded already.
    const auto pieces = static_cast<std::size_t>(counted.pieces[0]);
    const bool same = std::all_of(counted.pieces.begin(), counted.pieces.begin() + together,
                                  [&](std::int64_t n) { return n == counted.pieces[0]; });
    if (same && pieces > 1 && i + together <= segments_.size()) {
      divide_few(numbers, together, pieces, out);
      continue;
    }
    for (std::size_t k = 0; k < together && i + k < segments_.size(); ++k)
      of_pieces_[static_cast<std::size_t>(counted.pieces[k])].push_back(numbers[k]);
  }
  for (const std::uint32_t i : of_pieces_[1]) {
    settled_.push_back({segments_[i].number, static_cast<std::uint32_t>(out.size()), 0, midpoint_mm_[i],
                        predicted_mm_[i], off_mm_[i]});
  }
  for (std::size_t pieces = 2; pieces <= kMostPieces; ++pieces) divide_all(pieces, out);
  return settled_;
}

void EvenRun::divide_all(std::size_t pieces, std::vector<Point>& out) {
  const std::vector<std::uint32_t>& segments = of_pieces_[pieces];
  const std::size_t together = lanes::count_of(way_);
  for (std::size_t i = 0; i < segments.size(); i += together) {
    Few few;
    std::array<std::uint32_t, kMost> numbers;
    for (std::size_t k = 0; k < together; ++k) {
      numbers[k] = segments[std::min(i + k, segments.size() - 1)];
      few[k] = &segments_[numbers[k]];
    }
    lanes::at_a_time(way_, [&]<class T>() { work_->load<T>(few); });
    divide_few(numbers, std::min(together, segments.size() - i), pieces, out);
  }
}

void EvenRun::divide_few(const std::array<std::uint32_t, kMost>& segments, std::size_t count,
                         std::size_t pieces, std::vector<Point>& out) {
  const std::size_t nodes = pieces - 1;
  const std::size_t first = out.size();
  out.resize(first + count * nodes);
  Few few;
  std::array<Point*, kMost> points;
  for (std::size_t k = 0; k < lanes::count_of(way_); ++k) {
    few[k] = &segments_[segments[k]];
    points[k] = out.data() + first + std::min(k, count - 1) * nodes;
  }
  Division division;
  lanes::at_a_time(way_, [&]<class T>() { divide<T>(few, pieces, points, division); });
  for (std::size_t k = 0; k < count; ++k) {
    if (division.keeps[k] == 0) continue;
    settled_.push_back({few[k]->number, static_cast<std::uint32_t>(first + k * nodes),
                        static_cast<std::uint32_t>(nodes), midpoint_mm_[segments[k]],
                        predicted_mm_[segments[k]], division.off_mm[k]});
  }
}

// The middle tells whether points are asked for, as in SegmentRefiner::decide: by the prediction, or since it
// is farther off than the tolerance.
template <class T>
void EvenRun::count(Count& out) const {
  const Work& work = *work_;
  const Work::Load<T>& load = *work.of<T>().load;
  const PieceOf<T> whole(work.kinematics, work.of<T>().chain, load.from, load.to);
  const bool has_flute = tolerance_.flute.length_mm > 0.0;
  const double tolerance_mm = has_flute ? tolerance_.flute.off_mm : tolerance_.tip_mm;
  const T& rounding = whole.rounding_mm();
  const lanes::Triple<T> middle = whole.middle_P();
  const T midpoint = whole.midpoint_mm(middle);
  const T beyond = whole.beyond_parabola_mm();
  const ChordOf<T> straight(load.from.tip_P, load.to.tip_P);
  const T bow = straight.distance(middle);
  lanes::Mask<T> turns_little = whole.turn() < kSmallTurn.rad();
  lanes::Mask<T> known =
      (whole.bow_mm() + rounding <= known_mm_) | (midpoint + beyond + rounding <= known_mm_);
  if (!exact_) known |= bow >= 0.0;  // then the bow is the prediction
  lanes::Mask<T> asks, across;       // across: as in SegmentRefiner::insert_evenly
  T off;
  T size = bow;  // in which the count of pieces is taken
  if (has_flute) {
    const ToolSegmentOf<T> segment = load.prescribed.tool(tolerance_.flute.length_mm);
    const Tube tube = work.tube(tolerance_);
    const lanes::Triple<T> middle_axis = whole.middle_axis_P();
    const T nearest = segment.nearest(middle, middle_axis);
    const ToolOffOf<T> tool = segment.off(middle, middle_axis, nearest);
    const T tip = lanes::sqrt(T(lanes::squared(tool.tip_P)));
    const T end = lanes::sqrt(T(lanes::squared(tool.at(tube.flute_mm))));
    size = size_mm(tube, tool);
    asks = lanes::larger(tip, end) > tolerance_mm + kSearched_mm + whole.tool_rounding_mm(tube.flute_mm);
    if (prediction_asks_) asks |= (exact_ ? tip : bow) > tolerance_.tip_mm;
    across = EvenPieces::bends_across<T>(nearest);
    off = whole.tool_off_mm(segment, T{}, lanes::splat<T>(1.0));
    // A prediction is held against the straight chord of the tip.
    if (prediction_asks_) off = lanes::larger<T>(off, midpoint + beyond + rounding);
    turns_little &= segment.arc().holds();
  } else {
    asks = load.chord.distance(middle) > tolerance_mm + rounding;
    const lanes::Triple<T> from_mid = middle - 0.5 * (load.from.tip_P + load.to.tip_P);
    across = EvenPieces::bends_across<T>(lanes::dot(from_mid, straight.way), straight.length2) &
             (bow > tolerance_mm);
    if (prediction_asks_) asks |= bow > tolerance_mm;
    off = lanes::larger(load.from.off_mm, load.to.off_mm) + rounding +
          lanes::smaller<T>(whole.bow_mm(), midpoint + beyond);
  }
  const bool sharper = lanes::any(
      lanes::Mask<T>(turns_little & ~(known & (asks | (off <= (has_flute ? tolerance_mm : enough_mm_))))));
  if (sharper) {
    // What leads along the chord is no error. On its own chord too: a prediction is held against that.
    const T from_straight = parabola_mm(straight, load.from.tip_P, middle, load.to.tip_P);
    known |= from_straight + beyond + rounding <= known_mm_;
    if (!has_flute) {
      const T parabola =
          lanes::larger(parabola_mm(load.chord, load.from.tip_P, middle, load.to.tip_P), from_straight);
      off = lanes::smaller<T>(off, parabola + beyond + rounding);
      // Near the tolerance the rounding of the ends decides.
      if (lanes::any(lanes::Mask<T>(turns_little & known & ~asks & (off > tolerance_mm)))) {
        const T quarters = lanes::larger(
            parabola_in_quarters_mm(load.chord, load.from.tip_P, middle, load.to.tip_P), from_straight);
        off = lanes::smaller<T>(off, quarters + beyond + rounding);
      }
    }
  }
  const lanes::Mask<T> keeps = (off <= tolerance_mm) & whole.axis_keeps(tolerance_.axis);
  known &= turns_little;
  lanes::Mask<T> even = known & asks;
  if (!prediction_asks_) even &= across;
  const double tube_mm = work.tube(tolerance_).tip_mm;
  for (std::size_t k = 0; k < lanes::kCount<T>; ++k) {
    const int lane = static_cast<int>(k);
    out.midpoint_mm[k] = midpoint[lane];
    out.bow_mm[k] = bow[lane];
    out.off_mm[k] = off[lane];
    out.pieces[k] = known[lane] != 0 && keeps[lane] != 0 ? 1 : 0;
    if (even[lane] == 0) continue;
    const double wanted = work.even.count(size[lane], tolerance_mm, tube_mm);
    out.pieces[k] = wanted <= static_cast<double>(kMostPieces) ? static_cast<std::int64_t>(wanted) : 0;
  }
}

// The nodes as NodeMaker makes them on the great circle, where the nearest turn is the one and the sines of
// the solution are turned on to those of the words.
template <class T>
void EvenRun::divide(const Few& few, std::size_t pieces, std::array<Point*, kMost> out,
                     Division& division) const {
  const Work& work = *work_;
  const auto& chain = work.of<T>().chain;
  const WordGridOf<T>& grid = work.of<T>().grid;
  const Work::Load<T>& load = *work.of<T>().load;
  const Work::Prescribed<T>& prescribed = load.prescribed;
  const PieceOf<T> whole(work.kinematics, chain, load.from, load.to);
  const double flute_mm = tolerance_.flute.length_mm;
  const ToolSegmentOf<T> tool_segment = prescribed.tool(flute_mm);
  const SmallArc<T>& arc = tool_segment.arc();
  const T against = lanes::splat<T>(-work.even.beside(pieces));
  const lanes::Triple<T> middle_P = whole.middle_P();
  lanes::Triple<T> against_P, against_axis_P{};
  if (flute_mm > 0.0) {
    const lanes::Triple<T> middle_axis_P = whole.middle_axis_P();
    const ToolOffOf<T> bow =
        tool_segment.off(middle_P, middle_axis_P, tool_segment.nearest(middle_P, middle_axis_P));
    against_P = against * bow.tip_P;
    against_axis_P = against * bow.axis_P;
  } else {
    against_P = against * ChordOf<T>(load.from.tip_P, load.to.tip_P).to(middle_P);
  }
  lanes::Mask<T> keeps = arc.holds();
  StandOf<T> last = load.from;
  T off{};
  const ChordOf<T>& segment = load.chord;
  T place{};  // of `last`
  const auto goes_within = [&](const StandOf<T>& to, const T& t) {
    const PieceOf<T> piece(work.kinematics, chain, last, to);
    const lanes::Mask<T> axis_keeps = piece.axis_keeps(tolerance_.axis);
    if (flute_mm > 0.0) {
      off = lanes::larger(off, piece.tool_off_mm(tool_segment, place, t));
      place = t;
      return lanes::Mask<T>(axis_keeps & (off <= tolerance_.flute.off_mm));
    }
    off = lanes::larger(off, piece.tip_off_mm(segment, enough_mm_, keeps & axis_keeps));
    return lanes::Mask<T>(axis_keeps & (off <= tolerance_.tip_mm));
  };
  for (std::size_t i = 1; i < pieces; ++i) {
    const T t = lanes::splat<T>(work.even.share(i, pieces));
    const lanes::Triple<T> on_arc_P = arc.at(t);
    const lanes::Triple<T> axis_P =
        flute_mm > 0.0 && work.even.two_sided() ? axis_beside(on_arc_P, against_axis_P) : on_arc_P;
    const lanes::Triple<T> tip_P = T(1.0 - t) * prescribed.tip0_P + t * prescribed.tip1_P;
    RotarySolver::OneTogether<T> solved;
    work.solver.solve_one_together<T>(axis_P, load.from.sines.sin[0], load.from.sines.cos[0], solved);
    keeps &= solved.known;
    StandOf<T> now;
    T travel{};
    for (std::size_t k = 0; k < 2; ++k) {
      const T straight = load.from.angle[k] + t * (load.to.angle[k] - load.from.angle[k]);
      const T apart = straight - solved.angle[k];
      const auto within = [&](const T& angle) {
        return lanes::Mask<T>((angle >= work.min[k]) & (angle <= work.max[k]));
      };
      const T turned = solved.angle[k] + kTwoPi * lanes::nearest<T>(apart / kTwoPi);
      const lanes::Mask<T> as_it_is = (lanes::abs(apart) < kPi) & within(solved.angle[k]);
      const T angle = lanes::select(as_it_is, solved.angle[k], turned);
      keeps &= within(angle);
      travel += lanes::abs(T(angle - straight));
      now.angle[k] = grid.rounded(work.rotary[k], angle);
      const T by = now.angle[k] - angle;
      keeps &= lanes::abs(by) <= RotarySines::kSmallTurn_rad;
      now.sines.sin[k] = solved.sin[k];
      now.sines.cos[k] = solved.cos[k];
      turn_on(now.sines.sin[k], now.sines.cos[k], by);
    }
    keeps &= travel < 0.5 * RotarySolver::kApart_rad;
    const lanes::Triple<T> at_P = tip_P + against_P;
    const lanes::Triple<T> exact = linear_positions(work.kinematics, chain, at_P, now.sines);
    const lanes::Triple<T> linear = {grid.rounded(work.linear[0], exact.x),
                                     grid.rounded(work.linear[1], exact.y),
                                     grid.rounded(work.linear[2], exact.z)};
    now.w = chain.w0 + linear;
    put(StationOf<T>(work.kinematics, chain, now.w, now.sines), load.chord, on_arc_P, now);
    keeps &= goes_within(now, t);
    if (!lanes::any(keeps)) break;
    for (std::size_t n = 0; n < lanes::kCount<T>; ++n) {
      const int lane = static_cast<int>(n);
      Point& point = out[n][i - 1];
      point.q[work.rotary[0]] = now.angle[0][lane];
      point.q[work.rotary[1]] = now.angle[1][lane];
      point.q[work.linear[0]] = linear.x[lane];
      point.q[work.linear[1]] = linear.y[lane];
      point.q[work.linear[2]] = linear.z[lane];
      point.tip_P = Vec3(tip_P.x[lane], tip_P.y[lane], tip_P.z[lane]);
      point.axis_P = Vec3(axis_P.x[lane], axis_P.y[lane], axis_P.z[lane]);
      const lanes::Triple<T> beside_P = at_P - tip_P;
      point.beside_P = Vec3(beside_P.x[lane], beside_P.y[lane], beside_P.z[lane]);
      point.where = few[n]->where;
      point.inserted = true;
    }
    last = now;
  }
  keeps &= goes_within(load.to, lanes::splat<T>(1.0));
  std::memcpy(division.keeps.data(), &keeps, sizeof(keeps));
  std::memcpy(division.off_mm.data(), &off, sizeof(off));
}

}  // namespace trunnion::path
