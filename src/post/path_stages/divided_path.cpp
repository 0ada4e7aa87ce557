#include "post/path_stages/divided_path.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <variant>

#include "post/making/post_words.hpp"

namespace trunnion::post {
namespace {

// Ends are rounded to the digits of the text, and lengths to those of a double: a part may be so much longer,
// as a share. No word of a program shows it.
constexpr double kRounding = 1e-9;
// Farther apart, and there is one great circle between two tool axes.
constexpr double kOpposite = -1.0 + 1e-12;

}  // namespace

bool DividedPath::next_record(cl::Record& record) {
  if (ahead_.next == ahead_.count) {
    ahead_.next = 0;
    ahead_.count = path_->next_cuts(ahead_.cuts, ahead_.feed);
    if (ahead_.count == 0) return path_->next(record);
  }
  const cl::PlainCut& cut = ahead_.cuts[ahead_.next++];
  record.where = cut.where;
  record.data = cl::Motion{cut.tip_P, cut.axis_P, ahead_.feed};
  return true;
}

DividedPath::Division DividedPath::division_of(cl::Record record) {
  const auto& motion = std::get<cl::Motion>(record.data);
  const ToolPose to{motion.tip_P, motion.axis_P};
  const bool may_divide =
      from_ && !motion.rapid && tap_left_ == 0 && from_->axis_P.dot(to.axis_P) > kOpposite;
  Division out{std::move(record), from_.value_or(to), 1, 1};
  if (tap_left_ > 0) --tap_left_;
  if (may_divide) {
    constexpr double kMost = 1e15;  // every smaller number of parts is exact as a double
    const double parts = std::ceil(rule_(*from_, to) * (1.0 - kRounding));
    if (parts > 1.0) out.count = static_cast<std::uint64_t>(std::min(parts, kMost));
  }
  from_ = to;
  return out;
}

// Each part has its share of the time that the motion is given.
void DividedPath::put_part(Division& division, std::vector<cl::Record>& queue) {
  auto& part = std::get<cl::Motion>(queue.emplace_back(division.whole).data);
  const cl::Motion& whole = std::get<cl::Motion>(division.whole.data);
  const std::uint64_t i = division.next++;
  const auto count = static_cast<double>(division.count);
  part.part.share /= count;
  if (part.feed.mode == cl::FeedMode::inverse) part.feed.value *= count;
  if (i == division.count) return;
  const double t = static_cast<double>(i) / count;
  part.tip_P = division.from.tip_P + t * (whole.tip_P - division.from.tip_P);
  part.axis_P = slerp(division.from.axis_P, whole.axis_P, t);
  part.part.ends_inside = true;
}

// An arc or a hole says beforehand how many motions it has.
void DividedPath::put_shape(const cl::Record& begin, std::vector<cl::Record>& queue) {
  const auto& told = *std::get<cl::ShapeBegin>(begin.data).shape;
  queue.push_back(begin);
  std::size_t added = 0;
  cl::Record record;
  for (std::size_t left = told.motions; left > 0 && next_record(record);) {
    if (!std::holds_alternative<cl::Motion>(record.data)) {
      queue.push_back(std::move(record));
      continue;
    }
    Division division = division_of(std::move(record));
    added += division.count - 1;
    while (!division.is_done()) put_part(division, queue);
    --left;
  }
  auto shape = std::make_shared<cl::Shape>(told);
  shape->added += added;
  queue.front().data = cl::ShapeBegin{std::move(shape)};
}

void DividedPath::refill(std::vector<cl::Record>& queue) {
  if (division_.is_done()) {
    cl::Record record;
    if (!next_record(record)) return;
    if (!std::holds_alternative<cl::Motion>(record.data)) {
      if (const auto* begin = std::get_if<cl::ShapeBegin>(&record.data)) {
        const auto* hole = std::get_if<cl::Hole>(&begin->shape->what);
        if (hole == nullptr || hole->kind != cl::Hole::Kind::tap) return put_shape(record, queue);
        tap_left_ = begin->shape->motions;
      }
      const auto* word = std::get_if<cl::PostWord>(&record.data);
      if (std::holds_alternative<cl::ToolChange>(record.data) || (word != nullptr && may_turn_table(*word)))
        from_.reset();
      queue.push_back(std::move(record));
      return;
    }
    division_ = division_of(std::move(record));
  }
  for (std::size_t i = 0; i < kAtATime && !division_.is_done(); ++i) put_part(division_, queue);
}

}  // namespace trunnion::post
