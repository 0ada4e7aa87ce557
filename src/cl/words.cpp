#include "cl/words.hpp"

#include <string>
#include <unordered_map>

#include "trunnion/base/contract.hpp"

namespace trunnion::cl {

namespace {

constexpr std::string_view kRefused[] = {
    // curves
    "ARC", "MOVNRB", "SPLINE", "HELIX", "INDIRP", "ARCSLP", "ARCDAT", "ARCMOV",
    // motion along part, drive and check surfaces, and motions whose end the file does not say
    "GO", "GOLFT", "GORGT", "GOFWD", "GOBACK", "GOUP", "GODOWN", "TLLFT", "TLRGT", "TLONPS", "TLOFPS", "TURN",
    "POCKET", "HEAD",
    // frames and copies
    "TRACUT", "TRANS", "ORIGIN", "ROTHED", "COPY", "MIRROR", "INDEX", "REFSYS", "LCS", "MATRIX", "SETANG",
    "POSTN",
    // programs that call themselves
    "DEFSUB", "ENDSUB", "CALL", "MACRO", "LOOPST", "LOOPND", "JUMPTO", "INCLUD", "LOOP", "ENDLOOP", "REPEAT",
    "IF", "INCR", "TRANSFORM"};

constexpr std::string_view kSilent[] = {
    // display
    "PAINT", "CAMERA", "DISPLY", "CLPRNT", "PLOT", "NOPLOT", "PPLOT", "PEN", "TITLE", "CSI_SET_FLUTE_LENGTH",
    "CSI_SET_EXTENSION_LENGTH", "CSI_SET_PATH_PARAM", "CSI_PATH_TOLERANCE", "START",
    // what the CAM system worked with: it is in the points already
    "MACHIN", "MCHTOL", "INTOL", "OUTTOL", "TOLER", "THICK", "AUTOPS", "PSIS", "CUT", "DNTCUT", "NOPOST",
    "TMARK", "MACHINE", "PRINT", "SEQNO", "PLABEL", "END"};

// Text that names what follows; in that of others somebody may write of a GOTO.
constexpr std::string_view kNames[] = {"TOOLPATH", "HEADER", "CSI_TOOL_PATH"};
constexpr const char* kLost =
    ": a second statement in the line, which would be lost; is the end of a line missing?";

// How the tool stands to the curve, before the motion itself (TLON,GOFWD/...).
constexpr std::string_view kBeforeMotion[] = {"TLON", "TLLFT", "TLRGT", "TLONPS", "TLOFPS"};

// Between the center of an arc and its end they would change what one of the two means.
constexpr std::string_view kBreakArcs[] = {"MCS",  "MSYS",   "TLAXIS", "MULTAX", "UNITS",  "UNIT",
                                           "FROM", "LOADTL", "LOAD",   "CYCLE",  "RETRCT", "RAPID"};

using ReadingTable = std::unordered_map<std::string_view, Reading>;

const ReadingTable& readings() {
  static const ReadingTable table = [] {
    ReadingTable all;
    for (const auto list : {motion_words(), process_words(), tool_words(), frame_words(), text_words(),
                            circle_words(), cycle_words(), catia_words(), nurbs_words(), lathe_words()}) {
      for (const WordReading& entry : list) {
        const bool first = all.emplace(entry.word, entry.read).second;
        TRUNNION_EXPECTS(first);
      }
    }
    return all;
  }();
  return table;
}

bool is_in(std::span<const std::string_view> list, std::string_view word) {
  for (const std::string_view entry : list) {
    if (entry == word) return true;
  }
  return false;
}

/// What to set in the system that writes the word, so that it writes lines.
std::string_view remedy_for(std::string_view word) {
  if (word == "MOVNRB") return " (Creo: OUTPUT_3DNURBS NO)";
  return {};
}

/// A word that says where the tool goes: behind FINI another program begins.
bool moves(std::string_view word) {
  for (const auto list : {motion_words(), circle_words(), cycle_words(), nurbs_words()}) {
    for (const WordReading& entry : list) {
      if (entry.word == word) return true;
    }
  }
  return false;
}

bool is_letter(char c) {
  return c >= 'A' && c <= 'Z';
}

/// The word of a second statement in the value: "211GOTO/40", "GOTO/40", "10RAPID"; empty: there is none.
/// What stands in parentheses is of the APT language.
std::string_view second_statement(std::string_view value) {
  const auto stands = [](std::string_view word) {
    return readings().find(word) != readings().end() || is_in(kRefused, word);
  };
  if (value.empty()) return {};
  if (!is_letter(value.back()) && value.find('/') == std::string_view::npos) return {};  // a number
  if (const auto quote = value.rfind('\''); quote != std::string_view::npos) value.remove_prefix(quote + 1);
  const auto slash = value.find('/');
  std::size_t begin = std::min(slash, value.size());
  while (begin > 0 && is_letter(value[begin - 1])) --begin;
  const std::string_view word = value.substr(begin, std::min(slash, value.size()) - begin);
  const bool in_parentheses = begin > 0 && value[begin - 1] == '(';
  if (word.empty() || in_parentheses) return {};
  if (slash != std::string_view::npos) {
    if (stands(word)) return word;
    // A word that runs into it (DISPLY/ONGOTO/15). Only such as no name ends with.
    constexpr std::string_view kDistinct[] = {"GOTO",   "GODLTA", "CIRCLE", "CYCLE", "LOADTL",
                                              "FEDRAT", "SPINDL", "UNITS",  "RAPID"};
    for (const std::string_view known : kDistinct)
      if (word.ends_with(known)) return known;
    return {};
  }
  const bool behind_number = begin > 0 && value.find_first_not_of("0123456789.+-") == begin;
  return behind_number && is_in(kBareWords, word) ? word : std::string_view{};
}

}  // namespace

std::span<const std::string_view> refused_words() {
  return kRefused;
}
std::span<const std::string_view> silent_words() {
  return kSilent;
}

void read_statement(Context& context, const Statement& statement) {
  if (context.modal.nurbs && statement.word != "KNOT" && statement.word != "CNTRL") finish_nurbs(context);
  if (context.modal.ended && moves(statement.word)) {
    context.give_up(
        statement.where,
        std::string(statement.word) + " behind FINI: a second program in the file, which would be left out");
    return;
  }
  if (context.modal.ended) {
    context.warning_once("after FINI", statement.where,
                         std::string(statement.word.substr(0, 40)) + ": what follows FINI is not read");
    return;
  }
  if (context.modal.pending_arc && is_in(kBreakArcs, statement.word)) {
    context.error(statement.where, std::string(statement.word) + " between " +
                                       std::string(context.modal.pending_arc->word) +
                                       " and the end (GOTO) of its arc");
    context.modal.pending_arc.reset();
    return;
  }
  const bool names = statement.kind == Statement::Kind::text && is_in(kNames, statement.word);
  if (names && statement.text.find("GOTO/") != std::string_view::npos)
    return context.error(statement.where, "GOTO in the text of " + std::string(statement.word) + kLost);
  for (const Field& field : statement.fields) {
    if (statement.kind != Statement::Kind::command || is_in(kBeforeMotion, statement.word)) break;
    const std::string_view second = second_statement(field.text);
    if (second.empty()) continue;
    return context.error(field.where,
                         std::string(second) + " in the values of " + std::string(statement.word) + kLost);
  }
  if (!context.modal.synonyms.empty()) {
    const auto found = context.modal.synonyms.find(statement.word);
    if (found != context.modal.synonyms.end()) {
      if (found->second.starts_with("$$")) return;  // made a comment
      Statement renamed = statement;
      renamed.word = found->second;
      const auto reading = readings().find(renamed.word);
      if (reading != readings().end()) return reading->second(context, renamed);
      return judge_unknown(context, renamed);
    }
  }
  const auto reading = readings().find(statement.word);
  if (reading != readings().end()) {
    reading->second(context, statement);
  } else if (is_in(refused_words(), statement.word)) {
    context.error(statement.where, std::string(statement.word) +
                                       " changes the geometry and is not understood by this program" +
                                       std::string(remedy_for(statement.word)));
  } else if (!is_in(silent_words(), statement.word)) {
    judge_unknown(context, statement);
  }
}

}  // namespace trunnion::cl
