#include "post/judging/program_judge.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/motion_time.hpp"
#include "trunnion/nc/axis_words.hpp"

#include "post/feeds/feed_plan.hpp"

namespace trunnion::post {
namespace {

std::string number_or(const std::optional<std::int64_t>& number, const std::string& none) {
  return number ? std::to_string(*number) : none;
}

std::string spindle_text(const nc::Spindle& spindle) {
  if (spindle.turn == nc::SpindleTurn::off) return "off";
  return std::to_string(spindle.rpm) +
         (spindle.turn == nc::SpindleTurn::clockwise ? " rpm clockwise" : " rpm counterclockwise");
}

std::string coolant_text(unsigned kinds) {
  static constexpr std::array kNames = {"off", "flood", "mist", "through the tool", "air"};
  std::string out;
  for (std::size_t i = 1; i < kNames.size(); ++i) {
    if ((kinds & (1U << i)) == 0) continue;
    out.append(out.empty() ? "" : " and ").append(kNames[i]);
  }
  return out.empty() ? kNames[0] : out;
}

// From the motion that was made last on: SPINDL and COOLNT of a word are looked for among so many. Several
// may stand at one place.
constexpr std::size_t kMotionsAbout = 8;

bool same_spindle(const nc::Spindle& a, const nc::Spindle& b) {
  return a.turn == b.turn && (a.turn == nc::SpindleTurn::off || a.rpm == b.rpm);
}

std::string name_of(AskedPause::Kind kind) {
  static constexpr std::array kNames = {"dwell", "stop", "optional stop"};
  return kNames[static_cast<std::size_t>(kind)];
}

}  // namespace

std::string cl_line(std::uint32_t line) {
  return " (CL line " + std::to_string(line) + ")";
}

const char* name_of(CheckOf check) {
  static constexpr std::array kNames = {"path",    "feeds",   "rapids", "tools",
                                        "offsets", "spindle", "order",  "end"};
  return kNames[static_cast<std::size_t>(check)];
}

const char* name_of(Check::State state) {
  static constexpr std::array kNames = {"passed", "failed", "not known to this control file"};
  return kNames[static_cast<std::size_t>(state)];
}

ProgramJudge::ProgramJudge(const Machine& machine, const nc::Controller& controller,
                           const VerifyOptions& options, const PathPoints& points)
    : machine_(machine),
      controller_(controller),
      options_(options),
      points_(points),
      told_(controller),
      adds_length_(machine.output_point == OutputPoint::tip),
      accelerates_(MotionTime::is_known(machine)) {
  for (const Axis& axis : machine.axes) {
    if (axis.kind == AxisKind::linear && axis.rapid)
      slowest_axis_mm_s_ = std::min(slowest_axis_mm_s_, *axis.rapid);
    axes_ = static_cast<std::uint16_t>(axes_ | nc::AxisWords::bit(*nc::axis_letter(axis.name)));
  }
}

void ProgramJudge::find_axis(std::uint16_t mask, std::uint32_t nc_line) {
  std::string names;
  for (const nc::AxisLetter letter : nc::kAllAxisLetters) {
    if ((mask & ~axes_ & nc::AxisWords::bit(letter)) == 0) continue;
    names.append(names.empty() ? "" : ", ").append(1, nc::letter_of(letter));
  }
  find(CheckOf::path, nc_line, [&] { return "the machine has no axis " + names; });
}

void ProgramJudge::take(const nc::Block& block, const Place& at, std::uint32_t nc_line) {
  told_.take(block);
  if (const auto* word = std::get_if<nc::AllowedWord>(&block)) {
    const auto it = std::find_if(allowed_.begin(), allowed_.end(),
                                 [&](const AllowedUse& use) { return use.word == word->text; });
    if (it == allowed_.end())
      allowed_.push_back({word->text, 1, nc_line});
    else
      ++it->count;
    return;
  }
  if (std::holds_alternative<nc::Probe>(block)) {
    find(CheckOf::path, nc_line, [] { return "a touch of a probe: where it ends is not known beforehand"; });
    return;
  }
  if (const auto* length = std::get_if<nc::LengthCompensation>(&block))
    return check_register(*length, at, nc_line);
  if (const auto* motion = std::get_if<nc::Motion>(&block)) return take_partly(*motion, nc_line);
  if (const auto* tcp = std::get_if<nc::TcpControl>(&block)) return check_needs_length(tcp->on, nc_line);
  if (const auto* plane = std::get_if<nc::TiltedPlane>(&block)) return check_needs_length(plane->on, nc_line);
  if (const auto* dwell = std::get_if<nc::Dwell>(&block))
    return take_pause(at, {0, AskedPause::Kind::dwell, dwell->milliseconds, 0}, nc_line);
  if (const auto* stop = std::get_if<nc::Stop>(&block)) {
    const auto kind = stop->optional ? AskedPause::Kind::optional_stop : AskedPause::Kind::stop;
    return take_pause(at, {0, kind, 0, 0}, nc_line);
  }
  if (const auto* spindle = std::get_if<nc::Spindle>(&block)) return check_speed(*spindle, at, nc_line);
  if (const auto* coolant = std::get_if<nc::Coolant>(&block)) return check_coolant(*coolant, at, nc_line);
  if (std::holds_alternative<nc::OffsetShift>(block) && options_.offsets == nullptr) {
    find(CheckOf::offsets, nc_line,
         [] { return std::string("a shift of the coordinates that nothing asks for (--offsets)"); });
  }
}

// Of a place where CL points stand together nobody sees which of them the tool is at.
bool ProgramJudge::asks_about(const Place& at,
                              const std::function<bool(const nc::Spindle&, unsigned)>& is) const {
  std::size_t first = at.segment, last = at.segment;
  while (first > 0 && is_rounding(first, 1.0)) --first;
  for (std::size_t moved = 0; last < points_.size() && moved < kMotionsAbout; ++last)
    if (!is_rounding(last + 1, 1.0)) ++moved;
  return asked_.says_between(number(first), number(last), is);
}

// Where no cut follows, too: a control speeds up at once, whatever tool it has.
void ProgramJudge::check_speed(const nc::Spindle& spindle, const Place& at, std::uint32_t nc_line) {
  if (spindle.turn == nc::SpindleTurn::off || spindle.rpm == 0) return;
  if (asks_about(at, [&](const nc::Spindle& asked, unsigned) {
        return asked.turn != nc::SpindleTurn::off && spindle.rpm <= asked.rpm;
      }))
    return;
  find(CheckOf::spindle, nc_line, [&] {
    return "the spindle is told to turn at " + spindle_text(spindle) +
           ", faster than the CL file asks for before and behind";
  });
}

void ProgramJudge::check_coolant(const nc::Coolant& coolant, const Place& at, std::uint32_t nc_line) {
  if (coolant.kind == nc::CoolantKind::off) return;
  const unsigned bit = 1U << static_cast<unsigned>(coolant.kind);
  if (asks_about(at, [&](const nc::Spindle&, unsigned asked) { return (asked & bit) != 0U; })) return;
  find(CheckOf::spindle, nc_line, [&] {
    return "coolant " + coolant_text(bit) +
           " is switched on, which the CL file asks for neither before nor behind";
  });
}

void ProgramJudge::check_limits(const nc::LatchValues& latch, double elapsed_s, std::uint32_t nc_line) {
  // How long the blocks before take is known to their digits of F.
  constexpr double kTimes = 1.05;
  const thermal::OffsetLimits& limits = options_.offset_limits;
  const double quantum_mm = controller_.numbers.axes.quantum(nc::AxisLetter::X);
  const double most_mm = 2.0 * limits.clamp_mm;
  const double step_mm = latch.first ? most_mm : std::min(most_mm, kTimes * limits.slew_mm_s * elapsed_s);
  const auto check = [&](std::int64_t quanta, double largest_mm, const char* what, const char* option) {
    const double mm = controller_.numbers.axes.internal(nc::AxisLetter::X, quanta);
    if (mm <= largest_mm + quantum_mm) return;
    find(CheckOf::offsets, nc_line, [&] {
      return std::string("values that the control reads ") + what + " " + fixed_text(mm, 4) + " mm; " +
             fixed_text(largest_mm, 4) + " mm is the most that " + option + " allows";
    });
  };
  check(latch.clamp, limits.clamp_mm, "shift an axis by up to", "--thermal-clamp-um");
  check(latch.step, step_mm, "change at once by up to", "--thermal-slew-um-s");
  check(latch.dead_band, limits.dead_band_mm, "are not followed below", "--thermal-dead-band-um");
}

// The words of both are places of the tip.
void ProgramJudge::check_needs_length(bool on, std::uint32_t nc_line) {
  if (!on || machine_.output_point == OutputPoint::tip) return;
  find(CheckOf::tools, nc_line, [] {
    return std::string(
        "tool-centre-point control and tilted planes need the tool's length, and the machine file asks for "
        "words of the spindle's gauge point ([output] point)");
  });
}

// The register of another tool: on some controls Z moves at once. Asked for is that of the CL motions here.
void ProgramJudge::check_register(const nc::LengthCompensation& length, const Place& at,
                                  std::uint32_t nc_line) {
  if (length.number <= 0 || !adds_length_ || !nc::holds(controller_.length.on, "length_offset")) return;
  std::optional<std::int64_t> other;
  for (std::size_t point = at.segment; point <= at.segment + 1 && point < points_.size(); ++point) {
    const AskedState& asked = asked_.at(number(point));
    if (!asked.tool || asked.tool != told_.tool()) continue;
    if (asked.length_register == length.number) return;
    other = asked.length_register;
  }
  if (!other) return;
  find(CheckOf::tools, nc_line, [&] {
    return "the control adds the length in register " + std::to_string(length.number) +
           ", asked for is register " + std::to_string(*other);
  });
}

void ProgramJudge::take_partly(const nc::Motion& motion, std::uint32_t nc_line) {
  check_offset(nc_line);
  if (told_.length() || !motion.words.has(nc::AxisLetter::Z)) return;
  find(CheckOf::tools, nc_line,
       [] { return std::string("Z moves, and whether the control adds a tool's length is not known"); });
}

// In the order of the CL file, where it has them.
void ProgramJudge::take_pause(const Place& at, const AskedPause& told, std::uint32_t nc_line) {
  const auto text = [&] {
    if (told.kind != AskedPause::Kind::dwell)
      return (told.kind == AskedPause::Kind::stop ? "a " : "an ") + name_of(told.kind);
    return "a dwell of " + fixed_text(static_cast<double>(told.milliseconds) / 1000.0, 3) + " s";
  };
  const auto is_it = [&](const AskedPause& asked) {
    double step_ms = 1.0;
    for (int i = controller_.dwell_decimals; i < 3; ++i) step_ms *= 10.0;
    if (asked.kind != told.kind ||
        std::abs(static_cast<double>(asked.milliseconds - told.milliseconds)) > step_ms)
      return false;
    // Between the CL point before it and the place where the program is there is no way.
    const std::size_t before = asked.before - std::min(asked.before, points_.gone());
    if (before > points_.size()) return false;
    const std::size_t point = before > 0 ? before - 1 : 0;
    for (std::size_t j = at.segment + 1; j <= point; ++j) {
      if (!is_rounding(j, j == at.segment + 1 ? 1.0 - at.t : 1.0)) return false;
    }
    for (std::size_t j = point + 1; j <= at.segment; ++j) {
      if (!is_rounding(j, 1.0)) return false;
    }
    return at.segment < point || at.t == 0.0 || is_rounding(at.segment + 1, at.t);
  };
  const AskedPause* next = asked_.next_pause();
  if (next != nullptr && is_it(*next)) {
    check_stop(*next, nc_line);
    return asked_.meet_pause();
  }
  find(CheckOf::order, nc_line, [&] { return text() + " that the CL file does not ask for here"; });
}

void ProgramJudge::check_stop(const AskedPause& stop, std::uint32_t nc_line) {
  const nc::Spindle& spindle = told_.at_stop().spindle;
  const bool turns = spindle.turn != nc::SpindleTurn::off && spindle.rpm > 0;
  if (stop.spindle_is_off && turns)
    find(CheckOf::spindle, nc_line, [&] {
      return "the spindle turns at the " + name_of(stop.kind) + ", and the CL file has it off" +
             cl_line(stop.line);
    });
  if (stop.coolant_is_off && told_.at_stop().coolant != 0U)
    find(CheckOf::spindle, nc_line, [&] {
      return "the coolant is on at the " + name_of(stop.kind) + ", and the CL file has it off" +
             cl_line(stop.line);
    });
}

bool ProgramJudge::is_rounding(std::size_t point, double share) const {
  if (point >= points_.size()) return true;
  const Target& target = points_[point];
  return share * target.way_mm <= kNearEnds * options_.tolerance_mm + kNearEnd_mm &&
         share * target.turn <= kNearEnds * options_.axis_tolerance.rad();
}

void ProgramJudge::comes_back(std::size_t point, const Place& at) {
  comes_to(point);
  const double gone = at.segment + 1 == point ? at.t : 0.0;
  if (point + 1 < points_.size() && is_rounding(point, 1.0 - gone))
    cut_->beside = point + 1;
  else if (point > 0 && is_rounding(point, gone))
    cut_->beside = point - 1;
}

ProgramJudge::Covered ProgramJudge::covered(const Cut& cut) const {
  Covered out;
  if (cut.from.segment + 1 >= points_.size()) return out;
  out.first = cut.from.segment + 1;
  out.last = std::clamp(cut.to.segment + 1, out.first, points_.size() - 1);
  double begins = cut.from.t;
  double ends = cut.to.segment + 1 >= points_.size() ? 1.0 : cut.to.t;
  while (out.first < out.last && is_rounding(out.last, ends)) {
    --out.last;
    ends = 1.0;
  }
  while (out.first < out.last && is_rounding(out.first, 1.0 - begins)) {
    ++out.first;
    begins = 0.0;
  }
  out.any = cut.outside || out.first < out.last || !is_rounding(out.first, ends - begins);
  return out;
}

void ProgramJudge::check_states(const Cut& cut, const Covered& covered, std::uint32_t nc_line) {
  if (!covered.any && !cut.outside) return;
  check_pauses(covered.first, nc_line);
  std::size_t first = number(covered.first), last = number(covered.last);
  if (cut.beside && !agrees(asked_.at(first)) && agrees(asked_.at(number(*cut.beside))))
    first = last = number(*cut.beside);
  for (std::size_t j = first; j <= last; j = asked_.next_change(j)) {
    const AskedState& asked = asked_.at(j);
    check_place(asked, nc_line);
    check_cut(asked, nc_line);
  }
  if (cut.outside) return;
  for (std::size_t j = covered.first; j <= covered.last; ++j) {
    if (points_.is_plain(j) || !points_[j].rapid) continue;
    find(CheckOf::rapids, nc_line,
         [&] { return "a feed where the CL file has a rapid" + cl_line(points_[j].line); });
  }
}

void ProgramJudge::rapid_to(std::size_t point, std::uint32_t nc_line) {
  told_.take_new_cutter();
  check_pauses(point, nc_line);
  const AskedState& asked = asked_.at(number(point));
  check_place(asked, nc_line);
  if (told_.cutter().side != nc::CutterSide::off && asked.cutter.side == nc::CutterSide::off)
    find_cutter(asked, nc_line);
}

void ProgramJudge::find_cutter(const AskedState& asked, std::uint32_t nc_line) {
  find(CheckOf::path, nc_line, [&] {
    return "compensation of the cutter's radius is " +
           std::string(told_.cutter().side == nc::CutterSide::off ? "off" : "on") +
           ", and not as CUTCOM asks for it" + cl_line(asked.line);
  });
}

void ProgramJudge::check_pauses(std::size_t point, std::uint32_t nc_line) {
  for (const AskedPause* pause = asked_.next_pause(); pause != nullptr && pause->before <= number(point);
       asked_.meet_pause(), pause = asked_.next_pause()) {
    find(CheckOf::order, nc_line,
         [&] { return "the " + name_of(pause->kind) + " before it is missing" + cl_line(pause->line); });
  }
}

void ProgramJudge::check_place(const AskedState& asked, std::uint32_t nc_line) {
  if (asked.tool != told_.tool()) {
    find(CheckOf::tools, nc_line, [&] {
      return "the program moves with " + number_or(told_.tool(), "no tool that it called") +
             ", the CL file asks for tool " + number_or(asked.tool, "none") + cl_line(asked.line);
    });
  }
  check_length(asked, nc_line);
  check_offset(nc_line);
}

void ProgramJudge::check_offset(std::uint32_t nc_line) {
  const std::int64_t offset =
      options_.work_offset.value_or(asked_.work_offset().value_or(machine_.work_offset));
  if (!controller_.work_offsets.empty() && told_.work_offset() != offset) {
    find(CheckOf::offsets, nc_line, [&] {
      return "the program moves in work offset " + number_or(told_.work_offset(), "that it has not called") +
             ", asked for is " + std::to_string(offset) +
             " (--work-offset, SET/OFSETL, [output] work_offset)";
    });
  }
}

void ProgramJudge::check_length(const AskedState& asked, std::uint32_t nc_line) {
  if (controller_.length.automatic) return;
  const auto& length = told_.length();
  if (!adds_length_) {
    if (length && *length == 0) return;
    if (!length && controller_.length.off.empty()) return;  // there are no words to say so
    find(CheckOf::tools, nc_line, [&] {
      return std::string(
          length
              ? "the control adds a tool length, but X Y Z are positions of the spindle's gauge point"
              : "it is unknown here whether the control adds a tool length: the program must say it again");
    });
    return;
  }
  const bool has_register = controller_.adds_length_of_register();
  if (!length) {
    find(CheckOf::tools, nc_line, [] {
      return std::string(
          "it is unknown here whether the control adds the tool's length: the program must say it again");
    });
  } else if (has_register && asked.tool ? *length != asked.length_register : *length == 0) {
    find(CheckOf::tools, nc_line, [&] {
      return *length == 0 ? std::string("the control does not add the tool's length")
                          : "the control adds the length in register " + std::to_string(*length) +
                                ", asked for is register " + std::to_string(asked.length_register) +
                                cl_line(asked.line);
    });
  }
}

// The feed of a tap alone says nothing of its thread.
void ProgramJudge::check_thread(const AskedState& asked, std::uint32_t nc_line) {
  constexpr double kPitch = 5e-4;  // digits of F and of the pitch's word
  const auto mm = [](double pitch_mm) { return fixed_text(pitch_mm, 5) + " mm"; };
  const auto& told = told_.thread();
  if (!told && !(asked.pitch_mm > 0.0)) {
    if (!told_.spindle_is_open()) return;
    return find(CheckOf::spindle, nc_line, [&] {
      return "it is unknown whether the spindle turns after the tapping cycle: the program must start it "
             "again" +
             cl_line(asked.line);
    });
  }
  if (!told || !(asked.pitch_mm > 0.0)) {
    return find(CheckOf::feeds, nc_line, [&] {
      return (told ? "a tapping cycle that the CL file does not ask for"
                   : "the CL file asks for a thread of " + mm(asked.pitch_mm) +
                         ", and this is no tapping cycle") +
             cl_line(asked.line);
    });
  }
  const double pitch_mm = static_cast<double>(told->pitch) * nc::kPitchUnit_mm;
  if (std::abs(pitch_mm - asked.pitch_mm) > kPitch * asked.pitch_mm) {
    find(CheckOf::feeds, nc_line, [&] {
      return "the tapping cycle has a pitch of " + mm(pitch_mm) + ", the CL file asks for " +
             mm(asked.pitch_mm) + cl_line(asked.line);
    });
  }
  using Hand = nc::Thread::Hand;
  const Hand hand = asked.spindle.turn == nc::SpindleTurn::counterclockwise ? Hand::left : Hand::right;
  if (told->rpm == asked.spindle.rpm && (told->hand == hand || told->hand == Hand::as_spindle)) return;
  find(CheckOf::spindle, nc_line, [&] {
    return "the tapping cycle turns at " + std::to_string(told->rpm) + " rpm for a " +
           (told->hand == Hand::left ? "left" : "right") + "-hand thread, the CL file asks for " +
           spindle_text(asked.spindle) + cl_line(asked.line);
  });
}

bool ProgramJudge::agrees(const AskedState& asked) const {
  return same_spindle(told_.spindle(), asked.spindle) && told_.coolant() == asked.coolant &&
         told_.cutter().side == asked.cutter.side && told_.cutter().number == asked.cutter.number;
}

void ProgramJudge::check_cut(const AskedState& asked, std::uint32_t nc_line) {
  check_thread(asked, nc_line);
  const double fastest = machine_.spindle_max_rpm;
  if (fastest > 0.0 && static_cast<double>(told_.spindle().rpm) > fastest) {
    find(CheckOf::spindle, nc_line, [&] {
      return "the spindle is to turn at " + std::to_string(told_.spindle().rpm) + " rpm, the machine's at " +
             shortest_text(fastest) + " rpm at most";
    });
  }
  if (!same_spindle(told_.spindle(), asked.spindle)) {
    find(CheckOf::spindle, nc_line, [&] {
      return "the spindle is " + spindle_text(told_.spindle()) + ", the CL file asks for " +
             spindle_text(asked.spindle) + cl_line(asked.line);
    });
  }
  if (told_.coolant() != asked.coolant) {
    find(CheckOf::spindle, nc_line, [&] {
      return "the coolant is " +
             (told_.coolant() ? coolant_text(*told_.coolant()) : "not said again after the tool change") +
             ", the CL file asks for " + coolant_text(asked.coolant) + cl_line(asked.line);
    });
  }
  if (told_.cutter().side != asked.cutter.side || told_.cutter().number != asked.cutter.number)
    find_cutter(asked, nc_line);
  const auto& mode = told_.path_mode();
  const auto& wanted = controller_.default_path_mode;
  const auto& smoothing = options_.smoothing_mm;
  const bool kept =
      smoothing ? mode && mode->kind == nc::PathModeKind::continuous &&
                      mode->tolerance == controller_.numbers.axes.quanta(nc::AxisLetter::X, *smoothing)
      : wanted ? mode && mode->kind == *wanted && mode->tolerance == 0
               : !mode || mode->kind != nc::PathModeKind::continuous;
  if (!kept) {
    find(CheckOf::path, nc_line, [&] {
      return mode ? std::string(
                        "the control may leave the path: its path mode is not the one that is asked for "
                        "([path_mode] default, "
                        "--smoothing)")
                  : std::string("the path mode is not said");
    });
  }
}

std::size_t ProgramJudge::next_change(std::size_t point) const {
  const std::size_t change = asked_.next_change(number(point));
  return change == Asked::kNever ? Asked::kNever : change - points_.gone();
}

ProgramJudge::Found ProgramJudge::found() const {
  Found out;
  for (std::size_t i = 0; i < kChecks; ++i) {
    out.count[i] = checks_[i].count;
    out.places[i] = checks_[i].places.size();
  }
  out.inverse = inverse_;
  out.pauses_met = asked_.pauses_met();
  return out;
}

void ProgramJudge::go_back_to(const Found& found) {
  for (std::size_t i = 0; i < kChecks; ++i) {
    checks_[i].count = found.count[i];
    checks_[i].places.resize(std::min(checks_[i].places.size(), found.places[i]));
  }
  inverse_ = found.inverse;
  asked_.go_back_to_pause(found.pauses_met);
}

void ProgramJudge::finish(VerifyReport& report, std::uint32_t nc_line) {
  const auto row = [&](CheckOf of) -> Check& { return checks_[static_cast<std::size_t>(of)]; };
  if (told_.cutter().side != nc::CutterSide::off)
    find(CheckOf::path, nc_line, [] { return std::string("the program ends with cutter compensation on"); });
  if (asked_.now().spindle.turn == nc::SpindleTurn::off && told_.spindle().turn != nc::SpindleTurn::off &&
      told_.spindle().rpm > 0)
    find(CheckOf::spindle, nc_line,
         [] { return std::string("the program ends with the spindle on, and the CL file has it off"); });
  if (asked_.now().coolant == 0U && told_.coolant().value_or(0U) != 0U)
    find(CheckOf::spindle, nc_line,
         [] { return std::string("the program ends with the coolant on, and the CL file has it off"); });
  for (const std::int64_t number : told_.wear_of_tools())
    find(CheckOf::path, nc_line, [&] {
      return "register " + std::to_string(number) + " is used for wear, and is the entry of tool " +
             std::to_string(number) + ": the control adds half the diameter of that tool";
    });
  for (; const AskedPause* pause = asked_.next_pause(); asked_.meet_pause()) {
    find(CheckOf::order, nc_line,
         [&] { return "the " + name_of(pause->kind) + " is missing" + cl_line(pause->line); });
  }
  static constexpr std::array kAbout = {
      "tip, tool axis and travel limits; path mode, cutter compensation, axis words",
      "each cut as fast as FEDRAT, or as its slowest axis",
      "rapids on their lines, where the CL file has rapids; motion outside the cuts",
      "tool and length register at every cut",
      "work offset at every cut, shifts",
      "direction and speed of the spindle, coolant at every cut",
      "every CL motion, in order; dwells and stops",
      "the end of the program is reached, and nothing follows it"};
  for (std::size_t i = 0; i < kChecks; ++i) checks_[i].about = kAbout[i];
  if (controller_.work_offsets.empty()) {
    row(CheckOf::offsets).state = Check::State::not_known;
    row(CheckOf::offsets).about = "the controller file has no words for work offsets ([work_offset])";
  }
  if (controller_.length.on.empty() && !controller_.length.automatic && controller_.tcp.on.empty()) {
    row(CheckOf::tools).state = Check::State::not_known;
    row(CheckOf::tools).about = "the controller file has no words for tool length compensation ([length])";
  }
  const auto fail = [&](CheckOf of, bool failed) {
    if (failed || row(of).count > 0) row(of).state = Check::State::failed;
  };
  fail(CheckOf::path, !report.cuts_within_tolerance() || !report.limits_ok());
  fail(CheckOf::feeds, !report.speeds_ok());
  fail(CheckOf::rapids, report.unsafe_count > 0 || report.max_rapid_deviation_mm > report.rapid_tolerance_mm);
  fail(CheckOf::order, report.points_missed > 0);
  for (const CheckOf of : {CheckOf::tools, CheckOf::offsets, CheckOf::spindle, CheckOf::end}) fail(of, false);
  report.checks = checks_;
  report.allowed = allowed_;
}

}  // namespace trunnion::post
