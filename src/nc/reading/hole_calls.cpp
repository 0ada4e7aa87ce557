#include "nc/reading/hole_calls.hpp"

#include <algorithm>
#include <array>

#include "nc/control/templates.hpp"

namespace trunnion::nc {
namespace {

using Meaning = std::string_view;
constexpr std::array<Meaning, 14> kMeanings = {"surface",  "above",   "bottom", "depth",        "below",
                                               "back",     "rise",    "step",   "first_bottom", "feed",
                                               "feed_out", "seconds", "lead",   "rpm"};

// Values are kept in millionths: more decimals than any control takes.
constexpr int kDecimals = 6;

std::size_t find_word(std::string_view text, std::string_view word) {
  for (std::size_t i = 0; i + word.size() <= text.size(); ++i) {
    const auto is_of_word = [&](std::size_t at) { return at < text.size() && is_of_name(text[at]); };
    if (begins_as(text.substr(i), word) && !is_of_word(i + word.size()) && (i == 0 || !is_of_word(i - 1)))
      return i;
  }
  return std::string_view::npos;
}

std::string text_of(std::int64_t value) {
  const std::int64_t one = kPowersOfTen[kDecimals];
  std::string out = value < 0 ? "-" : "";
  const std::int64_t size = value < 0 ? -value : value;
  out += std::to_string(size / one);
  std::string rest = std::to_string(one + size % one).substr(1);
  while (!rest.empty() && rest.back() == '0') rest.pop_back();
  return rest.empty() ? out : out + "." + rest;
}

std::optional<std::int64_t> number_in(std::string_view text) {
  const char* p = text.data();
  const char* const end = p + text.size();
  Number number;
  std::int64_t out = 0;
  constexpr std::int64_t kLargest = 10'000'000;  // mm, mm/min, 1/min: sums of them fit
  if (!scan_number(p, end, number) || p != end || !to_quanta(number, kDecimals, out) ||
      out > kLargest * kPowersOfTen[kDecimals] || out < -kLargest * kPowersOfTen[kDecimals])
    return std::nullopt;
  return out;
}

}  // namespace

// What the values of a cycle mean, Z in the coordinates of the program.
struct HoleCalls::Values {
  std::array<std::optional<std::int64_t>, kMeanings.size()> value;  // by kMeanings

  std::optional<std::int64_t>& operator[](std::string_view meaning) {
    return value[static_cast<std::size_t>(std::find(kMeanings.begin(), kMeanings.end(), meaning) -
                                          kMeanings.begin())];
  }
};

namespace {

struct Fixed {
  std::int64_t value = 0;
  bool may_be_left_out = false;
};

// 0, 5, 1?
std::optional<Fixed> fixed_in(std::string_view meaning) {
  const bool asks = meaning.ends_with('?');
  const auto number = number_in(meaning.substr(0, meaning.size() - (asks ? 1 : 0)));
  if (!number) return std::nullopt;
  return Fixed{*number, asks || *number == 0};
}

}  // namespace

bool is_meaning_in_cycle(std::string_view meaning) {
  return meaning == "any" || fixed_in(meaning) ||
         std::find(kMeanings.begin(), kMeanings.end(), meaning) != kMeanings.end();
}

HoleCalls::HoleCalls(const Controller& controller) : c_(controller), holes_(controller.input.flow.holes) {}

bool HoleCalls::fail(const std::string& message) {
  error = message;
  return true;
}

bool Controller::Input::Flow::Holes::Cycle::is_begun_by(std::string_view line) const {
  return begins_as(line, begins) &&
         (begins.back() == '(' || line.size() == begins.size() || !is_digit(line[begins.size()]));
}

// Nearly every line has none of these.
bool HoleCalls::may_hold(std::string_view text) const {
  if (begun_ || everywhere_) return true;
  if (holes_.cycles.empty()) return false;
  for (std::size_t i = 0; i + 1 < text.size(); ++i) {
    const char c = upper(text[i]);
    if ((c == 'C' && upper(text[i + 1]) == 'Y') ||
        (c == 'M' && (text[i + 1] == '9' || upper(text[i + 1]) == 'C')))
      return true;
  }
  return false;
}

// Without comment and block number.
std::string_view HoleCalls::plain(std::string_view text) const {
  if (!c_.comments.open.empty()) text = text.substr(0, text.find(c_.comments.open));
  text = without_blanks(text);
  std::string_view rest = text;
  if (begins_as(rest, c_.block_numbers.prefix)) {
    rest.remove_prefix(c_.block_numbers.prefix.size());
    const auto digits = std::find_if_not(rest.begin(), rest.end(), is_digit) - rest.begin();
    if (digits > 0) text = without_blanks(rest.substr(static_cast<std::size_t>(digits)));
  }
  return text;
}

// `Q201=-20` in a line without a block number of its own: a parameter of the cycle before it, `~` or not.
bool HoleCalls::sets_parameter(std::string_view text) const {
  const std::string& mark = c_.input.flow.variables;
  text = without_blanks(text);
  if (mark.empty() || !begins_as(text, mark)) return false;
  text.remove_prefix(mark.size());
  const auto digits =
      static_cast<std::size_t>(std::find_if_not(text.begin(), text.end(), is_digit) - text.begin());
  return digits > 0 && without_blanks(text.substr(digits)).starts_with('=');
}

bool HoleCalls::take(std::string_view text, std::uint32_t number, const Sink& sink) {
  if (!may_hold(text)) return false;
  error.clear();
  const std::string_view line = plain(text);
  if (begun_) {
    if (line.empty()) return false;  // a remark
    begun_ = sets_parameter(text);
    if (goes_on_ && !begun_) {
      error_line = number;
      return fail("a line behind '~' that sets no value of the cycle: the control stops at such a block");
    }
    if (begun_) {
      goes_on_ = without_blanks(text).ends_with('~');
      return take_values(line), true;
    }
    define();
    if (!error.empty()) return true;
  }
  error_line = number;
  std::string_view cycle = line;
  const bool at_each = !holes_.modal_call.empty() &&
                       find_word(cycle.substr(0, holes_.modal_call.size() + 1), holes_.modal_call) == 0;
  if (at_each) cycle = without_blanks(cycle.substr(holes_.modal_call.size()));
  if (at_each && cycle.empty()) return everywhere_ = false, true;
  const auto known = std::find_if(holes_.cycles.begin(), holes_.cycles.end(),
                                  [&](const Cycle& one) { return one.is_begun_by(cycle); });
  if (known == holes_.cycles.end())
    return at_each ? fail("'" + holes_.modal_call + "' of something that is no drilling cycle is not read")
                   : call(line, sink);
  if (everywhere_ && !at_each) return fail("a drilling cycle under '" + holes_.modal_call + "'");
  name_ = known->begins;
  given_.clear();
  if (!take_values(cycle.substr(name_.size()))) return true;
  begun_ = name_.back() != '(';
  if (begun_) calls_[number] = false;
  goes_on_ = begun_ && without_blanks(text).ends_with('~');
  if (begun_) return true;
  define();
  if (!error.empty()) return true;
  everywhere_ = at_each;
  if (!at_each)
    for (const std::string& one : called_) sink(one);
  return true;
}

// (100,0,2,-20,,3) or DRILLING Q200=2 Q201=-20 ~
bool HoleCalls::take_values(std::string_view behind) {
  if (name_.back() == '(') {
    const auto end = behind.find(')');
    if (end == std::string_view::npos || !without_blanks(behind.substr(end + 1)).empty())
      return !fail("'" + name_ + "' is read in a line of its own, to its ')'");
    behind = behind.substr(0, end);
    for (std::size_t at = 0; at <= behind.size();) {
      const auto comma = std::min(behind.find(',', at), behind.size());
      given_.emplace_back(without_blanks(behind.substr(at, comma - at)));
      at = comma + 1;
    }
    return true;
  }
  for (auto at = behind.find('='); at != std::string_view::npos; at = behind.find('=', at + 1)) {
    std::size_t begin = at;
    while (begin > 0 && is_blank(behind[begin - 1])) --begin;
    const std::size_t name_end = begin;
    while (begin > 0 && is_of_name(behind[begin - 1])) --begin;
    std::size_t value = at + 1;
    while (value < behind.size() && is_blank(behind[value])) ++value;
    std::size_t end = value;
    while (end < behind.size() && !is_blank(behind[end]) && behind[end] != '~') ++end;
    given_.push_back(std::string(behind.substr(begin, name_end - begin)) + "=" +
                     std::string(behind.substr(value, end - value)));
  }
  return true;
}

void HoleCalls::define() {
  called_.clear();
  // Several that differ in values that they must have: what the last one lacks is said.
  for (const Cycle& cycle : holes_.cycles) {
    if (cycle.begins != name_) continue;
    error.clear();
    if (auto lines = lines_of(cycle)) {
      called_ = std::move(*lines);
      return;
    }
  }
}

bool HoleCalls::take_meanings(const Cycle& cycle, Values& out) {
  const auto refuse = [&](const std::string& reason) { return !fail("'" + name_ + "': " + reason); };
  const bool by_place = name_.back() == '(';
  const auto meaning_of = [&](std::size_t i) {
    return cycle.values[i].substr(by_place ? 0 : cycle.values[i].find('=') + 1);
  };
  std::vector<bool> met(cycle.values.size());
  for (std::size_t i = 0; i < given_.size(); ++i) {
    std::size_t at = i;
    std::string value = given_[i], called = "value " + std::to_string(i + 1);
    if (!by_place) {
      called = given_[i].substr(0, given_[i].find('='));
      value = given_[i].substr(called.size() + 1);
      const auto known = std::find_if(cycle.values.begin(), cycle.values.end(),
                                      [&](const std::string& one) { return begins_as(one, called + "="); });
      at = static_cast<std::size_t>(known - cycle.values.begin());
    }
    if (value.empty()) continue;
    if (at >= cycle.values.size()) return refuse(called + " is not read");
    if (met[at]) return refuse(called + " stands there twice");
    met[at] = true;
    const std::string meaning = meaning_of(at);
    if (meaning == "any") continue;
    const auto number = number_in(value);
    if (!number) return refuse(called + " = '" + value + "' is no number that is read");
    const auto fixed = fixed_in(meaning);
    if (fixed && fixed->value != *number)
      return refuse(called + " = " + value + " is not read, but " + meaning + " only");
    if (!fixed) out[meaning] = *number;
  }
  for (std::size_t i = 0; i < met.size(); ++i) {
    const auto fixed = fixed_in(meaning_of(i));
    if (!met[i] && fixed && !fixed->may_be_left_out) return refuse(cycle.values[i] + " is missing");
  }
  return true;
}

std::optional<Template> HoleCalls::lines_of(const Cycle& cycle) {
  const auto refuse = [&](const std::string& reason) {
    fail("'" + name_ + "': " + reason);
    return std::nullopt;
  };
  Values v;
  if (!take_meanings(cycle, v)) return std::nullopt;
  if (!v["surface"]) return refuse("without the height of the surface");
  const std::int64_t surface = *v["surface"];
  // Of those that say the same, the first; two that differ are refused.
  std::optional<std::int64_t> bottom = v["bottom"];
  bool differs = false;
  const auto also = [&](std::optional<std::int64_t> place) {
    differs = differs || (place && bottom && *place != *bottom);
    if (place) bottom = place;
  };
  if (v["depth"]) also(surface + *v["depth"]);
  if (v["below"]) also(surface - *v["below"]);
  if (differs) return refuse("its depth is said twice, and not the same");
  if (!bottom) return refuse("without its depth");
  if (*bottom >= surface) return refuse("its bottom is not below the surface");
  const std::int64_t above = v["above"].value_or(0);
  if (above < 0) return refuse("a safety distance below 0");
  const std::int64_t clear = surface + above;
  if (!v["back"] && !v["rise"]) return refuse("without the height to which it returns");
  const std::int64_t back = v["back"].value_or(surface + std::max(v["rise"].value_or(0), above));
  if (back < clear) return refuse("it returns below its safety distance");
  std::optional<std::int64_t> step = v["step"];
  if (v["first_bottom"]) {
    if (step && *v["first_bottom"] != surface - *step)
      return refuse("its first depth is said twice, and not the same");
    step = surface - *v["first_bottom"];
  }
  const bool is_tap = cycle.kind == Hole::Kind::tap;
  const bool steps = cycle.kind == Hole::Kind::peck || cycle.kind == Hole::Kind::chip_break;
  if (steps && step.value_or(0) <= 0) return refuse("without the depth of its first step");
  if (step.value_or(0) < 0) return refuse("a step below 0");
  if (v["feed_out"].value_or(0) != 0 && v["feed_out"] != v["feed"])
    return refuse("it comes out at another feed than it goes in");
  const std::int64_t seconds = v["seconds"].value_or(0);
  if (seconds < 0) return refuse("a dwell in turns of the spindle");
  // A step of the whole depth, which counts from the surface, is one stroke from the safety distance on.
  if (step && *step >= surface - *bottom) step = clear - *bottom;
  const auto kind = static_cast<std::size_t>(cycle.kind);
  const Template& words = !cycle.lines.empty() ? cycle.lines
                          : is_tap             ? c_.cycles.tap
                          : seconds > 0        ? c_.cycles.dwell[kind]
                                               : c_.cycles.plain[kind];
  if (words.empty()) return refuse("this kind of cycle is not read here");
  if (seconds > 0 && !holds(words, Placeholder::seconds)) return refuse("its dwell is not read");
  for (const auto& [placeholder, meaning] :
       {std::pair(Placeholder::feed, "feed"), std::pair(Placeholder::lead, "lead"),
        std::pair(Placeholder::rpm, "rpm")}) {
    if (holds(words, placeholder) && v[meaning].value_or(0) == 0)
      return refuse(std::string("without its ") + meaning);
  }
  trunnion::nc::Values texts;
  const auto put = [&](Placeholder placeholder, std::int64_t value) {
    texts.set(placeholder, text_of(value));
  };
  put(Placeholder::clear, clear);
  put(Placeholder::bottom, *bottom);
  put(Placeholder::depth, *bottom - clear);
  put(Placeholder::back, back);
  put(Placeholder::rise, back - clear);
  put(Placeholder::step, step.value_or(0) > 0 ? *step : clear - *bottom);  // 0: in one stroke
  put(Placeholder::seconds, seconds);
  put(Placeholder::feed, v["feed"].value_or(0));
  put(Placeholder::lead, v["lead"].value_or(0));
  put(Placeholder::rpm, v["rpm"].value_or(0));
  Template out;
  for (const std::string& line : words) out.push_back(render(line, texts));
  return out;
}

// CYCL CALL, M99 behind a motion, or a motion under MCALL.
bool HoleCalls::call(std::string_view line, const Sink& sink) {
  if (!holes_.call.empty() && begins_as(line, holes_.call)) {
    if (line.size() != holes_.call.size())
      return fail("'" + holes_.call + "' with other words is not read: give them a line of their own");
    return call_behind({}, sink);
  }
  if (everywhere_) return call_everywhere(line, sink);
  const auto at = holes_.call_word.empty() ? std::string_view::npos : find_word(line, holes_.call_word);
  if (at == std::string_view::npos) return false;
  std::string without(line);
  return call_behind(without.erase(at, holes_.call_word.size()), sink);
}

// X and Y are the places of holes: whatever else moves would be drilled behind, too.
bool HoleCalls::call_everywhere(std::string_view line, const Sink& sink) {
  bool moves = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (!is_letter(line[i])) continue;
    const char letter = upper(line[i]);
    moves = moves || letter == 'X' || letter == 'Y';
    const bool is_name = i + 1 < line.size() && is_letter(line[i + 1]);
    if (is_name || std::string_view("XYGFNMSTD").find(letter) == std::string_view::npos)
      return fail("under '" + holes_.modal_call +
                  "' the control drills after every motion: only X and Y may move, and '" +
                  holes_.modal_call + "' alone ends it");
  }
  return moves && call_behind(line, sink);
}

std::vector<std::uint32_t> HoleCalls::never_called() const {
  std::vector<std::uint32_t> out;
  for (const auto& [line, called] : calls_)
    if (!called) out.push_back(line);
  return out;
}

bool HoleCalls::call_behind(std::string_view line, const Sink& sink) {
  if (!calls_.empty()) calls_.rbegin()->second = true;
  if (called_.empty()) return fail("a drilling cycle is called, and none that is read stands before it");
  if (!without_blanks(line).empty()) sink(line);
  for (const std::string& one : called_) sink(one);
  return true;
}

}  // namespace trunnion::nc
