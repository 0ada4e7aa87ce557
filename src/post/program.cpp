#include "post/program.hpp"

#include <algorithm>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/global_control.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>
#include <utility>

#include "trunnion/base/failure.hpp"
#include "trunnion/base/number_text.hpp"

#include "post/intake/path_source.hpp"
#include "post/prepare/preparer.hpp"

namespace trunnion::post {
namespace {

cl::ReaderOptions reading_of(const PostJob& job, const PostOptions& options) {
  cl::ReaderOptions out = reading_within(options.cl, options.tolerance_mm);
  out.mark_shapes = options.native_arcs.value_or(job.controller->arcs.native) ||
                    options.native_cycles.value_or(job.controller->cycles.native);
  return out;
}

// Positions of the rotary axes of one mean the same on the other.
bool turns_alike(const Machine& a, const Machine& b) {
  const auto has = [](const Machine& machine, const Axis& axis) {
    return axis.kind != AxisKind::rotary ||
           std::any_of(machine.axes.begin(), machine.axes.end(), [&](const Axis& other) {
             return other.name == axis.name && other.direction == axis.direction;
           });
  };
  const auto all = [&](const Machine& of, const Machine& in) {
    return std::all_of(of.axes.begin(), of.axes.end(), [&](const Axis& axis) { return has(in, axis); });
  };
  return all(a, b) && all(b, a);
}

std::unique_ptr<cl::RecordSource> path_of(std::unique_ptr<cl::TextSource> source, const PostJob& job,
                                          const PostOptions& options, Diagnostics& diagnostics) {
  const PathReading with{&options.tools, options.axis_tolerance.value_or(job.machine->axis_tolerance),
                         job.from != nullptr && turns_alike(*job.from->machine, *job.machine)};
  return behind_stages(
      records_of({std::move(source), job.cl_file, reading_of(job, options), job.from}, with, diagnostics),
      options.path_stages);
}

// What the work gives, or the Failure that it throws: stages that work at the same time fail as they do one
// after the other.
template <class F>
Result<void> or_failure(const F& work) {
  try {
    return work();
  } catch (const Failure& failure) {
    return tl::unexpected(failure.error());
  }
}

// The preparer of the tool that the chunk at hand is made with.
class PreparerOfTool {
 public:
  PreparerOfTool(const PostJob& job, const PostOptions& options, const Pipeline& pipeline)
      : job_(job), options_(options), pipeline_(pipeline) {}

  void prepare(Chunk& chunk) {
    if (!preparer_ || tool_ != chunk.tool) {
      tool_ = chunk.tool;
      preparer_.emplace(*job_.machine, tool_.vector(),
                        path::Rounding::of(*job_.machine, tool_.in_words(), pipeline_.quantum()), options_,
                        pipeline_.compensator_by_place(tool_));
    }
    preparer_->prepare(chunk);
  }

 private:
  const PostJob& job_;
  const PostOptions& options_;
  const Pipeline& pipeline_;
  SpindleTool tool_;
  std::optional<Preparer> preparer_;
};

}  // namespace

Program::Program(std::unique_ptr<cl::TextSource> source, const PostJob& job, const PostOptions& options,
                 const TextSink& sink, Diagnostics& diagnostics)
    : job_(job),
      options_(options),
      diagnostics_(diagnostics),
      errors_before_(diagnostics.error_count()),
      pipeline_(job, options),
      read_back_(job, options, sink, pipeline_.errors()),
      feeds_(job, options),
      intake_(job, options, pipeline_.quantum(), store_),
      records_(path_of(std::move(source), job, options, diagnostics)) {}

double Program::half_a_digit(AxisKind kind) const {
  double least = 0.0;
  for (AxisId id = 0; id < job_.machine->axes.size(); ++id) {
    if (job_.machine->axes[id].kind != kind) continue;
    const double half = 0.5 * pipeline_.quantum()[id];
    least = least > 0.0 ? std::min(least, half) : half;
  }
  return least;
}

// The rounding of the words uses such a tolerance up: points without end would be inserted to keep it.
Result<void> Program::may_keep_tolerances() const {
  const auto below = [](const std::string& name, double asked, double least, const std::string& unit) {
    return fail(ErrorCode::wrong_use, name + " " + shortest_text(asked) +
                                          " is below half a digit of the words, " + shortest_text(least) +
                                          " " + unit);
  };
  const double least_mm = half_a_digit(AxisKind::linear);
  if (options_.tolerance_mm < least_mm) return below("--tolerance-mm", options_.tolerance_mm, least_mm, "mm");
  if (options_.rapid_tolerance_mm < least_mm)
    return below("--rapid-tolerance-mm", options_.rapid_tolerance_mm, least_mm, "mm");
  return {};
}

bool Program::read() {
  if (!records_->next(record_)) return false;
  const auto* tolerance = std::get_if<cl::Tolerance>(&record_.data);
  if (tolerance == nullptr) return true;
  const auto below = [&](double asked, double least, const std::string& unit) {
    if (asked < least) {
      diagnostics_.error(job_.cl_file, record_.where,
                         "LINTOL: " + shortest_text(asked) + " " + unit +
                             " is below half a digit of the words, " + shortest_text(least) + " " + unit);
    }
  };
  if (tolerance->value_mm) below(*tolerance->value_mm, half_a_digit(AxisKind::linear), "mm");
  if (tolerance->axis_angle) below(*tolerance->axis_angle, half_a_digit(AxisKind::rotary), "rad");
  return true;
}

std::unique_ptr<Chunk> Program::next() {
  const auto stopped = [&] { return choice_failed_ || diagnostics_.error_count() > errors_before_; };
  if (auto piece = intake_.next_piece()) return piece;
  while (!ended_) {
    std::unique_ptr<Chunk> chunk;
    cl::Feed feed;
    const std::size_t count = records_->next_cuts(std::span(cuts_).first(intake_.cuts_taken()), feed);
    if (count > 0) {
      if (!stopped()) chunk = intake_.take(std::span(cuts_).first(count), feed, records_->resolution());
    } else if (!read()) {
      ended_ = true;
      if (stopped()) return nullptr;
      chunk = intake_.finish();
    } else if (stopped()) {
      continue;
    } else {
      chunk = intake_.take(record_, records_->resolution());
    }
    if (!chunk) continue;
    choice_failed_ = chunk->failure.has_value();
    return chunk;
  }
  return nullptr;
}

void Program::look_ahead(Chunk& chunk) {
  if (feeds_.is_on()) feeds_.change(chunk);
}

void Program::emit(Chunk& chunk) {
  // There is none before the first ones.
  if (feeds_.is_on() && chunk.is_empty()) return;
  if (!failures_.emit) {
    if (auto done = or_failure([&] { return pipeline_.emit(chunk); }); !done) failures_.emit = done.error();
  }
  if (failures_.emit) chunk.clear();  // nothing of it goes on
}

void Program::pass_on(Chunk& chunk) {
  // Of a chunk whose text could not be made nothing is left.
  if (failures_.pass_on || (chunk.text.empty() && chunk.points.empty())) return;
  if (auto done = or_failure([&] { return read_back_.pass_on(chunk); }); !done)
    failures_.pass_on = done.error();
}

std::array<Program::Stage, 4> Program::stages(std::function<void(Chunk&)> prepare) {
  return {
      // Points on the word grid and inserted between them, errors of the machine that hang on the place
      // alone:
      // nothing here asks for another chunk, and it takes the most time.
      Stage{Stage::Order::any, std::move(prepare)},
      // What comes behind a block decides how fast it can be: the chunk that goes on is the one before the
      // last.
      Stage{Stage::Order::of_file, [this](Chunk& chunk) { look_ahead(chunk); }},
      // Blocks and their text. Words are modal, and lost motion, lags and rewinds hang on what came before.
      Stage{Stage::Order::of_file, [this](Chunk& chunk) { emit(chunk); }},
      // The text is read back and judged behind all that shaped it; then it may go out.
      Stage{Stage::Order::of_file, [this](Chunk& chunk) { pass_on(chunk); }},
  };
}

void Program::run_in_turn() {
  PreparerOfTool preparer(job_, options_, pipeline_);
  const auto all = stages([&](Chunk& chunk) { preparer.prepare(chunk); });
  while (auto chunk = next()) {
    if (failures_.emit || failures_.pass_on) continue;
    for (const Stage& stage : all) stage.work(*chunk);
    store_.give_back(std::move(chunk));
  }
}

void Program::run_in_parallel() {
  const std::size_t threads = options_.threads;
  // One that every thread works on, and as many on their way: more would only take memory.
  const std::size_t tokens = 2 * threads;
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
  tbb::task_arena arena(static_cast<int>(threads));
  tbb::enumerable_thread_specific<PreparerOfTool> preparers(
      [&] { return PreparerOfTool(job_, options_, pipeline_); });
  using Held = Chunk*;  // owned by whichever stage has it: the pipeline's items must be copied
  auto so_far = tbb::make_filter<void, Held>(tbb::filter_mode::serial_in_order,
                                             [&](tbb::flow_control& control_of_flow) -> Held {
                                               auto chunk = next();
                                               if (!chunk) control_of_flow.stop();
                                               return chunk.release();
                                             });
  for (const Stage& stage : stages([&](Chunk& chunk) { preparers.local().prepare(chunk); })) {
    const auto mode =
        stage.order == Stage::Order::any ? tbb::filter_mode::parallel : tbb::filter_mode::serial_in_order;
    so_far = so_far & tbb::make_filter<Held, Held>(mode, [work = stage.work](Held chunk) {
               work(*chunk);
               return chunk;
             });
  }
  const auto give_back = tbb::make_filter<Held, void>(tbb::filter_mode::serial_in_order, [&](Held chunk) {
    store_.give_back(std::unique_ptr<Chunk>(chunk));
  });
  arena.execute([&] { tbb::parallel_pipeline(tokens, so_far & give_back); });
}

Result<PostReport> Program::finish() {
  if (feeds_.is_on()) {
    for (std::size_t i = 0; i < FeedAhead::kHeld; ++i) {
      Chunk left = feeds_.take_left();
      emit(left);
      pass_on(left);
    }
    if (failures_.emit || failures_.pass_on)
      return tl::unexpected(failures_.emit ? *failures_.emit : *failures_.pass_on);
  }
  Chunk end;
  if (auto done = pipeline_.finish(intake_, end); !done) return tl::unexpected(done.error());
  if (auto done = read_back_.pass_on(end); !done) return tl::unexpected(done.error());
  auto report = pipeline_.report();
  if (!report) return report;
  if (auto done = read_back_.finish(*report); !done) return tl::unexpected(done.error());
  return report;
}

Result<PostReport> Program::run() {
  if (auto kept = may_keep_tolerances(); !kept) return tl::unexpected(kept.error());
  if (auto begun = pipeline_.begin(); !begun) return tl::unexpected(begun.error());
  if (options_.threads > 1) {
    run_in_parallel();
  } else {
    run_in_turn();
  }
  Result<PostReport> out = tl::unexpected(Error{});
  if (records_->read_failure()) {
    out = tl::unexpected(*records_->read_failure());
  } else if (diagnostics_.error_count() > errors_before_) {
    out = tl::unexpected(diagnostics_.first_error());
  } else if (failures_.emit || failures_.pass_on) {
    out = tl::unexpected(failures_.pass_on ? *failures_.pass_on : *failures_.emit);
  } else {
    out = finish();
  }
  diagnostics_.append(pipeline_.diagnostics());
  diagnostics_.append(read_back_.diagnostics());
  return out;
}

}  // namespace trunnion::post
