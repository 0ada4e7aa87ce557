// What the verification writes into its report of the cut.
#include <algorithm>
#include <array>
#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/path/flute.hpp"

#include "post/verifier_state.hpp"

namespace trunnion::post {

std::string flute_text(const VerifyReport& report) {
  if (report.flute_mm > 0.0)
    return "from its tip to " + shortest_text(report.flute_mm) + " mm up the tool stays within " +
           fixed_text(report.certified_flute_deviation_mm, 6) + " mm of its place" +
           (report.pole_tolerance > Angle{} ? " outside the pole's cone, where it may be tilted" : "");
  constexpr double kUp_mm = 10.0;
  return shortest_text(kUp_mm) + " mm up the tool the axis tolerance allows " +
         fixed_text(kUp_mm * 2.0 * std::sin(0.5 * report.axis_tolerance.rad()), 4) + " mm more";
}

void Verifier::State::take_deviation(const DeviationMeter::Deviation& d, bool in_cone) {
  of_block.proved = of_block.proved && d.proved;
  if (d.unbounded != nullptr) {
    auto& ids = report.unproved_effects;
    const std::string& id = d.unbounded->info().id;
    if (std::find(ids.begin(), ids.end(), id) == ids.end()) ids.push_back(id);
  }
  of_block.tip_mm = std::max(of_block.tip_mm, d.tip_mm.upper);
  of_block.axis_rad = std::max(of_block.axis_rad, d.axis_rad.upper);
  report.max_tip_deviation_mm = std::max(report.max_tip_deviation_mm, d.tip_mm.lower);
  report.certified_tip_deviation_mm = std::max(report.certified_tip_deviation_mm, d.tip_mm.upper);
  if (!in_cone) judged_axis_rad = std::max(judged_axis_rad, d.axis_rad.upper);
  Angle& largest = in_cone ? report.max_pole_axis_deviation : report.max_axis_deviation;
  largest = std::max(largest, Angle::radians(d.axis_rad.upper));
}

void Verifier::State::take_beside(const Vertex& from, const Vertex& v, std::size_t segment, double t0,
                                  double t1) {
  const Target& a = targets()[segment];
  const Target& b = targets()[segment + 1];
  if (near_pole(a, b)) return;
  DeviationMeter::Beside known;
  known.axis_rad.upper = report.max_axis_deviation_at_tip.rad();
  // What a block is off its chord comes on top: then the figure itself is needed.
  if (b.flute_mm == 0.0) known.flute_mm.upper = std::numeric_limits<double>::infinity();
  if (b.flute_mm > 0.0 && !(v.off_chord_mm > 0.0F))
    known.flute_mm.upper = report.certified_flute_deviation_mm;
  auto beside = meter().beside(from, v, a, b, t0, t1, as_run.state, known);
  report.max_axis_deviation_at_tip =
      std::max(report.max_axis_deviation_at_tip, Angle::radians(beside.axis_rad.upper));
  if (beside.flute_mm.upper > options.tolerance_mm) beside.flute_mm = flute_about(from, v, segment, 0);
  take_flute(beside, b);
}

void Verifier::State::take_flute(const DeviationMeter::Beside& beside, const Target& to) {
  if (to.flute_mm == 0.0) return;
  of_block.flute_mm = std::max(of_block.flute_mm, beside.flute_mm.upper);
  of_block.proved = of_block.proved && beside.proved;
  report.max_flute_deviation_mm = std::max(report.max_flute_deviation_mm, beside.flute_mm.lower);
  if (!(beside.flute_mm.upper > report.certified_flute_deviation_mm)) return;
  report.certified_flute_deviation_mm = beside.flute_mm.upper;
  report.worst_flute = {nc_line(), to.line};
}

// The segments on which the tool may have its place while the tip tells `segment`: one to each side of it,
// and farther where the tip does not go beyond its tolerance.
std::pair<std::size_t, std::size_t> Verifier::State::segments_about(std::size_t segment) const {
  constexpr std::size_t kFarthest = 16;
  const double here_mm = targets()[segment + 1].along_mm;
  const auto is_near = [&](std::size_t i) {
    return std::abs(targets()[i].along_mm - here_mm) <= 2.0 * options.tolerance_mm;
  };
  std::size_t first = segment > 0 ? segment - 1 : 0;
  while (first > 0 && segment - first < kFarthest && is_near(first)) --first;
  std::size_t last = std::min(segment + 1, targets().size() - 2);
  while (last + 2 < targets().size() && last - segment < kFarthest && is_near(last)) ++last;
  return {first, last};
}

// Where the axis turns far on a short way of the tip the tool may be nearer to a place of another segment
// than the tip's, and part of a block to one of each.
DeviationMeter::Interval Verifier::State::flute_about(const Vertex& from, const Vertex& v,
                                                      std::size_t segment, int halvings) {
  constexpr int kMostHalvings = 12;
  constexpr double kSharp = 1.05;
  constexpr double kMiddle = 0.5;
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const double flute_mm = targets()[segment + 1].flute_mm;
  DeviationMeter::Interval least{kInfinite, kInfinite};
  std::array<double, 2> at_end_mm = {kInfinite, kInfinite};  // the least of all segments
  const auto [first, last] = segments_about(segment);
  for (std::size_t j = first; j <= last; ++j) {
    const Target& a = targets()[j];
    const Target& b = targets()[j + 1];
    if (b.rapid || b.flute_mm != flute_mm || near_pole(a, b)) continue;
    const auto beside = meter().beside(from, v, a, b, 0.0, 1.0, as_run.state, {});
    if (beside.flute_mm.upper < least.upper) least = beside.flute_mm;
    const path::FluteSegment path({a.tip_P, b.tip_P, a.axis_P, b.axis_P}, flute_mm);
    for (std::size_t k = 0; k < 2; ++k) {
      const ToolPose& end = k == 0 ? from : v;
      const double t = path.nearest(end.tip_P, end.axis_P, kMiddle);
      at_end_mm[k] = std::min(at_end_mm[k], path.off(end.tip_P, end.axis_P, t).largest_mm(flute_mm));
    }
  }
  const double found_mm = std::max(at_end_mm[0], at_end_mm[1]);
  least.lower = std::min(found_mm, least.upper);
  const bool is_sharp = least.upper <= std::max(options.tolerance_mm, kSharp * found_mm);
  if (is_sharp || halvings == kMostHalvings) return least;
  const Vertex middle = meter().middle_of(from, v, as_run.state);
  const auto before = flute_about(from, middle, segment, halvings + 1);
  const auto behind = flute_about(middle, v, segment, halvings + 1);
  return {std::max(before.lower, behind.lower), std::max(before.upper, behind.upper)};
}

void Verifier::State::bows_by(double off_chord_mm) {
  of_block.tip_mm += off_chord_mm;
  report.certified_tip_deviation_mm = std::max(report.certified_tip_deviation_mm, of_block.tip_mm);
  // The tool stays parallel to itself on the way of an arc: its points bow alike.
  if (targets().longest_flute_mm() == 0.0) return;
  of_block.flute_mm += off_chord_mm;
  report.certified_flute_deviation_mm = std::max(report.certified_flute_deviation_mm, of_block.flute_mm);
}

void Verifier::State::record_feed(const Vertex& v, std::uint32_t cl_line, bool programmed) {
  auto& worst = report.worst;
  if (worst.size() < options.worst_count || (!worst.empty() && of_block.tip_mm > worst.back().tip_mm)) {
    const WorstPlace place{v.nc_line, cl_line, of_block.tip_mm, Angle::radians(of_block.axis_rad), v.tip_P};
    const auto by_tip = [](const WorstPlace& x, const WorstPlace& y) { return x.tip_mm > y.tip_mm; };
    worst.insert(std::upper_bound(worst.begin(), worst.end(), place, by_tip), place);
    if (worst.size() > options.worst_count) worst.pop_back();
  }
  record(v, of_block.tip_mm, of_block.axis_rad, cl_line, programmed);
  if (!of_block.proved) {
    ++report.sampled_blocks;
    report.certified = false;
  }
  of_block = {};
}

void Verifier::State::record(const Vertex& v, double tip_mm, double axis_rad, std::uint32_t cl_line,
                             bool programmed) {
  if (!options.collect) return;
  report.blocks.push_back({v.q, v.tip_P, static_cast<float>(tip_mm), static_cast<float>(axis_rad), path_mm,
                           0.0, v.nc_line, cl_line, v.rapid, programmed, of_block.proved});
}

}  // namespace trunnion::post
