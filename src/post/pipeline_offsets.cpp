// Thermal offsets in the program: followed at every point, or one shift of the work offset for each
// operation.
#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/base/number_text.hpp"

#include "post/pipeline.hpp"

namespace trunnion::post {

Result<void> Pipeline::begin_offsets() {
  if (!offsets_ || !shifts()) return {};
  if (variables()) {
    shift_due_ = true;
    if (!controller_.has_run_time_values())
      return fail(ErrorCode::wrong_use,
                  "the control '" + controller_.name + "' has no words for values at run time ([run_time])");
    if (job_.run_time_drift != nullptr && !controller_.has_run_time_temperatures())
      return fail(ErrorCode::wrong_use, "the control '" + controller_.name +
                                            "' has no words for calculating with temperatures "
                                            "([run_time_temperatures])");
    return {};
  }
  const auto kind = shift_.kind(job_.offset_output == OffsetOutput::local_shift);
  if (!kind) return tl::unexpected(kind.error());
  shift_kind_ = *kind;
  if (*kind == nc::OffsetShift::Kind::set) {
    const Vec3 value = work_offset_words(machine_, options_.rtcp);
    diagnostics_.warning(machine_.file, {},
                         "the program sets its work offset to X" + fixed_text(value.x(), 4) + " Y" +
                             fixed_text(value.y(), 4) + " Z" + fixed_text(value.z(), 4) +
                             " and shifts of it: that must be what the control has there (--thermal-output "
                             "local-shift leaves it alone)");
  }
  shift_due_ = job_.offsets->key == thermal::OffsetTable::Key::time;
  return {};
}

void Pipeline::begin_operation(const std::string& name) {
  if (!offsets_) return;
  offsets_->operation(name);
  if (job_.offsets->of_operation(name) != nullptr) ++operations_known_;
  operation_ = name;
  shift_due_ = shifts();
}

void Pipeline::elapse(double seconds) {
  report_.duration_s += seconds;
  if (offsets_) offsets_->advance(seconds);
}

void Pipeline::pause(double seconds) {
  state_.wait(seconds);
  elapse(seconds);
}

void Pipeline::prepare_shift(const JointVector& q) {
  if (!shift_due_) return;
  if (variables()) return;
  shift_due_ = false;
  offsets_->hold();
  const Vec3 deviation_P = offsets_->deviation_P(part_in_machine(machine_, q).R);
  const nc::OffsetShift wanted = shift_.take_out(deviation_P, q, options_.rtcp, shift_kind_);
  report_.largest_error_mm = std::max(report_.largest_error_mm, deviation_P.norm());
  if (shift_now_ && shift_now_->offset == wanted.offset) return;
  shift_waits_ = wanted;
  // Tool-centre-point control is off while the offset changes: the tool must be away from the part.
  if (options_.rtcp) approach_ = true;
}

Result<void> Pipeline::emit_shift() {
  if (variables() && shift_due_) return emit_latch();
  if (!shift_waits_) return {};
  if (shift_kind_ == nc::OffsetShift::Kind::set) {
    if (auto r = write(nc::WorkOffset{shift_waits_->index}); !r) return r;
  }
  if (auto r = write(*shift_waits_); !r) return r;
  ++report_.offset_shifts;
  shift_now_ = std::exchange(shift_waits_, std::nullopt);
  return {};
}

// The control takes its three values anew, calculated from its temperatures where there is a model for that.
Result<void> Pipeline::emit_latch() {
  shift_due_ = false;
  const bool first = latched_s_ < 0.0;
  if (job_.run_time_drift != nullptr) {
    if (auto r = emit_calculation(first); !r) return r;
  }
  const thermal::OffsetLimits& limits = job_.offset_limits;
  const auto quanta = [&](double mm) { return controller_.numbers.axes.quanta(nc::AxisLetter::X, mm); };
  nc::LatchValues latch;
  latch.first = first;
  latch.clamp = quanta(limits.clamp_mm);
  latch.dead_band = quanta(limits.dead_band_mm);
  // Nothing is being cut yet at the first one.
  const double most_mm = 2.0 * limits.clamp_mm;
  latch.step =
      quanta(first ? most_mm : std::min(most_mm, limits.slew_mm_s * (report_.duration_s - latched_s_)));
  latched_s_ = report_.duration_s;
  ++report_.offset_shifts;
  return write(latch);
}

Result<void> Pipeline::emit_calculation(bool first) {
  using Kind = nc::RunTimeStep::Kind;
  const Eigen::Matrix3Xd& drift = job_.run_time_drift->mm_per_K;
  const auto sensors = static_cast<std::size_t>(drift.cols());
  nc::RunTimeStep step;
  const auto put = [&](Kind kind) {
    step.kind = kind;
    return write(step);
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
void Pipeline::note_terms(const nc::VariableMotion& motion, const JointVector& q, bool feed) {
  const double clamp_mm = job_.offset_limits.clamp_mm;
  const Mat3 R_MP = part_in_machine(machine_, q).R;
  const bool constant = (job_.offsets->frame == thermal::OffsetFrame::part) == options_.rtcp;
  if (feed && terms_R_MP_ && !constant) {
    const double turn = rotation_vector(Mat3(terms_R_MP_->transpose() * R_MP)).norm();
    report_.run_time_bend_mm =
        std::max(report_.run_time_bend_mm, std::sqrt(3.0) * clamp_mm * turn * turn / 8.0);
  }
  terms_R_MP_ = R_MP;
  const double unit = std::pow(10.0, -nc::kCoefficientDecimals);
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    const auto i = nc::index(letters_[id]);
    if (machine_.axes[id].kind != AxisKind::linear || i > 2 || options_.rtcp) continue;
    double reach_mm = 0.0;
    for (const std::int64_t c : motion.coefficient[i])
      reach_mm += std::abs(static_cast<double>(c)) * unit * clamp_mm;
    JointVector most = q;
    most[id] += q[id] > 0.5 * (least_[id] + most_[id]) ? reach_mm : -reach_mm;
    terms_beyond_ = terms_beyond_ || !(most[id] >= least_[id] && most[id] <= most_[id]);
  }
}

nc::VariableMotion Pipeline::with_terms(const nc::Motion& motion, const JointVector& q) const {
  nc::VariableMotion out{motion, {}};
  const bool drift_in_part = job_.offsets->frame == thermal::OffsetFrame::part;
  const Mat3 R_PM = part_in_machine(machine_, q).R.transpose();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 unit = Vec3::Unit(static_cast<Eigen::Index>(k));
    const ShiftWords words = shift_.words_against(drift_in_part ? unit : Vec3(R_PM * unit), q, options_.rtcp);
    for (std::size_t i = 0; i < 3; ++i) {
      out.coefficient[i][k] =
          std::llround(words[static_cast<Eigen::Index>(i)] * std::pow(10.0, nc::kCoefficientDecimals));
    }
  }
  return out;
}

JointVector Pipeline::shifted(const JointVector& q) {
  if (!offsets_ || !shifts() || variables()) return q;
  const Vec3 left = offsets_->deviation_P(part_in_machine(machine_, q).R) + shift_.effect_P(q, options_.rtcp);
  report_.shift_error_mm = std::max(report_.shift_error_mm, left.norm());
  return shift_.joints(q, options_.rtcp);
}

Result<void> Pipeline::finish_offsets() {
  if (!offsets_) return {};
  const auto warn = [&](const std::string& text) { diagnostics_.warning(job_.offsets->file, {}, text); };
  const auto um = [](double mm) { return fixed_text(mm / kMmPerUm, 1) + " um"; };
  if (job_.offsets->key == thermal::OffsetTable::Key::operation && operations_known_ == 0) {
    return fail(ErrorCode::wrong_input, "none of the operations of the offsets stands in " + job_.cl_file,
                job_.offsets->file);
  }
  if (offsets_->clamped())
    warn("offsets beyond the clamp of " + um(job_.offset_limits.clamp_mm) + " are not followed");
  if (offsets_->slew_limited())
    warn("offsets that change by more than " + um(job_.offset_limits.slew_mm_s) + "/s are followed late");
  if (terms_beyond_)
    warn("with offsets as large as the clamp of " + um(job_.offset_limits.clamp_mm) +
         " the program leaves the travel of an axis");
  if (!shifts() || variables()) return {};
  if (report_.shift_error_mm > job_.offset_limits.dead_band_mm) {
    warn(std::string("the work offset ") +
         (options_.rtcp ? "turns with the table under tool-centre-point control"
                        : "does not turn with the table, as the offset does") +
         ": one shift for each operation is wrong by up to " + um(report_.shift_error_mm) +
         " where the table stands otherwise than at its beginning (axis values would not be)");
  }
  if (!shift_now_) return {};
  return write(shift_.none(options_.rtcp, shift_kind_));
}

}  // namespace trunnion::post
