#include "trunnion/nc/blocks.hpp"

#include <tuple>

namespace trunnion::nc {
namespace {

std::string text_of(const AxisWords& words) {
  std::string out;
  for (const AxisLetter letter : kAllAxisLetters) {
    if (words.has(letter)) out += std::string(" ") + letter_of(letter) + " " + std::to_string(words[letter]);
  }
  return out;
}

struct Describe {
  std::string operator()(const Motion& b) const {
    if (b.kind == MotionKind::rapid) return "rapid" + text_of(b.words);
    return "feed" + text_of(b.words) + (b.feed_mode == FeedMode::inverse_time ? " | 1/min " : " | per min ") +
           std::to_string(b.feed);
  }
  std::string operator()(const ProgramStart& b) const {
    return "program start " + b.name + " " + std::to_string(b.number);
  }
  std::string operator()(const ProgramEnd&) const { return "program end"; }
  std::string operator()(const Comment& b) const { return "comment " + b.text; }
  std::string operator()(const Raw& b) const { return "raw " + b.text; }
  std::string operator()(const Dwell& b) const { return "dwell ms " + std::to_string(b.milliseconds); }
  std::string operator()(const Spindle& b) const {
    static constexpr std::array kTurns = {"off", "clockwise", "counterclockwise"};
    return std::string("spindle ") + kTurns[static_cast<std::size_t>(b.turn)] + " " + std::to_string(b.rpm);
  }
  std::string operator()(const Coolant& b) const {
    static constexpr std::array kKinds = {"off", "flood", "mist", "through tool", "air"};
    return std::string("coolant ") + kKinds[static_cast<std::size_t>(b.kind)];
  }
  std::string operator()(const ToolCall& b) const {
    return "tool " + std::to_string(b.tool) + " offset " + std::to_string(b.length_offset);
  }
  std::string operator()(const LengthCompensation& b) const { return "length " + std::to_string(b.number); }
  std::string operator()(const TcpControl& b) const {
    return b.on ? "tcp on offset " + std::to_string(b.length_offset) : "tcp off";
  }
  std::string operator()(const WorkOffset& b) const { return "work offset " + std::to_string(b.index); }
  std::string operator()(const PathMode& b) const {
    static constexpr std::array kKinds = {"exact path", "exact stop", "continuous"};
    return std::string("path ") + kKinds[static_cast<std::size_t>(b.kind)] + " " +
           std::to_string(b.tolerance);
  }
  std::string operator()(const Retract& b) const {
    AxisWords words;
    words.mask = b.axes;
    return "retract" + text_of(words) + (b.to.mask == 0 ? "" : " | to" + text_of(b.to));
  }
  std::string operator()(const TiltedPlane& b) const {
    std::string out = b.on ? "plane on" : "plane off";
    if (b.direction < 0) out += " other way";
    if (b.follows_part) out += " follows the part";
    for (const auto& triple : {b.origin, b.angles}) {
      for (const auto value : triple) out += " " + std::to_string(value);
    }
    return out;
  }
  std::string operator()(const OffsetShift& b) const {
    std::string out =
        b.kind == OffsetShift::Kind::set ? "set offset " + std::to_string(b.index) : "add offset";
    for (const auto value : b.offset) out += " " + std::to_string(value);
    return out;
  }
  std::string operator()(const VariableMotion& b) const {
    std::string out = (*this)(b.motion) + " | values";
    for (const auto& row : b.coefficient) {
      for (const auto value : row) out.append(" ").append(std::to_string(value));
    }
    return out;
  }
  std::string operator()(const LatchValues& b) const {
    return std::string(b.first ? "first latch " : "latch ") + std::to_string(b.clamp) + " " +
           std::to_string(b.step) + " " + std::to_string(b.dead_band);
  }
  std::string operator()(const RunTimeStep& b) const {
    static constexpr std::array kKinds = {"reset", "read", "reference", "start", "add"};
    return std::string(kKinds[static_cast<std::size_t>(b.kind)]) + " " + std::to_string(b.axis) + " " +
           std::to_string(b.sensor) + " " + std::to_string(b.factor);
  }
  std::string operator()(const Arc& b) const {
    return (b.clockwise ? "clockwise" : "counterclockwise") + text_of(b.words) + " | center " +
           std::to_string(b.center[0]) + " " + std::to_string(b.center[1]) + " | per min " +
           std::to_string(b.feed);
  }
  std::string operator()(const Hole& b) const {
    static constexpr std::array kKinds = {"drill", "peck", "chip break", "feed out", "tap"};
    static constexpr std::array kHands = {"as the spindle", "right", "left"};
    return std::string(kKinds[static_cast<std::size_t>(b.kind)]) + text_of(b.words) + " | clear " +
           std::to_string(b.clear) + " bottom " + std::to_string(b.bottom) + " step " +
           std::to_string(b.step) + " dwell ms " + std::to_string(b.dwell_ms) + " | per min " +
           std::to_string(b.feed) +
           (b.kind == Hole::Kind::tap
                ? " | pitch " + std::to_string(b.thread.pitch) + " rpm " + std::to_string(b.thread.rpm) +
                      " hand " + kHands[static_cast<std::size_t>(b.thread.hand)]
                : "");
  }
  std::string operator()(const AllowedWord& b) const { return "allowed " + b.text; }
  std::string operator()(const CutterCompensation& b) const {
    static constexpr std::array kSides = {"off", "left", "right"};
    return std::string("cutter ") + kSides[static_cast<std::size_t>(b.side)] + " " + std::to_string(b.number);
  }
  std::string operator()(const Probe& b) const {
    return std::string(b.first    ? "first guarded"
                       : b.guards ? "guarded"
                                  : "probe") +
           text_of(b.words) + " | per min " + std::to_string(b.feed);
  }
  std::string operator()(const ProbeLog& b) const {
    static constexpr std::array kKinds = {"declare", "open", "record", "close"};
    return std::string("probe log ") + kKinds[static_cast<std::size_t>(b.kind)] + " " + b.name;
  }
  std::string operator()(const ToolSelect& b) const { return "select tool " + std::to_string(b.tool); }
  std::string operator()(const Clamp& b) const {
    AxisWords axes;
    axes.mask = b.axes;
    return (b.on ? "clamp" : "free") + text_of(axes);
  }
  std::string operator()(const Stop& b) const { return b.optional ? "optional stop" : "stop"; }
};

}  // namespace

std::string to_text(const Block& block) {
  return std::visit(Describe{}, block);
}

bool same(const Block& a, const Block& b) {
  return a.index() == b.index() && to_text(a) == to_text(b);
}

}  // namespace trunnion::nc
