#pragma once
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "cl/context.hpp"
#include "cl/statement.hpp"

namespace trunnion::cl {

using Reading = void (*)(Context&, const Statement&);

/// A word and what reads its statement.
struct WordReading {
  std::string_view word;
  Reading read;
};

// One list per concern; a word stands in one list only.
std::span<const WordReading> motion_words();   // GOTO, FROM, GODLTA, RAPID, MULTAX, TLAXIS, UNITS
std::span<const WordReading> process_words();  // FEDRAT, SPINDL, COOLNT, DELAY, STOP, LINTOL, FINI ...
std::span<const WordReading> tool_words();     // LOADTL, LOAD, SELECT, CUTTER, TLDATA ...
std::span<const WordReading> frame_words();    // MSYS, CSYS, TRNTYP ...
std::span<const WordReading> text_words();     // PARTNO, PPRINT, INSERT, TOOL PATH ...
std::span<const WordReading> circle_words();   // CIRCLE, MOVARC
std::span<const WordReading> cycle_words();    // CYCLE
std::span<const WordReading> catia_words();    // INDIRV, TLON
std::span<const WordReading> nurbs_words();    // NURBS, KNOT, CNTRL
std::span<const WordReading> lathe_words();    // MODE, TURRET

/// Ends the reading: this is the file of a lathe, as `sign` shows.
void refuse_lathe(Context& context, SourceRef where, const std::string& sign);

/// The GOTO to the end of context.modal.pending_arc.
void finish_arc(Context& context, SourceRef where, const Vec3& end_A, const Vec3& axis_A);
/// The motions of context.modal.nurbs, whose last statement was read.
void finish_nurbs(Context& context);
/// The GOTO to a hole of context.modal.cycle.
void drill_hole(Context& context, SourceRef where, const Vec3& tip_A, const Vec3& axis_A);

/// Mode of a word for the unit of a feed and its factor to the record's unit; nothing for another word.
std::optional<std::pair<FeedMode, double>> feed_unit_factor(std::string_view word, double mm_per_unit);

/// Words that change where the tool goes and are not understood: each is an error.
std::span<const std::string_view> refused_words();
/// Words that draw, name or set what does not concern the NC program: skipped without a word.
std::span<const std::string_view> silent_words();

/// Text of the file with a `?` for every byte that is no UTF-8, and every character that acts on a terminal
/// or a page instead of being shown: C1 controls, line and paragraph separators, marks that change the
/// direction.
std::string shown_text(std::string_view text);

/// The verdict on a word that no list knows.
void judge_unknown(Context& context, const Statement& statement);

/// Reads one statement into `context`: its word's reading, or the verdict on a word without one.
void read_statement(Context& context, const Statement& statement);

/// Comments that carry data: Creo's `$$-> ...`, CATIA's operation names.
void read_directive(Context& context, const Statement& statement);
void read_comment(Context& context, const Statement& statement);

}  // namespace trunnion::cl
