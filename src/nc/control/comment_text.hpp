#pragma once
#include <string>
#include <vector>

#include "trunnion/nc/controller.hpp"

namespace trunnion::nc {

/// The texts of the comment lines that say `text` on this control: only characters of its list, none longer
/// than it takes. A line begins with the control's mark when the text is somebody else's (`foreign`), when it
/// continues the line before it, and when the control might execute its beginning. At least one line.
std::vector<std::string> comment_lines(const Controller::Comments& rules, const std::string& text,
                                       bool foreign);

/// The control might execute a comment that begins so: a word of [comments] active_words, or a word and a
/// comma.
bool may_act(const Controller::Comments& rules, std::string_view line);
/// It begins with one of the active words, as a whole word.
bool acts(const Controller::Comments& rules, std::string_view line);

}  // namespace trunnion::nc
