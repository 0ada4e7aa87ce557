// Drilling cycles, expanded to motions. A GOTO under a cycle is the point where the hole begins; all
// distances count from it along the tool axis:
//   DEPTH, FEDTO   to the bottom. Systems differ in the sign (NX -33, SolidWorks 2.75); a hole only goes
//   down: its size counts. CLEAR, RAPTO   where the feed begins, above. RETURN, RTRCTO where the tool is
//   taken after the hole, above: at least CLEAR. AUTO: as high as it came.
// Values without a word for them, three orders:
//   depth, unit, feed, clearance     ISO 4343
//   depth, feed, unit, clearance     APT 360, SURFCAM
//   depth, clearance [, feed, unit]  CATIA: documented nowhere that we know. Taken where the tool stands at
//   that
//                                    clearance above the first hole, else refused.
// In the files of Fusion and HSMWorks (MODE/MILL) the GOTO is the bottom of the hole, and the clearance an
// absolute height: refused.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"

#include "cl/words.hpp"

namespace trunnion::cl {

namespace {

// Between two pecks the rapid ends this far above the last bottom. More only cuts air.
constexpr double kPeckGap_mm = 1.0;
// A rapid to where the tool stands already, to the digits of a CL file, is none.
constexpr double kSamePlace_mm = 1e-3;
constexpr double kSameCycleAxis = 1e-6;
// Tool axes of two holes that differ by more than the rounding of their components: chord of unit vectors.
constexpr double kTurned = 1e-3;
constexpr std::size_t kMostPecks = 10000;

// Not by the first character: 1STPECK is a word.
bool is_number(std::string_view text) {
  return static_cast<bool>(parse_number(text));
}

/// The fields of one CYCLE statement, one after the other.
class CycleReading {
 public:
  CycleReading(Context& context, const Statement& statement) : context_(context), statement_(statement) {}

  bool read(Cycle& cycle) {
    read_kind(cycle);
    while (good_ && at_ < statement_.fields.size()) {
      if (is_number(field().text)) {
        read_positional(cycle);
      } else {
        read_couplet(cycle);
      }
    }
    return good_ && complete(cycle);
  }

 private:
  const Field& field() const { return statement_.fields[at_]; }
  void fail(SourceRef where, const std::string& message) {
    context_.error(where, "CYCLE: " + message);
    good_ = false;
  }

  void read_kind(Cycle& cycle) {
    const std::string_view kind = field().text;
    if (kind == "DRILL" || kind == "FACE" || kind == "THRU" || kind == "CSINK") {
      cycle.kind = Cycle::Kind::drill;
    } else if (kind == "DEEP" || kind == "DEEP2") {
      cycle.kind = Cycle::Kind::peck;
    } else if (kind == "BRKCHP") {
      cycle.kind = Cycle::Kind::chip_break;  // a hole with full retracts is the same hole
    } else if (kind == "REAM" || kind == "BORE") {
      cycle.kind = Cycle::Kind::feed_out;  // no mark of the tool's edge
    } else if (kind == "TAP") {
      cycle.kind = Cycle::Kind::tap;
    } else {
      return fail(field().where, std::string(kind.substr(0, 40)) +
                                     " changes the geometry and is not understood by this program");
    }
    ++at_;
    if (kind == "DRILL" && at_ < statement_.fields.size() &&
        (field().text == "DEEP" || field().text == "BRKCHP")) {
      cycle.kind = field().text == "BRKCHP" ? Cycle::Kind::chip_break : Cycle::Kind::peck;
      ++at_;
    }
  }

  std::optional<double> value() {
    const auto number = context_.number(statement_, at_);
    ++at_;
    if (!number) good_ = false;
    return number;
  }
  void length(double& target) {
    const auto number = value();
    context_.use_unit(statement_.where);
    if (number) target = *number * context_.modal.mm_per_unit;
  }

  bool unit_follows() const {
    return at_ + 1 < statement_.fields.size() &&
           feed_unit_factor(statement_.fields[at_ + 1].text, context_.modal.mm_per_unit).has_value();
  }
  void read_feed(Cycle& cycle, std::size_t value_at, std::size_t unit_at) {
    const std::string_view word = statement_.fields[unit_at].text;
    const auto unit = *feed_unit_factor(word, context_.modal.mm_per_unit);
    context_.take_feed_unit(word, statement_.fields[unit_at].where);
    const auto number = context_.positive(statement_, value_at);
    if (number) {
      cycle.own_feed = Feed{unit.first, *number * unit.second};
    } else {
      good_ = false;
    }
    at_ = std::max(value_at, unit_at) + 1;
  }

  void read_positional(Cycle& cycle) {
    const SourceRef where = field().where;
    if (context_.modal.origin.fusion) {
      fail(where,
           "values without words, as Fusion and HSMWorks write them: their GOTO is the bottom of the hole, "
           "and "
           "their clearance a height in a system that the file does not give (in the CAM system's post: let "
           "onCyclePoint call expandCyclePoint)");
    } else if (!cycle.has_depth) {
      length(cycle.depth_mm);
      cycle.has_depth = true;
    } else if (!cycle.own_feed && unit_follows()) {
      read_feed(cycle, at_, at_ + 1);
    } else if (!cycle.has_clear) {
      cycle.clear_by_place = !cycle.own_feed;
      length(cycle.clear_mm);
      cycle.has_clear = true;
      positional_clear_ = true;
    } else {
      fail(where, "a value without a word for it");
    }
  }

  void read_couplet(Cycle& cycle) {
    const std::string word(field().text);
    const SourceRef where = field().where;
    ++at_;
    if (std::find(couplets_.begin(), couplets_.end(), word) != couplets_.end())
      return fail(where, word + " stands twice");
    couplets_.push_back(word);
    if (word == "DEPTH" || word == "FEDTO") {
      const std::optional<double> before_mm = cycle.has_depth ? std::optional(cycle.depth_mm) : std::nullopt;
      length(cycle.depth_mm);
      cycle.has_depth = true;
      if (before_mm && std::abs(*before_mm) != std::abs(cycle.depth_mm))
        fail(where, "two depths, " + word + " is the second");
    } else if (word == "CLEAR" || word == "RAPTO") {
      if (positional_clear_) return fail(where, word + " behind a clearance without a word");
      double clear_mm = 0.0;
      length(clear_mm);
      if (word == "RAPTO" || !cycle.has_rapto) cycle.clear_mm = clear_mm;
      cycle.has_rapto = cycle.has_rapto || word == "RAPTO";
      cycle.has_clear = true;
    } else if (word == "RETURN" || word == "RTRCTO") {
      const bool as_came = cycle.return_as_came, is_second = std::exchange(has_return_, true);
      const double before_mm = cycle.return_mm;
      cycle.return_as_came = at_ < statement_.fields.size() && field().text == "AUTO";
      if (cycle.return_as_came) {
        ++at_;
      } else {
        length(cycle.return_mm);
      }
      // One of them may be a height in the part, as in Autodesk's post of APT for MANUS.
      if (is_second && (as_came != cycle.return_as_came || before_mm != cycle.return_mm))
        fail(where, "two ways to return, " + word + " is the second: which of them counts?");
    } else if (word == "STEP" || word == "SUBPECK" || word == "INCR") {
      length(cycle.step_mm);
    } else if (word == "1STPECK") {
      length(cycle.first_step_mm);
    } else if (word == "DWELL") {
      const auto number = value();
      if (number) cycle.dwell_s = *number;
    } else if (feed_unit_factor(word, context_.modal.mm_per_unit)) {
      if (cycle.own_feed) return fail(where, "a second feed, " + word);
      read_feed(cycle, at_, at_ - 1);
    } else if (!word.empty()) {
      fail(where, "'" + word.substr(0, 40) + "' is not understood");
    }
  }

  bool complete(Cycle& cycle) {
    cycle.depth_mm = std::abs(cycle.depth_mm);
    if (!cycle.has_depth) {
      fail(statement_.where, "no depth (DEPTH or FEDTO)");
    } else if (!cycle.has_clear) {
      fail(statement_.where,
           "no clearance (CLEAR or RAPTO): the tool would go at rapid rate down to the part's surface, and "
           "across it to the next hole");
    }
    if (cycle.clear_mm < 0.0 || cycle.return_mm < 0.0 || cycle.step_mm < 0.0 || cycle.first_step_mm < 0.0 ||
        cycle.dwell_s < 0.0) {
      fail(statement_.where, "a clearance, return, step or dwell below 0");
    }
    const double longest = std::max({cycle.depth_mm, cycle.clear_mm, cycle.return_mm});
    if (!(longest <= Context::kLongest_mm))
      fail(statement_.where, "a distance beyond " + short_text(Context::kLongest_mm) + " mm");
    if (cycle.kind == Cycle::Kind::tap) check_tap(cycle);
    const bool in_steps = cycle.step_mm > 0.0 || cycle.first_step_mm > 0.0;
    if (in_steps && cycle.kind == Cycle::Kind::feed_out)
      fail(statement_.where, "steps of a hole that is reamed or bored are not understood by this program");
    if (in_steps && cycle.kind == Cycle::Kind::drill) {
      context_.warning_once("CYCLE steps", statement_.where,
                            "CYCLE: steps are given: the hole is drilled in pecks, as with DRILL,DEEP");
      cycle.kind = Cycle::Kind::peck;
    }
    if (cycle.in_pecks()) {
      if (cycle.step_mm == 0.0) cycle.step_mm = cycle.first_step_mm;
      if (cycle.first_step_mm == 0.0) cycle.first_step_mm = cycle.step_mm;
      if (cycle.step_mm == 0.0) {
        context_.warning(statement_.where, "CYCLE: no step is given: each hole is drilled in one go");
        cycle.kind = Cycle::Kind::drill;
      } else if (cycle.depth_mm / cycle.step_mm > static_cast<double>(kMostPecks)) {
        fail(statement_.where, "more than " + std::to_string(kMostPecks) + " pecks");
      }
    }
    return good_;
  }

  // Its feed is the pitch, or the pitch times the speed of the spindle: that of the cuts before it is
  // neither.
  void check_tap(Cycle& cycle) {
    if (!cycle.own_feed && context_.modal.feed.mode == FeedMode::per_revolution)
      cycle.own_feed = context_.modal.feed;
    if (!cycle.own_feed)
      fail(statement_.where,
           "TAP without a pitch: a feed per revolution (MMPR, IPR), or per minute behind SPINDL, in the "
           "statement");
    if (cycle.step_mm > 0.0 || cycle.first_step_mm > 0.0)
      fail(statement_.where, "TAP in steps is not understood by this program");
    if (cycle.dwell_s > 0.0)
      fail(statement_.where,
           "TAP with a dwell is not understood by this program: the spindle is geared to the feed");
  }

  Context& context_;
  const Statement& statement_;
  std::size_t at_ = 0;
  bool good_ = true;
  bool positional_clear_ = false;
  bool has_return_ = false;
  std::vector<std::string> couplets_;  // words so far
};

void read_cycle(Context& context, const Statement& statement) {
  const std::string_view first = statement.has_fields() ? statement.fields[0].text : std::string_view{};
  if (first == "OFF") {
    context.modal.cycle.reset();
  } else if (first == "ON") {
    if (!context.modal.last_cycle)
      return context.error(statement.where, "CYCLE/ON: there is no cycle before it");
    context.modal.cycle = context.modal.last_cycle;
  } else if (first.empty()) {
    context.error(statement.where, "CYCLE: no kind");
  } else if (first != "INIT") {
    Cycle cycle;
    if (!CycleReading(context, statement).read(cycle)) return;
    context.modal.cycle = cycle;
    context.modal.last_cycle = cycle;
  }
}

constexpr WordReading kCycleWords[] = {{"CYCLE", read_cycle}};

}  // namespace

std::span<const WordReading> cycle_words() {
  return kCycleWords;
}

namespace {

/// One hole under the modal cycle.
class Drilling {
 public:
  Drilling(Context& context, SourceRef where, const Vec3& tip_A, const Vec3& axis_A)
      : context_(context),
        modal_(context.modal),
        cycle_(*context.modal.cycle),
        where_(where),
        tip_A_(tip_A),
        axis_A_(axis_A),
        feed_(cycle_.own_feed.value_or(modal_.feed)),
        leave_(std::max(cycle_.return_mm, cycle_.clear_mm)) {}

  void run() {
    if (std::exchange(modal_.rapid_next, false))
      context_.warning_once("rapid under cycle", where_,
                            "RAPID under CYCLE: its GOTO is a hole, too. If the tool only travels there, "
                            "CYCLE/OFF must stand before it");
    if (!clear_is_proved() || !keeps_pitch()) return;
    // As a control's own cycle: up to the return height, across, and down to where the feed begins.
    double came = leave_;
    if (modal_.has_position && (axis_A_ - modal_.axis_A).norm() > kTurned) {
      // Heights above two holes whose axes differ have nothing to do with one another, and the part may stand
      // between them.
      context_.emit(where_, PostWord{"RETRCT", {}});
    } else if (modal_.has_position) {
      const double height = axis_A_.dot(modal_.tip_A - tip_A_);
      came = std::max(leave_, height);
      // A tool that was changed is not there: it comes from where that was done, over this hole.
      if (height < leave_ && !context_.comes_from_change())
        rapid_to(modal_.tip_A + modal_.axis_A * (leave_ - height), modal_.axis_A);
    }
    if (cycle_.return_as_came) leave_ = came;
    begin_shape();
    const std::size_t before = context_.motion_count();
    rapid_to(at(came), axis_A_);
    const bool across = context_.motion_count() > before;
    if (came > cycle_.clear_mm) rapid_to(at(cycle_.clear_mm), axis_A_);
    drill();
    if (cycle_.dwell_s > 0.0) context_.emit(where_, Dwell{cycle_.dwell_s, std::nullopt});
    if (cycle_.kind == Cycle::Kind::feed_out || cycle_.kind == Cycle::Kind::tap) feed_to(cycle_.clear_mm);
    rapid_to(at(leave_), axis_A_);
    end_shape(across, context_.motion_count() - before);
  }

 private:
  // One tap cuts one pitch.
  bool keeps_pitch() {
    const double rpm = modal_.said.rpm;
    if (cycle_.kind != Cycle::Kind::tap || feed_.mode != FeedMode::per_minute || !(rpm > 0.0)) return true;
    constexpr double kSamePitch_mm = 2e-3;  // speeds and feeds are rounded
    const double pitch_mm = feed_.value * kSecondsPerMinute / rpm;
    const double before_mm = modal_.cycle->pitch_mm;
    if (before_mm > 0.0 && std::abs(pitch_mm - before_mm) > kSamePitch_mm) {
      context_.error(where_, "CYCLE/TAP: a feed of " + short_text(feed_.value * kSecondsPerMinute) +
                                 " mm/min at " + short_text(rpm) + " rpm is a pitch of " +
                                 short_text(pitch_mm) + " mm, and the hole before was cut with " +
                                 short_text(before_mm) +
                                 " mm: the speed has changed, and the feed of the cycle with it must");
      return false;
    }
    modal_.cycle->pitch_mm = pitch_mm;
    if (modal_.last_cycle) modal_.last_cycle->pitch_mm = pitch_mm;
    return true;
  }
  bool clear_is_proved() {
    constexpr double kSameHeight_mm = 5e-3;  // three decimals
    if (!cycle_.clear_by_place) return true;
    const Vec3 away = modal_.tip_A - tip_A_;
    const bool stands_there =
        modal_.has_position && (away - axis_A_ * cycle_.clear_mm).norm() <= kSameHeight_mm;
    if (!stands_there) {
      context_.error(where_,
                     "CYCLE: is the value behind its depth, " + short_text(cycle_.clear_mm) +
                         " mm, the clearance? The tool does not stand there above this hole (words are "
                         "needed: DEPTH, CLEAR)");
    }
    modal_.cycle->clear_by_place = false;
    if (modal_.last_cycle) modal_.last_cycle->clear_by_place = false;
    return stands_there;
  }
  Vec3 at(double height) const { return tip_A_ + axis_A_ * height; }
  void rapid_to(const Vec3& point, const Vec3& axis, bool step = false) {
    if (modal_.has_position && !context_.comes_from_change() &&
        (point - modal_.tip_A).norm() < kSamePlace_mm && (axis - modal_.axis_A).norm() < kSameCycleAxis)
      return;
    context_.add_motion(where_, {point, axis, feed_, true, step_of(step)});
  }
  void feed_to(double height, bool step = false) {
    context_.add_motion(where_, {at(height), axis_A_, feed_, false, step_of(step)});
  }
  Motion::Step step_of(bool is_step) const {
    if (!is_step) return Motion::Step::none;
    return cycle_.kind == Cycle::Kind::peck ? Motion::Step::leaves : Motion::Step::stays;
  }
  void drill() {
    const double clear = cycle_.clear_mm;
    if (cycle_.in_pecks()) {
      double bottom = std::min(cycle_.first_step_mm, cycle_.depth_mm);
      feed_to(-bottom, bottom < cycle_.depth_mm);
      while (bottom < cycle_.depth_mm) {
        rapid_to(at(clear), axis_A_, true);
        rapid_to(at(std::min(clear, kPeckGap_mm - bottom)), axis_A_, true);
        bottom = std::min(bottom + cycle_.step_mm, cycle_.depth_mm);
        feed_to(-bottom, bottom < cycle_.depth_mm);
      }
    } else {
      feed_to(-cycle_.depth_mm);
    }
  }
  // It is filled in before anybody can take the record.
  void begin_shape() {
    if (!context_.options().mark_shapes && cycle_.kind != Cycle::Kind::tap) return;
    shape_ = std::make_shared<Shape>();
    context_.emit(where_, ShapeBegin{shape_});
  }
  void end_shape(bool across, std::size_t motions) {
    if (!shape_) return;
    Hole hole = static_cast<const Hole&>(cycle_);
    hole.top_P = modal_.X_PA * tip_A_;
    hole.axis_P = modal_.X_PA.R * axis_A_;
    hole.leave_mm = leave_;
    hole.feed = feed_;
    hole.across = across;
    *shape_ = Shape{.motions = motions, .what = hole};
  }

  Context& context_;
  Modal& modal_;
  const Cycle cycle_;
  SourceRef where_;
  Vec3 tip_A_, axis_A_;
  Feed feed_;
  double leave_;
  std::shared_ptr<Shape> shape_;
};

}  // namespace

void drill_hole(Context& context, SourceRef where, const Vec3& tip_A, const Vec3& axis_A) {
  Drilling(context, where, tip_A, axis_A).run();
}

}  // namespace trunnion::cl
