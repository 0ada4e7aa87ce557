// Thermal offsets in the program: followed at every point, or one shift of the work offset for each
// operation.
#include <algorithm>
#include <utility>

#include "trunnion/base/number_text.hpp"

#include "post/pipeline.hpp"

namespace trunnion::post {

Result<void> Pipeline::begin_offsets() {
  if (!offsets_ || !shifts()) return {};
  const auto kind = shift_.kind(job_.offset_output == OffsetOutput::local_shift);
  if (!kind) return tl::unexpected(kind.error());
  shift_kind_ = *kind;
  if (*kind == nc::OffsetShift::Kind::set) {
    const Vec3 value = work_offset_words(machine_, options_.rtcp);
    diagnostics_.warning(machine_.file, {},
                         "the program sets work offset 1 to X" + fixed_text(value.x(), 4) + " Y" +
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
  if (!shift_waits_) return {};
  if (shift_kind_ == nc::OffsetShift::Kind::set) {
    if (auto r = write(nc::WorkOffset{shift_waits_->index}); !r) return r;
  }
  if (auto r = write(*shift_waits_); !r) return r;
  ++report_.offset_shifts;
  shift_now_ = std::exchange(shift_waits_, std::nullopt);
  return {};
}

JointVector Pipeline::shifted(const JointVector& q) {
  if (!offsets_ || !shifts()) return q;
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
  if (!shifts()) return {};
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
