#include "post/pipeline.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/base/number_text.hpp"

namespace trunnion::post {
namespace {

// Under tool-centre-point control the linear words are not joint positions: those are not rounded.
JointVector quantum_of(const Machine& machine, const nc::Controller& controller, bool rtcp) {
  JointVector out;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    if (rtcp && machine.axes[id].kind == AxisKind::linear) continue;
    out[id] = controller.numbers.axes.quantum(*nc::axis_letter(machine.axes[id].name));
  }
  return out;
}

VerifyOptions verify_options(const PostJob& job, const PostOptions& options, const Machine& machine,
                             const ModelEvaluator* truth) {
  VerifyOptions v;
  v.tolerance_mm = options.tolerance_mm;
  v.rapid_tolerance_mm = options.rapid_tolerance_mm;
  v.axis_tolerance = options.axis_tolerance.value_or(machine.axis_tolerance);
  v.pole = options.pole;
  v.certify = options.nonlinear.certify;
  v.truth = truth;
  v.temperatures = job.temperatures;
  v.offsets = job.offsets;
  v.offset_limits = job.offset_limits;
  if (job.run_time_drift != nullptr) v.run_time_temperatures = &job.run_time_drift->history;
  v.tools = options.tools;
  v.work_offset = options.work_offset;
  v.smoothing_mm = options.smoothing_mm;
  v.default_feed_mm_s = options.default_feed_mm_s;
  v.collect = options.collect;
  return v;
}

}  // namespace

Pipeline::Pipeline(const PostJob& job, const PostOptions& options, const TextSink& sink,
                   Diagnostics& diagnostics)
    : job_(job),
      options_(options),
      sink_(sink),
      all_findings_(diagnostics),
      machine_(*job.machine),
      controller_(*job.controller),
      tool_{options.tools.length_mm.value_or(machine_.tool_length_mm)},
      quantum_(quantum_of(machine_, controller_, options.rtcp)),
      writer_(controller_, text_),
      kinematics_(machine_, tool_.vector()),
      rounding_(path::Rounding::of(machine_, tool_.in_words(), quantum_)),
      refiner_(machine_, tool_.vector(), rounding_, options.nonlinear),
      rapid_refiner_(machine_, tool_.vector(), rounding_, {}),
      planner_(machine_, controller_, options.feed),
      tolerances_(job, options),
      word_offsets_(words_of(machine_, JointVector(), tool_.in_words())),
      state_(machine_.axes.size(),
             job.model != nullptr ? lag_requests(*job.model) : std::vector<LagRequest>{}, job.temperatures),
      shift_(machine_, controller_) {
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    letters_[id] = *nc::axis_letter(machine_.axes[id].name);
    least_[id] = machine_.axes[id].min;
    most_[id] = machine_.axes[id].max;
    plain_.words.set(letters_[id], 0);
    quanta_per_unit_[id] = 1.0 / controller_.numbers.axes.quantum(letters_[id]);
    if (machine_.axes[id].kind != AxisKind::linear) continue;
    word_radius_mm_ = std::hypot(word_radius_mm_, 0.5 * rounding_.quantum[id]);
  }
  axis_count_ = machine_.axes.size();
  writes_runs_ = axis_count_ == nc::RunBlock::kAxes && !options.rtcp;
  if (job.model != nullptr) {
    evaluator_ = std::make_unique<ModelEvaluator>(*job.model);
    compensators_ = std::make_unique<Compensators>(*job.machine, *job.model);
    loses_motion_ = evaluator_->depends_on() >= DependsOn::motion;
    knows_history_ = evaluator_->depends_on() > DependsOn::position;
  }
  if (job.offsets != nullptr) {
    offsets_.emplace(*job.offsets, job.offset_limits,
                     shifts() ? OffsetTracker::Follow::operations : OffsetTracker::Follow::always);
  }
  set_tool(tool_);
  corrects_by_place_ =
      compensator_ != nullptr && writes_runs_ && meter_->is_fixed() && !loses_motion_ && !knows_history_;
  if (!options.verify) return;
  const std::string nc_file = "<program>";
  verifier_ = std::make_unique<Verifier>(*job.machine, controller_,
                                         verify_options(job, options, *job.machine, evaluator_.get()),
                                         nc_file, verification_);
  if (evaluator_ || offsets_) {
    VerifyOptions nominal = verify_options(job, options, *job.machine, nullptr);
    nominal.collect = false;
    nominal.offsets = nullptr;
    nominal.run_time_temperatures = nullptr;
    nominal_ = std::make_unique<Verifier>(*job.machine, controller_, nominal, nc_file, verification_);
    verifier_->share_with(*nominal_);
  }
}

Pipeline::~Pipeline() = default;

void Pipeline::set_tool(const SpindleTool& tool) {
  tool_ = tool;
  const Vec3 vector = tool.vector();
  kinematics_ = TableKinematics(machine_, vector);
  rounding_ = path::Rounding::of(machine_, tool.in_words(), quantum_);
  refiner_ = path::Refiner(machine_, vector, rounding_, options_.nonlinear);
  rapid_refiner_ = path::Refiner(machine_, vector, rounding_, {});
  word_offsets_ = words_of(machine_, JointVector(), tool.in_words());
  if (compensators_) compensator_ = &compensators_->of(tool.length_mm);
  if (compensator_ == nullptr && !offsets_) return;
  meter_.emplace(machine_, vector, evaluator_.get(), offsets_ && !shifts() ? &*offsets_ : nullptr,
                 options_.nonlinear.certify, options_.tolerance_mm,
                 options_.axis_tolerance.value_or(machine_.axis_tolerance));
  for (Vertex& v : vertices_) meter_->place(v, v.q, state_);
  station_ = vertices_[0].station;
}

Result<void> Pipeline::write(const nc::Block& block) {
  return writer_.write(block);
}

Result<void> Pipeline::begin() {
  return begin_offsets();
}

Result<void> Pipeline::emit(Chunk& chunk) {
  if (chunk.failure) return tl::unexpected(*chunk.failure);
  chunk_ = &chunk;
  if (chunk.tool != tool_) set_tool(chunk.tool);
  if (!begun_) {
    if (auto begun = begin_text(chunk); !begun) return begun;
  }
  tell_notes();
  if (options_.tilted_plane && !chunk.motions.empty()) choose_plane();
  auto done = emit_run();
  chunk_ = nullptr;
  chunk.text.swap(text_);
  return done;
}

// The verification reads a text when it knows the CL points behind it, too: a block near the last one could
// not be judged yet.
Result<void> Pipeline::pass_on(Chunk& chunk) {
  if (verifier_) {
    for (const Event& event : chunk.events) {
      if (const auto* change = std::get_if<cl::ToolChange>(&event.record.data))
        verifier_->expect_tool(change->number, *change->gauge_length_mm);
    }
    if (!chunk.tool.control_adds_length) verifier_->expect_no_length();
    std::size_t event = 0;
    for (std::size_t i = 0; i <= chunk.motions.size(); ++i) {
      for (; event < chunk.events.size() && chunk.events[event].before == i; ++event)
        verifier_->expect(chunk.events[event].record);
      if (i == chunk.motions.size()) break;
      const Pending& p = chunk.motions[i];
      verifier_->expect({p.point.pose.tip_P, p.programmed_axis_P, p.feed, p.point.rapid, p.step},
                        p.point.where);
    }
    verifier_->text(unverified_);
    unverified_.clear();
  }
  if (chunk.text.empty()) return {};
  auto done = sink_(chunk.text);
  if (verifier_) unverified_.swap(chunk.text);
  return done;
}

void Pipeline::tell_findings() {
  all_findings_.append(diagnostics_);
  all_findings_.append(verification_);
}

// A motion whose length the post does not know or that only leaves or enters: F per minute.
Result<void> Pipeline::emit_feed_per_minute(const JointVector& q, double rate_mm_s, SourceRef where) {
  const nc::FeedFormat& format = controller_.numbers.feed;
  const double rate = std::min(rate_mm_s, planner_.linear_rate_mm_s());
  BlockFeed feed;
  feed.quanta = format.quanta(nc::FeedMode::per_minute, rate);
  if (format.internal(nc::FeedMode::per_minute, feed.quanta) > rate && feed.quanta > 1) --feed.quanta;
  return emit_motion(q, nc::MotionKind::feed, feed, where);
}

Result<void> Pipeline::emit_feed(const path::Point& to, const cl::Feed& feed, SourceRef where, int depth) {
  const double tip_mm = (to.tip_P - last_.tip_P).norm();
  const auto rate = feed_rate(feed, tip_mm, where);
  if (!rate) return tl::unexpected(rate.error());
  auto found = corrected(to, tip_mm / *rate);
  if (!found) return tl::unexpected(found.error());
  if (loses_motion_) {
    const auto taken_up = emit_take_up(*found, where);
    if (!taken_up) return tl::unexpected(taken_up.error());
    if (*taken_up) found = corrected(to, tip_mm / *rate);
    if (!found) return tl::unexpected(found.error());
  }
  if (*found == last_emitted_) return {};
  return emit_corrected(to, *found, *rate, feed, where, depth);
}

Result<void> Pipeline::emit_corrected(const path::Point& to, JointVector q, double rate_mm_s,
                                      const cl::Feed& feed, SourceRef where, int depth) {
  const double tip_mm = (to.tip_P - last_.tip_P).norm();
  // A point between the two, compensated itself.
  const auto in_halves = [&]() -> Result<void> {
    const path::Point middle = middle_before(to);
    ++report_.points_inserted;
    if (auto r = emit_feed(middle, feed, where, depth + 1); !r) return r;
    last_ = middle;
    return emit_feed(to, feed, where, depth + 1);
  };
  // The errors bend the path between the two.
  const bool bent = (compensator_ || (offsets_ && !shifts())) && depth < kMaxBends && bends(to, q);
  if (bent || (depth < kMaxBends && lasts_long(q, tip_mm, rate_mm_s))) return in_halves();
  const FeedPlanner::Move move = move_to(q, tip_mm);
  BlockFeed block = planner_.plan(move, rate_mm_s);
  holds_digits_ = false;
  // Of a way of one digit even the smallest F may be too fast for axes that turn far.
  if (block.other_mode || block.runs_away() || block.seconds < move.axes_s) {
    if (const auto held = without_idle_digits(to, q)) {
      q = *held;
      holds_digits_ = true;
      ++report_.blocks_held;
      block = planner_.plan(move_to(q, tip_mm), rate_mm_s);
    } else if (block.seconds < move.axes_s && depth < kMaxBends) {
      return in_halves();
    }
  }
  moved(q, block.seconds);
  report_.feed_time_lost_s += block.lost_s;
  last_emitted_ = q;
  return emit_motion(q, nc::MotionKind::feed, block, where);
}

Result<double> Pipeline::feed_rate(const cl::Feed& feed, double segment_mm, SourceRef where) {
  switch (feed.mode) {
    case cl::FeedMode::per_minute:
      return feed.value;
    case cl::FeedMode::per_revolution:
      if (spindle_rpm_ > 0.0) return feed.value * spindle_rpm_ / kSecondsPerMinute;
      return fail(ErrorCode::wrong_input, "the feed is given per revolution and the spindle has no speed",
                  job_.cl_file, where);
    case cl::FeedMode::inverse:
      return std::max(feed.value * segment_mm, 1e-6);
    case cl::FeedMode::none:
      break;
  }
  diagnostics_.warning_once("no feed", job_.cl_file, where,
                            "no FEDRAT before this motion: the default feed of " +
                                fixed_text(options_.default_feed_mm_s * kSecondsPerMinute, 1) +
                                " mm/min is used");
  return options_.default_feed_mm_s;
}

void Pipeline::moved(const JointVector& q, double seconds) {
  if (!knows_history_) return elapse(seconds);
  const auto lagged = state_.lagged();
  const std::vector<double> before(lagged.begin(), lagged.end());
  state_.move_to(q, seconds);
  elapse(seconds);
  if (before.empty()) return;
  const Vec3 then = compensator_->actual(state_.now(), before).tip_P;
  const Vec3 now = compensator_->actual(state_.now(), state_.lagged()).tip_P;
  report_.lag_step_mm = std::max(report_.lag_step_mm, (now - then).norm());
}

Result<JointVector> Pipeline::corrected(const path::Point& point, double seconds) {
  JointVector q = point.q;
  if (!compensator_ && !offsets_ && !in_part()) {
    check_limits(point, q);
    return q;
  }
  if (loses_motion_) hold_idle_turns(q);
  Vec3 tip_P = point.tip_P + point.beside_P;
  // The grid of a plane's words is not that of the joints.
  if (plane_) kinematics_.solve_linear(tip_P, kinematics_.sines(q), q);
  if (offsets_ && !shifts()) {
    // A deviation of the tool is answered by its opposite.
    const Vec3 deviation_P = offsets_->deviation_P(part_in_machine(machine_, q).R);
    tip_P -= deviation_P;
    kinematics_.solve_linear(tip_P, kinematics_.sines(q), q);
    round_joints(q);
    report_.largest_error_mm = std::max(report_.largest_error_mm, deviation_P.norm());
  }
  if (compensator_) {
    MachineState at = knows_history_ ? state_.towards(expected(q), q, seconds) : state_.now();
    at.q = q;
    const auto found = compensated(tip_P, point.axis_P, at);
    if (!found) {
      Error error = found.error();
      error.file = job_.cl_file;
      error.where = point.where;
      return tl::unexpected(error);
    }
    if (found->held) {
      diagnostics_.warning_once("table range", job_.cl_file, point.where, compensator_->range_message(at));
    }
    double correction2 = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double by = found->q[kinematics_.linear(i)] - q[kinematics_.linear(i)];
      correction2 += by * by;
    }
    const double correction_mm = std::sqrt(correction2);
    if (correction_mm > options_.largest_correction_mm) {
      return fail(ErrorCode::check_failed,
                  "the model asks for a correction of " + fixed_text(correction_mm, 4) +
                      " mm here, at most " + shortest_text(options_.largest_correction_mm) +
                      " mm is taken to be meant (--largest-correction-mm)",
                  job_.cl_file, point.where);
    }
    report_.largest_correction_mm = std::max(report_.largest_correction_mm, correction_mm);
    report_.largest_error_mm = std::max(report_.largest_error_mm, found->before_mm);
    q = found->q;
    aim_P_ = found->aim_P;
    round_joints(q);
  }
  // What the axes do follows from the words, and those are rounded.
  if (in_part()) kinematics_.solve_linear(word_tip_P(q), kinematics_.sines(q), q);
  check_limits(point, shifted(q));
  return q;
}

void Pipeline::round_joints(JointVector& q) const {
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    if (plane_ && machine_.axes[id].kind == AxisKind::linear) continue;
    q[id] = rounding_.rounded(id, q[id]);
  }
}

// Where a nominal position will be sent to, as far as it can be told before: shifted as the last one was.
JointVector Pipeline::expected(const JointVector& nominal) const {
  JointVector q = nominal;
  for (AxisId id = 0; id < machine_.axes.size(); ++id) q[id] += last_emitted_[id] - last_.q[id];
  return q;
}

void Pipeline::check_limits(const path::Point& point, const JointVector& q) {
  if (within_travel(q)) return;
  for (const LimitViolation& v : limit_violations(machine_, q)) {
    if (v.by <= 0.5 * rounding_.quantum[v.axis] + 1e-12) continue;  // rounding of a position at the limit
    BeyondAxis& beyond = beyond_[v.axis];
    ++beyond.count;
    if (beyond.count == 1) beyond.first = point.where;
    if (v.by > beyond.worst.by) {
      beyond.worst = v;
      beyond.where = point.where;
      beyond.tool_mm = tool_.vector();
    }
  }
}

Result<void> Pipeline::emit_motion(const JointVector& q, nc::MotionKind kind, const BlockFeed& feed,
                                   SourceRef where, std::uint16_t only) {
  if (only == kAllWords && !in_part() && !variables()) return write_plain(q, kind, feed, where);
  const JointVector words = this->words(q);
  nc::Motion motion;
  motion.kind = kind;
  motion.feed_mode = feed.mode;
  motion.feed = feed.quanta;
  motion.source = where;
  const std::size_t axes = machine_.axes.size();
  for (AxisId id = 0; id < axes; ++id) {
    if ((only & nc::AxisWords::bit(letters_[id])) == 0) continue;
    if (plane_ && machine_.axes[id].kind == AxisKind::rotary) continue;  // the control keeps them
    motion.words.set(letters_[id], controller_.numbers.axes.quanta(letters_[id], words[id]));
  }
  if (motion.words.mask == 0) return {};
  if (!variables() || (motion.words.mask & nc::kXyz) != nc::kXyz) return writer_.write(motion);
  const nc::VariableMotion with = with_terms(motion, q);
  note_terms(with, q, kind == nc::MotionKind::feed);
  return write(with);
}

Result<PostReport> Pipeline::finish(const Intake& intake) {
  report_.points_in = intake.points();
  report_.choice = intake.choice();
  report_.tools = intake.tools().loaded();
  intake.tools().warn_of_machine_file(job_.cl_file, diagnostics_);
  if (!begun_) {
    if (auto r = begin_text(Chunk()); !r) return tl::unexpected(r.error());
  }
  if (auto r = emit_end(); !r) return tl::unexpected(r.error());
  if (auto r = write(nc::ProgramEnd{}); !r) return tl::unexpected(r.error());
  Chunk end;
  end.text.swap(text_);
  if (auto r = pass_on(end); !r) return tl::unexpected(r.error());
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    if (beyond_[id].count > 0) diagnostics_.error(job_.cl_file, beyond_[id].where, limit_text(id));
  }
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    if (beyond_[id].count > 0)
      return fail(ErrorCode::check_failed, limit_text(id), job_.cl_file, beyond_[id].where);
  }
  report_.nc_lines = writer_.lines();
  if (verifier_) {
    verifier_->text(unverified_);
    auto verified = verifier_->finish();
    if (!verified) return tl::unexpected(verified.error());
    report_.verification = std::move(*verified);
  }
  if (nominal_) {
    auto verified = nominal_->finish();
    if (!verified) return tl::unexpected(verified.error());
    report_.nominal_verification = std::move(*verified);
  }
  return std::move(report_);
}

std::string Pipeline::limit_text(AxisId id) const {
  const Axis& axis = machine_.axes[id];
  const BeyondAxis& beyond = beyond_[id];
  const bool rotary = axis.kind == AxisKind::rotary;
  const double factor = rotary ? kDegreePerRad : 1.0;
  const std::string unit = rotary ? " deg" : " mm";
  const auto number = [&](double v) { return fixed_text(v * factor, 4) + unit; };
  // Along the spindle the position is that of the spindle nose: what of it is tool is what can be changed.
  const double along_mm = rotary || axis.carries_part ? 0.0 : axis.direction.dot(beyond.tool_mm);
  std::string text;
  if (along_mm != 0.0) {
    const auto short_number = [](double v) { return fixed_text(v, 3); };
    const bool above = beyond.worst.value > axis.max;
    text = "spindle nose at " + axis.name + " " + short_number(beyond.worst.value) + " (tip " +
           short_number(beyond.worst.value + along_mm) + (along_mm < 0.0 ? " + tool " : " - tool ") +
           short_number(std::abs(along_mm)) + "): " + short_number(beyond.worst.by) +
           (above ? " above" : " below") + " the limit of " + shortest_text(above ? axis.max : axis.min);
  } else {
    text = "axis " + axis.name + " would stand at " + number(beyond.worst.value) + ", " +
           number(beyond.worst.by) + " beyond its limits of " + number(axis.min) + " to " + number(axis.max);
  }
  if (beyond.count > 1) {
    text += "; " + std::to_string(beyond.count) + " positions are beyond them, the first at line " +
            std::to_string(beyond.first.line);
  }
  return text;
}

}  // namespace trunnion::post
