#include "post/program_judge.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/base/number_text.hpp"
#include "trunnion/nc/axis_words.hpp"

namespace trunnion::post {
namespace {

// Where a block ends is known but for rounding and what it is off its place.
constexpr double kNearEnd_mm = 2e-3;
constexpr double kNearEnds = 3.0;  // tolerances

// What the post allows itself between the way of the tip and that by which a control divides F, and a little.
constexpr double kOtherWay = 1.02 * (1.0 + kSameWay);
constexpr double kRoundedEnds = 4.0;        // quanta of X Y Z
constexpr double kCorrected_mm = 0.05;      // by which corrections of errors change from block to block
constexpr double kSlower = 1.05;            // beyond what axes and F explain
constexpr double kShort_s = 1e-3;           // blocks of this time may be slower
constexpr double kShortCorrected_s = 0.03;  // as above; blocks that take up lost motion among them

std::string cl_line(std::uint32_t line) {
  return " (CL line " + std::to_string(line) + ")";
}

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

bool same_spindle(const nc::Spindle& a, const nc::Spindle& b) {
  return a.turn == b.turn && (a.turn == nc::SpindleTurn::off || a.rpm == b.rpm);
}

bool names_register(const nc::Template& words) {
  return std::any_of(words.begin(), words.end(), [](const std::string& line) {
    return line.find("{length_offset}") != std::string::npos;
  });
}

std::string rate_text(double mm_s) {
  return fixed_text(mm_s * kSecondsPerMinute, 1) + " mm/min";
}

}  // namespace

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
    : controller_(controller),
      options_(options),
      points_(points),
      told_(controller),
      work_offset_(machine.work_offset),
      adds_length_(machine.output_point == OutputPoint::tip) {
  for (const Axis& axis : machine.axes)
    axes_ = static_cast<std::uint16_t>(axes_ | nc::AxisWords::bit(*nc::axis_letter(axis.name)));
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
  if (const auto* motion = std::get_if<nc::Motion>(&block)) return take_partly(*motion, nc_line);
  if (const auto* dwell = std::get_if<nc::Dwell>(&block))
    return take_pause(at, {0, false, dwell->milliseconds, 0}, nc_line);
  if (const auto* stop = std::get_if<nc::Stop>(&block); stop != nullptr && !stop->optional)
    return take_pause(at, {0, true, 0, 0}, nc_line);
  if (std::holds_alternative<nc::OffsetShift>(block) && options_.offsets == nullptr) {
    find(CheckOf::offsets, nc_line,
         [] { return std::string("a shift of the coordinates that nothing asks for (--offsets)"); });
  }
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
    return told.stops ? std::string("a stop")
                      : "a dwell of " + fixed_text(static_cast<double>(told.milliseconds) / 1000.0, 3) + " s";
  };
  auto& pauses = asked_.pauses();
  const auto is_it = [&](const AskedPause& asked) {
    double step_ms = 1.0;
    for (int i = controller_.dwell_decimals; i < 3; ++i) step_ms *= 10.0;
    if (asked.stops != told.stops ||
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
  if (!pauses.empty() && is_it(pauses.front())) return pauses.pop_front();
  find(CheckOf::order, nc_line, [&] { return text() + " that the CL file does not ask for here"; });
}

bool ProgramJudge::is_rounding(std::size_t point, double share) const {
  if (point >= points_.size()) return true;
  const Target& target = points_[point];
  return share * target.way_mm <= kNearEnds * options_.tolerance_mm + kNearEnd_mm &&
         share * target.turn <= kNearEnds * options_.axis_tolerance.rad();
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
  out.any = out.first < out.last || !is_rounding(out.first, ends - begins);
  return out;
}

double ProgramJudge::rate_of(const AskedState& asked) const {
  switch (asked.feed.mode) {
    case cl::FeedMode::per_minute:
      return asked.feed.value;
    case cl::FeedMode::per_revolution:
      return asked.feed.value * asked.rpm / kSecondsPerMinute;
    case cl::FeedMode::none:
      return options_.default_feed_mm_s.value_or(0.0);
    case cl::FeedMode::inverse:
      break;
  }
  return 0.0;
}

// Blocks may go from one side of the path to the other.
double ProgramJudge::pace_slack_mm() const {
  const bool corrected = options_.truth != nullptr || options_.offsets != nullptr;
  return kRoundedEnds * controller_.numbers.axes.quantum(nc::AxisLetter::X) + 2.0 * options_.tolerance_mm +
         (corrected ? kCorrected_mm : 0.0);
}

void ProgramJudge::check_progress(const Cut& cut, double seconds, const Rates& rates, std::uint32_t nc_line) {
  const auto along = [&](const Place& place) {
    const std::size_t next = std::min(place.segment + 1, points_.size() - 1);
    return points_[place.segment].along_mm + place.t * points_[next].way_mm;
  };
  const double way_mm = along(cut.to) - along(cut.from);
  if (way_mm <= seconds * rates.most * kOtherWay + rates.slack_mm) return;
  find(CheckOf::feeds, nc_line, [&] {
    return "up to here the tip goes " + fixed_text(way_mm, 4) + " mm along its path in " +
           shortest_text(std::round(1e5 * seconds) / 1e5) + " s, " + rate_text(way_mm / seconds) +
           "; the CL file asks for " + rate_text(rates.most);
  });
}

ProgramJudge::Rates ProgramJudge::rates_of(const Covered& covered) const {
  Rates out;
  out.slack_mm = pace_slack_mm();
  out.known = covered.any;
  if (!covered.any) return out;
  out.least = std::numeric_limits<double>::infinity();
  for (std::size_t j = number(covered.first); j <= number(covered.last); j = asked_.next_change(j)) {
    const AskedState& asked = asked_.at(j);
    const double rate = rate_of(asked);
    out.known = out.known && rate > 0.0;
    out.least = std::min(out.least, rate);
    out.most = std::max(out.most, rate);
    if (asked.rotary_rad_s > 0.0)
      out.rotary_rad_s =
          out.rotary_rad_s > 0.0 ? std::min(out.rotary_rad_s, asked.rotary_rad_s) : asked.rotary_rad_s;
  }
  return out;
}

// Of a CL motion that is to last so long the block has a share.
double ProgramJudge::inverse_s(const Cut& cut, const Covered& covered) const {
  double seconds = 0.0;
  for (std::size_t j = covered.first; covered.any && j <= covered.last; ++j) {
    const AskedState& asked = asked_.at(number(j));
    if (asked.feed.mode != cl::FeedMode::inverse) return 0.0;
    const double begins = j == cut.from.segment + 1 ? cut.from.t : 0.0;
    const double ends = j == cut.to.segment + 1 ? cut.to.t : 1.0;
    if (points_[j].way_mm > kNearEnd_mm) seconds += std::max(0.0, ends - begins) / asked.feed.value;
  }
  return seconds;
}

void ProgramJudge::lasts(const Pace& pace, std::uint32_t nc_line) {
  if (!cut_) return;
  const Cut cut = *cut_;
  cut_.reset();
  const Covered motions = covered(cut);
  check_states(cut, motions, nc_line);
  const Rates rates = rates_of(motions);
  if (rates.known && pace.seconds > 0.0) return check_pace(pace, rates, motions.last, !cut.outside, nc_line);
  const double inverse = cut.outside ? 0.0 : inverse_s(cut, motions);
  const double slack_s = kNearEnd_mm + kNearEnds * options_.tolerance_mm;
  if (inverse <= 0.0 || pace.seconds <= 0.0 || !(pace.way_mm > kNearEnds * slack_s)) return;
  if (pace.seconds >= inverse * (1.0 - slack_s / pace.way_mm) / kOtherWay) return;
  find(CheckOf::feeds, nc_line, [&] {
    return "the block lasts " + shortest_text(pace.seconds) + " s, its share of the CL motion " +
           shortest_text(inverse) + " s" + cl_line(points_[motions.last].line);
  });
}

bool ProgramJudge::keeps_pace(const Pace& pace, const Rates& rates, bool may_not_be_slow) const {
  if (!(pace.seconds > 0.0)) return true;
  const bool corrected = options_.truth != nullptr || options_.offsets != nullptr;
  const double slack_mm = rates.slack_mm;
  // Half a digit of F, and of the time that it means.
  const double digit = 1.0 + 1.0 / static_cast<double>(std::max<std::int64_t>(pace.feed, 1));
  if (pace.way_mm > pace.seconds * rates.most * digit * kOtherWay + slack_mm) return false;
  if (!may_not_be_slow) return true;
  const double short_s = corrected ? kShortCorrected_s : kShort_s;
  const double lasts_s = pace.seconds / digit;
  if (lasts_s <= kSlower * pace.slowest_s + short_s) return true;
  if ((lasts_s - short_s) * rates.least <= kSlower * (kOtherWay * pace.way_mm + slack_mm)) return true;
  if (rates.rotary_rad_s > 0.0 && lasts_s <= kSlower * pace.turn_rad / rates.rotary_rad_s + short_s)
    return true;
  // The largest F that the control takes.
  const nc::Controller::FeedRules& rules = controller_.feed;
  const std::optional<double>& most =
      pace.mode == nc::FeedMode::inverse_time ? rules.max_inverse_time : rules.max_per_minute;
  const double f = controller_.numbers.feed.internal(pace.mode, pace.feed) * kSecondsPerMinute;
  return most && f >= *most / kSlower;
}

void ProgramJudge::find_pace(const Pace& pace, const Rates& rates, std::size_t point, std::uint32_t nc_line) {
  find(CheckOf::feeds, nc_line, [&] {
    std::string text = "the tip goes " + shortest_text(std::round(1e4 * pace.way_mm) / 1e4) + " mm in " +
                       shortest_text(std::round(1e5 * pace.seconds) / 1e5) + " s, " +
                       rate_text(pace.way_mm / pace.seconds) + "; the CL file asks for " +
                       rate_text(rates.most);
    if (rates.least < rates.most) text += " or " + rate_text(rates.least);
    text += cl_line(points_[point].line);
    if (pace.way_mm < pace.seconds * rates.least)
      text += "; its slowest axis needs " + shortest_text(std::round(1e5 * pace.slowest_s) / 1e5) + " s";
    return text;
  });
}

void ProgramJudge::check_states(const Cut& cut, const Covered& covered, std::uint32_t nc_line) {
  if (!covered.any && !cut.outside) return;
  check_pauses(covered.first, nc_line);
  for (std::size_t j = number(covered.first); j <= number(covered.last); j = asked_.next_change(j)) {
    const AskedState& asked = asked_.at(j);
    check_place(asked, nc_line);
    check_cut(asked, nc_line);
  }
  if (cut.outside) return;
  for (std::size_t j = covered.first; j <= covered.last; ++j) {
    if (!points_[j].rapid) continue;
    find(CheckOf::rapids, nc_line,
         [&] { return "a feed where the CL file has a rapid" + cl_line(points_[j].line); });
  }
}

void ProgramJudge::rapid_to(std::size_t point, std::uint32_t nc_line) {
  check_pauses(point, nc_line);
  check_place(asked_.at(number(point)), nc_line);
}

void ProgramJudge::check_pauses(std::size_t point, std::uint32_t nc_line) {
  auto& pauses = asked_.pauses();
  for (; !pauses.empty() && pauses.front().before <= number(point); pauses.pop_front()) {
    const AskedPause& pause = pauses.front();
    find(CheckOf::order, nc_line, [&] {
      return std::string(pause.stops ? "the stop" : "the dwell") + " before it is missing" +
             cl_line(pause.line);
    });
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
  const std::int64_t offset = options_.work_offset.value_or(asked_.work_offset().value_or(work_offset_));
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
    if (length && *length != 0)
      find(CheckOf::tools, nc_line, [] {
        return std::string(
            "the control adds a tool length, and the words are those of the spindle's gauge point");
      });
    return;
  }
  const bool has_register = names_register(controller_.length.on) || names_register(controller_.tcp.on);
  if (!length) {
    find(CheckOf::tools, nc_line, [] {
      return std::string("whether the control adds the tool's length is not known: it is not said again");
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

void ProgramJudge::check_cut(const AskedState& asked, std::uint32_t nc_line) {
  if (!same_spindle(told_.spindle(), asked.spindle)) {
    find(CheckOf::spindle, nc_line, [&] {
      return "the spindle is " + spindle_text(told_.spindle()) + ", the CL file asks for " +
             spindle_text(asked.spindle) + cl_line(asked.line);
    });
  }
  if (told_.coolant() != asked.coolant) {
    find(CheckOf::spindle, nc_line, [&] {
      return "the coolant is " + coolant_text(told_.coolant()) + ", the CL file asks for " +
             coolant_text(asked.coolant) + cl_line(asked.line);
    });
  }
  if (told_.cutter().side != asked.cutter.side || told_.cutter().number != asked.cutter.number) {
    find(CheckOf::path, nc_line, [&] {
      return "compensation of the cutter's radius is " +
             std::string(told_.cutter().side == nc::CutterSide::off ? "off" : "on") +
             ", and not as CUTCOM asks for it" + cl_line(asked.line);
    });
  }
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
  return out;
}

void ProgramJudge::go_back_to(const Found& found) {
  for (std::size_t i = 0; i < kChecks; ++i) {
    checks_[i].count = found.count[i];
    checks_[i].places.resize(std::min(checks_[i].places.size(), found.places[i]));
  }
}

void ProgramJudge::finish(VerifyReport& report, std::uint32_t nc_line) {
  const auto row = [&](CheckOf of) -> Check& { return checks_[static_cast<std::size_t>(of)]; };
  for (const AskedPause& pause : asked_.pauses()) {
    find(CheckOf::order, nc_line, [&] {
      return std::string(pause.stops ? "the stop" : "the dwell") + " is missing" + cl_line(pause.line);
    });
  }
  static constexpr std::array kAbout = {
      "tip, tool axis and travel; path mode, compensation of the cutter's radius, axes",
      "each cut as fast as FEDRAT, or as its slowest axis",
      "rapids on their lines and where the CL file has them; what moves outside the cuts",
      "tool and length register at every cut",
      "work offset at every cut, shifts",
      "sense and speed of the spindle, coolant at every cut",
      "every CL motion, in order; dwells and stops",
      "the end of the program is reached, and nothing stands behind it"};
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
