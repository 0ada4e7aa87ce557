#include "post/making/pipeline.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/base/number_text.hpp"

namespace trunnion::post {
Pipeline::Pipeline(const PostJob& job, const PostOptions& options)
    : posting_(job, options),
      tool_(posting_, {options.tools.length_mm.value_or(posting_.machine.tool_length_mm)}),
      axis_words_(posting_, tool_.tool),
      refined_(posting_, tool_.tool.vector(), axis_words_.rounding()),
      planner_(posting_.machine, posting_.controller, options.feed),
      modes_{PathTolerances(job, options), {}},
      planes_(posting_),
      head_(posting_),
      errors_(job),
      spindle_(posting_),
      thermal_(posting_) {
  set_tool(tool_.tool);
  errors_.by_place = errors_.compensator != nullptr && axis_words_.fill_runs() &&
                     course_.meter().is_fixed() && !errors_.lose_motion && !errors_.know_history;
}

void Pipeline::set_tool(const SpindleTool& tool) {
  const Vec3 vector = tool.vector();
  tool_.set(posting_, tool);
  axis_words_.set_tool(tool);
  refined_.set_tool(posting_, vector, axis_words_.rounding());
  errors_.set_tool(tool);
  modes_.tolerances.set_flute(tool.flute_mm);
  if (errors_.compensator == nullptr && !thermal_.has_offsets()) return;
  course_.set_meter(errors_.state, posting_.machine, vector, errors_.evaluator.get(), thermal_.followed(),
                    posting_.options.nonlinear.certify, posting_.options.tolerance_mm,
                    posting_.options.axis_tolerance.value_or(posting_.machine.axis_tolerance));
}

Result<void> Pipeline::begin() {
  return thermal_.begin();
}

Result<void> Pipeline::begin_text(const Chunk& chunk) {
  if (auto r = head_.write(chunk); !r) return r;
  thermal_.call(nc::WorkOffset{posting_.report.work_offset});
  return {};
}

Result<void> Pipeline::emit(Chunk& chunk) {
  if (chunk.failure) return tl::unexpected(*chunk.failure);
  now_.chunk = &chunk;
  if (chunk.tool != tool_.tool) set_tool(chunk.tool);
  if (!head_.is_written()) {
    if (auto begun = begin_text(chunk); !begun) return begun;
  }
  tell_notes();
  if (posting_.options.tilted_plane && !chunk.motions.empty()) choose_plane();
  auto done = emit_run();
  now_.chunk = nullptr;
  chunk.text.swap(posting_.text);
  return done;
}

// A motion whose length the post does not know or that only leaves or enters: F per minute.
Result<void> Pipeline::emit_feed_per_minute(const JointVector& q, double rate_mm_s, SourceRef where) {
  const nc::FeedFormat& format = posting_.controller.numbers.feed;
  const double rate = std::min(rate_mm_s, planner_.linear_rate_mm_s());
  BlockFeed feed;
  feed.quanta = format.quanta(nc::FeedMode::per_minute, rate);
  if (format.internal(nc::FeedMode::per_minute, feed.quanta) > rate && feed.quanta > 1) --feed.quanta;
  return emit_motion(q, nc::MotionKind::feed, feed, where);
}

Result<void> Pipeline::emit_feed(const path::Point& to, const cl::Feed& feed, SourceRef where, int depth) {
  const double tip_mm = (to.tip_P - at_.point.tip_P).norm();
  const auto rate = feed_rate(feed, tip_mm, where);
  if (!rate) return tl::unexpected(rate.error());
  auto found = corrected(to, tip_mm / *rate);
  if (!found) return tl::unexpected(found.error());
  if (errors_.lose_motion) {
    const auto taken_up = emit_take_up(*found, where);
    if (!taken_up) return tl::unexpected(taken_up.error());
    if (*taken_up) found = corrected(to, tip_mm / *rate);
    if (!found) return tl::unexpected(found.error());
  }
  if (*found == at_.joints) return {};
  return emit_corrected(to, *found, *rate, feed, where, depth);
}

Result<void> Pipeline::emit_corrected(const path::Point& to, JointVector q, double rate_mm_s,
                                      const cl::Feed& feed, SourceRef where, int depth) {
  const double tip_mm = (to.tip_P - at_.point.tip_P).norm();
  // A point between the two, compensated itself.
  const auto in_halves = [&]() -> Result<void> {
    const path::Point middle = middle_before(to);
    ++posting_.report.points_inserted;
    if (auto r = emit_feed(middle, feed, where, depth + 1); !r) return r;
    at_.point = middle;
    return emit_feed(to, feed, where, depth + 1);
  };
  // The errors bend the path between the two.
  const bool bent = (errors_.compensator || thermal_.follows()) && depth < kMaxBends && bends(to, q);
  if (bent || (depth < kMaxBends && lasts_long(q, tip_mm, rate_mm_s))) return in_halves();
  const FeedPlanner::Move move = move_to(q, tip_mm);
  BlockFeed block = planner_.plan(move, rate_mm_s);
  at_.holds_digits = false;
  // Of a way of one digit even the smallest F may be too fast for axes that turn far.
  if (block.other_mode || block.runs_away() || block.seconds < move.axes_s) {
    if (const auto held = without_idle_digits(to, q)) {
      q = *held;
      at_.holds_digits = true;
      ++posting_.report.blocks_held;
      block = planner_.plan(move_to(q, tip_mm), rate_mm_s);
    } else if (block.seconds < move.axes_s && depth < kMaxBends) {
      return in_halves();
    }
  }
  moved(q, block.seconds);
  posting_.report.feed_time_lost_s += block.lost_s;
  at_.joints = q;
  return emit_motion(q, nc::MotionKind::feed, block, where);
}

void Pipeline::elapse(double seconds) {
  posting_.report.duration_s += seconds;
  thermal_.advance(seconds);
}

void Pipeline::pause(double seconds) {
  errors_.state.wait(seconds);
  elapse(seconds);
}

Result<double> Pipeline::feed_rate(const cl::Feed& feed, double segment_mm, SourceRef where) {
  switch (feed.mode) {
    case cl::FeedMode::per_minute:
      return feed.value;
    case cl::FeedMode::per_revolution:
      if (spindle_.rpm() > 0.0) return feed.value * spindle_.rpm() / kSecondsPerMinute;
      return fail(ErrorCode::wrong_input, "the feed is given per revolution and the spindle has no speed",
                  posting_.job.cl_file, where);
    case cl::FeedMode::inverse:
      return std::max(feed.value * segment_mm, 1e-6);
    case cl::FeedMode::none:
      break;
  }
  posting_.diagnostics.warning_once(
      "no feed", posting_.job.cl_file, where,
      "no FEDRAT before this motion: the default feed of " +
          fixed_text(posting_.options.default_feed_mm_s * kSecondsPerMinute, 1) + " mm/min is used");
  return posting_.options.default_feed_mm_s;
}

void Pipeline::moved(const JointVector& q, double seconds) {
  if (!errors_.know_history) return elapse(seconds);
  const auto lagged = errors_.state.lagged();
  const std::vector<double> before(lagged.begin(), lagged.end());
  errors_.state.move_to(q, seconds);
  elapse(seconds);
  if (before.empty()) return;
  const Vec3 then = errors_.compensator->actual(errors_.state.now(), before).tip_P;
  const Vec3 now = errors_.compensator->actual(errors_.state.now(), errors_.state.lagged()).tip_P;
  posting_.report.lag_step_mm = std::max(posting_.report.lag_step_mm, (now - then).norm());
}

bool Pipeline::axis_stands(const path::Point& to) const {
  return errors_.turner != nullptr && at_.known && to.axis_P == at_.point.axis_P &&
         same_rotary(to.q, at_.point.q);
}

// The rotary words are rounded first: the linear axes answer what that leaves at the tip. Where the tool axis
// stands the words of the block before are kept as long as they hold the flute: a turn by a digit would free
// the clamps in the cut.
Result<void> Pipeline::turn_for_errors(const path::Point& point, const Vec3& tip_P, MachineState& at) {
  constexpr double kHeld = 0.5;  // of the tolerance: a cut with a fixed axis bends by nothing else
  const auto turn_to = [&](MachineState& state, const auto& angle) {
    for (std::size_t k = 0; k < tool_.kinematics.rotary_count() && !planes_.in_force(); ++k) {
      const AxisId id = tool_.kinematics.rotary(k);
      state.q[id] = angle(id);
    }
    tool_.kinematics.solve_linear(tip_P, tool_.kinematics.sines(state.q), state.q);
  };
  if (axis_stands(point)) {
    MachineState held = at;
    turn_to(held, [&](AxisId id) { return at_.joints[id]; });
    const auto there = compensated(tip_P, point.axis_P, held);
    const auto end_off_mm = [&] {
      return (point.beside_P + tool_.tool.flute_mm * (there->axis_P - point.axis_P)).norm();
    };
    if (there && end_off_mm() <= kHeld * modes_.tolerances.tolerance_mm()) {
      at.q = held.q;
      return {};
    }
  }
  const auto turned = errors_.turner->corrected(tip_P, point.axis_P, at, errors_.state.lagged());
  if (!turned) return tl::unexpected(turned.error());
  turn_to(at, [&](AxisId id) { return axis_words_.rounded(id, turned->q[id]); });
  return {};
}

Result<JointVector> Pipeline::corrected(const path::Point& point, double seconds) {
  JointVector q = point.q;
  if (!errors_.compensator && !thermal_.has_offsets() && !in_part()) {
    axis_words_.check_travel(q, tool_.tool, point.where);
    return q;
  }
  if (errors_.lose_motion) hold_idle_turns(q);
  Vec3 tip_P = point.tip_P + point.beside_P;
  // The grid of a plane's words is not that of the joints.
  if (planes_.in_force()) tool_.kinematics.solve_linear(tip_P, tool_.kinematics.sines(q), q);
  if (thermal_.follows()) {
    // A deviation of the tool is answered by its opposite.
    const Vec3 deviation_P = thermal_.deviation_P(q);
    tip_P -= deviation_P;
    tool_.kinematics.solve_linear(tip_P, tool_.kinematics.sines(q), q);
    round_joints(q);
    posting_.report.largest_error_mm = std::max(posting_.report.largest_error_mm, deviation_P.norm());
  }
  if (errors_.compensator) {
    MachineState at =
        errors_.know_history ? errors_.state.towards(expected(q), q, seconds) : errors_.state.now();
    at.q = q;
    const auto at_point = [&](Error error) {
      error.file = posting_.job.cl_file;
      error.where = point.where;
      return tl::unexpected(error);
    };
    if (errors_.turner) {
      if (auto done = turn_for_errors(point, tip_P, at); !done) return at_point(done.error());
      q = at.q;
    }
    const auto found = compensated(tip_P, point.axis_P, at);
    if (!found) return at_point(found.error());
    if (found->held) {
      posting_.diagnostics.warning_once("table range", posting_.job.cl_file, point.where,
                                        errors_.compensator->range_message(at));
    }
    double correction2 = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double by = found->q[tool_.kinematics.linear(i)] - q[tool_.kinematics.linear(i)];
      correction2 += by * by;
    }
    const double correction_mm = std::sqrt(correction2);
    if (correction_mm > posting_.options.largest_correction_mm) {
      const auto most = errors_.compensators->largest_effect(at, tool_.tool.length_mm);
      return fail(ErrorCode::check_failed,
                  "the model asks for a correction of " + fixed_text(correction_mm, 4) + " mm here, '" +
                      most.id + "' alone for " + fixed_text(most.tip_mm, 4) + " mm; at most " +
                      shortest_text(posting_.options.largest_correction_mm) +
                      " mm is taken to be meant (--largest-correction-mm)",
                  posting_.job.cl_file, point.where);
    }
    posting_.report.largest_correction_mm = std::max(posting_.report.largest_correction_mm, correction_mm);
    posting_.report.largest_error_mm = std::max(posting_.report.largest_error_mm, found->before_mm);
    q = found->q;
    errors_.aim_P = found->aim_P;
    round_joints(q);
  }
  // What the axes do follows from the words, and those are rounded.
  if (in_part()) tool_.kinematics.solve_linear(word_tip_P(q), tool_.kinematics.sines(q), q);
  axis_words_.check_travel(thermal_.shifted(q), tool_.tool, point.where);
  return q;
}

void Pipeline::round_joints(JointVector& q) const {
  for (AxisId id = 0; id < posting_.machine.axes.size(); ++id) {
    if (planes_.in_force() && posting_.machine.axes[id].kind == AxisKind::linear) continue;
    q[id] = axis_words_.rounded(id, q[id]);
  }
}

// Where a nominal position will be sent to, as far as it can be told before: shifted as the last one was.
JointVector Pipeline::expected(const JointVector& nominal) const {
  JointVector q = nominal;
  for (AxisId id = 0; id < posting_.machine.axes.size(); ++id) q[id] += at_.joints[id] - at_.point.q[id];
  return q;
}

Result<void> Pipeline::emit_motion(const JointVector& q, nc::MotionKind kind, const BlockFeed& feed,
                                   SourceRef where, std::uint16_t only) {
  if (only == kAllWords && !in_part() && !thermal_.is_at_run_time()) return write_plain(q, kind, feed, where);
  const JointVector words = this->words(q);
  nc::Motion motion;
  motion.kind = kind;
  motion.feed_mode = feed.mode;
  motion.feed = feed.quanta;
  motion.source = where;
  const std::size_t axes = posting_.machine.axes.size();
  for (AxisId id = 0; id < axes; ++id) {
    if ((only & nc::AxisWords::bit(posting_.letters[id])) == 0) continue;
    if (planes_.in_force() && posting_.machine.axes[id].kind == AxisKind::rotary)
      continue;  // the control keeps them
    motion.words.set(posting_.letters[id],
                     posting_.controller.numbers.axes.quanta(posting_.letters[id], words[id]));
  }
  if (motion.words.mask == 0) return {};
  return thermal_.is_at_run_time() ? thermal_.write_motion(motion, q) : posting_.writer.write(motion);
}

Result<void> Pipeline::finish(const Intake& intake, Chunk& end) {
  posting_.report.points_in = intake.points();
  posting_.report.choice = intake.choice();
  posting_.report.tools = intake.tools().loaded();
  intake.tools().warn_of_machine_file(posting_.job.cl_file, posting_.diagnostics);
  if (!head_.is_written()) {
    if (auto r = begin_text(Chunk()); !r) return r;
  }
  if (auto r = emit_end(); !r) return r;
  if (auto r = posting_.write(nc::ProgramEnd{}); !r) return r;
  end.text.swap(posting_.text);
  return {};
}

Result<PostReport> Pipeline::report() {
  if (auto r = axis_words_.tell_beyond_travel(posting_); !r) return tl::unexpected(r.error());
  posting_.report.nc_lines = posting_.writer.lines();
  return std::move(posting_.report);
}

}  // namespace trunnion::post
