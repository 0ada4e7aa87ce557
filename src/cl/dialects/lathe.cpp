// What shows that a file is a lathe's. Its GOTOs have three values (x, y = 0, z or z, x, 0) and read as those
// of a mill: nothing else tells, so the signs are errors.
//   MODE/TURN (Fusion, HSMWorks, CAMplete), TURRET (CATIA), TLDATA/TURN, GROOVE, THREAD (NX), TOOLNO/n,TURN,
//   CHANNEL (CATIA), a surface speed where nothing shows a mill.
#include <string>

#include "cl/words.hpp"

namespace trunnion::cl {

namespace {

// MODE/MILL, MODE/TURN: the first statement that the posts of Fusion and HSMWorks write.
void read_mode(Context& context, const Statement& statement) {
  const std::string mode = statement.has_fields() ? std::string(statement.fields[0].text.substr(0, 40)) : "";
  if (mode == "TURN") return refuse_lathe(context, statement.where, "MODE/TURN");
  if (mode != "MILL" || statement.fields.size() > 1) {
    return context.error(statement.where, "MODE/" + mode +
                                              " changes the geometry and is not understood by this program; "
                                              "MODE/MILL is");
  }
  context.modal.origin.mill = true;
  context.modal.origin.fusion = true;
}

void read_turret(Context& context, const Statement& statement) {
  refuse_lathe(context, statement.where, std::string(statement.word));
}

constexpr WordReading kLatheWords[] = {
    {"MODE", read_mode}, {"TURRET", read_turret}, {"CHANNEL", read_turret}, {"THREAD", read_turret}};

}  // namespace

std::span<const WordReading> lathe_words() {
  return kLatheWords;
}

void refuse_lathe(Context& context, SourceRef where, const std::string& sign) {
  context.give_up(where, sign + ": this is the file of a lathe; turning has no tool axis and is not posted");
}

}  // namespace trunnion::cl
