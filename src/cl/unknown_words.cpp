// The verdict on a word without a reading.
#include <algorithm>
#include <string>
#include <vector>

#include "trunnion/base/number_text.hpp"

#include "cl/words.hpp"

namespace trunnion::cl {

namespace {

// Shorter words have neighbours by chance.
constexpr std::size_t kShortestForNeighbour = 4;
constexpr std::size_t kShortestForError = 5;

/// One letter wrong, too many, missing, or two neighbours exchanged.
bool one_slip_apart(std::string_view a, std::string_view b) {
  if (a.size() > b.size()) std::swap(a, b);
  if (b.size() - a.size() > 1) return false;
  const auto differs = std::mismatch(a.begin(), a.end(), b.begin());
  const auto at = static_cast<std::size_t>(differs.first - a.begin());
  if (a.size() < b.size()) return a.substr(at) == b.substr(at + 1);
  if (at == a.size()) return true;
  if (a.substr(at + 1) == b.substr(at + 1)) return true;
  return at + 1 < a.size() && a[at] == b[at + 1] && a[at + 1] == b[at] &&
         a.substr(at + 2) == b.substr(at + 2);
}

struct Neighbour {
  std::string_view word;
  bool moves = false;  // it says where the tool goes
};

std::optional<Neighbour> neighbour_of(std::string_view word) {
  if (word.size() < kShortestForNeighbour) return std::nullopt;
  const auto among = [&](std::span<const WordReading> list) -> std::string_view {
    for (const WordReading& known : list) {
      if (one_slip_apart(word, known.word)) return known.word;
    }
    return {};
  };
  for (const auto list :
       {motion_words(), circle_words(), cycle_words(), frame_words(), catia_words(), nurbs_words()}) {
    if (const auto found = among(list); !found.empty()) return Neighbour{found, true};
  }
  for (const std::string_view known : refused_words()) {
    if (one_slip_apart(word, known)) return Neighbour{known, true};
  }
  for (const auto list : {process_words(), tool_words(), text_words()}) {
    if (const auto found = among(list); !found.empty()) return Neighbour{found, false};
  }
  return std::nullopt;
}

// "N20 LOADTL": the word, where one stands behind a block number.
std::string_view behind_block_number(std::string_view word) {
  if (!word.starts_with('N')) return {};
  const auto digits = word.find_first_not_of("0123456789", 1);
  if (digits == std::string_view::npos || digits == 1) return {};
  word.remove_prefix(digits);
  for (const auto list : {motion_words(), circle_words(), cycle_words(), frame_words(), catia_words(),
                          nurbs_words(), process_words(), tool_words(), text_words()})
    for (const WordReading& known : list)
      if (known.word == word) return known.word;
  const auto refused = refused_words();
  const auto it = std::find(refused.begin(), refused.end(), word);
  return it == refused.end() ? std::string_view{} : *it;
}

/// "G0X5Y5", as a block of an NC program.
bool looks_like_nc(const Statement& statement) {
  static constexpr std::string_view kNumber = "0123456789.+-";
  const std::string_view all = statement.word;
  if (statement.has_fields() || all.size() < 2 ||
      std::string_view("GXYZ").find(all.front()) == std::string_view::npos)
    return false;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool letter = all[i] >= 'A' && all[i] <= 'Z';
    if (!letter && kNumber.find(all[i]) == std::string_view::npos) return false;
    if (letter && (i + 1 == all.size() || kNumber.find(all[i + 1]) == std::string_view::npos)) return false;
  }
  return true;
}

/// Three or six numbers and nothing else: a point, or a point and a tool axis.
bool looks_like_a_point(const Statement& statement) {
  const std::size_t count = statement.fields.size();
  // Three, six: a point; nine, twelve: a frame.
  return (count == 3 || count == 6 || count == 9 || count == 12) &&
         std::all_of(statement.fields.begin(), statement.fields.end(),
                     [](const Field& field) { return static_cast<bool>(parse_number(field.text)); });
}

}  // namespace

void judge_unknown(Context& context, const Statement& statement) {
  const std::string word(statement.word.substr(0, 40));
  const char first = word.empty() ? '\0' : word.front();
  if (first < 'A' || first > 'Z') {
    if (statement.text.find("BEGINPGM") != std::string_view::npos ||
        statement.text.find("BEGIN PGM") != std::string_view::npos) {
      context.error(statement.where,
                    "this is not CL text but an NC program in Klartext: --from CONTROL reads it as a path");
      return;
    }
    if (statement.text.starts_with("(") || statement.text.starts_with("%")) {
      context.error(statement.where, "this is not CL text (the line starts with '" +
                                         std::string(statement.text.substr(0, 1)) +
                                         "'); is it an NC program? then --from CONTROL reads it as a path, "
                                         "and `trunnion verify` checks it");
      return;
    }
    context.error(statement.where, "the line starts with '" +
                                       (word.empty() ? std::string(statement.text.substr(0, 1)) : word) +
                                       "', not with a word; does the line before it lack its $?");
    return;
  }
  if (statement.text.starts_with("=")) {
    context.error(statement.where, word + "=: this is APT source language, not CL data");
    return;
  }
  if (const auto known = behind_block_number(statement.word); !known.empty()) {
    context.error(statement.where, word + ": a block number before " + std::string(known) +
                                       "; statements of a CL file have none: take the numbers out");
    return;
  }
  // A misspelt motion must not get lost with a warning.
  const auto near = neighbour_of(statement.word);
  const std::string meant = near ? "; did you mean " + std::string(near->word) + "?" : std::string();
  const bool has_matrix = std::any_of(statement.fields.begin(), statement.fields.end(),
                                      [](const Field& field) { return field.text == "MATRIX"; });
  if (looks_like_nc(statement)) {
    context.error(statement.where, word + ": a block of an NC program; in a CL file it stands behind INSERT");
  } else if (has_matrix) {
    context.error(statement.where, word + "/MATRIX: a frame that is not understood");
  } else if (word.starts_with("GO")) {
    context.error(statement.where, word + ": no motion word of this name" + meant);
  } else if (looks_like_a_point(statement)) {
    context.error(statement.where, word + " is not known, and its " +
                                       std::to_string(statement.fields.size()) + " numbers may be " +
                                       (statement.fields.size() > 6 ? "a frame" : "a point") + meant +
                                       " (if it means nothing: SYN/'" + word + "','$$')");
  } else if (near && near->moves && word.size() >= kShortestForError) {
    context.error(statement.where,
                  word + " is not known" + meant + " (if it means nothing: SYN/'" + word + "','$$')");
  } else {
    context.warning_once(word, statement.where, word + " is not known and was skipped" + meant);
  }
}

}  // namespace trunnion::cl
