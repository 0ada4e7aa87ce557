#include "post/making/pipeline.hpp"

#include <span>
#include <utility>
#include <variant>

#include "trunnion/machine/iso841.hpp"

#include "post/making/run_choice.hpp"

namespace trunnion::post {

Pipeline::Pipeline(const PostJob& job, const PostOptions& options)
    : work_(job, options),
      head_(work_.posting),
      words_(work_),
      lost_motion_(work_, words_),
      places_(work_, words_, lost_motion_),
      bend_(work_, words_),
      blocks_(work_, words_, lost_motion_, places_, bend_),
      safe_way_(work_, words_, places_, blocks_),
      turns_(work_, places_, blocks_, safe_way_),
      segments_(work_, bend_, blocks_, safe_way_, turns_),
      plain_(work_, places_, bend_, blocks_, segments_),
      shapes_(work_, words_, places_, blocks_, segments_),
      cutter_words_(work_, words_),
      events_(work_, head_, safe_way_, cutter_words_),
      reach_(work_.posting) {}

void Pipeline::set_tool(const SpindleTool& tool) {
  work_.set_tool(tool);
  segments_.set_tool(tool);
}

Result<void> Pipeline::begin() {
  return work_.thermal.begin();
}

Result<void> Pipeline::begin_text(const Chunk& chunk) {
  if (auto r = head_.write(chunk); !r) return r;
  return work_.thermal.call(nc::WorkOffset{work_.posting.report.head.work_offset});
}

Result<void> Pipeline::emit(Chunk& chunk) {
  if (chunk.failure) return tl::unexpected(*chunk.failure);
  work_.now.chunk = &chunk;
  if (chunk.tool != work_.tool.tool) set_tool(chunk.tool);
  if (!head_.is_written()) {
    if (auto begun = begin_text(chunk); !begun) return begun;
  }
  reach_.take(chunk);
  if (!work_.posting.options.path_stages.empty()) count_parts(chunk, 0, chunk.size(), 1);
  tell_pole(work_);
  if (work_.posting.options.tilted_plane && !chunk.points.empty()) choose_plane(work_);
  auto done = emit_run();
  work_.now.chunk = nullptr;
  chunk.text.swap(work_.posting.text);
  return done;
}

// What path stages have added; `times` is -1 for what does not go into the text after all.
void Pipeline::count_parts(const Chunk& chunk, std::size_t first, std::size_t end, int times) {
  int added = 0, divided = 0;
  for (std::size_t i = first; i < end; ++i) {
    const cl::Motion::Part& part = chunk.words_at(i).part;
    if (part.ends_inside) ++added;
    if (!part.ends_inside && part.share < 1.0) ++divided;
  }
  PostReport& report = work_.posting.report;
  report.points_inserted += static_cast<std::size_t>(times * added);  // to take off is to add, modulo 2^64
  report.segments_with_points += static_cast<std::size_t>(times * divided);
}

Result<void> Pipeline::emit_run() {
  const Chunk& chunk = *work_.now.chunk;
  const auto& events = work_.now.chunk->events;
  const auto& chosen = work_.now.chunk->chosen;
  std::size_t event = 0;
  for (std::size_t i = 0; i <= chunk.size(); ++i) {
    work_.now.motion = i;
    for (; event < events.size() && events[event].before == i; ++event) {
      if (const auto* begin = std::get_if<cl::ShapeBegin>(&events[event].record.data)) {
        // Behind a stop, too, a hole begins with the rapid over it.
        if (i < chunk.size() && chunk.motion(i).point.rapid) {
          if (auto done = safe_way_.come_back(chunk.point(i), chunk.motion(i)); !done) return done;
        }
        const auto taken = shapes_.make(*begin->shape, i);
        if (!taken) return tl::unexpected(taken.error());
        if (!*taken) continue;
        if (begin->shape->added > 0) count_parts(chunk, i, i + begin->shape->all_motions(), -1);
        // Nothing but the dwell of a hole stands between its motions.
        i += begin->shape->all_motions();
        while (event + 1 < events.size() && events[event + 1].before < i) ++event;
        continue;
      }
      if (auto done = events_.take(events[event].record); !done) return done;
    }
    if (i == chunk.size()) break;
    const ChunkMotion motion = chunk.motion(i);
    if (auto done = work_.spindle.resume(); !done) return done;
    if (!motion.point.rapid) {
      if (auto done = work_.spindle.check_before_cut(motion.point.where); !done) return done;
    }
    if (work_.at.returns) {
      if (auto done = safe_way_.come_back(chunk.point(i), motion); !done) return done;
    }
    if (auto done = turns_.make_waiting(motion); !done) return done;
    if (!work_.cutter.is_idle()) {
      if (auto done = cutter_words_.check(i); !done) return done;
    }
    if (chosen[i].reconfigure && !work_.at.approaches) {
      const auto there = segments_.reconfigure(chosen[i], motion);
      if (!there) return tl::unexpected(there.error());
      if (*there) continue;
    }
    if (const std::size_t last = segments_.cutting_run_end(i, event); last > i) {
      if (auto done = segments_.make_cutting_run(i, last); !done) return done;
      i = last;
      continue;
    }
    const PreparedSegment* const segment = segments_.prepared(i);
    if (segment != nullptr && plain_.serve()) {
      const std::size_t end = event < events.size() ? events[event].before : chunk.size();
      const auto next = plain_.make(i, end);
      if (!next) return tl::unexpected(next.error());
      if (*next > i) {
        i = *next - 1;
        continue;
      }
    }
    if (auto done = segments_.make(work_.now.chunk->point(i), motion, segment); !done) return done;
    if (chosen[i].q_leave == chosen[i].q) continue;
    if (auto done = segments_.make(work_.rounded(motion.point, chosen[i].q_leave), motion, nullptr); !done)
      return done;
  }
  return {};
}

Result<void> Pipeline::finish(const Intake& intake, Chunk& end) {
  work_.posting.report.points_in = intake.points();
  work_.posting.report.choice = intake.choice();
  work_.posting.report.tools = intake.tools().loaded();
  intake.tools().warn(work_.posting.job.cl_file, work_.posting.diagnostics);
  for (const std::string& doubt : directions_beside_iso841(work_.posting.machine))
    work_.posting.diagnostics.warning_once(doubt, work_.posting.machine.file, {}, doubt);
  if (!head_.is_written()) {
    if (auto r = begin_text(Chunk()); !r) return r;
  }
  if (auto r = safe_way_.end(); !r) return r;
  if (auto r = work_.posting.write(nc::ProgramEnd{}); !r) return r;
  end.text.swap(work_.posting.text);
  return {};
}

Result<PostReport> Pipeline::report() {
  if (auto r = work_.axis_words.tell_beyond_travel(work_.posting); !r) return tl::unexpected(r.error());
  reach_.warn(work_.posting);
  work_.posting.report.nc_lines = work_.posting.writer.lines();
  return std::move(work_.posting.report);
}

}  // namespace trunnion::post
