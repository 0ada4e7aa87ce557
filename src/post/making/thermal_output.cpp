#include "post/making/thermal_output.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/base/number_text.hpp"

namespace trunnion::post {

ThermalOutput::ThermalOutput(Posting& posting)
    : posting_(posting), shift_(posting.machine, posting.controller) {
  const PostJob& job = posting.job;
  if (job.offsets == nullptr) return;
  tracker_.emplace(*job.offsets, job.offset_limits,
                   is_by_operation() ? OffsetTracker::Follow::operations : OffsetTracker::Follow::always);
}

Result<void> ThermalOutput::begin() {
  if (!shifts()) return {};
  if (is_at_run_time()) {
    due_ = true;
    if (!posting_.controller.has_run_time_values())
      return fail(ErrorCode::wrong_use, "the control '" + posting_.controller.name +
                                            "' has no words for values at run time ([run_time])");
    if (posting_.job.run_time_drift != nullptr && !posting_.controller.has_run_time_temperatures())
      return fail(ErrorCode::wrong_use, "the control '" + posting_.controller.name +
                                            "' has no words for calculating with temperatures "
                                            "([run_time_temperatures])");
    return {};
  }
  const auto kind = shift_.kind(posting_.job.offset_output == OffsetOutput::local_shift);
  if (!kind) return tl::unexpected(kind.error());
  kind_ = *kind;
  if (*kind == nc::OffsetShift::Kind::set) {
    const Vec3 value = work_offset_words(posting_.machine, posting_.options.rtcp);
    posting_.diagnostics.warning(
        posting_.machine.file, {},
        "the program sets its work offset to X" + fixed_text(value.x(), 4) + " Y" + fixed_text(value.y(), 4) +
            " Z" + fixed_text(value.z(), 4) +
            " and shifts of it: that must be what the control has there (--thermal-output "
            "local-shift leaves it alone)");
  }
  due_ = posting_.job.offsets->key == thermal::OffsetTable::Key::time;
  return {};
}

void ThermalOutput::begin_operation(const std::string& name) {
  if (!tracker_) return;
  tracker_->operation(name);
  if (posting_.job.offsets->of_operation(name) != nullptr) {
    ++operations_named_;
  } else if (std::find(without_row_.begin(), without_row_.end(), name) == without_row_.end()) {
    without_row_.push_back(name);
  }
  operation_ = name;
  due_ = is_by_operation();
}

bool ThermalOutput::prepare_shift(const JointVector& q) {
  if (!due_ || is_at_run_time()) return false;
  due_ = false;
  tracker_->hold();
  const Vec3 deviation_P = this->deviation_P(q);
  const nc::OffsetShift wanted = shift_.take_out(deviation_P, q, posting_.options.rtcp, kind_);
  posting_.report.largest_error_mm = std::max(posting_.report.largest_error_mm, deviation_P.norm());
  if (written_ && written_->offset == wanted.offset) return false;
  prepared_ = wanted;
  // Tool-centre-point control is off while the offset changes.
  return posting_.options.rtcp;
}

Result<void> ThermalOutput::write_shift() {
  if (is_at_run_time() && due_) return latch();
  if (!prepared_) return {};
  if (kind_ == nc::OffsetShift::Kind::set) {
    if (auto r = posting_.write(nc::WorkOffset{prepared_->index}); !r) return r;
  }
  if (auto r = posting_.write(*prepared_); !r) return r;
  ++posting_.report.offset_shifts;
  written_ = std::exchange(prepared_, std::nullopt);
  return {};
}

void ThermalOutput::renew() {
  constexpr double kOld_s = 60.0;
  if (is_at_run_time() && latched_s_ >= 0.0 && posting_.report.duration_s - latched_s_ > kOld_s) due_ = true;
}

// The control takes its three values anew, calculated from its temperatures where there is a model for that.
Result<void> ThermalOutput::latch() {
  due_ = false;
  const bool first = latched_s_ < 0.0;
  if (posting_.job.run_time_drift != nullptr) {
    if (auto r = write_calculation(first); !r) return r;
  }
  const thermal::OffsetLimits& limits = posting_.job.offset_limits;
  const auto quanta = [&](double mm) {
    return posting_.controller.numbers.axes.quanta(nc::AxisLetter::X, mm);
  };
  nc::LatchValues values;
  values.first = first;
  values.clamp = quanta(limits.clamp_mm);
  values.dead_band = quanta(limits.dead_band_mm);
  // Nothing is being cut yet at the first one.
  const double most_mm = 2.0 * limits.clamp_mm;
  values.step = quanta(
      first ? most_mm : std::min(most_mm, limits.slew_mm_s * (posting_.report.duration_s - latched_s_)));
  latched_s_ = posting_.report.duration_s;
  ++posting_.report.offset_shifts;
  return posting_.write(values);
}

Result<void> ThermalOutput::write_calculation(bool first) {
  using Kind = nc::RunTimeStep::Kind;
  const Eigen::Matrix3Xd& drift = posting_.job.run_time_drift->mm_per_K;
  const auto sensors = static_cast<std::size_t>(drift.cols());
  nc::RunTimeStep step;
  const auto put = [&](Kind kind) {
    step.kind = kind;
    return posting_.write(step);
  };
  for (step.sensor = 0; step.sensor < sensors; ++step.sensor) {
    if (auto r = put(Kind::read); !r) return r;
  }
  if (first) {
    if (auto r = put(Kind::reset); !r) return r;
    for (step.sensor = 0; step.sensor < sensors; ++step.sensor) {
      if (auto r = put(Kind::reference); !r) return r;
    }
  }
  for (step.axis = 0; step.axis < 3; ++step.axis) {
    if (auto r = put(Kind::start); !r) return r;
    for (step.sensor = 0; step.sensor < sensors; ++step.sensor) {
      const double mm_per_K =
          drift(static_cast<Eigen::Index>(step.axis), static_cast<Eigen::Index>(step.sensor));
      step.factor = std::llround(mm_per_K * std::pow(10.0, nc::kFactorDecimals));
      if (step.factor == 0) continue;
      if (auto r = put(Kind::add); !r) return r;
    }
  }
  return {};
}

// What the clamp allows moves the axes, and bends the way between two poses: with the tool's turn phi in the
// part from one to the next, a straight way between the terms of both misses those in between by at most
// d phi^2 / 8.
void ThermalOutput::note_terms(const nc::VariableMotion& motion, const JointVector& q) {
  const double clamp_mm = posting_.job.offset_limits.clamp_mm;
  const Mat3 R_MP = part_in_machine(posting_.machine, q).R;
  const bool constant = (posting_.job.offsets->frame == thermal::OffsetFrame::part) == posting_.options.rtcp;
  if (motion.motion.kind == nc::MotionKind::feed && terms_R_MP_ && !constant) {
    const double turn = rotation_vector(Mat3(terms_R_MP_->transpose() * R_MP)).norm();
    posting_.report.run_time_bend_mm =
        std::max(posting_.report.run_time_bend_mm, std::sqrt(3.0) * clamp_mm * turn * turn / 8.0);
  }
  terms_R_MP_ = R_MP;
  const double unit = std::pow(10.0, -nc::kCoefficientDecimals);
  for (AxisId id = 0; id < posting_.machine.axes.size(); ++id) {
    const auto i = nc::index(posting_.letters[id]);
    if (posting_.machine.axes[id].kind != AxisKind::linear || i > 2 || posting_.options.rtcp) continue;
    double reach_mm = 0.0;
    for (const std::int64_t c : motion.coefficient[i])
      reach_mm += std::abs(static_cast<double>(c)) * unit * clamp_mm;
    JointVector most = q;
    const Axis& axis = posting_.machine.axes[id];
    most[id] += q[id] > 0.5 * (axis.min + axis.max) ? reach_mm : -reach_mm;
    terms_beyond_ = terms_beyond_ || !(most[id] >= axis.min && most[id] <= axis.max);
  }
}

Result<void> ThermalOutput::write_motion(const nc::Motion& motion, const JointVector& q) {
  if ((motion.words.mask & nc::kXyz) != nc::kXyz) return posting_.write(motion);
  const nc::VariableMotion with = with_terms(motion, q);
  note_terms(with, q);
  return posting_.write(with);
}

nc::VariableMotion ThermalOutput::with_terms(const nc::Motion& motion, const JointVector& q) const {
  nc::VariableMotion out{motion, {}};
  const bool drift_in_part = posting_.job.offsets->frame == thermal::OffsetFrame::part;
  const Mat3 R_PM = part_in_machine(posting_.machine, q).R.transpose();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 unit = Vec3::Unit(static_cast<Eigen::Index>(k));
    const ShiftWords words =
        shift_.words_against(drift_in_part ? unit : Vec3(R_PM * unit), q, posting_.options.rtcp);
    for (std::size_t i = 0; i < 3; ++i) {
      out.coefficient[i][k] =
          std::llround(words[static_cast<Eigen::Index>(i)] * std::pow(10.0, nc::kCoefficientDecimals));
    }
  }
  return out;
}

JointVector ThermalOutput::shifted(const JointVector& q) {
  if (!shifts() || is_at_run_time()) return q;
  const Vec3 left = deviation_P(q) + shift_.effect_P(q, posting_.options.rtcp);
  posting_.report.shift_error_mm = std::max(posting_.report.shift_error_mm, left.norm());
  return shift_.joints(q, posting_.options.rtcp);
}

// Offsets hold on where there are none: that of another day, or of another unit of time, looks the same.
void ThermalOutput::tell_what_is_not_covered() {
  const thermal::OffsetTable& table = *posting_.job.offsets;
  const auto warn = [&](const std::string& text) { posting_.diagnostics.warning(table.file, {}, text); };
  if (table.key == thermal::OffsetTable::Key::operation) {
    constexpr std::size_t kMostNames = 5;
    std::string names;
    for (std::size_t i = 0; i < std::min(without_row_.size(), kMostNames); ++i)
      names += (i > 0 ? ", " : "") + without_row_[i];
    if (without_row_.size() > kMostNames)
      names += " and " + std::to_string(without_row_.size() - kMostNames) + " more";
    if (!names.empty())
      warn("no row for the operations " + names + ": the offset before each of them is kept");
    return;
  }
  if (table.rows.size() < 2) return;
  constexpr double kSlack_s = 10.0;  // in which no machine drifts
  const double first_s = table.rows.front().time_s, last_s = table.rows.back().time_s;
  const double end_s = posting_.report.duration_s;
  if (first_s <= kSlack_s && last_s >= end_s - kSlack_s) return;
  warn("the offsets are those of " + fixed_text(first_s, 0) + " to " + fixed_text(last_s, 0) +
       " s, the program lasts from 0 to " + fixed_text(end_s, 0) +
       " s: outside them the first or last value is used");
}

Result<void> ThermalOutput::finish() {
  if (!tracker_) return {};
  const auto warn = [&](const std::string& text) {
    posting_.diagnostics.warning(posting_.job.offsets->file, {}, text);
  };
  const auto um = [](double mm) { return fixed_text(mm / kMmPerUm, 1) + " um"; };
  if (posting_.job.offsets->key == thermal::OffsetTable::Key::operation && operations_named_ == 0) {
    return fail(ErrorCode::wrong_input,
                "none of the operations of the offsets stands in " + posting_.job.cl_file,
                posting_.job.offsets->file);
  }
  tell_what_is_not_covered();
  if (tracker_->clamped())
    warn("offsets beyond the clamp of " + um(posting_.job.offset_limits.clamp_mm) + " are not followed");
  if (tracker_->slew_limited())
    warn("offsets that change by more than " + um(posting_.job.offset_limits.slew_mm_s) +
         "/s are followed late");
  if (terms_beyond_)
    warn("with offsets as large as the clamp of " + um(posting_.job.offset_limits.clamp_mm) +
         " the program leaves the travel of an axis");
  if (!shifts() || is_at_run_time()) return {};
  if (posting_.report.shift_error_mm > posting_.job.offset_limits.dead_band_mm) {
    warn(std::string("the work offset ") +
         (posting_.options.rtcp ? "turns with the table under tool-centre-point control"
                                : "does not turn with the table, as the offset does") +
         ": one shift for each operation is wrong by up to " + um(posting_.report.shift_error_mm) +
         " where the table stands otherwise than at its beginning (axis values would not be)");
  }
  if (!written_) return {};
  return posting_.write(shift_.none(posting_.options.rtcp, kind_));
}

}  // namespace trunnion::post
