#include "post/intake/nc_walk.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/base/number_text.hpp"

#include "post/coolant_kinds.hpp"
#include "post/making/post_words.hpp"

namespace trunnion::post {
namespace {

SpindleTool tool_at_start(const NcOrigin& origin, const ToolOptions& tools) {
  // --tool: as if its change and its length stood in front of the program.
  return {tools.length_mm.value_or(origin.machine->tool_length_mm),
          origin.controller->length.automatic || origin.words == FromWords::tip || tools.tool.has_value(),
          0.0};
}

}  // namespace

NcWalk::NcWalk(const NcOrigin& origin, const Keep& keep, const std::string& file, Diagnostics& diagnostics)
    : origin_(origin),
      keep_(keep),
      file_(file),
      diagnostics_(diagnostics),
      axis_words_(*origin.machine, origin.controller->numbers.axes),
      in_force_(*origin.machine, *origin.controller, axis_words_, tool_at_start(origin, *keep.with.tools)),
      times_(*origin.machine, *origin.controller) {}

void NcWalk::refuse(SourceRef where, const std::string& kind, const std::string& message) {
  if (told_.insert(kind).second) diagnostics_.error(file_, where, message);
}

// Its own height the program had from its machine; who comes from another one comes down the same line.
bool NcWalk::is_straight_down(const cl::Motion& motion) const {
  constexpr double kBeside_mm = 0.01;  // digits of the words
  constexpr double kSameAxis = 1e-6;
  const auto& above = std::get<cl::Motion>(approach_->data);
  const Vec3 way = motion.tip_P - above.tip_P;
  const double down_mm = -way.dot(motion.axis_P);
  return motion.rapid && (motion.axis_P - above.axis_P).norm() < kSameAxis && down_mm > 0.0 &&
         (way + down_mm * motion.axis_P).norm() < kBeside_mm;
}

void NcWalk::put_approach() {
  if (approach_) records_.push_back(*std::exchange(approach_, {}));
}

void NcWalk::put_tool() {
  if (!change_.tool) return;
  records_.push_back(*std::exchange(change_.tool, {}));
  records_.insert(records_.end(), change_.behind.begin(), change_.behind.end());
  change_.behind.clear();
}

void NcWalk::put(SourceRef where, const cl::Motion& motion) {
  put_tool();
  moved_.ever = moved_.low = true;
  if (approach_ && !is_straight_down(motion)) put_approach();
  approach_.reset();
  records_.push_back({where, motion});
}

void NcWalk::take(const nc::Block& block, SourceRef where) {
  if (const auto* motion = std::get_if<nc::Motion>(&block)) return take(*motion);
  if (const auto* arc = std::get_if<nc::Arc>(&block)) return take(*arc);
  if (const auto* hole = std::get_if<nc::Hole>(&block)) return take(*hole);
  const bool keeps_place =
      std::holds_alternative<nc::Spindle>(block) || std::holds_alternative<nc::Coolant>(block) ||
      std::holds_alternative<nc::Comment>(block) || std::holds_alternative<nc::Dwell>(block);
  if (!keeps_place) moved_.over.reset();
  take_setting(block, where);
  take_process(block, where);
}

// What decides about where the words lead.
void NcWalk::take_setting(const nc::Block& block, SourceRef where) {
  if (const auto* call = std::get_if<nc::ToolCall>(&block)) return take(*call, where);
  if (const auto* retract = std::get_if<nc::Retract>(&block)) return take(*retract, where);
  if (const auto* plane = std::get_if<nc::TiltedPlane>(&block)) return take(*plane, where);
  if (const auto* cutter = std::get_if<nc::CutterCompensation>(&block)) return take(*cutter, where);
  const auto use_register = [&](std::int64_t number) {
    if (change_.tool && number > 0)
      std::get<cl::ToolChange>(change_.tool->data).length_register = static_cast<std::uint32_t>(number);
  };
  if (const auto* length = std::get_if<nc::LengthCompensation>(&block)) {
    if (!origin_.controller->length.on.empty() && length->number > 1) use_register(length->number);
    if (length->number > 0) hold_register(length->number, where);
    change_.length_on = length->number > 0;
    change_.length_open = false;
    in_force_.add_length(length->number > 0);
  }
  if (const auto* control = std::get_if<nc::TcpControl>(&block)) {
    if (control->on) use_register(control->length_offset);
    if (control->on && control->length_offset > 0) hold_register(control->length_offset, where);
    in_force_.tcp = control->on;
    if (origin_.controller->tcp.replaces_length) change_.length_on = change_.length_open = false;
    if (origin_.controller->tcp.replaces_length) in_force_.add_length(false);
    at_.reset();
  }
  if (const auto* offset = std::get_if<nc::WorkOffset>(&block)) {
    in_force_.shift.read(*offset);
    put(where, cl::WorkOffset{static_cast<std::uint32_t>(offset->index)});
  }
  if (const auto* shift = std::get_if<nc::OffsetShift>(&block)) {
    in_force_.shift.read(*shift);
    if (in_force_.plane || in_force_.follows_part) refuse_shifted_plane(where);
  }
  if (std::holds_alternative<nc::Probe>(block))
    refuse(where, "probe", "a probing move: its end position depends on the part and is unknown here");
  if (std::holds_alternative<nc::VariableMotion>(block) || std::holds_alternative<nc::LatchValues>(block) ||
      std::holds_alternative<nc::RunTimeStep>(block)) {
    refuse(where, "variables",
           "words that depend on variables of the control at run time: the position is unknown here");
  }
}

// What stands in another one the program does not say.
void NcWalk::hold_register(std::int64_t number, SourceRef where) {
  if (!change_.register_used) change_.register_used = number;
  if (*change_.register_used == number) return;
  refuse(where, "register",
         "length register " + std::to_string(number) + ", and register " +
             std::to_string(*change_.register_used) +
             " was in force for the same tool: what is added between them the program does not say");
}

void NcWalk::take_process(const nc::Block& block, SourceRef where) {
  if (const auto* spindle = std::get_if<nc::Spindle>(&block)) {
    spindle_ = *spindle;
    change_.turned = change_.turned || spindle->turn != nc::SpindleTurn::off;
    change_.spindle_open = false;
    cl::Spindle out;
    out.state = spindle->turn == nc::SpindleTurn::off ? cl::Spindle::State::off : cl::Spindle::State::on;
    if (spindle->rpm > 0) out.speed_rpm = static_cast<double>(spindle->rpm);
    out.counterclockwise = spindle->turn == nc::SpindleTurn::counterclockwise;
    put(where, out);
  }
  if (const auto* coolant = std::get_if<nc::Coolant>(&block))
    put(where, cl::Coolant{coolant_kind(coolant->kind)});
  if (const auto* dwell = std::get_if<nc::Dwell>(&block))
    put(where, cl::Dwell{static_cast<double>(dwell->milliseconds) / 1000.0, {}});
  if (const auto* stop = std::get_if<nc::Stop>(&block)) put(where, cl::Stop{stop->optional});
  // Those of the head are about the program that is read.
  if (const auto* comment = std::get_if<nc::Comment>(&block); comment != nullptr && moved_.ever)
    put(where, cl::Text{cl::Text::Kind::print, comment->text});
  if (const auto* word = std::get_if<nc::AllowedWord>(&block)) {
    diagnostics_.warning_once(word->text, file_, where,
                              "'" + word->text +
                                  "' is allowed by the controller file ([read] allowed) and "
                                  "left out: what it does is not known");
  }
  if (std::holds_alternative<nc::ProgramEnd>(block)) {
    put_tool();
    put(where, cl::End{});
  }
}

void NcWalk::take(const nc::ToolCall& call, SourceRef where) {
  put_tool();
  const auto number = static_cast<std::uint32_t>(call.tool);
  cl::ToolChange change;
  change.number = number;
  if (call.length_offset != call.tool)
    change.length_register = static_cast<std::uint32_t>(call.length_offset);
  change_.tool = cl::Record{where, change};
  change_.register_used.reset();
  if (std::exchange(change_.length_on, false)) change_.length_open = true;
  moved_.low = false;
  moved_.above = false;
  spindle_ = {};
  change_.spindle_open = change_.turned;
  double length_mm = keep_.with.tools->length_mm.value_or(origin_.machine->tool_length_mm);
  if (const Tool* known = keep_.with.tools->find(number)) length_mm = known->length_mm;
  in_force_.set_length(length_mm);
  in_force_.add_length(origin_.controller->length.automatic || origin_.words == FromWords::tip);
  change_.ever = true;
  at_.reset();
}

void NcWalk::come_from_above(SourceRef where) {
  if (std::exchange(moved_.low, false)) put(where, cl::PostWord{"RETRCT", {}});
}

bool NcWalk::rises_to_height(const BlockEnd& from, const BlockEnd& to) const {
  constexpr double kBeside = 0.05;  // mm, rad: digits of the words far from the axes
  const auto z = origin_.machine->axis("Z");
  if (!to.tcp || !z || !origin_.machine->safe.is_safe(to.q[*z], 1.0)) return false;
  for (AxisId id = 0; id < axis_words_.count; ++id)
    if (id != *z && std::abs(to.q[id] - from.q[id]) > kBeside) return false;
  return true;
}

// Whoever posts the path has a safe height of its own, and comes from there.
void NcWalk::take(const nc::Retract& retract, SourceRef where) {
  if ((retract.axes & nc::AxisWords::bit(nc::AxisLetter::Z)) != 0) {
    // Its own height is that of its machine.
    if (moved_.risen != 0 && moved_.risen == records_.size()) records_.pop_back();
    moved_.risen = 0;
    come_from_above(where);
    moved_.above = true;
  }
  at_.reset();
}

bool NcWalk::comes_down(const nc::Motion& motion, const JointVector& words) const {
  if (at_ || !moved_.over || in_force_.in_part() || motion.feed_mode != nc::FeedMode::per_minute)
    return false;
  for (AxisId id = 0; id < axis_words_.count; ++id) {
    if (axis_words_.letters[id] != nc::AxisLetter::Z && words[id] != (*moved_.over)[id]) return false;
  }
  return true;
}

void NcWalk::refuse_shifted_plane(SourceRef where) {
  constexpr double kNothing_mm = 1e-6;
  if (in_force_.shift.words(false).norm() > kNothing_mm)
    refuse(
        where, "shifted plane",
        "a tilted plane and a shift of the work offset that the program set: which of them is counted in the "
        "other is not read");
}

// The rotary axes stand where the program had them before, if the plane's rounded angles mean that place.
void NcWalk::take(const nc::TiltedPlane& plane, SourceRef where) {
  constexpr double kRounded = 5e-5;  // of angles with three decimals
  at_.reset();
  if (plane.on) refuse_shifted_plane(where);
  if (!in_force_.enter(plane)) return;
  const auto& k = in_force_.kinematics;
  if ((k.axis_P(k.sines(in_force_.rotary)) - in_force_.plane->X_PF.R.col(2)).norm() < kRounded)
    in_force_.plane_q = in_force_.rotary;
}

void NcWalk::take(const nc::CutterCompensation& cutter, SourceRef where) {
  using HowAsked = cl::ReaderOptions::CutterCompensation;
  if (keep_.reading.cutter_compensation == HowAsked::tool_center) {
    diagnostics_.warning_once("cutter", file_, where,
                              "cutter compensation is left out: the points are those of the tool's center "
                              "(--cutter-compensation tool-center)");
  } else if (keep_.reading.cutter_compensation == HowAsked::wear) {
    cl::CutterCompensation out;
    out.side = cutter.side == nc::CutterSide::off    ? cl::CutterCompensation::Side::off
               : cutter.side == nc::CutterSide::left ? cl::CutterCompensation::Side::left
                                                     : cl::CutterCompensation::Side::right;
    if (cutter.number > 0) out.wear_register = static_cast<std::uint32_t>(cutter.number);
    put(where, out);
  } else if (cutter.side != nc::CutterSide::off) {
    refuse(where, "cutter",
           "cutter compensation changes the geometry by what stands in a register: "
           "--cutter-compensation tool-center or wear, where the words are the path of the tool's center");
  }
}

bool NcWalk::turns_between(const BlockEnd& from, const JointVector& words) const {
  for (AxisId id = 0; id < axis_words_.count; ++id)
    if (!axis_words_.is_linear(id) && in_force_.joints_of(words)[id] != from.q[id]) return true;
  return false;
}

bool NcWalk::may_cut(SourceRef where) {
  const bool needs_length = in_force_.in_part() ? !origin_.controller->tcp.replaces_length || in_force_.plane
                                                : origin_.machine->output_point == OutputPoint::tip;
  if (change_.spindle_open) {
    refuse(
        where, "spindle",
        "a cut after a tool change without a spindle start: controls differ in whether the spindle turns, "
        "and how fast ('" +
            (origin_.controller->spindle_clockwise.empty() ? "M3"
                                                           : origin_.controller->spindle_clockwise.back()) +
            "' after the change)");
    return false;
  }
  if (change_.length_open && !in_force_.in_part() && origin_.words == FromWords::refused) {
    refuse(where, "open length",
           "a cut after a tool change, with length compensation on before it: controls differ in whether it "
           "is still on, and with which register ('" +
               origin_.controller->length.off.front() + "' or '" + origin_.controller->length.on.front() +
               "')");
    return false;
  }
  const bool is_told = origin_.words == FromWords::spindle || (keep_.with.tools->length_mm && !change_.ever);
  if (needs_length && !in_force_.tool.control_adds_length && change_.ever && !is_told) {
    refuse(
        where, "length",
        "a cut after a tool change without tool length compensation, and X Y Z of this machine are positions "
        "of the tip: --from-words tip if the control adds the length by itself ('" +
            (origin_.controller->length.on.empty() ? std::string() : origin_.controller->length.on.front()) +
            "') or the tool was touched off, --from-words spindle if X Y Z are the spindle's gauge point");
    return false;
  }
  if (needs_length && !in_force_.tool.control_adds_length && !is_told) {
    refuse(where, "length",
           "a cut without tool length compensation, and X Y Z of this machine are positions of the tip "
           "([output] point of " +
               origin_.machine->file +
               "; --tool N: the program starts with this tool and its length; --tool-length-mm L: X Y Z are "
               "the spindle's gauge point)");
    return false;
  }
  return true;
}

bool NcWalk::stands_in_plane(const ToolPose& pose, SourceRef where) {
  constexpr double kAlong = 5e-5;
  if (!in_force_.plane || (pose.axis_P - in_force_.plane->X_PF.R.col(2)).norm() < kAlong) return true;
  refuse(where, "plane",
         "the machine that the program was made for cannot stand along Z of the tilted plane");
  return false;
}

ToolPose NcWalk::pose_of(const BlockEnd& end) const {
  return in_force_.kinematics.pose(end.q);
}

cl::Feed NcWalk::feed_of(std::int64_t per_minute) const {
  return {cl::FeedMode::per_minute,
          origin_.controller->numbers.feed.internal(nc::FeedMode::per_minute, per_minute)};
}

// That of a tap is its pitch.
cl::Feed NcWalk::feed_of(const nc::Hole& hole) const {
  if (hole.kind != nc::Hole::Kind::tap) return feed_of(hole.feed);
  return {cl::FeedMode::per_revolution, nc::kPitchUnit_mm * static_cast<double>(hole.thread.pitch)};
}

// What the control makes of F: the speed of the tip where that is what it measures, else the duration.
cl::Feed NcWalk::feed_of(const BlockEnd& end, const nc::Motion& motion) const {
  const BlockEnd& from = *at_;
  bool turns = false;
  for (AxisId id = 0; id < axis_words_.count; ++id)
    turns = turns || (!axis_words_.is_linear(id) && from.q[id] != end.q[id]);
  const bool under_tcp = from.tcp && end.tcp;
  const double tcp_way_mm = under_tcp ? (end.word_tip_P - from.word_tip_P).norm() : 0.0;
  if (motion.feed_mode == nc::FeedMode::per_minute && (!turns || tcp_way_mm > 0.0))
    return feed_of(motion.feed);
  const ControlTimes::Way way =
      times_.way(from.q, end.q, under_tcp ? std::optional(tcp_way_mm) : std::nullopt);
  return {cl::FeedMode::inverse, 1.0 / times_.seconds(way, motion.feed_mode, motion.feed)};
}

BlockEnd NcWalk::on_way(const BlockEnd& end, double t) const {
  BlockEnd out = end;
  out.q = JointVector::interpolate(at_->q, end.q, t);
  if (end.tcp && at_->tcp) {
    in_force_.kinematics.solve_linear(at_->word_tip_P + t * (end.word_tip_P - at_->word_tip_P),
                                      in_force_.kinematics.sines(out.q), out.q);
  }
  return out;
}

double NcWalk::turn_to(const BlockEnd& end) const {
  double turn = 0.0;
  for (AxisId id = 0; id < axis_words_.count; ++id)
    if (!axis_words_.is_linear(id)) turn += std::abs(end.q[id] - at_->q[id]);
  return turn;
}

NcWalk::OffLine NcWalk::off_line(const BlockEnd& end) const {
  constexpr double kStep_rad = 0.25;  // of the rotary axes, from place to place
  constexpr double kMostPlaces = 10000.0;
  constexpr double kSame = 1e-9;
  OffLine out;
  const double turn = turn_to(end);
  if (turn == 0.0) return out;
  const double places = std::min(kMostPlaces, std::ceil(turn / kStep_rad) + 1.0);
  const ToolPose from = pose_of(*at_), to = pose_of(end);
  const Vec3 way = to.tip_P - from.tip_P;
  const Vec3 normal = from.axis_P.cross(to.axis_P);
  for (double i = 1.0; i < places; ++i) {
    const ToolPose here = pose_on_way(end, i / places);
    const double along =
        way.isZero(0.0) ? 0.0 : std::clamp((here.tip_P - from.tip_P).dot(way) / way.squaredNorm(), 0.0, 1.0);
    out.tip_mm = std::max(out.tip_mm, (here.tip_P - from.tip_P - along * way).norm());
    const double beside = normal.norm() > kSame
                              ? std::asin(std::min(1.0, std::abs(here.axis_P.dot(normal.normalized()))))
                              : std::acos(std::clamp(here.axis_P.dot(from.axis_P), -1.0, 1.0));
    out.axis_rad = std::max(out.axis_rad, beside);
  }
  return out;
}

// On joints that move linearly the second derivative of the tip is at most
//     Omega^2 (|w| + |b|) + 2 Omega (|w'| + |b'|)     (TableKinematics)
// and a chord over 1/n of the block is off by at most an eighth of it over n^2.
double NcWalk::pieces_to(const BlockEnd& end, const OffLine& limit) const {
  const TableKinematics& k = in_force_.kinematics;
  const double turn = turn_to(end);
  double bends_mm = 0.0;
  if (!(end.tcp && at_->tcp)) {
    const double far_mm =
        std::max(k.w(at_->q).norm(), k.w(end.q).norm()) + std::max(k.b(at_->q).norm(), k.b(end.q).norm());
    const double way_mm = (k.w(end.q) - k.w(at_->q)).norm() + (k.b(end.q) - k.b(at_->q)).norm();
    bends_mm = turn * (turn * far_mm + 2.0 * way_mm);
  }
  constexpr double kChord = 8.0;
  const double n2 = std::max(bends_mm / (kChord * limit.tip_mm), turn * turn / (kChord * limit.axis_rad));
  return std::max(1.0, std::ceil(std::sqrt(n2)));
}

// Programs whose points stand too far apart have errors of some tenths of a mm between them, and of a degree
// or two; what leaves the line further is a part that the table turns under the tool.
bool NcWalk::says_its_way(const BlockEnd& end, SourceRef where) {
  constexpr OffLine kOwnError{0.5, 5.0 / kDegreePerRad};
  if (origin_.path == FromPath::motion) return true;
  const OffLine off = off_line(end);
  if (off.within(kOwnError)) return true;
  const std::string what = "rotary axes turn by " + fixed_text(turn_to(end) * kDegreePerRad, 2) +
                           " deg in this cut; between its ends the tip of that machine is " +
                           fixed_text(off.tip_mm, 2) + " mm off the straight line, the tool axis " +
                           fixed_text(off.axis_rad * kDegreePerRad, 2) + " deg off the shortest turn";
  if (origin_.path == FromPath::points) {
    diagnostics_.warning_once("way", file_, where, what + ": this deviation is dropped (--from-path points)");
    return true;
  }
  refuse(where, "way", what + " (--from-path motion keeps this path, --from-path points goes straight)");
  return false;
}

void NcWalk::put_way(const BlockEnd& end, const cl::Motion& last, double wanted, SourceRef where) {
  constexpr std::size_t kMostPieces = 100000;
  if (!(wanted <= kMostPieces))
    return refuse(where, "pieces",
                  "the way of this block needs " + shortest_text(wanted) + " points, more than " +
                      std::to_string(kMostPieces) + (last.rapid ? "" : " (--from-path points)"));
  const auto pieces = static_cast<std::size_t>(wanted);
  cl::Motion each = last;
  if (each.feed.mode == cl::FeedMode::inverse) each.feed.value *= static_cast<double>(pieces);
  for (std::size_t i = 1; i <= pieces; ++i) {
    const BlockEnd here =
        i < pieces ? on_way(end, static_cast<double>(i) / static_cast<double>(pieces)) : end;
    const ToolPose pose = pose_of(here);
    each.tip_P = pose.tip_P;
    each.axis_P = pose.axis_P;
    if (last.rapid) put_rotary(here, where);
    put(where, each);
  }
  rotary_ = end.q;
}

void NcWalk::put_rotary(const BlockEnd& end, SourceRef where) {
  if (!keep_.with.keeps_turns) return;
  cl::PostWord word{kStands, {}};
  bool turns = false;
  for (AxisId id = 0; id < axis_words_.count; ++id) {
    if (axis_words_.is_linear(id)) continue;
    turns = turns || end.q[id] != rotary_[id];
    word.fields.emplace_back(1, letter_of(axis_words_.letters[id]));
    word.fields.push_back(shortest_text(end.q[id] * kDegreePerRad));
  }
  if (turns) put(where, word);
  rotary_ = end.q;
}

void NcWalk::take(const nc::Motion& motion) {
  const bool rapid = motion.kind == nc::MotionKind::rapid;
  const JointVector words = axis_words_.internal(motion.words);
  in_force_.take_rotary(motion.words, words);
  const auto missing = static_cast<std::uint16_t>(in_force_.wanted() & ~motion.words.mask);
  const bool leaves = in_force_.leaves_plane(motion.words);
  if ((motion.words.mask & ~axis_words_.all) != 0) {
    for (const nc::AxisLetter letter : nc::kAllAxisLetters) {
      if (!motion.words.has(letter) || (nc::AxisWords::bit(letter) & axis_words_.all) != 0) continue;
      refuse(motion.source, std::string("axis ") + letter_of(letter),
             std::string("axis ") + letter_of(letter) + ": the machine '" + origin_.machine->name + "' (" +
                 origin_.machine->file +
                 ") has none (--from-machine: the machine that the program was made for)");
    }
    return;
  }
  // Axes that are said one after the other, or anew: the tool need not go straight to where they lead.
  if (rapid && (missing != 0 || leaves || !at_)) come_from_above(motion.source);
  const bool down = !rapid && comes_down(motion, words);
  const auto z = nc::AxisWords::bit(nc::AxisLetter::Z);
  moved_.above = moved_.above && (missing & z) != 0;
  moved_.over.reset();
  if (moved_.above && rapid && missing == z && !leaves) moved_.over = words;
  if (missing != 0 || leaves || (!rapid && !at_ && !down)) {
    at_.reset();
    // On its way to the part the program may say one axis after the other.
    if (rapid && (missing != 0 || leaves)) return;
    std::string names;
    for (AxisId id = 0; id < axis_words_.count; ++id) {
      if ((missing & nc::AxisWords::bit(axis_words_.letters[id])) != 0)
        names += std::string(names.empty() ? "" : ", ") + letter_of(axis_words_.letters[id]);
    }
    return refuse(motion.source, "unknown",
                  names.empty()
                      ? "a cut from an unknown position: there is no rapid of all axes before it"
                      : "a cut, but the program gives no position of these axes before it: " + names);
  }
  if (in_force_.follows_part && !rapid && at_ && turns_between(*at_, words))
    return refuse(motion.source, "following",
                  "a rotary axis turns in a cut, and the zero goes with the part: the control holds that for "
                  "axes that stand");
  const BlockEnd end = [&] {
    BlockEnd out = in_force_.end_at(words);
    out.rapid = rapid;
    return out;
  }();
  const ToolPose pose = pose_of(end);
  if (!stands_in_plane(pose, motion.source)) return;
  if (!rapid && !may_cut(motion.source)) return;
  if (!stands_in_travel(end, motion)) return;
  if (at_ && at_->q == end.q) return;
  if (rapid) {
    const cl::Motion out{pose.tip_P, pose.axis_P, {}, true};
    // Under tool-centre-point control it says X, Y and Z together where it is over the part.
    if (at_) {
      // A rapid is not where a path is made better: it goes as the old one did, and hits nothing that that
      // one did not hit.
      // How the tool turns about its tip is up to the rotary axes, there as here.
      // Ends of blocks that keep to 1 mm of a rapid of a CL file, as those of `post` do, are left as they
      // are.
      constexpr OffLine kRapid{2.0, kPi}, kPiece{1.0, 10.0 / kDegreePerRad};
      const bool rises = rises_to_height(*at_, end);
      put_way(end, out, off_line(end).within(kRapid) ? 1.0 : pieces_to(end, kPiece), motion.source);
      if (rises) moved_.risen = records_.size();
    } else if (!end.tcp) {
      put_rotary(end, motion.source);
      put(motion.source, out);
    } else {
      put_rotary(end, motion.source);
      put_tool();
      put_approach();
      moved_.ever = true;
      approach_ = cl::Record{motion.source, out};
    }
  } else {
    if (down)
      put(motion.source, cl::Motion{pose.tip_P, pose.axis_P, feed_of(motion.feed), false});
    else if (says_its_way(end, motion.source))
      put_way(end, {pose.tip_P, pose.axis_P, feed_of(end, motion), false},
              origin_.path == FromPath::motion
                  ? pieces_to(end, {keep_.reading.arc_tolerance_mm, keep_.chords_rad()})
                  : 1.0,
              motion.source);
    rotary_ = end.q;
  }
  at_ = end;
}

// Of linear axes only a stated work offset could tell.
bool NcWalk::stands_in_travel(const BlockEnd& end, const nc::Motion& motion) {
  constexpr double kRounding_rad = 1e-6;
  for (AxisId id = 0; id < axis_words_.count; ++id) {
    const Axis& axis = origin_.machine->axes[id];
    if (axis.cyclic || axis_words_.is_linear(id) || !motion.words.has(axis_words_.letters[id]) ||
        axis.within_limits(end.q[id] - kRounding_rad) || axis.within_limits(end.q[id] + kRounding_rad))
      continue;
    refuse(motion.source, "travel",
           std::string("axis ") + letter_of(axis_words_.letters[id]) + " would stand at " +
               fixed_text(end.q[id] * kDegreePerRad, 2) + " deg, beyond its travel of " +
               fixed_text(axis.min * kDegreePerRad, 2) + " to " + fixed_text(axis.max * kDegreePerRad, 2) +
               " deg: machine '" + origin_.machine->name + "' (" + origin_.machine->file +
               "; --from-machine: the machine that the program was made for)");
    return false;
  }
  return true;
}

// A program for three axes says nothing of the rotary ones.
std::string NcWalk::unknown_place(const std::string& what, std::uint16_t missing) const {
  std::string axes;
  bool rotary = missing != 0;
  for (const nc::AxisLetter letter : nc::kAllAxisLetters) {
    if ((missing & nc::AxisWords::bit(letter)) == 0) continue;
    axes += (axes.empty() ? " of " : ", ") + std::string(1, nc::letter_of(letter));
    rotary = rotary && nc::is_rotary(letter);
  }
  std::string out = what + " from a place that is not known: no word" + axes + " before it";
  if (rotary)
    out +=
        " (a program for three axes: --from-machine with a machine file of three axes; or a line in front "
        "that says where the rotary axes stand)";
  return out;
}

void NcWalk::take(const nc::Arc& arc) {
  const std::uint16_t missing = in_force_.wanted() & static_cast<std::uint16_t>(~arc.words.mask);
  if (missing != 0 || !at_) return refuse(arc.source, "unknown", unknown_place("an arc", missing));
  if (!may_cut(arc.source)) return;
  const nc::AxisFormat& format = origin_.controller->numbers.axes;
  const JointVector words = axis_words_.internal(arc.words);
  const auto course = nc::course_of(arc, format, keep_.reading.arc_tolerance_mm);
  const cl::Feed feed = feed_of(arc.feed);
  BlockEnd end = in_force_.end_at(words);
  const ToolPose last = pose_of(end);
  if (!stands_in_plane(last, arc.source)) return;
  if (keep_.reading.mark_shapes) {
    const auto axes = nc::plane_axes(arc.plane);
    const auto at = [&](double along, double across, double up) {
      std::array<double, 3> xyz{};
      xyz[nc::index(axes[0])] = along;
      xyz[nc::index(axes[1])] = across;
      xyz[nc::index(axes[2])] = up;
      return pose_at(axis_words_.with_xyz(words, xyz)).tip_P;
    };
    const auto mm = [&](std::int64_t quanta) { return format.internal(nc::AxisLetter::X, quanta); };
    const double z = mm(arc.from[axes[2]]);
    const double center[2] = {mm(arc.center[0]), mm(arc.center[1])};
    cl::Arc out;
    out.start_P = pose_of(*at_).tip_P;
    out.end_P = last.tip_P;
    out.center_P = at(center[0], center[1], z);
    out.normal_P = (at(center[0], center[1], z + (arc.clockwise ? -1.0 : 1.0)) - out.center_P).normalized();
    out.axis_P = last.axis_P;
    out.sweep = Angle::radians(course.sweep_rad);
    out.feed = feed;
    put_tool();
    put(arc.source,
        cl::ShapeBegin{std::make_shared<cl::Shape>(cl::Shape{.motions = course.xyz_mm.size(), .what = out})});
  }
  for (const auto& xyz : course.xyz_mm)
    put(arc.source, cl::Motion{pose_at(axis_words_.with_xyz(words, xyz)).tip_P, last.axis_P, feed, false});
  at_ = end;
}

void NcWalk::put_stroke(const nc::Stroke& stroke, const JointVector& words, const cl::Feed& feed,
                        cl::Motion::Step step, SourceRef where) {
  const ToolPose pose = pose_at(axis_words_.with_xyz(words, stroke.xyz_mm));
  put(where, cl::Motion{pose.tip_P, pose.axis_P, stroke.rapid ? cl::Feed{} : feed, stroke.rapid, step});
  if (stroke.dwell_s > 0.0) put(where, cl::Dwell{stroke.dwell_s, {}});
}

// A control that starts the spindle for its cycle by itself needs no word for it before.
bool NcWalk::put_spindle_of(const nc::Hole& tap) {
  using Hand = nc::Thread::Hand;
  nc::Spindle now{spindle_.turn, tap.thread.rpm};
  if (now.turn == nc::SpindleTurn::off && tap.thread.hand != Hand::as_spindle)
    now.turn = tap.thread.hand == Hand::left ? nc::SpindleTurn::counterclockwise : nc::SpindleTurn::clockwise;
  const Hand hand = now.turn == nc::SpindleTurn::counterclockwise ? Hand::left : Hand::right;
  if (now.turn == nc::SpindleTurn::off || (tap.thread.hand != Hand::as_spindle && tap.thread.hand != hand)) {
    refuse(tap.source, "tap",
           now.turn == nc::SpindleTurn::off ? "a tapping cycle, and the spindle does not turn"
                                            : "a tapping cycle of the other hand than the spindle turns");
    return false;
  }
  if (now.turn == spindle_.turn && now.rpm == spindle_.rpm) return true;
  take_process(now, tap.source);
  return true;
}

// It begins where the feed does.
void NcWalk::put_shape(const nc::Hole& hole, const JointVector& words, bool across, std::size_t motions) {
  const auto z_mm = [&](std::int64_t quanta) {
    return origin_.controller->numbers.axes.internal(nc::AxisLetter::Z, quanta);
  };
  std::array<double, 3> xyz{};
  for (const nc::AxisLetter letter : {nc::AxisLetter::X, nc::AxisLetter::Y})
    xyz[nc::index(letter)] = origin_.controller->numbers.axes.internal(letter, hole.words[letter]);
  xyz[2] = z_mm(hole.clear);
  const ToolPose top = pose_at(axis_words_.with_xyz(words, xyz));
  cl::Hole out;
  out.kind = static_cast<cl::Hole::Kind>(hole.kind);
  out.top_P = top.tip_P;
  out.axis_P = top.axis_P;
  out.depth_mm = z_mm(hole.clear - hole.bottom);
  out.leave_mm = z_mm(hole.words[nc::AxisLetter::Z] - hole.clear);
  out.step_mm = out.first_step_mm = z_mm(hole.step);
  out.dwell_s = static_cast<double>(hole.dwell_ms) / 1000.0;
  out.feed = feed_of(hole);
  out.across = across;
  put_tool();
  put(hole.source, cl::ShapeBegin{std::make_shared<cl::Shape>(cl::Shape{.motions = motions, .what = out})});
}

void NcWalk::take(const nc::Hole& hole) {
  const std::uint16_t missing = in_force_.wanted() & static_cast<std::uint16_t>(~hole.words.mask);
  if (missing != 0 || !at_) return refuse(hole.source, "unknown", unknown_place("a hole", missing));
  const bool is_tap = hole.kind == nc::Hole::Kind::tap;
  if (is_tap && !put_spindle_of(hole)) return;
  if (!may_cut(hole.source)) return;
  const JointVector words = axis_words_.internal(hole.words);
  const cl::Feed feed = feed_of(hole);
  if (!stands_in_plane(pose_at(words), hole.source)) return;
  const auto strokes = nc::strokes_of(hole, origin_.controller->cycles, origin_.controller->numbers.axes);
  const double bottom_mm = origin_.controller->numbers.axes.internal(nc::AxisLetter::Z, hole.bottom);
  const auto deepest = std::find_if(strokes.begin(), strokes.end(),
                                    [&](const nc::Stroke& stroke) { return stroke.xyz_mm[2] == bottom_mm; });
  auto stroke = strokes.begin();
  // Up to the clearance is no part of a hole.
  const auto mm = [&](const nc::AxisWords& of, nc::AxisLetter letter) {
    return origin_.controller->numbers.axes.internal(letter, of[letter]);
  };
  const auto is_above = [&](const nc::Stroke& s) {
    return s.xyz_mm[0] == mm(hole.words, nc::AxisLetter::X) &&
           s.xyz_mm[1] == mm(hole.words, nc::AxisLetter::Y);
  };
  const bool across =
      std::any_of(strokes.begin(), deepest, [&](const auto& s) { return !is_above(s); }) ||
      !is_above({true, {mm(hole.from, nc::AxisLetter::X), mm(hole.from, nc::AxisLetter::Y), 0.0}, 0.0});
  for (; stroke != deepest && !is_above(*stroke); ++stroke)
    put_stroke(*stroke, words, {}, cl::Motion::Step::none, hole.source);
  if (keep_.reading.mark_shapes || is_tap)
    put_shape(hole, words, across, static_cast<std::size_t>(strokes.end() - stroke));
  // Steps begin with the first feed.
  const auto begins = std::find_if(stroke, strokes.end(), [](const nc::Stroke& s) { return !s.rapid; });
  const auto in_steps =
      hole.kind == nc::Hole::Kind::peck ? cl::Motion::Step::leaves : cl::Motion::Step::stays;
  for (; stroke != strokes.end(); ++stroke) {
    const bool is_step = hole.step > 0 && stroke >= begins && stroke < deepest;
    put_stroke(*stroke, words, feed, is_step ? in_steps : cl::Motion::Step::none, hole.source);
  }
  at_ = in_force_.end_at(words);
}

}  // namespace trunnion::post
