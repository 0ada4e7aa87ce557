#include "nc/control/base_differences.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include "nc/control/pattern_tokens.hpp"

namespace trunnion::nc {
namespace {

// What one file takes its words for.
struct Meanings {
  struct Use {
    Event event;
    std::string origin;
  };
  struct Word {
    std::string text;  // for messages
    std::vector<Use> uses;
  };
  std::map<std::string, Word> words;  // by "M3", and by the key of a whole line
  /// By the G and M words of a line and the letter behind which the value stands: "G4 P".
  std::map<std::string, std::map<Placeholder, std::string>> values;
};

// The end of length compensation is the same word whether or not it ends tool-centre-point control too.
Event general(Event event) {
  if (event.kind == EventKind::tcp_off || event.kind == EventKind::length_or_tcp_off)
    event.kind = EventKind::length_off;
  // One word may move several axes to their retract, and begin a group of cycles.
  if (event.kind == EventKind::retract) event.argument = 0;
  return event;
}

bool means_something(EventKind kind) {
  return kind != EventKind::silent && kind != EventKind::tape && kind != EventKind::allowed &&
         kind != EventKind::remember && kind != EventKind::program_start;
}

void add_pattern(const Pattern& pattern, Meanings& out) {
  const bool means = means_something(pattern.event.kind);
  const Meanings::Use use{general(pattern.event), pattern.origin};
  std::string codes;
  for (std::size_t i = 0; i < pattern.words.size(); ++i) {
    if (!pattern.words[i].is_fixed) continue;
    for (const std::string& word : words_in({pattern.tokens[2 * i], pattern.tokens[2 * i + 1]})) {
      if (means) out.words.try_emplace(word, Meanings::Word{word, {}}).first->second.uses.push_back(use);
      codes += (codes.empty() ? "" : " ") + word;
    }
  }
  if (means)
    out.words.try_emplace(pattern.key, Meanings::Word{codes.empty() ? pattern.key : codes, {}})
        .first->second.uses.push_back(use);
  if (codes.empty()) return;
  for (const PatternWord& word : pattern.words)
    if (!word.is_fixed) out.values[codes + " " + word.letter].try_emplace(word.placeholder, pattern.origin);
}

Meanings meanings_of(const PatternSet& patterns) {
  Meanings out;
  for (const auto* list : {&patterns.words, &patterns.phrases})
    for (const Pattern& pattern : *list) add_pattern(pattern, out);
  return out;
}

std::string origins(const std::vector<Meanings::Use>& uses) {
  std::set<std::string> names;
  for (const auto& use : uses) names.insert(use.origin);
  std::string out;
  for (const std::string& name : names) out += (out.empty() ? "" : " and ") + name;
  return out;
}

class Comparison {
 public:
  Comparison(const Controller& own, const Controller& base, Diagnostics& diagnostics)
      : own_(own),
        base_(base),
        base_name_(std::filesystem::path(base.file).filename().string()),
        diagnostics_(diagnostics) {
    for (const std::string& word : own.differs_in) meant_so_.insert(pattern_key(word));
  }

  void words(const Meanings& own, const Meanings& base) {
    for (const auto& [key, word] : own.words) {
      const auto there = base.words.find(key);
      if (there == base.words.end()) {
        // Arcs and wear a file may add to a base that has none.
        const EventKind kind = word.uses.front().event.kind;
        const auto why = base_.refused.find(key);
        if (why != base_.refused.end() && kind != EventKind::arc && kind != EventKind::cutter)
          say(word.text, "'" + word.text + "' is " + origins(word.uses) + " here; " + base_name_ +
                             " refuses it: " + why->second);
        continue;
      }
      const auto& others = there->second.uses;
      const bool agrees = std::any_of(word.uses.begin(), word.uses.end(), [&](const auto& use) {
        return std::any_of(others.begin(), others.end(),
                           [&](const auto& other) { return other.event == use.event; });
      });
      if (!agrees)
        say(word.text, "'" + word.text + "' is " + origins(word.uses) + " here and " + origins(others) +
                           " in " + base_name_);
    }
  }

  void values(const Meanings& own, const Meanings& base) {
    for (const auto& [place, meanings] : own.values) {
      const auto there = base.values.find(place);
      if (there == base.values.end()) continue;
      for (const auto& [placeholder, origin] : meanings) {
        if (there->second.contains(placeholder)) continue;
        say(place, origin + ": the value behind '" + place + "' is {" + std::string(name_of(placeholder)) +
                       "} here and {" + std::string(name_of(there->second.begin()->first)) + "} in " +
                       base_name_);
      }
    }
  }

  // Words of the base's setup that this setup leaves out, and G and M words that a tool change has there and
  // none here.
  void left_out() {
    const auto words_of_all = [](const Template& lines) {
      std::vector<std::string> out;
      for (const std::string& line : lines)
        for (const std::string& word : setup_words(line)) out.push_back(pattern_key(word));
      return out;
    };
    const auto here = words_of_all(own_.program.setup);
    for (const std::string& line : base_.program.setup)
      for (const std::string& word : setup_words(line))
        if (std::find(here.begin(), here.end(), pattern_key(word)) == here.end())
          say(word, "[program] setup leaves out '" + word + "', which " + base_name_ + " has there");
    const auto codes = [](const Template& lines) {
      std::vector<std::string> out;
      for (const std::string& line : lines)
        for (std::string& word : words_in(tokens_of(line))) out.push_back(std::move(word));
      return out;
    };
    const auto changes = codes(base_.tool_change);
    if (!changes.empty() && codes(own_.tool_change).empty())
      say(changes.back(),
          "[tool] change leaves out '" + changes.back() + "', which " + base_name_ + " has there");
  }

  void choices() {
    if (!own_.arcs.clockwise.empty() && !base_.arcs.clockwise.empty() &&
        own_.arcs.center_absolute != base_.arcs.center_absolute)
      say("center", std::string("[arcs] center is ") +
                        (own_.arcs.center_absolute ? "absolute" : "from_start") + " here and " +
                        (base_.arcs.center_absolute ? "absolute" : "from_start") + " in " + base_name_);
    if (base_.numbers.point_required && !own_.numbers.point_required)
      say("decimal_point_required", "[numbers] decimal_point_required is false here and true in " +
                                        base_name_ + ": X10 may be 0.01 mm on such a control");
  }

 private:
  void say(const std::string& word, const std::string& what) {
    if (meant_so_.contains(pattern_key(word))) return;
    diagnostics_.warning_once(
        "base:" + word, own_.file, {},
        what +
            ". Nothing else checks this: a program is written and verified by this file. "
            "If it is meant, add \"" +
            word + "\" to [controller] differs_in");
  }

  const Controller& own_;
  const Controller& base_;
  std::string base_name_;
  Diagnostics& diagnostics_;
  std::set<std::string> meant_so_;
};

}  // namespace

void warn_of_differences_from_base(const Controller& own, const PatternSet& own_patterns,
                                   const Controller& base, Diagnostics& diagnostics) {
  Diagnostics unheard;
  const Meanings here = meanings_of(own_patterns);
  const Meanings there = meanings_of(compile_patterns(base, unheard));
  Comparison comparison(own, base, diagnostics);
  comparison.words(here, there);
  comparison.values(here, there);
  // The words that controls share (iso.toml) are no control: what they need in a setup each of them decides.
  if (base.bases.empty()) return;
  comparison.left_out();
  comparison.choices();
}

}  // namespace trunnion::nc
