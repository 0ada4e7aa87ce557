#pragma once
// Texts that would do something if a control took them for more than a remark.
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "trunnion/nc/blocks.hpp"
#include "trunnion/nc/controller.hpp"

namespace trunnion::test {

/// Random bytes, and words that controls know, alone and in pieces; `py,` makes the file `made`.
inline std::vector<std::string> hostile_texts(std::mt19937_64& random) {
  static const std::vector<std::string> kActive = {"py,open('made','w')",
                                                   "PY,open('made','w')",
                                                   " py, open('made','w')",
                                                   ";py,open('made','w')",
                                                   "LOGOPEN,made",
                                                   "logappend,made",
                                                   "LOGCLOSE",
                                                   "PROBEOPEN made",
                                                   "PROBECLOSE",
                                                   "LOG,#1",
                                                   "MSG,stop",
                                                   "DEBUG,#1",
                                                   "PRINT,#1",
                                                   "AXIS,hide",
                                                   "ABORT,now",
                                                   "PREVIEW,stop",
                                                   "%",
                                                   ")",
                                                   "(",
                                                   ";",
                                                   "*",
                                                   "~",
                                                   "\n",
                                                   "\r",
                                                   "\n%\n",
                                                   ")G0 Z-100(",
                                                   "\nG0 Z-100\n",
                                                   "\nL Z-100 FMAX\n",
                                                   "G91",
                                                   "M30",
                                                   "O1",
                                                   "#1=5",
                                                   "$PATH=/_N_MPF_DIR",
                                                   "/",
                                                   "\\",
                                                   "\t",
                                                   "CYCL CALL",
                                                   "WITHIN TOLERANCE: 0.000000 OF 0.010000 MM",
                                                   "END PGM 1 MM",
                                                   "\xc3\xa9",
                                                   "\xe4\xbd\xa0",
                                                   "STOP"};
  const auto below = [&](std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
  };
  std::vector<std::string> out;
  for (std::size_t i = 0; i < 4; ++i) {
    std::string text;
    for (std::size_t piece = below(6); piece < 6; ++piece) {
      if (below(3) > 0) text += kActive[below(kActive.size())];
      if (below(3) == 0) text += ' ';
      for (std::size_t n = below(40); n > 30; --n) text += static_cast<char>(below(256));
      if (below(6) == 0) text += std::string(below(120), 'X') + " ";
    }
    out.push_back(text);
  }
  out.push_back(kActive[below(kActive.size())]);
  return out;
}

/// Some motions, with a remark of `said` before each; the CL file's, and the program's own.
inline std::vector<nc::Block> program_with_comments(const nc::Controller& c,
                                                    const std::vector<std::string>& said) {
  std::vector<nc::Block> blocks = {nc::ProgramStart{}};
  const auto say = [&](std::size_t i) {
    if (i < said.size()) blocks.emplace_back(nc::Comment{said[i], i % 2 == 0});
  };
  say(0);
  for (std::size_t i = 0; i < 4; ++i) {
    nc::Motion m;
    m.kind = i == 0 ? nc::MotionKind::rapid : nc::MotionKind::feed;
    m.feed = i == 0 ? 0 : c.numbers.feed.quanta(nc::FeedMode::per_minute, 10.0);
    m.words.set(nc::AxisLetter::X, c.numbers.axes.quanta(nc::AxisLetter::X, 1.0 + static_cast<double>(i)));
    m.words.set(nc::AxisLetter::Z, c.numbers.axes.quanta(nc::AxisLetter::Z, 50.0 - static_cast<double>(i)));
    blocks.emplace_back(m);
    say(i + 1);
  }
  blocks.emplace_back(nc::ProgramEnd{});
  return blocks;
}

}  // namespace trunnion::test
