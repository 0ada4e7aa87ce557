#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/machine/machine.hpp"
#include "trunnion/nc/controller.hpp"
#include "trunnion/probe/program.hpp"

namespace trunnion::probe {

/// A touch of a probing program: the joints go from one place towards another (mm, rad; the rotary axes
/// stand).
struct Touch {
  JointVector from, to;
  std::int64_t feed = 0;  // per minute, quanta
  std::uint32_t line = 0;
  std::size_t pose = 0;
  std::size_t turns = 0;  // of the rotary axes before it, since the program began
  /// Touches along one line follow one another, the slowest last: that one measures.
  bool measures = false;
};

/// A motion between touches. What is not known of it, as its start behind a touch, is not in `knows`.
struct Move {
  JointVector from, to;
  bool knows_from = false, knows_to = false;
  bool knows_plane = false;          // X and Y of `from`, even where its Z is only the safe height's
  bool at_safe_height = false;       // Z has not moved since the safe height
  bool turns = false;                // a rotary axis moves
  bool guarded = false;              // it stops where the probe is touched, and the program with it
  std::ptrdiff_t behind_touch = -1;  // it begins where this touch ended
  std::uint32_t line = 0;
};

/// A probing program as its text has it.
struct Strokes {
  Ball ball;
  std::vector<Touch> touches;
  std::vector<Move> moves;
  std::vector<JointVector> poses;  // rotary axes, each time that they have turned to one
  /// Sense of the last motion of each axis before that pose: +1, -1; 0 of linear axes, and where it is not
  /// known.
  std::vector<std::array<std::int8_t, kMaxAxes>> senses;
  /// The control watches the probe on motions only that have words for it: Controller::Probing::guarded.
  bool must_guard = false;
  /// The line of the first motion that a touch stops, where the control has to learn there and the program
  /// has other words for it: Controller::Probing::first.
  std::optional<std::uint32_t> not_learned;
  std::size_t log_lines() const { return touches.size(); }
  /// "pose 3 (A30 C-90)", counted from 1.
  std::string pose_text(const Machine& machine, std::size_t pose) const;
};

/// Reads a program of `make_program`: positions of the joints from its words and the lines of its head about
/// ball and stylus. Fails with wrong_input and file:line where the text is none.
Result<Strokes> read_strokes(const Machine& machine, const nc::Controller& controller, std::string_view text,
                             const std::string& file, Diagnostics& diagnostics);

/// What is wrong with the strokes, each finding with its line: an end beyond a limit, a rotary axis that
/// turns below the safe height, or at it where the ball or its stem gets in the way, a motion that comes
/// nearer to the ball than Ball::apart_mm, or to its stem and the table as far as they are given, one behind
/// a touch that does not go back along it, a touch that cannot meet the ball, or meets something else first,
/// a pose without five measuring touches; where the control watches the probe on some motions only, one below
/// the safe height on which it does not.
std::vector<std::string> faults_of(const Machine& machine, const Strokes& strokes);

}  // namespace trunnion::probe
