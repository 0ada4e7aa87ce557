#include "path/insertion/spacing.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "path/insertion/even_pieces.hpp"

namespace trunnion::path {
namespace {

// I-length of a piece whose bow is one tolerance: l^2 / 8 = 1.
const double kOnChordLength = std::sqrt(8.0);
// Between two nodes displaced by one tolerance against the bow: l^2 / 8 = 2.
constexpr double kInnerLength = 4.0;

std::size_t pieces(double exact) {
  return static_cast<std::size_t>(std::max(1.0, std::ceil(exact - kCountSlack)));
}

// I-length of a piece between ends displaced by x and y tolerances against the bow. Its curve is -x (1-t) - y
// t + 4 c t (1-t) with c = l^2/8; its largest value, 1, gives c + (y-x)^2/(16 c) = 1 + (x+y)/2.
double length_between(double x, double y) {
  const double m = 1.0 + 0.5 * (x + y);
  const double c = 0.5 * (m + std::sqrt(std::max(0.0, m * m - 0.25 * (y - x) * (y - x))));
  return std::sqrt(8.0 * c);
}

// I-length that `count` >= 2 pieces cover between ends displaced by x0 and x1 tolerances.
double covered_between(std::size_t count, double x0, double x1) {
  return length_between(x0, 1.0) + kInnerLength * static_cast<double>(count - 2) + length_between(1.0, x1);
}

// The same in a tube of w^2 tolerances.
double covered(std::size_t count, double w, double end0, double end1) {
  const double w2 = w * w;
  const double x0 = std::clamp(end0 / w2, -1.0, 1.0);
  const double x1 = std::clamp(end1 / w2, -1.0, 1.0);
  return w * covered_between(count, x0, x1);
}

// w of the narrowest tube in which `count` pieces cover `length`; 1 where none up to 1 does. 40 halvings
// reach the last digit that matters.
double narrowest_tube(std::size_t count, double end0, double end1, double length) {
  constexpr int kHalvings = 40;
  if (end0 == 0.0 && end1 == 0.0) {
    // Then it is a proportion: where the halvings would end.
    constexpr double kSteps = static_cast<double>(std::int64_t{1} << kHalvings);
    const double whole = covered_between(count, 0.0, 0.0);
    const auto covers = [&](double step) { return step / kSteps * whole >= length; };
    double step = std::clamp(std::ceil(length / whole * kSteps), 1.0, kSteps);
    while (step > 1.0 && covers(step - 1.0)) step -= 1.0;
    while (step < kSteps && !covers(step)) step += 1.0;
    return step / kSteps;
  }
  double low = 0.0;
  double high = 1.0;
  for (int i = 0; i < kHalvings; ++i) {
    const double w = 0.5 * (low + high);
    (covered(count, w, end0, end1) < length ? low : high) = w;
  }
  return high;
}

}  // namespace

Tube Tube::within(const Tolerance& tolerance, double word_mm, double word_rad) {
  Tube out;
  if (tolerance.flute.length_mm == 0.0) {
    out.tip_mm = tube_within(tolerance.tip_mm, word_mm);
    return out;
  }
  const Tolerance::Flute& flute = tolerance.flute;
  out.tip_mm = tube_within(flute.off_mm, word_mm);
  out.flute_mm = flute.length_mm;
  out.end_share = out.tip_mm / tube_within(flute.off_mm, word_mm + flute.length_mm * word_rad);
  out.mm_per_axis = out.tip_mm / tolerance.axis.rad();
  return out;
}

void Spacing::set(const std::vector<Cell>& cells, const Tube& tube, double axis_tolerance_rad,
                  bool axis_counts) {
  cells_ = &cells;
  tube_ = tube;
  cumulative_.clear();
  double sum = 0.0;
  double excess = 0.0;
  for (const Cell& cell : cells) {
    const double tip = std::sqrt(8.0 * tube.size_mm(cell.bow) / tube.tip_mm);
    const double axis = axis_counts ? std::sqrt(8.0 * cell.axis / axis_tolerance_rad) : 0.0;
    sum += std::max(tip, axis);
    excess += std::max(0.0, axis - tip * kOnChordLength / kInnerLength);
    cumulative_.push_back(sum);
  }
  tip_leads_ = excess == 0.0;
}

std::size_t Spacing::on_chord_pieces() const {
  return pieces(total() / kOnChordLength);
}

std::size_t Spacing::two_sided_pieces(double end0, double end1) const {
  if (total() <= length_between(end0, end1)) return 1;
  const double inner = (total() - covered(2, 1.0, end0, end1)) / kInnerLength;
  return 1 + pieces(1.0 + inner);
}

double Spacing::free_end_share(double length) {
  const double w = length / (kInnerLength * std::ceil(length / kInnerLength - kCountSlack));
  return std::min(1.0, w * w);
}

bool Spacing::one_piece_covers(double length, double x0, double x1) {
  // A displacement of more than one tolerance, or so far along the bow that its end is outside, is nobody's
  // plan.
  return length <= length_between(std::clamp(x0, -1.0, 1.0), std::clamp(x1, -1.0, 1.0));
}

double Spacing::t_at(double length) const {
  const auto it = std::lower_bound(cumulative_.begin(), cumulative_.end(), length);
  if (it == cumulative_.end()) return 1.0;
  const Cell& cell = (*cells_)[static_cast<std::size_t>(it - cumulative_.begin())];
  const double before = it == cumulative_.begin() ? 0.0 : *(it - 1);
  const double share = *it > before ? (length - before) / (*it - before) : 1.0;
  return cell.t0 + share * (cell.t1 - cell.t0);
}

void Spacing::place_on_chord(std::size_t count, std::vector<Place>& out) const {
  out.clear();
  for (std::size_t j = 1; j < count; ++j) {
    const double share = static_cast<double>(j) / static_cast<double>(count);
    // Without any bow (the axis alone is short, or rounding) evenly.
    out.push_back({total() > 0.0 ? t_at(share * total()) : share, {}});
  }
}

void Spacing::place_two_sided(std::size_t count, double end0, double end1, std::vector<Place>& out) const {
  out.clear();
  if (count < 2) return;
  const double w = narrowest_tube(count, end0, end1, total());
  const double x0 = std::clamp(end0 / (w * w), -1.0, 1.0);
  const double scale = total() / covered(count, w, end0, end1);
  for (std::size_t j = 1; j < count; ++j) {
    const double length = w * (length_between(x0, 1.0) + kInnerLength * static_cast<double>(j - 1));
    const double t = t_at(std::min(1.0, scale) * length);
    out.push_back({t, (w * w * tube_.tip_mm) * against(t)});
  }
}

ToolOff Spacing::against(double t) const {
  // Bow per square of length between the cells' middles, then its direction.
  // Two nodes of the last attempt may have come to the same place: nothing bends between them.
  const auto bend = [](const Cell& c) {
    const double width2 = (c.t1 - c.t0) * (c.t1 - c.t0);
    return width2 > 0.0 ? c.bow / width2 : ToolOff{};
  };
  const auto middle = [](const Cell& c) { return 0.5 * (c.t0 + c.t1); };
  const std::vector<Cell>& cells = *cells_;
  const auto after = std::upper_bound(cells.begin(), cells.end(), t,
                                      [&](double value, const Cell& cell) { return value < middle(cell); });
  const std::size_t i = after == cells.begin() ? 0 : static_cast<std::size_t>(after - cells.begin()) - 1;
  ToolOff bow = bend(cells[i]);
  if (i + 1 < cells.size() && t > middle(cells[i])) {
    const double share = (t - middle(cells[i])) / (middle(cells[i + 1]) - middle(cells[i]));
    bow = (1.0 - share) * bow + share * bend(cells[i + 1]);
  }
  const double size = tube_.size_mm(bow);
  return size > 0.0 ? bow / -size : ToolOff{};
}

}  // namespace trunnion::path
