#include "post/intake/path_tolerances.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion::post {
namespace {

// Under tool-centre-point control the tip keeps its line by itself: points are inserted for the tool axis
// only.
constexpr double kNoTipError_mm = 1e9;

// Of the tool axis' tolerance: a hundredth of a degree, 175 urad, of the usual 0.05 is more than the angular
// errors of a machine change within a block.
constexpr double kAxisShareWithErrors = 0.8;
// Of the tip's: a block that takes up lost motion ends on the grid of a rotary word, half a digit of which is
// a micrometre and more at the tip, and axes that would have to reverse for that do not. A tenth, as for
// pieces over several segments. Of 27 090 random programs on machines that lose motion five then leave their
// tolerance, 0.003 mm, and are refused.
constexpr double kTipShareWithLostMotion = 0.9;
// What axes that follow late leave at corners, led as they are.
constexpr double kTipShareWithLags = 0.8;

// Of a rapid's tolerance: the rest is left to errors and offsets, of which nothing is corrected between
// points.
constexpr double kRapidShare = 0.9;

// Of a flute's tolerance: the axes correct errors of the tip and of the tool's direction at the points, and
// nothing between them.
constexpr double kFluteShareWithErrors = 0.9;

// Largest distance by which rounding moves a tip whose coordinates are the words X Y Z.
double half_diagonal_mm(const nc::Controller& controller) {
  double sum = 0.0;
  for (const auto letter : {nc::AxisLetter::X, nc::AxisLetter::Y, nc::AxisLetter::Z}) {
    const double quantum = controller.numbers.axes.quantum(letter);
    sum += quantum * quantum;
  }
  return 0.5 * std::sqrt(sum);
}

// Largest angle by which rounding turns a tool that two rotary axes turn to places at right angles.
double half_turn_diagonal(const Machine& machine, const nc::Controller& controller) {
  double sum = 0.0;
  for (const Axis& axis : machine.axes) {
    const auto letter = nc::axis_letter(axis.name);
    if (axis.kind != AxisKind::rotary || !letter) continue;
    const double quantum = controller.numbers.axes.quantum(*letter);
    sum += quantum * quantum;
  }
  return 0.5 * std::sqrt(sum);
}

double tip_share(const PostJob& job) {
  const bool loses = job.model != nullptr && ModelEvaluator(*job.model).depends_on() >= DependsOn::motion;
  if (loses) return kTipShareWithLostMotion;
  return job.lag_s == JointVector() ? 1.0 : kTipShareWithLags;
}

}  // namespace

PathTolerances::PathTolerances(const PostJob& job, const PostOptions& options)
    : options_(options),
      axis_share_(job.model != nullptr ? kAxisShareWithErrors : 1.0),
      axis_given_(options.axis_tolerance.value_or(job.machine->axis_tolerance) * axis_share_),
      tip_share_(tip_share(job)),
      tip_given_mm_(options.tolerance_mm * tip_share_),
      word_error_mm_(options.rtcp ? half_diagonal_mm(*job.controller) : 0.0),
      flute_share_(job.model != nullptr || job.offsets != nullptr ? kFluteShareWithErrors : 1.0),
      asked_mm_(options.tolerance_mm),
      turn_error_(job.model != nullptr ? half_turn_diagonal(*job.machine, *job.controller) : 0.0),
      cutting_{options.rtcp ? kNoTipError_mm : tip_given_mm_, axis_given_, {0.0, tip_given_mm_}},
      rapid_given_mm_(kRapidShare * options.rapid_tolerance_mm),
      rapid_{options.rtcp ? kNoTipError_mm : rapid_given_mm_, Angle::radians(kPi)} {}

void PathTolerances::set_flute(double length_mm) {
  constexpr double kLeastShare = 0.5;  // the rest fails in the verification
  const double tip_mm = asked_mm_ * tip_share_;
  const double words_mm = word_error_mm_ + length_mm * turn_error_;
  cutting_.flute = {length_mm, std::max(kLeastShare * tip_mm, tip_mm * flute_share_ - words_mm)};
}

// LINTOL asks for at most this deviation; the command line is a limit too, so the smaller of both holds.
void PathTolerances::take(const cl::Tolerance& t) {
  if (!t.on) return;
  if (t.applies == cl::Tolerance::Applies::feed) {
    const double tip_mm = std::min(tip_given_mm_, t.value_mm.value_or(options_.tolerance_mm) * tip_share_);
    asked_mm_ = tip_mm / tip_share_;
    set_flute(cutting_.flute.length_mm);
    if (!options_.rtcp) cutting_.tip_mm = tip_mm;
  } else if (t.applies == cl::Tolerance::Applies::rapid && t.value_mm) {
    if (!options_.rtcp) rapid_.tip_mm = std::min(rapid_given_mm_, kRapidShare * *t.value_mm);
  } else if (t.applies == cl::Tolerance::Applies::axis && t.axis_angle) {
    cutting_.axis = std::min(axis_given_, Angle::radians(*t.axis_angle) * axis_share_);
  }
}

}  // namespace trunnion::post
