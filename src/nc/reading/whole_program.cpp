#include "nc/reading/whole_program.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace trunnion::nc {

WholeProgram::WholeProgram(const Controller& controller, const PatternSet& patterns)
    : controller_(controller) {
  for (const std::string& line : controller.program.setup) {
    for (const std::string& word : setup_words(line)) setup_[pattern_key(word)].text = word;
  }
  // What an aborted program left on: where these words are missing the first motions go elsewhere.
  if (controller.tcp.off_at_start && !controller.tcp.off.empty())
    ends_earlier_[EventKind::tcp_off] = controller.tcp.off.back();
  if (controller.tilted_plane.off_at_start && !controller.tilted_plane.off.empty())
    ends_earlier_[EventKind::plane_off] = controller.tilted_plane.off.back();
  for (const auto* list : {&patterns.words, &patterns.phrases}) {
    for (const Pattern& pattern : *list) {
      for (const Pattern::Others& others : pattern.others) {
        lines_.insert(others.before.begin(), others.before.end());
        lines_.insert(others.after.begin(), others.after.end());
      }
    }
  }
}

// Keys of a template's lines, in its order. Words of one line may be written in any order.
bool WholeProgram::in_order(const std::vector<std::string>& keys, std::vector<SaidLine> said) {
  std::uint32_t line = 0;
  for (const std::string& key : keys) {
    const auto it = std::find_if(said.begin(), said.end(),
                                 [&](const SaidLine& one) { return one.line >= line && one.key == key; });
    if (it == said.end()) return false;
    line = it->line;
    it->key.clear();
  }
  return true;
}

std::string WholeProgram::missing() {
  std::string out;
  if (!open_.empty()) out = open_.front().place + " is not followed by the other lines of its template";
  if (out.empty() && !expected_.empty()) out = expected_by_ + ": not all lines of the template follow";
  open_.clear();
  expected_.clear();
  return out;
}

std::string WholeProgram::take(const Pattern& pattern, std::uint32_t line) {
  const bool is_event = pattern.event.kind != EventKind::silent && pattern.event.kind != EventKind::tape &&
                        pattern.event.kind != EventKind::remember &&
                        pattern.event.kind != EventKind::cycle_name;
  const std::string place =
      "'" + pattern.origin + "' (" + controller_.file + ") of line " + std::to_string(line);
  if (!is_event) {
    if (!lines_.contains(pattern.key)) return {};
    said_.push_back({pattern.key, line});
    const auto awaited = std::find(expected_.begin(), expected_.end(), pattern.key);
    if (awaited == expected_.end()) {
      if (pattern.is_part) open_.push_back({pattern.key, place});
      return {};
    }
    expected_.erase(awaited);
    followed_.push_back({pattern.key, line});
    if (!expected_.empty() || in_order(template_after_, followed_)) return {};
    return expected_by_ + ": the lines of the template follow in another order";
  }
  ends_earlier_.erase(pattern.event.kind);
  if (pattern.event.kind == EventKind::tcp_on) asks_for_tcp_ = true;
  if (pattern.event.kind == EventKind::tcp_off && first_off_line_ == 0) first_off_line_ = line;
  // The lines before it are its own, or nothing may stand open.
  if (pattern.others.empty()) {
    said_.clear();
    if (lines_.contains(pattern.key)) said_.push_back({pattern.key, line});
    return missing();
  }
  const auto said = std::exchange(said_, {});
  const auto is_said = [&](const Pattern::Others& others) { return in_order(others.before, said); };
  const auto of_one = std::find_if(pattern.others.begin(), pattern.others.end(), is_said);
  if (of_one == pattern.others.end()) {
    open_.clear();
    if (std::string behind = missing(); !behind.empty()) return behind;
    // The tool that is made ready stays so, whatever stands between.
    if (pattern.event.kind == EventKind::tool) return {};
    return place + ": lines of its template are missing before it, or stand in another order";
  }
  // One of each is its own; what else stands open is somebody's who never came.
  for (const std::string& key : of_one->before) {
    const auto own =
        std::find_if(open_.rbegin(), open_.rend(), [&](const OpenLine& open) { return open.key == key; });
    if (own != open_.rend()) open_.erase(std::next(own).base());
  }
  if (std::string left = missing(); !left.empty()) return left;
  expected_ = template_after_ = of_one->after;
  followed_.clear();
  expected_by_ = place;
  return {};
}

std::string WholeProgram::moves() {
  if (!std::exchange(is_head_, false)) return missing();
  for (const auto& [key, word] : setup_) {
    if (!word.said)
      return "the program moves and has not said '" + word.text + "' ([program] setup of " +
             controller_.file + ")";
  }
  if (!ends_earlier_.empty())
    return "the program moves and has not said '" + ends_earlier_.begin()->second +
           "', which ends what an aborted program may have left on (off_at_start of " + controller_.file +
           ")";
  return missing();
}

// A program that switches shows by it that its control can, whatever the machine file says.
std::string WholeProgram::ends() const {
  if (asks_for_tcp_ || first_off_line_ == 0 || !controller_.tcp.has_one_kinematics) return {};
  return "'" + controller_.tcp.off.back() + "', and the program never says '" + controller_.tcp.on.back() +
         "': a control that cannot switch its kinematics does not know the word and stops there; if yours "
         "can, "
         "say so in the machine file ([machine] switchable_kinematics = true)";
}

}  // namespace trunnion::nc
