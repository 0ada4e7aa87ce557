#include "post/intake/intake.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

namespace trunnion::post {
namespace {

// A local choice looks at one point at a time: its runs may be cut anywhere.
constexpr std::size_t kLocalRun = 4096;
// Where a long run may not be cut, the next look is so many motions farther on.
constexpr std::size_t kLookEvery = 32;

}  // namespace

Intake::Intake(const PostJob& job, const PostOptions& options, const JointVector& quantum, ChunkStore& store)
    : job_(job),
      options_(options),
      store_(store),
      tools_(*job.machine, options.tools,
             job.controller->adds_length_of_register() &&
                 (options.rtcp || job.machine->output_point == OutputPoint::tip)),
      tool_{tools_.length_of_nobody()},
      coming_{FluteLength(options.tools), {}},
      tolerances_(job, options),
      choice_(job, options, tolerances_, tool_, quantum),
      long_run_(job, options, choice_, store),
      chunk_(fresh()) {}

std::unique_ptr<Chunk> Intake::fresh() {
  auto chunk = store_.take();
  chunk->tool = tool_;
  chunk->tolerances.push_back({0, tolerances_.cutting()});
  chunk->before = choice_.last();
  chunk->has_before = choice_.has_last();
  return chunk;
}

// Where the axes stand is another place for another tool: what comes next begins anew.
void Intake::set_tool(const SpindleTool& tool) {
  tool_ = tool;
  choice_.set_tool(tool);
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
  choice_.set_goes_on(false);
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
  choice_.set_goes_on(true);
  coming_.tool = with_flute;
  return before;
}

// Where points may be dropped or moved a run is looked at as a whole.
bool Intake::may_cut(const ToolPose& pose) const {
  const std::size_t count = run_size();
  if (options_.nonlinear.thin || options_.nonlinear.move_programmed_points) return false;
  if (choice_.method() != path::ChoiceMethod::global) return count >= kLocalRun;
  return count >= kLongRun && count % kLookEvery == 0 && choice_.settles(pose);
}

std::unique_ptr<Chunk> Intake::take_word(const cl::Record& record) {
  if (const auto* begin = std::get_if<cl::ShapeBegin>(&record.data)) {
    shape_left_ = begin->shape->all_motions();
    shape_ = record;
    return nullptr;
  }
  if (const auto* change = std::get_if<cl::ToolChange>(&record.data)) return take_tool(*change, record.where);
  chunk_->events.push_back({run_size(), record});
  if (const auto* cutter = std::get_if<cl::ToolGeometry>(&record.data)) return take_cutter(*cutter);
  if (const auto* word = std::get_if<cl::Tolerance>(&record.data)) {
    tolerances_.take(*word);
    chunk_->tolerances.push_back({run_size(), tolerances_.cutting()});
  }
  if (const auto* word = std::get_if<cl::PostWord>(&record.data)) {
    auto before = run_is_empty() ? nullptr : flush();
    choice_.set_goes_on(true);
    const JointChoice::Change change = choice_.take(*word);
    if (change != JointChoice::Change::none) chunk_->has_before = false;
    if (change == JointChoice::Change::turn) feed_seen_ = false;
    return before;
  }
  return nullptr;
}

std::unique_ptr<Chunk> Intake::take(const cl::Record& record, const cl::Resolution& resolution) {
  take_next_tool();
  choice_.set_resolution(resolution);
  const auto* motion = std::get_if<cl::Motion>(&record.data);
  if (motion == nullptr) return take_word(record);
  if (!tool_known_ && !begin_without_tool(record.where)) return std::exchange(chunk_, fresh());
  if (!motion->part.ends_inside) ++points_;
  std::unique_ptr<Chunk> done;
  // A plane holds one tool axis: a rapid to another one begins a new run.
  const bool leaves_plane = options_.tilted_plane && motion->rapid && !chunk_->points.empty() &&
                            (chunk_->points.back().pose.axis_P - motion->axis_P).norm() > 1e-9;
  if (shape_left_ > 0 && !shape_) {
    --shape_left_;
  } else if (motion->rapid && (feed_seen_ || leaves_plane)) {
    done = flush();
    feed_seen_ = false;
    choice_.set_goes_on(false);
  } else if (!run_is_empty() && may_cut(last_pose())) {
    done = flush();
    choice_.set_goes_on(true);
  }
  if (shape_) {
    --shape_left_;
    chunk_->events.push_back({run_size(), *std::exchange(shape_, std::nullopt)});
  }
  feed_seen_ = feed_seen_ || !motion->rapid;
  const path::ChoicePoint point = {{motion->tip_P, motion->axis_P}, record.where, motion->rapid};
  const MotionWords words = {motion->feed, motion->step, motion->part};
  if (long_run_.is_held()) {
    long_run_.add(point, words);
  } else {
    chunk_->say(words);
    chunk_->points.push_back(point);
    hold_where_long();
  }
  return done;
}

void Intake::hold_where_long() {
  if (chunk_->size() != 2 * kLongRun || !long_run_.may_hold()) return;
  long_run_.hold(chunk_->points, chunk_->words);
  chunk_->clear_motions();
}

// Up to where a run may be cut or is held the next time; 0 within an arc or a hole.
std::size_t Intake::cuts_taken() const {
  static_assert(kLongRun % kLookEvery == 0 && kLocalRun % kLookEvery == 0 && kMostCuts == kLookEvery);
  return shape_left_ > 0 || shape_ ? 0 : kLookEvery - run_size() % kLookEvery;
}

std::unique_ptr<Chunk> Intake::take(std::span<const cl::PlainCut> cuts, const cl::Feed& feed,
                                    const cl::Resolution& resolution) {
  take_next_tool();
  choice_.set_resolution(resolution);
  if (!tool_known_ && !begin_without_tool(cuts[0].where)) return std::exchange(chunk_, fresh());
  points_ += cuts.size();
  std::unique_ptr<Chunk> done;
  if (!run_is_empty() && may_cut(last_pose())) {
    done = flush();
    choice_.set_goes_on(true);
  }
  feed_seen_ = true;
  if (long_run_.is_held()) {
    long_run_.add(cuts, feed);
  } else {
    auto& points = chunk_->points;
    points.reserve(2 * kLongRun);
    chunk_->say({feed});
    for (const cl::PlainCut& cut : cuts) points.push_back(point_of(cut));
    hold_where_long();
  }
  return done;
}

std::unique_ptr<Chunk> Intake::flush() {
  chunk_->inverse = choice_.inverse();
  const bool was_held = long_run_.is_held();
  if (was_held) {
    long_run_.finish(*chunk_);
  } else if (chunk_->points.empty()) {
    chunk_->chosen.clear();
  } else if (const auto done = choice_.choose(*chunk_); !done) {
    chunk_->failure = done.error();
  }
  auto out = std::exchange(chunk_, fresh());
  if (!was_held && (out->failure || !long_run_.may_divide(*out))) return out;
  return long_run_.hand_on(std::move(out));
}

}  // namespace trunnion::post
