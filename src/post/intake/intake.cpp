#include "post/intake/intake.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

#include "post/making/post_words.hpp"

namespace trunnion::post {
namespace {

// Under tool-centre-point control the tip keeps its line by itself: points are inserted for the tool axis
// only.
constexpr double kNoTipError_mm = 1e9;

// A local choice looks at one point at a time: its runs may be cut anywhere.
constexpr std::size_t kLocalRun = 4096;
// Motions after which a long run is cut where the choice allows it: they stay in the cache, and the costs of
// a chunk itself do not count.
constexpr std::size_t kLongRun = 1024;
// Where it does not, the next look is so many motions farther on.
constexpr std::size_t kLookEvery = 32;
// Of a run that is held so many points are chosen among at a time, as many as the choice looks up at once or
// more: they stay in the nearest cache.
constexpr std::size_t kHeldAtATime = 256;
// And when it is handed on so many motions are made at a time.
constexpr std::size_t kTakenAtATime = 128;
// Of the tool axis' tolerance: a hundredth of a degree, 175 urad, of the usual 0.05 is more than the angular
// errors of a machine change within a block.
constexpr double kAxisShareWithErrors = 0.8;
// Of the tip's: a block that takes up lost motion ends on the grid of a rotary word, half a digit of which is
// a micrometre and more at the tip, and axes that would have to reverse for that do not. A tenth, as for
// pieces over several segments. Of 27 090 random programs on machines that lose motion five then leave their
// tolerance, 0.003 mm, and are refused.
constexpr double kTipShareWithLostMotion = 0.9;

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
  return loses ? kTipShareWithLostMotion : 1.0;
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

Intake::Intake(const PostJob& job, const PostOptions& options, const JointVector& quantum, ChunkStore& store)
    : job_(job),
      options_(options),
      machine_(*job.machine),
      tools_(*job.machine, options.tools),
      tool_{tools_.length_of_nobody()},
      coming_{FluteLength(options.tools), {}},
      rounding_(path::Rounding::of(machine_, tool_.in_words(), quantum)),
      store_(store),
      kinematics_(machine_, tool_.vector()),
      solver_(machine_),
      tolerances_(job, options),
      method_(options.choice),
      axis_(options.choice_axis),
      chunk_(fresh()) {}

std::unique_ptr<Chunk> Intake::fresh() {
  auto chunk = store_.take();
  chunk->tool = tool_;
  chunk->tolerances.push_back({0, tolerances_.cutting()});
  chunk->before = last_;
  chunk->has_before = has_last_;
  return chunk;
}

path::ChoiceOptions Intake::choice_options() const {
  path::ChoiceOptions out;
  out.method = method_;
  out.axis = axis_;
  out.inverse = inverse_;
  out.tool_mm = tool_.vector();
  out.axis_tolerance = tolerances_.cutting().axis_room();
  return out;
}

// Where the axes stand is another place for another tool: what comes next begins anew.
void Intake::set_tool(const SpindleTool& tool) {
  tool_ = tool;
  kinematics_ = TableKinematics(machine_, tool.vector());
  rounding_ = path::Rounding::of(machine_, tool.in_words(), rounding_.quantum);
  chunk_->tool = tool;
  chunk_->has_before = false;
  tolerances_.set_flute(tool.flute_mm);
  chunk_->tolerances.assign(1, {0, tolerances_.cutting()});
}

std::unique_ptr<Chunk> Intake::take_tool(const cl::ToolChange& change, SourceRef where) {
  const auto loaded = tools_.load(change, job_.cl_file, where);
  if (loaded) coming_.flute.take(*loaded);
  if (loaded) chunk_->events.push_back({run_size(), {where, *loaded}});
  // Before the first motion all is one piece: the head of the program says what stands there.
  if (loaded && points_ == 0) {
    tool_known_ = true;
    set_tool({*loaded->gauge_length_mm, true, coming_.flute.mm()});
    return nullptr;
  }
  // The machine stands still for a tool change: what comes before is one thing, what comes after another.
  auto done = flush();
  feed_seen_ = false;
  summary_.goes_on = false;
  tool_known_ = true;
  if (loaded) {
    coming_.tool = SpindleTool{*loaded->gauge_length_mm, true, coming_.flute.mm()};
  } else {
    done->failure = loaded.error();
  }
  return done;
}

bool Intake::begin_without_tool(SourceRef where) {
  tool_known_ = true;
  const ToolOptions& given = options_.tools;
  if (given.tool) {
    const auto loaded = tools_.load({*given.tool, std::nullopt, std::nullopt}, job_.cl_file, where);
    if (!loaded) {
      chunk_->failure = loaded.error();
      return false;
    }
    chunk_->events.insert(chunk_->events.begin(), {0, {where, *loaded}});
    coming_.flute.take(*loaded);
    set_tool({*loaded->gauge_length_mm, true, coming_.flute.mm()});
    return true;
  }
  const bool in_part = options_.rtcp || options_.tilted_plane;
  const bool words_of_tip = job_.machine->output_point == OutputPoint::tip || in_part;
  const bool needs_number = in_part || job_.controller->length.automatic;
  if (words_of_tip && (needs_number || !given.length_mm)) {
    const std::string number = "--tool N, as if LOADTL/N stood in front of the file";
    chunk_->failure =
        Error{ErrorCode::wrong_input,
              "the file moves here and has loaded no tool, whose length the control adds to these words: " +
                  (needs_number ? number
                                : number + ", or --tool-length-mm L for words of the spindle's gauge point"),
              job_.cl_file, where};
    return false;
  }
  tools_.move_without_tool();
  set_tool({tools_.length_of_nobody(), !words_of_tip && tool_.control_adds_length, coming_.flute.mm()});
  return true;
}

// The flute of another cutter: the tolerance holds for it from the next motion on.
std::unique_ptr<Chunk> Intake::take_cutter(const cl::ToolGeometry& cutter) {
  coming_.flute.take(cutter);
  SpindleTool& tool = coming_.tool ? *coming_.tool : tool_;
  if (tool.flute_mm == coming_.flute.mm()) return nullptr;
  SpindleTool with_flute = tool;
  with_flute.flute_mm = coming_.flute.mm();
  if (points_ == 0) {
    set_tool(with_flute);
    return nullptr;
  }
  auto before = run_is_empty() ? nullptr : flush();
  summary_.goes_on = true;
  coming_.tool = with_flute;
  return before;
}

// Where points may be dropped or moved a run is looked at as a whole.
bool Intake::may_cut(const ToolPose& pose) const {
  const std::size_t count = run_size();
  if (options_.nonlinear.thin || options_.nonlinear.move_programmed_points) return false;
  if (method_ != path::ChoiceMethod::global) return count >= kLocalRun;
  return count >= kLongRun && count % kLookEvery == 0 &&
         path::settles_choice(machine_, solver_, pose, choice_options());
}

std::unique_ptr<Chunk> Intake::take(const cl::Record& record, const cl::Resolution& resolution) {
  take_next_tool();
  inverse_.axis_resolution = resolution.axis;
  const auto* motion = std::get_if<cl::Motion>(&record.data);
  if (motion == nullptr) {
    if (const auto* begin = std::get_if<cl::ShapeBegin>(&record.data)) {
      shape_left_ = begin->shape->motions;
      shape_ = record;
      return nullptr;
    }
    if (const auto* change = std::get_if<cl::ToolChange>(&record.data))
      return take_tool(*change, record.where);
    chunk_->events.push_back({run_size(), record});
    if (const auto* cutter = std::get_if<cl::ToolGeometry>(&record.data)) return take_cutter(*cutter);
    if (const auto* word = std::get_if<cl::Tolerance>(&record.data)) {
      tolerances_.take(*word);
      chunk_->tolerances.push_back({run_size(), tolerances_.cutting()});
    }
    if (const auto* word = std::get_if<cl::PostWord>(&record.data)) {
      auto before = run_is_empty() ? nullptr : flush();
      summary_.goes_on = true;
      take_post_word(*word);
      return before;
    }
    return nullptr;
  }
  if (!tool_known_ && !begin_without_tool(record.where)) return std::exchange(chunk_, fresh());
  ++points_;
  std::unique_ptr<Chunk> done;
  // A plane holds one tool axis: a rapid to another one begins a new run.
  const bool leaves_plane = options_.tilted_plane && motion->rapid && !chunk_->motions.empty() &&
                            (chunk_->motions.back().programmed_axis_P - motion->axis_P).norm() > 1e-9;
  if (shape_left_ > 0 && !shape_) {
    --shape_left_;
  } else if (motion->rapid && (feed_seen_ || leaves_plane)) {
    done = flush();
    feed_seen_ = false;
    summary_.goes_on = false;
  } else if (!run_is_empty() && may_cut(last_pose())) {
    done = flush();
    summary_.goes_on = true;
  }
  if (shape_) {
    --shape_left_;
    chunk_->events.push_back({run_size(), *std::exchange(shape_, std::nullopt)});
  }
  feed_seen_ = feed_seen_ || !motion->rapid;
  const Pending next = {{{motion->tip_P, motion->axis_P}, record.where, motion->rapid},
                        motion->feed,
                        motion->axis_P,
                        motion->step};
  if (held_) {
    hold(next);
  } else {
    chunk_->motions.push_back(next);
  }
  hold_where_long();
  return done;
}

void Intake::hold_where_long() {
  if (held_) {
    if (choice_points_.size() >= kHeldAtATime) hand_to_held();
  } else if (chunk_->motions.size() == 2 * kLongRun && may_hold()) {
    begin_to_hold();
  }
}

// Up to where a run may be cut or is held the next time; 0 within an arc or a hole.
std::size_t Intake::cuts_taken() const {
  static_assert(kLongRun % kLookEvery == 0 && kLocalRun % kLookEvery == 0 && kMostCuts == kLookEvery);
  return shape_left_ > 0 || shape_ ? 0 : kLookEvery - run_size() % kLookEvery;
}

std::unique_ptr<Chunk> Intake::take(std::span<const cl::PlainCut> cuts, const cl::Feed& feed,
                                    const cl::Resolution& resolution) {
  take_next_tool();
  inverse_.axis_resolution = resolution.axis;
  if (!tool_known_ && !begin_without_tool(cuts[0].where)) return std::exchange(chunk_, fresh());
  points_ += cuts.size();
  std::unique_ptr<Chunk> done;
  if (!run_is_empty() && may_cut(last_pose())) {
    done = flush();
    summary_.goes_on = true;
  }
  feed_seen_ = true;
  const auto point = [](const cl::PlainCut& cut) {
    return path::ChoicePoint{{cut.tip_P, cut.axis_P}, cut.where, false};
  };
  if (held_) {
    hold_feed(feed, false);
    for (const cl::PlainCut& cut : cuts) choice_points_.push_back(point(cut));
  } else {
    auto& motions = chunk_->motions;
    motions.reserve(2 * kLongRun);
    for (const cl::PlainCut& cut : cuts) motions.push_back({point(cut), feed, cut.axis_P, false});
  }
  hold_where_long();
  return done;
}

// What is said of the pole, planes and runs in which points are dropped look at a run as a whole.
bool Intake::may_hold() const {
  return method_ == path::ChoiceMethod::global && options_.pole.tolerance.rad() <= 0.0 &&
         !options_.tilted_plane && !options_.nonlinear.thin && !options_.nonlinear.move_programmed_points;
}

void Intake::begin_to_hold() {
  held_ = std::make_unique<path::HeldRun>(machine_, last_.q, choice_options(), job_.cl_file);
  held_feeds_.clear();
  choice_points_.clear();
  for (const Pending& motion : chunk_->motions) hold(motion);
  chunk_->motions.clear();
  hand_to_held();
}

void Intake::hold(const Pending& motion) {
  hold_feed(motion.feed, motion.step);
  choice_points_.push_back(motion.point);
}

// Of the next motions.
void Intake::hold_feed(const cl::Feed& feed, bool step) {
  if (held_feeds_.empty() || held_feeds_.back().feed != feed || held_feeds_.back().step != step)
    held_feeds_.push_back({run_size(), feed, step});
}

// What came since the last time.
void Intake::hand_to_held() {
  if (choice_points_.empty()) return;
  held_->add(choice_points_);
  held_last_ = choice_points_.back();
  choice_points_.clear();
}

Result<void> Intake::choose(Chunk& chunk) {
  choice_points_.clear();
  choice_points_.reserve(chunk.motions.size());
  for (const Pending& p : chunk.motions) choice_points_.push_back(p.point);
  const path::ChoiceSummary so_far = summary_;
  const auto choice = [&] {
    return path::choose_solutions(machine_, choice_points_, last_.q, choice_options(), job_.cl_file,
                                  chunk.chosen, summary_);
  };
  if (auto done = choice(); !done) return done;
  const path::PoleOptions& pole = options_.pole;
  if (pole.tolerance.rad() <= 0.0 || !path::turns_near_pole(machine_, pole, choice_points_, chunk.chosen))
    return {};
  // Again, with the tool axes that may be led through the pole.
  const std::vector<path::ChoicePoint> programmed = choice_points_;
  const std::vector<path::ChosenPoint> before = std::exchange(chunk.chosen, {});
  choice_points_ = path::put_on_pole(machine_, pole, programmed);
  summary_ = so_far;
  if (auto done = choice(); !done) return done;
  chunk.pole =
      path::tilt_near_pole(machine_, tool_.vector(), pole, programmed, before, choice_points_, chunk.chosen);
  for (std::size_t i = 0; i < chunk.motions.size(); ++i) chunk.motions[i].point = choice_points_[i];
  return {};
}

// What the word changes for the motions behind it; the pipeline does the rest, and tells what it cannot do.
void Intake::take_post_word(const cl::PostWord& word) {
  std::string cut;
  if (word.word == "LIMITS") {
    take_limits(word, *job_.machine, machine_, cut);
    solver_ = RotarySolver(machine_);
  } else if (stands_at(word, machine_, last_.q)) {
    chunk_->has_before = false;
  } else if (const auto measure = measure_of(word, machine_)) {
    method_ = measure->method;
    axis_ = measure->axis;
  } else if (const auto turn = table_turn_of(word, machine_, last_.q);
             turn && machine_.axes[turn->axis].within_limits(turn->angle)) {
    last_.q[turn->axis] = rounding_.rounded(turn->axis, turn->angle);
    chunk_->has_before = false;
    feed_seen_ = false;
  }
}

// As for a run that is held; shapes too.
bool Intake::may_divide(const Chunk& chunk) const {
  if (chunk.motions.size() < 2 * kLongRun || !chunk.pole.empty() || options_.tilted_plane) return false;
  if (options_.nonlinear.thin || options_.nonlinear.move_programmed_points) return false;
  return std::none_of(chunk.events.begin(), chunk.events.end(), [](const Event& event) {
    return std::holds_alternative<cl::ShapeBegin>(event.record.data);
  });
}

// An arc or a hole stays in one piece.
std::size_t Intake::end_of_piece() const {
  std::size_t end = std::min(piece_begin_ + kLongRun, whole_size_);
  for (std::size_t i = piece_event_; i < whole_->events.size() && whole_->events[i].before < end; ++i) {
    const auto* begin = std::get_if<cl::ShapeBegin>(&whole_->events[i].record.data);
    if (begin != nullptr) end = std::max(end, whole_->events[i].before + begin->shape->motions);
  }
  return end;
}

void Intake::take_held(std::size_t count, Chunk& piece) {
  piece.chosen.resize(count);
  piece.motions.reserve(count);
  while (piece.motions.size() < count) {
    const std::size_t taken = piece.motions.size();
    choice_points_.clear();
    unheld_->take(std::span(piece.chosen).subspan(taken, std::min(kTakenAtATime, count - taken)),
                  choice_points_, summary_);
    for (const path::ChoicePoint& point : choice_points_) {
      const std::size_t motion = piece_begin_ + piece.motions.size();
      while (held_feed_ + 1 < held_feeds_.size() && held_feeds_[held_feed_ + 1].motion <= motion)
        ++held_feed_;
      const HeldFeed& feed = held_feeds_[held_feed_];
      piece.motions.push_back({point, feed.feed, point.pose.axis_P, feed.step});
    }
  }
}

std::unique_ptr<Chunk> Intake::next_piece() {
  if (!whole_) return nullptr;
  Chunk& whole = *whole_;
  const std::size_t begin = piece_begin_;
  const std::size_t end = end_of_piece();
  const bool is_last = end == whole_size_;
  const auto range = [&](const auto& from, auto& to) {
    to.assign(from.begin() + static_cast<std::ptrdiff_t>(begin),
              from.begin() + static_cast<std::ptrdiff_t>(end));
  };
  auto piece = store_.take();
  piece->tool = whole.tool;
  if (unheld_) {
    take_held(end - begin, *piece);
  } else {
    range(whole.motions, piece->motions);
    range(whole.chosen, piece->chosen);
  }
  piece->inverse = whole.inverse;
  for (; piece_event_ < whole.events.size(); ++piece_event_) {
    const Event& event = whole.events[piece_event_];
    if (event.before >= end && !is_last) break;
    piece->events.push_back({event.before - begin, event.record});
  }
  for (const ToleranceFrom& from : whole.tolerances) {
    if (from.motion <= begin) piece->tolerances.assign(1, {0, from.tolerance});
    if (from.motion > begin && (from.motion < end || is_last))
      piece->tolerances.push_back({from.motion - begin, from.tolerance});
  }
  piece->before = whole.before;
  piece->has_before = whole.has_before;
  whole.before =
      rounded_point(kinematics_, rounding_, piece->motions.back().point, piece->chosen.back().q_leave);
  whole.has_before = true;
  piece_begin_ = end;
  if (is_last) {
    whole_.reset();
    unheld_.reset();
  }
  return piece;
}

std::unique_ptr<Chunk> Intake::flush_held() {
  hand_to_held();
  const auto done = held_->finish(choice_options());
  if (done) {
    last_ = rounded_point(kinematics_, rounding_, held_last_, held_->last().q_leave);
    has_last_ = true;
  } else {
    chunk_->failure = done.error();
    chunk_->chosen.clear();
  }
  unheld_ = std::move(held_);
  auto out = std::exchange(chunk_, fresh());
  if (out->failure) {
    unheld_.reset();
    return out;
  }
  whole_ = std::move(out);
  whole_size_ = unheld_->size();
  piece_begin_ = piece_event_ = held_feed_ = 0;
  return next_piece();
}

std::unique_ptr<Chunk> Intake::flush() {
  chunk_->inverse = inverse_;
  if (held_) return flush_held();
  Chunk& chunk = *chunk_;
  if (chunk.motions.empty()) {
    chunk.chosen.clear();
  } else {
    const auto done = choose(chunk);
    if (!done) {
      chunk.failure = done.error();
    } else {
      last_ = rounded_point(kinematics_, rounding_, chunk.motions.back().point, chunk.chosen.back().q_leave);
      has_last_ = true;
    }
  }
  auto out = std::exchange(chunk_, fresh());
  if (out->failure || !may_divide(*out)) return out;
  choice_points_ = {};
  whole_ = std::move(out);
  whole_size_ = whole_->motions.size();
  piece_begin_ = piece_event_ = 0;
  return next_piece();
}

}  // namespace trunnion::post
