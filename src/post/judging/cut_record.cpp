#include "post/judging/cut_record.hpp"

#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/path/certificate.hpp"

namespace trunnion::post {
namespace {

// A hair for the rounding errors of the evaluation itself.
constexpr double kRounding_mm = 1e-9;

}  // namespace

bool VerifyReport::cuts_within_tolerance() const {
  constexpr double kRounding_rad = 1e-12;
  return certified_tip_deviation_mm <= tolerance_mm + kRounding_mm &&
         max_point_deviation_mm <= tolerance_mm + kRounding_mm &&
         (flute_mm == 0.0 || certified_flute_deviation_mm <= tolerance_mm + kRounding_mm) &&
         certified_pole_flute_deviation_mm <= pole_flute_tolerance_mm + kRounding_mm &&
         max_axis_deviation.rad() <= axis_tolerance.rad() + kRounding_rad &&
         max_pole_axis_deviation.rad() <= axis_tolerance.rad() + pole_tolerance.rad() + kRounding_rad;
}

bool VerifyReport::within_tolerance() const {
  return cuts_within_tolerance() && max_rapid_deviation_mm <= rapid_tolerance_mm + kRounding_mm;
}

std::string flute_text(const VerifyReport& report) {
  if (report.flute_mm > 0.0)
    return "from its tip to " + shortest_text(report.flute_mm) + " mm up the tool stays within " +
           fixed_text(report.certified_flute_deviation_mm, 6) + " mm of its place" +
           (report.pole_flute_tolerance_mm > 0.0
                ? "; in the pole's cone, where it may be tilted, within " +
                      fixed_text(report.certified_pole_flute_deviation_mm, 6) + " mm (tolerance " +
                      fixed_text(report.pole_flute_tolerance_mm, 6) + " mm)"
                : "");
  constexpr double kUp_mm = 10.0;
  return shortest_text(kUp_mm) + " mm above the tip the axis tolerance allows " +
         fixed_text(kUp_mm * 2.0 * std::sin(0.5 * report.axis_tolerance.rad()), 4) + " mm more deviation";
}

CutRecord::CutRecord(const VerifyOptions& options)
    : worst_count(options.worst_count), collect(options.collect) {
  report.tolerance_mm = options.tolerance_mm;
  report.axis_tolerance = options.axis_tolerance;
  report.pole_tolerance = options.pole.tolerance;
  report.rapid_tolerance_mm = options.rapid_tolerance_mm;
  report.on_truth = options.truth != nullptr || options.offsets != nullptr;
  // Between the ends of blocks late axes come to their ways over time: nothing is proved of that.
  report.certified = options.certify && !options.has_lags();
}

void CutRecord::take_deviation(const DeviationMeter::Deviation& d, bool in_cone) {
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

void CutRecord::take_flute(const DeviationMeter::Beside& beside, const Target& to, std::uint32_t nc_line,
                           bool in_cone) {
  if (to.flute_mm == 0.0) return;
  if (in_cone) {
    of_block.proved = of_block.proved && beside.proved;
    if (!(beside.flute_mm.upper > known_in_cone_mm(to.flute_mm))) return;
    report.certified_pole_flute_deviation_mm = beside.flute_mm.upper;
    report.pole_flute_tolerance_mm = cone_limit_mm(to.flute_mm);
    report.worst_pole_flute = {nc_line, to.line};
    return;
  }
  of_block.flute_mm = std::max(of_block.flute_mm, beside.flute_mm.upper);
  of_block.proved = of_block.proved && beside.proved;
  report.max_flute_deviation_mm = std::max(report.max_flute_deviation_mm, beside.flute_mm.lower);
  if (!(beside.flute_mm.upper > report.certified_flute_deviation_mm)) return;
  report.certified_flute_deviation_mm = beside.flute_mm.upper;
  report.worst_flute = {nc_line, to.line};
}

double CutRecord::cone_limit_mm(double flute_mm) const {
  return report.tolerance_mm + flute_mm * 2.0 * std::sin(0.5 * report.pole_tolerance.rad());
}

double CutRecord::known_in_cone_mm(double flute_mm) const {
  if (report.pole_flute_tolerance_mm == 0.0) return 0.0;
  return report.certified_pole_flute_deviation_mm / report.pole_flute_tolerance_mm * cone_limit_mm(flute_mm);
}

void CutRecord::take_axis(double axis, double at_tip, const KnownFigures& known) {
  if (axis > known.axis)
    report.max_axis_deviation = std::max(report.max_axis_deviation, Angle::radians(std::asin(axis)));
  report.max_axis_deviation_at_tip =
      std::max(report.max_axis_deviation_at_tip, Angle::radians(std::asin(std::min(1.0, at_tip))));
}

void CutRecord::take_end_axis(double axis_rad, bool in_cone) {
  of_block.axis_rad = std::max(of_block.axis_rad, axis_rad);
  Angle& largest = in_cone ? report.max_pole_axis_deviation : report.max_axis_deviation;
  largest = std::max(largest, Angle::radians(axis_rad));
}

void CutRecord::bows_by(double off_chord_mm, bool has_flute) {
  of_block.tip_mm += off_chord_mm;
  report.certified_tip_deviation_mm = std::max(report.certified_tip_deviation_mm, of_block.tip_mm);
  // The tool stays parallel to itself on the way of an arc: its points bow alike.
  if (!has_flute) return;
  of_block.flute_seen_mm += off_chord_mm;
  of_block.flute_mm += off_chord_mm;
  report.certified_flute_deviation_mm = std::max(report.certified_flute_deviation_mm, of_block.flute_mm);
}

void CutRecord::end_cut(const Vertex& v, std::uint32_t cl_line, bool programmed) {
  auto& worst = report.worst;
  if (worst.size() < worst_count || (!worst.empty() && of_block.tip_mm > worst.back().tip_mm)) {
    const WorstPlace place{v.nc_line, cl_line, of_block.tip_mm, Angle::radians(of_block.axis_rad), v.tip_P};
    const auto by_tip = [](const WorstPlace& x, const WorstPlace& y) { return x.tip_mm > y.tip_mm; };
    worst.insert(std::upper_bound(worst.begin(), worst.end(), place, by_tip), place);
    if (worst.size() > worst_count) worst.pop_back();
  }
  end_block(v, of_block, cl_line, programmed);
  if (!of_block.proved) {
    ++report.sampled_blocks;
    report.certified = false;
  }
  of_block = {};
}

void CutRecord::end_block(const Vertex& v, const Block& block, std::uint32_t cl_line, bool programmed) {
  if (!collect) return;
  report.blocks.push_back({{static_cast<float>(block.tip_mm), static_cast<float>(block.axis_rad),
                            static_cast<float>(block.flute_seen_mm)},
                           v.q,
                           v.tip_P,
                           path_mm,
                           0.0,
                           v.nc_line,
                           cl_line,
                           v.rapid,
                           programmed,
                           block.proved,
                           v.tcp,
                           v.from_unknown,
                           tool_length_mm});
}

DeviationMeter::Deviation CutRecord::uninteresting() const {
  if (collect || report.worst.size() < worst_count || report.worst.empty()) return {};
  return {{0.0, report.worst.back().tip_mm}, {0.0, judged_axis_rad}};
}

KnownFigures CutRecord::known_figures(double flute_mm) const {
  const DeviationMeter::Deviation known = uninteresting();
  // Differences that Certifier::axis does not tell: where the tool axis stands, all blocks miss it alike.
  constexpr double kSameAxis = 1e-9;
  const double axis = path::sine_at_least(known.axis_rad.upper);
  return {known.tip_mm.upper,
          axis,
          std::min(axis + kSameAxis, std::max(axis, path::sine_at_least(report.axis_tolerance.rad()))),
          flute_mm,
          report.certified_flute_deviation_mm,
          path::sine_at_least(report.max_axis_deviation_at_tip.rad())};
}

}  // namespace trunnion::post
