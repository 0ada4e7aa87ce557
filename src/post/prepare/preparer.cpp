#include "post/prepare/preparer.hpp"

#include <algorithm>
#include <limits>

#include "trunnion/base/failure.hpp"
#include "trunnion/path/flute.hpp"

#include "post/prepare/refinement.hpp"

namespace trunnion::post {

Preparer::Preparer(const Machine& machine, const Vec3& tool_mm, const path::Rounding& rounding,
                   const PostOptions& options, const path::Compensator* compensator)
    : rounding_(rounding),
      kinematics_(machine, tool_mm),
      refiner_(machine, tool_mm, rounding, nonlinear_options(options)),
      grid_(kinematics_, rounding),
      whole_runs_(options.nonlinear.thin || options.nonlinear.move_programmed_points) {
  if (kinematics_.side_by_side() && path::EvenRun::settles(options.nonlinear))
    even_.emplace(machine, kinematics_, rounding_, nonlinear_options(options));
  if (compensator != nullptr && kinematics_.side_by_side() && !whole_runs_)
    corrections_.emplace(*compensator, kinematics_, rounding_);
}

void Preparer::place(Chunk& chunk) {
  const std::size_t count = chunk.size();
  chunk.joints.resize(count);
  const auto pose_at = [&](std::size_t i) -> const ToolPose& { return chunk.points[i].pose; };
  if (kinematics_.side_by_side()) {
    grid_.place(chunk.has_before ? &chunk.before : nullptr, chunk.chosen, pose_at,
                chunk.tolerances[0].tolerance, known_, chunk.joints);
    return;
  }
  sines_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    chunk.joints[i] = chunk.chosen[i].q;
    sines_[i] = path::round_to_words(kinematics_, rounding_, pose_at(i).tip_P, chunk.joints[i],
                                     chunk.chosen[i].sines);
  }
}

// How far the tool is off its place on segment `i`, up to its flute length.
double Preparer::beside_mm(const Chunk& chunk, std::size_t i, const Vec3& tip_P, const Vec3& axis_P) const {
  const double flute_mm = chunk.tolerances[0].tolerance.flute.length_mm;
  if (flute_mm == 0.0) return 0.0;
  const ToolPose from = i == 0 ? ToolPose{chunk.before.tip_P, chunk.before.axis_P} : chunk.points[i - 1].pose;
  const ToolPose& to = chunk.points[i].pose;
  const path::FluteSegment segment({from.tip_P, to.tip_P, from.axis_P, to.axis_P}, flute_mm);
  const double t = segment.nearest(tip_P, axis_P, 0.5);
  return segment.off(tip_P, axis_P, t).largest_mm(flute_mm);
}

// The ends of all blocks, those of inserted points among them.
void Preparer::correct(Chunk& chunk) {
  const std::size_t count = chunk.size();
  const auto sines = grid_.sines();
  places_.resize(count + chunk.inserted.size());
  inserted_tips_P_.resize(chunk.inserted.size());
  inserted_sines_.resize(chunk.inserted.size());
  std::size_t k = 0;  // inserted points so far
  for (std::size_t i = 0; i < count; ++i) {
    PreparedSegment& segment = chunk.segments[i];
    for (const path::Point& point : chunk.inserted_in(segment)) {
      inserted_tips_P_[k] = point.tip_P + point.beside_P;
      inserted_sines_[k] = kinematics_.sines(point.q);
      places_[i + k] = {&point.q, &inserted_tips_P_[k], &point.axis_P, &inserted_sines_[k], off_mm_[i]};
      if (off_mm_[i] == path::CorrectionRun::NominalPlace::kUnknown)
        places_[i + k].beside_mm = beside_mm(chunk, i, inserted_tips_P_[k], point.axis_P);
      ++k;
    }
    segment.end = static_cast<std::uint32_t>(i + k);
    const ToolPose& pose = chunk.points[i].pose;
    places_[i + k] = {&chunk.joints[i], &pose.tip_P, &pose.axis_P, &sines[i], off_mm_[i]};
  }
  places_.resize(count + k);
  const path::Tolerance& tolerance = chunk.tolerances[0].tolerance;
  corrections_->correct(places_, tolerance.tip_mm, tolerance.flute.length_mm);
  const auto assign = [](auto& to, const auto& from) { to.assign(from.begin(), from.end()); };
  Chunk::Corrections& out = chunk.corrections;
  assign(out.joints, corrections_->joints());
  assign(out.known, corrections_->known());
  assign(out.keeps, corrections_->keeps());
  // Blocks that begin or end beside the path may keep to their chord, and leave the path.
  for (std::size_t i = 0; i < count; ++i) {
    if (off_mm_[i] != path::CorrectionRun::NominalPlace::kUnknown) continue;
    const PreparedSegment& segment = chunk.segments[i];
    const auto inserted = chunk.inserted_in(segment);
    for (std::size_t n = 0; n < inserted.size(); ++n) {
      if (inserted[n].beside_P.isZero(0.0)) continue;
      const std::size_t at = segment.end - inserted.size() + n;
      out.keeps[at] = out.keeps[at + 1] = 0;
    }
  }
  out.largest_error_mm = corrections_->largest_error_mm();
  out.largest_correction_mm = corrections_->largest_correction_mm();
}

void Preparer::decide(Chunk& chunk, std::size_t i, const path::Tolerance& tolerance) {
  PreparedSegment& segment = chunk.segments[i];
  const path::Point from = i == 0 ? chunk.before : chunk.point(i - 1);
  const auto sines_at = [&](std::size_t k) {
    return kinematics_.side_by_side() ? grid_.sines(k) : sines_[k];
  };
  const TableKinematics::Sines sines_a = sines_at(i == 0 ? 0 : i - 1);
  const TableKinematics::Sines sines_b = sines_at(i);
  segment.first = static_cast<std::uint32_t>(chunk.inserted.size());
  segment.report = static_cast<std::int32_t>(chunk.reports.size());
  const path::Point to = chunk.point(i);
  const path::SegmentReport& report = chunk.reports.emplace_back(refiner_.decide(
      {from, to, i == 0 ? nullptr : &sines_a, &sines_b}, tolerance, known_.predicted_mm, chunk.inserted));
  known_.predicted_mm = std::max(known_.predicted_mm, std::min(report.predicted_mm, report.midpoint_mm));
  known_.midpoint_mm = std::max(known_.midpoint_mm, report.midpoint_mm);
}

// Of the undecided segments that surely keep the widest may count; most of the others do not, once it is
// known.
void Preparer::keep_what_does_not_count(Chunk& chunk) {
  std::optional<std::size_t> widest;
  for (const std::size_t i : undecided_) {
    const bool may_count = grid_.keeps(i) && grid_.counts(i, known_);
    if (may_count && (!widest || grid_.across_mm(i) > grid_.across_mm(*widest))) widest = i;
  }
  if (!widest) return;
  decide(chunk, *widest, chunk.tolerances[0].tolerance);
  for (const std::size_t i : undecided_) {
    PreparedSegment& segment = chunk.segments[i];
    if (!segment.known() && settled_on_grid(i)) segment.report = PreparedSegment::kKept;
  }
}

// Those of the undecided segments that can be judged a few at a time.
void Preparer::settle(Chunk& chunk) {
  const auto end = [&](std::size_t i) {
    return path::EvenRun::End{&chunk.joints[i], &grid_.sines(i), &chunk.points[i].pose};
  };
  even_->clear();
  for (const std::size_t i : undecided_) {
    if (i > 0 && !chunk.segments[i].known()) even_->add({end(i - 1), end(i), chunk.points[i].where, i});
  }
  const path::Tolerance& tolerance = chunk.tolerances[0].tolerance;
  const double enough_mm = corrections_ ? 0.0 : tolerance.tip_mm;
  for (const auto& of : even_->settle(tolerance, enough_mm, known_.predicted_mm, chunk.inserted)) {
    PreparedSegment& segment = chunk.segments[of.number];
    if (corrections_) off_mm_[of.number] = of.off_mm;
    segment.report = PreparedSegment::kKept;
    if (of.inserted == 0 && of.midpoint_mm <= known_.midpoint_mm && of.predicted_mm <= known_.predicted_mm)
      continue;
    known_.midpoint_mm = std::max(known_.midpoint_mm, of.midpoint_mm);
    known_.predicted_mm = std::max(known_.predicted_mm, of.predicted_mm);
    segment.first = of.first;
    segment.report = static_cast<std::int32_t>(chunk.reports.size());
    path::SegmentReport& report = chunk.reports.emplace_back(refiner_.kept());
    report.inserted = of.inserted;
    report.midpoint_mm = of.midpoint_mm;
    report.predicted_mm = of.predicted_mm;
  }
}

// Once more, where segments bow farther than any figure that is known: the widest of them alone makes it
// known.
void Preparer::settle_all(Chunk& chunk) {
  settle(chunk);
  const auto widest = even_->widest_unknown();
  if (!widest) return;
  decide(chunk, *widest, chunk.tolerances[0].tolerance);
  settle(chunk);
}

void Preparer::prepare(Chunk& chunk) {
  if (chunk.failure) return;
  const std::size_t count = chunk.size();
  chunk.leave_unprepared();
  if (count == 0) return;
  place(chunk);
  if (whole_runs_) return;
  try {
    refine(chunk);
  } catch (const Failure&) {
    // Somewhere in the chunk: the pipeline meets the first of them in the order of the file.
    chunk.leave_unprepared();
  }
}

void Preparer::refine(Chunk& chunk) {
  const std::size_t count = chunk.size();
  // Where the tolerance changes within the chunk the refiner decides.
  const bool judged = kinematics_.side_by_side() && chunk.tolerances.size() == 1 && refiner_.bounds_decide();
  if (corrections_) off_mm_.assign(count, path::CorrectionRun::NominalPlace::kUnknown);
  // What leaves too little to the errors is looked at more sharply.
  left_to_errors_mm_ = std::numeric_limits<double>::infinity();
  if (even_ && corrections_) {
    const double limit_mm = corrections_->limit_mm(chunk.tolerances[0].tolerance.tip_mm);
    if (limit_mm > 0.0) left_to_errors_mm_ = limit_mm;
  }
  undecided_.clear();
  for (std::size_t i = 0; i < count; ++i) {
    if (chunk.points[i].rapid || chunk.chosen[i].reconfigure || (i == 0 && !chunk.has_before)) continue;
    if (judged && settled_on_grid(i)) {
      chunk.segments[i].report = PreparedSegment::kKept;
    } else {
      undecided_.push_back(i);
    }
  }
  if (judged) keep_what_does_not_count(chunk);
  if (judged && even_) settle_all(chunk);
  std::size_t next = 0;
  path::Tolerance tolerance = chunk.tolerances[0].tolerance;
  for (const std::size_t i : undecided_) {
    if (chunk.segments[i].known()) continue;
    for (; next < chunk.tolerances.size() && chunk.tolerances[next].motion <= i; ++next) {
      tolerance = chunk.tolerances[next].tolerance;
    }
    decide(chunk, i, tolerance);
  }
  if (corrections_ && chunk.tolerances.size() == 1) correct(chunk);
}

}  // namespace trunnion::post
