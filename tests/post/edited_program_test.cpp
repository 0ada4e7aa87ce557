// Programs that somebody edited: whatever would cut wrong is found, in the words of every control and at
// every place of the program. Programs that nobody edited pass.
#include <algorithm>
#include <gtest/gtest.h>
#include <map>
#include <sstream>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"

#include "post/posting.hpp"
#include "support/cases.hpp"
#include "support/folders.hpp"

namespace trunnion::post {
namespace {

using Lines = std::vector<std::string>;

// Two tools, cuts with a moving and with a held tool axis, a pause, a stop, coolant that changes.
std::string edited_part(bool dwells) {
  std::string out = "PARTNO EDITED\nLOADTL/3\nSPINDL/RPM,8000,CLW\nCOOLNT/FLOOD\nFEDRAT/MMPM,1200\nRAPID\n";
  const auto cut = [&](int first, int last, double tilt, double turn) {
    for (int i = first; i < last; ++i) {
      const double t = 0.1 * i;
      out += test::point_text(Vec3(30.0 * std::cos(t), 30.0 * std::sin(t), 10.0 + 0.2 * i),
                              test::tilted(tilt + turn * i, 0.4 + turn * i));
    }
  };
  out += test::point_text(Vec3(30.0, 0.0, 60.0), test::tilted(0.3, 0.4));
  cut(0, 6, 0.3, 0.0);
  out += "FEDRAT/MMPM,900\n";
  cut(6, 12, 0.3, 0.02);
  if (dwells) out += "DELAY/1.5\n";
  cut(12, 15, 0.3, 0.02);
  out += "RAPID\n" + test::point_text(Vec3(4.0, 29.0, 70.0), test::tilted(0.6, 0.7));
  out += "SPINDL/OFF\nSTOP\nSPINDL/RPM,6000,CLW\nRAPID\n";
  out += test::point_text(Vec3(0.0, 30.0, 70.0), test::tilted(0.5, 0.4));
  cut(16, 20, 0.5, 0.0);
  out += "RAPID\n" + test::point_text(Vec3(-10.0, 25.0, 90.0), test::tilted(0.5, 0.4));
  out += "LOADTL/5\nSPINDL/RPM,4000,CCLW\nCOOLNT/OFF\nFEDRAT/MMPM,500\nRAPID\n";
  out += test::point_text(Vec3(20.0, 10.0, 60.0), test::tilted(0.2, 0.3));
  cut(5, 9, 0.2, 0.0);
  return out + "RAPID\n" + test::point_text(Vec3(20.0, 10.0, 90.0), test::tilted(0.2, 0.3)) + "FINI\n";
}

struct Edited {
  std::string kind;
  Lines lines;
};

Lines split(const std::string& text) {
  Lines out;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) out.push_back(line);
  return out;
}

std::string joined(const Lines& lines) {
  std::string out;
  for (const std::string& line : lines) out.append(line).append("\n");
  return out;
}

// Behind the block number.
std::string words_of_line(const std::string& line) {
  std::size_t at = line.find_first_not_of("N0123456789");
  return line.empty() || at == std::string::npos || at == 0 || line[at] != ' ' ? line : line.substr(at + 1);
}

bool has(const std::string& line, const std::string& text) {
  return line.find(text) != std::string::npos;
}

class Editor {
 public:
  Editor(std::string control, const std::string& program, bool in_part, bool shapes)
      : control_(std::move(control)), in_part_(in_part), shapes_(shapes), lines_(split(program)) {
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      if (is_feed_line(i)) cuts_.push_back(i);
      if (is_retract(i) && first_ == 0) first_ = i;
    }
  }

  std::vector<Edited> edits() {
    delete_lines();
    swap_motions();
    insert_words();
    change_numbers();
    add_motions();
    return std::move(out_);
  }

 private:
  bool tnc() const { return control_ == "heidenhain_tnc640"; }
  bool siemens() const { return control_ == "siemens_840d_sl"; }
  bool is_comment(std::size_t i) const {
    const std::string w = words_of_line(lines_[i]);
    return w.empty() || w.front() == '(' || w.front() == ';';
  }
  bool is_motion(std::size_t i) const {
    const std::string w = words_of_line(lines_[i]);
    if (is_comment(i) || has(w, "G53") || has(w, "SUPA") || has(w, "M91") || has(w, "CYCL") ||
        has(w, "PLANE") || has(w, "G68") || has(w, "CYCLE") || has(w, "G4"))
      return false;
    if (tnc()) return w.starts_with("L ");
    return w.find_first_of("XYZAC") != std::string::npos &&
           w.find_first_of("0123456789") != std::string::npos && w.find_first_of("OTP%") == std::string::npos;
  }
  // A motion at a feed, by the modal word before it.
  bool is_feed_line(std::size_t i) const {
    if (!is_motion(i)) return false;
    if (tnc()) return !has(lines_[i], "FMAX");
    for (std::size_t j = i + 1; j-- > 0;) {
      const std::string w = " " + words_of_line(lines_[j]) + " ";
      if (has(w, " G1 ")) return true;
      if (has(w, " G0 ")) return false;
    }
    return false;
  }

  void add(const std::string& kind, Lines lines) { out_.push_back({kind, std::move(lines)}); }
  void without(const std::string& kind, std::size_t i) {
    Lines lines = lines_;
    lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(i));
    add(kind, std::move(lines));
  }
  void before(const std::string& kind, std::size_t i, const Lines& more) {
    Lines lines = lines_;
    lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(i), more.begin(), more.end());
    add(kind, std::move(lines));
  }
  void replaced(const std::string& kind, std::size_t i, const std::string& from, const std::string& to) {
    Lines lines = lines_;
    const auto at = lines[i].find(from);
    if (at == std::string::npos) return;
    lines[i].replace(at, from.size(), to);
    add(kind, std::move(lines));
  }

  // Every line that is no motion and no comment, up to the last motion.
  void delete_lines() {
    for (std::size_t i = 0; i < cuts_.back(); ++i) {
      const std::string w = words_of_line(lines_[i]);
      if (is_comment(i) || is_motion(i) || w.starts_with("%") || w.starts_with("O") || w.starts_with("BEGIN"))
        continue;
      // Said twice, or a retract at the height where it is already.
      if (is_retract(i) && seen_retract(i)) continue;
      if (said_again(i) || restates_modes(i) || ends_earlier(i)) continue;
      // Where the tool is when the program begins nobody knows, and controls go up for a tool change.
      if (is_retract(i) && !seen_motion(i)) continue;
      // The spindle stops, or the coolant, and nothing is cut before it is said anew.
      if (w == "M5" || w == "M9" || w == "M89") continue;
      without("a line left out: " + kind_of(w), i);
    }
    for (std::size_t i : {cuts_.front(), cuts_[cuts_.size() / 2], cuts_.back()}) {
      Lines lines(lines_.begin(), lines_.begin() + static_cast<std::ptrdiff_t>(i));
      add("the rest left out", lines);
      lines.push_back(tnc() ? "M30" : "M30");
      add("the rest left out, M30", lines);
    }
  }
  static std::string kind_of(const std::string& w) { return w.substr(0, w.find_first_of(" 0123456789", 4)); }
  bool is_retract(std::size_t i) const {
    return has(lines_[i], "M91") || has(lines_[i], "G53 G0") || has(lines_[i], "SUPA");
  }
  bool seen_motion(std::size_t i) const {
    for (std::size_t j = first_; j < i; ++j) {
      if (is_motion(j)) return true;
    }
    return false;
  }
  // In the same words, before anything is cut.
  bool said_again(std::size_t i) const {
    for (std::size_t j = i + 1; j < lines_.size() && !is_feed_line(j); ++j) {
      if (words_of_line(lines_[j]) == words_of_line(lines_[i])) return true;
    }
    return false;
  }
  // Behind a tool change, for who begins there: who runs the program from its top has them in force.
  bool restates_modes(std::size_t i) const {
    const nc::Controller c = test::shipped_controller(control_);
    const std::string w = words_of_line(lines_[i]);
    const auto are = [&](const std::vector<std::string>& words) {
      return !words.empty() && words.front() == w;
    };
    const auto& modes = c.program.modes;
    return seen_motion(i) && (std::any_of(c.work_offsets.begin(), c.work_offsets.end(), are) ||
                              std::any_of(c.path_modes.begin(), c.path_modes.end(), are) ||
                              std::find(modes.begin(), modes.end(), w) != modes.end());
  }
  // What an aborted program may have left on, where nothing has been switched on yet.
  bool ends_earlier(std::size_t i) const {
    const nc::Controller c = test::shipped_controller(control_);
    const std::string w = words_of_line(lines_[i]);
    const auto& ends = c.program.ends_earlier;
    if (w != "M429" && std::find(ends.begin(), ends.end(), w) == ends.end()) return false;
    for (std::size_t j = i; j-- > first_;) {
      if (is_motion(j)) return false;
      if (has(lines_[j], "M6") || has(lines_[j], "TOOL CALL")) break;
    }
    return c.tcp.switches_kinematics ? seen_motion(i) : true;
  }
  // No motion below since the last retract.
  bool seen_retract(std::size_t i) const {
    for (std::size_t j = i; j-- > 0;) {
      if (is_motion(j)) return false;
      if (is_retract(j)) return true;
    }
    return false;
  }

  void swap_motions() {
    for (const std::size_t i : places()) {
      if (tnc()) {
        Lines lines = lines_;
        const auto at = lines[i].rfind(" F");
        if (at == std::string::npos) continue;
        lines[i] = lines[i].substr(0, at) + " FMAX";
        add("a feed made a rapid", lines);
      } else {
        Lines lines = lines_;
        const std::string line = words_of_line(lines[i]);
        const bool named = has(" " + line + " ", " G1 ");
        lines[i] = "G0 " + (named ? erased(line, "G1") : line);
        if (i + 1 < lines.size() && is_feed_line(i + 1)) lines[i + 1] = "G1 " + words_of_line(lines[i + 1]);
        add("a feed made a rapid", lines);
      }
    }
    Lines all = lines_;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!is_motion(i)) continue;
      if (tnc()) {
        const auto at = all[i].rfind(" F");
        if (at != std::string::npos) all[i] = all[i].substr(0, at) + " FMAX";
      } else {
        const std::string line = words_of_line(all[i]);
        if (has(" " + line + " ", " G1 ")) all[i] = "G0 " + erased(line, "G1");
      }
    }
    add("every feed made a rapid", all);
    // Rapids that come down made feeds.
    for (std::size_t i = first_; i < lines_.size(); ++i) {
      if (!is_motion(i) || is_feed_line(i) || i + 1 >= lines_.size() || !is_feed_line(i + 1)) continue;
      Lines lines = lines_;
      if (tnc())
        lines[i] = lines[i].substr(0, lines[i].rfind(" FMAX")) + " F500";
      else
        lines[i] = "G94 G1 " + erased(words_of_line(lines[i]), "G0") + " F500.";
      if (i > first_ && is_motion(i - 1) && has(lines_[i], "X")) add("a rapid made a feed", lines);
    }
  }
  static std::string erased(std::string line, const std::string& word) {
    const auto at = line.find(word);
    if (at != std::string::npos) line.erase(at, word.size() + 1);
    return line;
  }

  // Some of the cuts.
  std::vector<std::size_t> places() const {
    return {cuts_[1], cuts_[cuts_.size() / 4], cuts_[cuts_.size() / 2], cuts_[3 * cuts_.size() / 4],
            cuts_[cuts_.size() - 2]};
  }

  void insert_words() {
    Lines words = {"M5", "M30", "M0", "M91", "M13", "M128 K", "XYZ", "A", "M2"};
    if (tnc()) {
      words.insert(words.end(), {"M4", "TOOL CALL Z S100", "TOOL CALL 9 Z", "TOOL CALL 5 Z S1000", "M127",
                                 "BEGIN PGM B MM", "END PGM EDITED MM", "CYCL DEF 7.1 X+5",
                                 "CYCL DEF 7.3 Z-5", "TRANS DATUM AXIS X1 Y0 Z0", "CYCL DEF 7.0 DATUM SHIFT",
                                 "PLANE RESET STAY X", "L X+5 R0 FMAX M91"});
      if (!in_part_) words.push_back("M128");
    } else {
      words.insert(words.end(), {"M4",
                                 "S100",
                                 "G91",
                                 "G20",
                                 "G18",
                                 "G19",
                                 "G92 X0.",
                                 "G41 D1",
                                 "G42 D3",
                                 "G64",
                                 "G51 X0.",
                                 "G10 L2 P1 X0. Y0. Z5.",
                                 "G52 X1. Y0. Z0.",
                                 "O7",
                                 "%",
                                 "M98 P5",
                                 "B10.",
                                 "U1.",
                                 "G28 Z0.",
                                 "G53 Z-300.",
                                 "G68 R45."});
      for (const char* offset : {"G55", "G56", "G57", "G58"}) {
        if (!(siemens() && std::string(offset) == "G58")) words.push_back(offset);
      }
    }
    if (siemens())
      words.insert(words.end(), {"G500", "TRANS X1 Y0 Z0", "ATRANS Z1", "G641 ADIS=5", "D0", "D2", "ROT Z5",
                                 "SOFTX", "T9", "ORIWKS", "RTLIOF"});
    if (siemens() && !in_part_) words.push_back("TRAORI");
    if (!tnc() && !siemens()) words.insert(words.end(), {"G49", "G43 H9", "T9 M6"});
    if (control_ == "linuxcnc")
      words.insert(words.end(), {"G64 P0.5", "G61.2", "G92.1", "M66 E0 L0", "#1=5", "M68 E0"});
    for (const std::string& word : words) {
      if (word == "G64" && (control_ == "fanuc_30i")) continue;  // its plain cutting mode
      for (const std::size_t i : places()) {
        if (word == "M4" && i == places().back()) continue;  // turns so there
        before("inserted: " + word, i, {word});
      }
    }
  }

  void change_numbers() {
    const auto each = [&](const std::string& kind, const std::string& from, const std::string& to) {
      for (std::size_t i = first_; i < lines_.size(); ++i)
        if (!is_comment(i) && has(lines_[i], from)) replaced(kind, i, from, to);
    };
    each("another register", "H3", "H4");
    each("another register", "H5", "H3");
    each("another tool", "T3", "T5");
    each("another tool", "T5", "T3");
    each("another tool", "CALL 3", "CALL 5");
    each("another speed", "S8000", "S800");
    each("another speed", "S4000", "S6000");
    each("the other sense", "M4", "M3");
    each("the other coolant", "M8", "M7");
    each("another offset", "Q339=+1", "Q339=+2");
    each("another dwell", "P1500", "P15000");
    each("another dwell", "X1.5", "X9.5");
    each("another retract", "Z700", "Z70");
    each("another retract", "Z+700", "Z+70");
    each("machine coordinates left out", " M91", "");
    each("machine coordinates left out", "G53 ", "");
    each("machine coordinates left out", "SUPA ", "");
    each("machine coordinates left out", "G53", "G58");
    for (std::size_t i = 0; i < first_; ++i) {
      if (is_comment(i)) continue;
      replaced("another offset", i, "G54", "G55");
      replaced("other units", i, "G21", "G20");
      replaced("other units", i, "G710", "G700");
      replaced("another plane", i, "G17", "G18");
      replaced("increments", i, "G90", "G91");
      replaced("another path mode", i, "G61", "G64");
    }
    // F three times as large, and a third.
    for (const double factor : {3.0, 0.3}) {
      Lines all = lines_;
      bool any = false;
      for (std::size_t i = first_; i < all.size(); ++i) {
        if (!is_motion(i) || has(all[i], "FMAX")) continue;
        const auto at = all[i].rfind(" F");
        if (at == std::string::npos) continue;
        const auto number = parse_number(std::string_view(all[i]).substr(at + 2));
        if (!number) continue;
        all[i] = all[i].substr(0, at + 2) + fixed_text(factor * number.value, 1);
        if (std::find(cuts_.begin() + 2, cuts_.end() - 1, i) != cuts_.end() - 1 && i % 5 == 0) {
          Lines one = lines_;
          one[i] = all[i];
          if (!(is_motion(i - 1) && !is_feed_line(i - 1)))
            add("one feed times " + fixed_text(factor, 1), one);
        }
        any = true;
      }
      if (any) add("all feeds times " + fixed_text(factor, 1), all);
    }
  }

  std::string motion(const std::string& words, bool rapid) const {
    if (tnc()) return "L " + words + (rapid ? " FMAX" : " F500");
    return rapid ? "G0 " + words : "G94 G1 " + words + " F500.";
  }
  std::string back(bool rapid) const { return rapid || tnc() ? "" : "G1"; }
  // The words of a motion without F, G and the block number.
  std::string axes_of(std::size_t i) const {
    std::istringstream in(words_of_line(lines_[i]));
    std::string out;
    for (std::string word; in >> word;) {
      if (std::string("XYZAC").find(word.front()) != std::string::npos)
        out += (out.empty() ? "" : " ") + word;
    }
    return out;
  }

  void add_motions() {
    const std::string sign = tnc() ? "+" : "";
    for (const std::size_t i : places()) {
      before("a rapid plunge", i, {motion("Z-100.5", true)});
      before("a rapid plunge and back", i, {motion("Z-100.5", true), motion("Z" + sign + "100.5", true)});
      before("a feed plunge", i, {motion("Z-100.5", false)});
      before("a rapid sideways", i, {motion("X" + sign + "100.5", true)});
      if (i < 6 || !is_feed_line(i - 4)) continue;
      Lines lines = lines_;  // a piece twice
      const auto first = lines.begin() + static_cast<std::ptrdiff_t>(i);
      lines.insert(first, lines_.begin() + static_cast<std::ptrdiff_t>(i - std::min<std::size_t>(i, 6)),
                   lines_.begin() + static_cast<std::ptrdiff_t>(i));
      add("a piece twice", lines);
    }
    // Behind a retract, where positions are not known.
    for (std::size_t i = first_; i + 1 < lines_.size(); ++i) {
      if (!is_retract(i)) continue;
      before("down behind a retract", i + 1, {motion("Z-200.5", false)});
      before("down behind a retract, at rapid rate", i + 1, {motion("Z-200.5", true)});
    }
    // A block of the cut left out, and one at a place of its own.
    // (Within one segment of the CL path, as those of an arc, the tool may go back over what it has cut.)
    for (const std::size_t i : places()) {
      if (shapes_ || i + 1 == lines_.size() || !is_feed_line(i + 1)) continue;
      Lines lines = lines_;
      std::swap(lines[i], lines[i + 1]);
      if (axes_of(i).size() > 20 && axes_of(i + 1).size() > 20 && !has(lines[i + 1], "G") &&
          !has(lines[i], "G"))
        add("two blocks in the other order", lines);
    }
  }

  std::string control_;
  bool in_part_, shapes_;
  Lines lines_;
  std::size_t first_ = 0;
  std::vector<std::size_t> cuts_;
  std::vector<Edited> out_;
};

struct Counts {
  std::map<std::string, std::array<int, 3>> kinds;  // edits, refused by the reader, found by a check
  int edits = 0, passed = 0;

  void print() const {
    for (const auto& [kind, count] : kinds)
      std::printf("[ figures  ] %s: %d edits, %d refused by the reader, %d found by a check\n", kind.c_str(),
                  count[0], count[1], count[2]);
    std::printf("[ figures  ] %d edits, %d passed\n", edits, passed);
  }
};

void edit_everything(const std::string& name, const std::string& control, const std::string& cl,
                     const PostOptions& options, Counts& counts) {
  Machine machine = test::shipped_machine("trunnion_offset");
  machine.work_offset_mm = Vec3(12.0, -7.0, -30.0);
  const auto p = test::posted(cl, machine, options, control);
  ASSERT_TRUE(p.report) << name << ": " << p.report.error().text();
  ASSERT_TRUE(p.report->verification->passed()) << name;
  const auto right = test::verified(p.nc, cl, machine, 0.01, control);
  ASSERT_TRUE(right) << name << ": " << right.error().text();
  ASSERT_TRUE(right->passed()) << name;
  for (const Edited& edit :
       Editor(control, p.nc, options.rtcp, options.native_arcs.value_or(false)).edits()) {
    const auto v = test::verified(joined(edit.lines), cl, machine, 0.01, control);
    ++counts.edits;
    auto& count = counts.kinds[edit.kind.substr(0, edit.kind.find(':'))];
    ++count[0];
    if (!v) {
      ++count[1];
      EXPECT_GT(v.error().where.line, 0U) << name << ": " << edit.kind;
      continue;
    }
    ++count[2];
    if (!v->passed()) continue;
    ++counts.passed;
    std::size_t at = 0;
    const Lines before = split(p.nc);
    while (at < edit.lines.size() && at < before.size() && edit.lines[at] == before[at]) ++at;
    ADD_FAILURE() << name << ": " << edit.kind << " at line " << at + 1 << ": '"
                  << (at < before.size() ? before[at] : "") << "' -> '"
                  << (at < edit.lines.size() ? edit.lines[at] : "") << "' passed";
  }
}

TEST(LongEditedProgram, IsFoundInTheWordsOfEveryControl) {
  Counts counts;
  for (const std::string& control : test::shipped_controllers()) {
    const nc::Controller c = test::shipped_controller(control);
    const std::string cl = edited_part(!c.dwell.empty());
    edit_everything(control, control, cl, {}, counts);
    if (c.has_tcp()) {
      PostOptions in_part;
      in_part.rtcp = true;
      in_part.feed = FeedOutput::tip;
      edit_everything(control + ", rtcp", control, cl, in_part, counts);
    }
    if (c.has_tilted_plane()) {
      PostOptions in_plane;
      in_plane.tilted_plane = true;
      edit_everything(control + ", plane", control, cl, in_plane, counts);
    }
    if (!c.arcs.clockwise.empty()) {
      PostOptions native;
      native.native_arcs = native.native_cycles = true;
      const std::string shapes = read_file(test::source_folder() + "/tests/golden/shapes.cls").value_or("");
      edit_everything(control + ", native", control, shapes, native, counts);
    }
  }
  counts.print();
  EXPECT_GT(counts.edits, 1000);
}

// Between cuts a control speeds up at once, whatever tool it has; whether the end of a program stops the
// spindle is for its builder to say.
TEST(EditedProgram, ASpindleIsToldNothingThatTheFileDoesNotAskFor) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  std::string cl = edited_part(false);
  cl.replace(cl.find("FINI"), 4, "COOLNT/OFF\nSPINDL/OFF\nFINI");
  for (const std::string& control : test::shipped_controllers()) {
    const bool tnc = control.starts_with("heidenhain");
    const auto p = test::posted(cl, machine, {}, control);
    ASSERT_TRUE(p.report && p.report->verification->passed()) << control;
    const Lines lines = split(p.nc);
    const auto with = [&](std::size_t at, const std::string& line) {
      Lines out = lines;
      out.insert(out.begin() + static_cast<std::ptrdiff_t>(at), line);
      return out;
    };
    const auto passes = [&](const Lines& edited) {
      const auto v = test::verified(joined(edited), cl, machine, 0.01, control);
      return v && v->passed();
    };
    std::size_t end = 0, retract = 0;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (lines[i].find("M30") != std::string::npos || lines[i] == "M2") end = i;
      // To the point of the CL file above the first tool's last cut.
      if (retract == 0 && lines[i].find(tnc ? "FMAX" : "G0 ") != std::string::npos && i > lines.size() / 4)
        retract = i;
    }
    ASSERT_TRUE(end > 0 && retract > 0) << control;
    EXPECT_TRUE(passes(lines)) << control;
    // (A tool call says the speed there.)
    EXPECT_TRUE(tnc || !passes(with(retract, "S30000 M3"))) << control << " " << lines[retract];
    // (Of a tool change nobody knows whether it ends the coolant.)
    if (control == "fanuc_30i" || control == "haas_ngc") {
      const auto change = std::find_if(lines.begin(), lines.end(), [](const std::string& line) {
        return line.find("T5") != std::string::npos && line.find("M6") != std::string::npos;
      });
      ASSERT_NE(change, lines.end()) << control;
      const auto at = static_cast<std::size_t>(change - lines.begin());
      EXPECT_FALSE(passes(with(at, "M88"))) << control;
    }
    EXPECT_FALSE(passes(with(end, "M3"))) << control;
    EXPECT_FALSE(passes(with(end, "M8"))) << control;
  }
}

// CL points that stand together before another speed: which of them the tool is at nobody sees.
TEST(EditedProgram, ASpeedBehindPointsThatStandTogetherPasses) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  std::string cl = "PARTNO R\nLOADTL/4\nSPINDL/RPM,3000,CLW\nFEDRAT/MMPM,500\nRAPID\nGOTO/0,0,50,0,0,1\n";
  for (int i = 0; i < 10; ++i) cl += test::point_text(Vec3(2.0 * i, 0.0, 10.0), Vec3::UnitZ());
  for (int i = 0; i < 30; ++i) cl += "GOTO/20,0,10,0,0,1\n";
  cl += "SPINDL/RPM,6000,CLW\nGOTO/22,0,10,0,0,1\nGOTO/40,0,10,0,0,1\n";
  for (int i = 0; i < 30; ++i) cl += "GOTO/40,0,10,0,0,1\n";
  cl += "SPINDL/RPM,9000,CLW\nRAPID\nGOTO/40,0,60,0,0,1\nSPINDL/OFF\nFINI\n";
  for (const std::string& control : test::shipped_controllers()) {
    const auto p = test::posted(cl, machine, {}, control);
    ASSERT_TRUE(p.report && p.report->verification->passed()) << control;
    const auto v = test::verified(p.nc, cl, machine, 0.01, control);
    ASSERT_TRUE(v) << control << v.error().text();
    EXPECT_TRUE(v->passed()) << control;
  }
}

// Where a tool is called in two lines, T and M6, T alone makes the next one ready.
TEST(EditedProgram, PassesWhereNobodyEditedAndTheNextToolIsMadeReady) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  nc::Controller c = with_axes_of(machine, test::shipped_controller("siemens_840d_sl"));
  c.tool_preselect = {"T{tool}"};
  std::string cl = edited_part(true);
  cl.insert(cl.find("DELAY"), "SELECT/TOOL,5\n");
  PostJob job;
  job.cl_file = "part.cls";
  job.machine = &machine;
  job.controller = &c;
  Diagnostics d;
  std::string nc_text;
  const auto report = post(
      std::make_unique<test::TextOf>(cl), job, {},
      [&](std::string_view text) {
        nc_text += text;
        return Result<void>{};
      },
      d);
  ASSERT_TRUE(report) << report.error().text();
  EXPECT_TRUE(report->verification->passed());
  EXPECT_NE(nc_text.find("T5"), nc_text.rfind("T5"));
}

}  // namespace
}  // namespace trunnion::post
