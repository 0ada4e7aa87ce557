#include "post/intake/long_run.hpp"

#include <algorithm>
#include <utility>
#include <variant>

namespace trunnion::post {
namespace {

// Of a run that is held so many points are chosen among at a time, as many as the choice looks up at once or
// more: they stay in the nearest cache.
constexpr std::size_t kHeldAtATime = 256;
// And when it is handed on so many motions are made at a time.
constexpr std::size_t kTakenAtATime = 128;

}  // namespace

bool LongRun::may_hold() const {
  return choice_.method() == path::ChoiceMethod::global && options_.pole.tolerance.rad() <= 0.0 &&
         !options_.tilted_plane && !options_.nonlinear.thin && !options_.nonlinear.move_programmed_points;
}

void LongRun::hold(std::span<const path::ChoicePoint> points, const std::vector<WordsFrom>& words) {
  held_ =
      std::make_unique<path::HeldRun>(choice_.machine(), choice_.last().q, choice_.options(), job_.cl_file);
  words_ = words;
  points_.assign(points.begin(), points.end());
  pack();
}

void LongRun::add(const path::ChoicePoint& point, const MotionWords& words) {
  MotionColumns::say_from(size(), words, words_);
  points_.push_back(point);
  pack_where_many();
}

void LongRun::add(std::span<const cl::PlainCut> cuts, const cl::Feed& feed) {
  MotionColumns::say_from(size(), {feed}, words_);
  for (const cl::PlainCut& cut : cuts) points_.push_back(point_of(cut));
  pack_where_many();
}

void LongRun::pack_where_many() {
  if (points_.size() >= kHeldAtATime) pack();
}

// What came since the last time.
void LongRun::pack() {
  if (points_.empty()) return;
  held_->add(points_);
  last_ = points_.back();
  points_.clear();
}

void LongRun::finish(Chunk& chunk) {
  pack();
  const auto done = held_->finish(choice_.options());
  if (done) {
    choice_.end_at(last_, held_->last().q_leave);
  } else {
    chunk.failure = done.error();
    chunk.chosen.clear();
  }
  unheld_ = std::move(held_);
}

std::unique_ptr<Chunk> LongRun::hand_on(std::unique_ptr<Chunk> whole) {
  if (whole->failure) {
    unheld_.reset();
    return whole;
  }
  whole_ = std::move(whole);
  whole_size_ = unheld_ ? unheld_->size() : whole_->size();
  piece_begin_ = piece_event_ = 0;
  return next_piece();
}

bool LongRun::may_divide(const Chunk& chunk) const {
  if (chunk.size() < 2 * kLongRun || !chunk.pole.empty() || options_.tilted_plane) return false;
  if (options_.nonlinear.thin || options_.nonlinear.move_programmed_points) return false;
  return std::none_of(chunk.events.begin(), chunk.events.end(), [](const Event& event) {
    return std::holds_alternative<cl::ShapeBegin>(event.record.data);
  });
}

// An arc or a hole stays in one piece.
std::size_t LongRun::end_of_piece() const {
  std::size_t end = std::min(piece_begin_ + kLongRun, whole_size_);
  for (std::size_t i = piece_event_; i < whole_->events.size() && whole_->events[i].before < end; ++i) {
    const auto* begin = std::get_if<cl::ShapeBegin>(&whole_->events[i].record.data);
    if (begin != nullptr) end = std::max(end, whole_->events[i].before + begin->shape->all_motions());
  }
  return end;
}

void LongRun::take_held(std::size_t count, Chunk& piece) {
  piece.chosen.resize(count);
  piece.points.reserve(count);
  while (piece.size() < count) {
    const std::size_t taken = piece.size();
    unheld_->take(std::span(piece.chosen).subspan(taken, std::min(kTakenAtATime, count - taken)),
                  piece.points, choice_.summary());
  }
}

std::unique_ptr<Chunk> LongRun::next_piece() {
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
    range(whole.points, piece->points);
    if (!whole.programmed_axes_P.empty()) range(whole.programmed_axes_P, piece->programmed_axes_P);
    range(whole.chosen, piece->chosen);
  }
  piece->inverse = whole.inverse;
  for (; piece_event_ < whole.events.size(); ++piece_event_) {
    const Event& event = whole.events[piece_event_];
    if (event.before >= end && !is_last) break;
    piece->events.push_back({event.before - begin, event.record});
  }
  const auto take_from = [&](const auto& all, auto& out) {
    for (auto from = in_force(all, begin); from != all.end() && (from->motion < end || is_last); ++from) {
      out.push_back(*from);
      out.back().motion = from->motion <= begin ? 0 : from->motion - begin;
    }
  };
  take_from(whole.tolerances, piece->tolerances);
  take_from(unheld_ ? words_ : whole.words, piece->words);
  piece->before = whole.before;
  piece->has_before = whole.has_before;
  whole.before = choice_.rounded(piece->points.back(), piece->chosen.back().q_leave);
  whole.has_before = true;
  piece_begin_ = end;
  if (is_last) {
    whole_.reset();
    unheld_.reset();
  }
  return piece;
}

}  // namespace trunnion::post
