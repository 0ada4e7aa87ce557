// Words that shift or turn the coordinates of a program: G52, G92, G68, TRANS, AROT.
#include <algorithm>
#include <cmath>

#include "trunnion/base/units.hpp"

#include "nc/reading/other_words.hpp"

namespace trunnion::nc {
namespace {

// Places of [input] frames.
constexpr std::size_t kTurnAnew = 2;

constexpr std::uint16_t bits_of(bool all) {
  return all ? kXyz : kPlaneWords;
}

Word* find_unused(ParsedLine& line, char letter) {
  const auto end = line.words.begin() + static_cast<std::ptrdiff_t>(line.word_count);
  const auto it =
      std::find_if(line.words.begin(), end, [&](const Word& w) { return !w.used && w.letter == letter; });
  return it == end ? nullptr : &*it;
}

}  // namespace

bool OtherWords::angle_of(const Word& word, double& rad) {
  std::int64_t quanta = 0;
  if (!to_quanta(word.number, format_.decimals(AxisLetter::A), quanta) ||
      (c_.numbers.point_required && !word.number.has_point && quanta != 0))
    return fail(word.column,
                std::string("'") + word.letter +
                    "' is no angle: too many decimals, or no decimal point where the control wants one");
  rad = format_.internal(AxisLetter::A, quanta);
  return true;
}

// Nothing else may stand in the line: which of the two comes first need not be asked.
bool OtherWords::take_frame(ParsedLine& line, const AxisWords& position, const char* why_not) {
  error.clear();
  for (std::size_t i = 0; i < line.word_count; ++i) {
    Word& word = line.words[i];
    if (word.used) continue;
    const bool shifts = is_code(word, c_.input.places.shift);
    const bool sets = is_code(word, c_.input.places.set_position);
    const bool turns = is_code(word, c_.input.places.turn);
    const bool ends_turn = is_code(word, c_.input.places.end_turn) && frame_.turns();
    const bool ends_shift = std::any_of(c_.input.places.end_shift.begin(), c_.input.places.end_shift.end(),
                                        [&](const std::string& text) { return is_code(word, text); });
    if (!shifts && !sets && !turns && !ends_turn && !ends_shift) continue;
    word.used = true;
    const std::string name(line.begin + word.column - 1, word.length);
    if (why_not != nullptr) return fail(word.column, "'" + name + "' " + why_not);
    if (frame_.turns() && !ends_turn)
      return fail(word.column, "'" + name + "' in coordinates that are turned ('" + c_.input.places.turn +
                                   "'): end that first");
    circle_.reset();
    if (ends_turn || ends_shift) {
      // A turn ends alone: the shift below it stays.
      if (ends_turn)
        frame_ = below_turn_;
      else
        frame_.reset();
      said_.stale_places |= bits_of(ends_shift);
    } else if (!(turns ? take_turn(line) : take_shift(line, position, sets))) {
      if (error_column == 0) error_column = word.column;
      return false;
    }
    for (std::size_t k = 0; k < line.word_count; ++k) {
      const Word& other = line.words[k];
      if (other.used) continue;
      if (axis_letter(std::string(1, other.letter)) || (other.letter >= 'I' && other.letter <= 'K'))
        return fail(other.column, std::string("'") + other.letter + "' in the line of '" + name + "'");
    }
    return true;
  }
  return true;
}

bool OtherWords::take_shift(ParsedLine& line, const AxisWords& position, bool sets_position) {
  bool any = false;
  error_column = 0;
  for (const AxisLetter letter : {AxisLetter::X, AxisLetter::Y, AxisLetter::Z}) {
    Word* word = find_unused(line, letter_of(letter));
    if (word == nullptr) {
      // Controls that keep the shift of an axis without a word, and others that end it.
      if (!sets_position && frame_.shift(letter) != 0)
        return fail(0, std::string("a shift without ") + letter_of(letter) +
                           ", which is shifted already: name all three");
      continue;
    }
    std::int64_t value = 0;
    if (word->means != Word::Means::as_in_force) return fail(word->column, "a shift is said by plain words");
    if (!quanta_of(*word, value)) return false;
    if (sets_position && !position.has(letter))
      return fail(word->column, std::string("where ") + letter_of(letter) +
                                    " stands is not known: a rapid to a place of it must stand before");
    frame_.set_shift(letter, sets_position ? position[letter] - value : value);
    said_.stale_places |= AxisWords::bit(letter);
    word->used = any = true;
  }
  return any || fail(0, "a shift without X, Y or Z");
}

bool OtherWords::take_turn(ParsedLine& line) {
  error_column = 0;
  if (said_.plane != 0) return fail(0, "a turn in another plane than X Y is not read");
  if (said_.increments) return fail(0, "a turn under '" + c_.incremental.on + "' is not read");
  Word* x = find_unused(line, 'X');
  Word* y = find_unused(line, 'Y');
  Word* r = find_unused(line, 'R');
  if (x == nullptr || y == nullptr || r == nullptr)
    return fail(0, "a turn is read with its centre and its angle: X, Y and R");
  std::int64_t center[2] = {0, 0};
  double rad = 0.0;
  if (!quanta_of(*x, center[0]) || !quanta_of(*y, center[1]) || !angle_of(*r, rad)) return false;
  x->used = y->used = r->used = true;
  below_turn_ = frame_;
  frame_.turn_about(center[0], center[1], rad);
  said_.stale_places |= kPlaneWords;
  return true;
}

std::optional<std::size_t> OtherWords::frame_named(std::string_view text) const {
  for (std::size_t i = 0; i < c_.input.places.frames.size(); ++i) {
    const std::string& name = c_.input.places.frames[i];
    if (text.size() < name.size() ||
        !std::equal(name.begin(), name.end(), text.begin(), [](char a, char b) { return a == upper(b); }))
      continue;
    if (text.size() == name.size() || !is_letter(text[name.size()]) || is_blank(text[name.size()])) return i;
  }
  return std::nullopt;
}

bool OtherWords::take_named_frame(ParsedLine& line, std::size_t name, std::optional<Number> turn_in_plane,
                                  const char* why_not) {
  error.clear();
  const std::string& said = c_.input.places.frames[name];
  if (why_not != nullptr) return fail(1, "'" + said + "' " + why_not);
  const bool turns = name >= kTurnAnew;
  std::array<std::int64_t, 3> way{};
  double rad = 0.0;
  for (std::size_t i = 0; i < line.word_count; ++i) {
    Word& word = line.words[i];
    const auto letter = axis_letter(std::string(1, word.letter));
    if (!letter || is_rotary(*letter) || index(*letter) > 2 || word.means != Word::Means::as_in_force)
      return fail(word.column,
                  std::string("'") + word.letter + "' in the line of '" + said + "' is not read");
    word.used = true;
    double angle = 0.0;
    if (!turns) {
      if (!quanta_of(word, way[index(*letter)])) return false;
    } else if (!angle_of(word, angle)) {
      return false;
    } else if (*letter == AxisLetter::Z) {
      rad = angle;
    } else if (angle != 0.0) {
      return fail(word.column,
                  "'" + said + "' about X or Y tilts the part: a tilted plane is read from its own words");
    }
  }
  if (turn_in_plane) {
    if (!turns || line.word_count != 0)
      return fail(1, "an angle in the plane beside other words of '" + said + "'");
    if (said_.plane != 0) return fail(1, "a turn in another plane than X Y is not read");
    Word word;
    word.letter = 'R';
    word.column = 1;
    word.number = *turn_in_plane;
    if (!angle_of(word, rad)) return false;
  }
  circle_.reset();
  // A shift or a turn anew takes away all that such words have said before.
  const bool anew = name == 0 || name == kTurnAnew;
  if (anew) frame_.reset();
  if (turns)
    frame_.turn_about(0, 0, rad);
  else
    frame_.shift_further(way);
  said_.stale_places |= kXyz;
  return true;
}

}  // namespace trunnion::nc
