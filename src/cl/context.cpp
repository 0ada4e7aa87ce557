#include "cl/context.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "trunnion/base/lanes.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/cl/arc.hpp"
#include "trunnion/geom/direction.hpp"

#include "cl/words.hpp"

namespace trunnion::cl {

namespace {

// Beyond this the numbers are no rounded unit vector.
constexpr double kWorstLengthError = 1e-2;
// Of one arc: 80 turns of radius 1 m within 1 um. More is a fault of the tolerance, and would fill the
// memory.
constexpr double kMostChords = 250000.0;
// Decimals of a file whose axis components are taken as rounded. Fewer are typed by hand: `0,0,1` and
// `.6,0,.8` are exact.
constexpr unsigned kRoundedDecimals = 3;

// Of a tool axis: the same bits however it is read.
template <class T>
T length_of(const lanes::Triple<T>& v) {
  return lanes::sqrt(lanes::squared(v));
}

}  // namespace

bool same_pose(const Pose& a, const Pose& b) {
  constexpr double kSame = 1e-6;  // mm, and components of axes with seven decimals
  return (a.R - b.R).cwiseAbs().maxCoeff() <= kSame && (a.p - b.p).cwiseAbs().maxCoeff() <= kSame;
}

unsigned decimals_of(std::string_view text) {
  const std::size_t end = text.find_first_of("EeDd");
  const std::string_view mantissa = text.substr(0, end);
  const std::size_t point = mantissa.find('.');
  long places = point == std::string_view::npos ? 0 : static_cast<long>(mantissa.size() - point - 1);
  if (end != std::string_view::npos) {
    const ParsedNumber exponent = parse_number(text.substr(end + 1));
    if (exponent) places -= std::lround(exponent.value);
  }
  return static_cast<unsigned>(std::clamp(places, 0L, 300L));
}

std::string short_text(double value, int digits) {
  std::array<char, 40> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, digits);
  return {text.data(), end.ptr};
}

Context::Context(std::string file, const ReaderOptions& options, Diagnostics& diagnostics)
    : options_(options), findings_(std::move(file), diagnostics) {
  if (options_.units == ReaderOptions::Units::inch) modal.mm_per_unit = kMmPerInch;
  modal.units.word = options_.units.has_value();
}

std::optional<double> Context::number(const Statement& statement, std::size_t index) {
  const std::string word(statement.word);
  const std::string place = "value " + std::to_string(index + 1);
  if (index >= statement.fields.size()) {
    error(statement.where, word + ": " + place + " is missing");
    return std::nullopt;
  }
  const Field& field = statement.fields[index];
  const ParsedNumber parsed = parse_number(field.text);
  const std::string quoted = "'" + std::string(field.text.substr(0, 40)) + "'";
  switch (parsed.fault) {
    case NumberFault::none:
      break;
    case NumberFault::empty:
      error(field.where, word + ": " + place + " is empty");
      return std::nullopt;
    case NumberFault::out_of_range:
      error(field.where, word + ": " + quoted + " is beyond the range of numbers");
      return std::nullopt;
    default:
      error(field.where, word + ": " + quoted + " is not a number");
      return std::nullopt;
  }
  if (field.digits_far_apart) {
    error(field.where, word + ": digits far apart, " + std::string(field.text.substr(0, 40)) +
                           " if they are one number: are the last ones the number of the line? Take such "
                           "numbers out");
    return std::nullopt;
  }
  if (field.blank_inside_number) {
    warning(field.where, word + ": blank inside a number, read as " + std::string(field.text));
  }
  return parsed.value;
}

std::optional<double> Context::positive(const Statement& statement, std::size_t index) {
  const auto value = number(statement, index);
  if (value && !(*value > 0.0)) {
    error(statement.fields[index].where,
          std::string(statement.word) + ": " + shortest_text(*value) + " is not above 0");
    return std::nullopt;
  }
  return value;
}

std::optional<std::uint32_t> Context::whole(const Statement& statement, std::size_t index) {
  const auto value = number(statement, index);
  if (!value) return std::nullopt;
  constexpr double kMost = 4294967295.0;
  if (*value < 0.0 || *value > kMost || *value != std::floor(*value)) {
    error(statement.fields[index].where,
          std::string(statement.word) + ": " + shortest_text(*value) + " is not a whole number from 0 on");
    return std::nullopt;
  }
  return static_cast<std::uint32_t>(*value);
}

bool Context::numbers(const Statement& statement, std::size_t first, std::size_t count, double* out) {
  bool all = true;
  for (std::size_t i = 0; i < count; ++i) {
    const auto value = number(statement, first + i);
    if (value) out[i] = *value;
    all = all && value.has_value();
  }
  return all;
}

bool Context::in_range(const Statement& statement, std::size_t index, double mm) {
  if (std::abs(mm) <= kLongest_mm) return true;
  error(statement.fields[index].where, std::string(statement.word) + ": " + short_text(mm) +
                                           " mm is beyond " + short_text(kLongest_mm) + " mm");
  return false;
}

std::optional<Vec3> Context::point(const Statement& statement, std::size_t first) {
  double value[3];
  if (!numbers(statement, first, 3, value)) return std::nullopt;
  use_unit(statement.where);
  bool good = true;
  for (std::size_t i = 0; i < 3; ++i) {
    value[i] *= modal.mm_per_unit;
    good = in_range(statement, first + i, value[i]) && good;
    count_decimals(decimals_of(statement.fields[first + i].text), 0);
  }
  if (!good) return std::nullopt;
  return Vec3(value[0], value[1], value[2]);
}

std::optional<Vec3> Context::axis(const Statement& statement, std::size_t first) {
  double value[3];
  if (!numbers(statement, first, 3, value)) return std::nullopt;
  const SourceRef where = statement.fields[first].where;
  const std::string word(statement.word);
  for (std::size_t i = 0; i < 3; ++i) count_decimals(0, decimals_of(statement.fields[first + i].text));
  const Vec3 v(value[0], value[1], value[2]);
  const double length = v.stableNorm();
  if (length == 0.0) {
    error(where, word + ": the tool axis (0, 0, 0) has no direction");
    return std::nullopt;
  }
  const double length_error = std::abs(length - 1.0);
  if (length_error > kWorstLengthError) {
    error(where, word + ": the tool axis has length " + short_text(length) + "; 1 within " +
                     short_text(kWorstLengthError) + " is needed");
    return std::nullopt;
  }
  if (length_error > Direction::kMaxLengthError) {
    ++normalised_;
    if (length_error > worst_length_error_) {
      worst_length_error_ = length_error;
      worst_length_at_ = where;
    }
    warning_once("axis length", where,
                 word + ": the tool axis has length " + fixed_text(length, 4) + " and was normalised");
  }
  modal.origin.mill = true;
  modal.axis_unsure = false;
  return Vec3(v / length_of(lanes::Triple<double>{v.x(), v.y(), v.z()}));
}

void Context::count_decimals(unsigned coordinate, unsigned axis_places) {
  if (coordinate > coordinate_decimals_ || resolution_.coordinate_mm == 0.0) {
    coordinate_decimals_ = std::max(coordinate, coordinate_decimals_);
    resolution_.coordinate_mm =
        0.5 * std::pow(10.0, -static_cast<double>(coordinate_decimals_)) * modal.mm_per_unit;
  }
  if (axis_places > axis_decimals_) {
    axis_decimals_ = axis_places;
    if (axis_decimals_ >= kRoundedDecimals) {
      resolution_.axis = 0.5 * std::pow(10.0, -static_cast<double>(axis_decimals_));
    }
  }
}

Motion Context::motion(const Vec3& tip_A, const Vec3& axis_A, const Feed& feed, bool rapid) const {
  if (!modal.turned) return {tip_A, axis_A, feed, rapid};
  return {modal.X_PA * tip_A, modal.X_PA.R * axis_A, feed, rapid};
}

void Context::add_motion(SourceRef where, const Motion& in_A) {
  if (modal.new_msys) settle_msys(in_A.axis_P);
  modal.tip_A = in_A.tip_P;
  modal.axis_A = in_A.axis_P;
  modal.has_position = true;
  Motion made = motion(in_A.tip_P, in_A.axis_P, in_A.feed, in_A.rapid);
  made.step = in_A.step;
  emit(where, made);
  ++motion_count_;
}

void Context::move_to(SourceRef where, const Vec3& tip_A, const Vec3& axis_A) {
  add_motion(where, {tip_A, axis_A, modal.feed, modal.rapid_next});
  modal.rapid_next = false;
}

namespace {

std::optional<ClearPlane> clear_plane_of(const PostWord& word) {
  std::array<double, 4> value{};
  const auto& f = word.fields;
  if (f.size() == 2) {
    const auto distance = parse_number(f[1]);
    const bool named = f[0] == "XYPLAN" || f[0] == "YZPLAN" || f[0] == "ZXPLAN";
    if (!named || !distance) return std::nullopt;
    const Vec3 normal = f[0] == "XYPLAN" ? Vec3::UnitZ() : f[0] == "YZPLAN" ? Vec3::UnitX() : Vec3::UnitY();
    return ClearPlane{normal, distance.value};
  }
  if (f.size() != 4) return std::nullopt;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto number = parse_number(f[i]);
    if (!number) return std::nullopt;
    value[i] = number.value;
  }
  const Vec3 normal(value[0], value[1], value[2]);
  if (!(normal.norm() > 1e-6)) return std::nullopt;
  // a x + b y + c z = d, told from below: the same plane.
  const double side = normal.z() < 0.0 && value[3] < 0.0 ? -1.0 : 1.0;
  return ClearPlane{side * normal.normalized(), side * value[3] / normal.norm()};
}

}  // namespace

PostWord Context::take_clear_plane(PostWord word) {
  modal.clear_plane = clear_plane_of(word);
  if (!modal.clear_plane) return word;
  const Vec3 normal_P = modal.X_PA.R * modal.clear_plane->normal_A;
  const double distance_mm = modal.clear_plane->distance_mm + normal_P.dot(modal.X_PA.p);
  word.fields.clear();
  for (const double value : {normal_P.x(), normal_P.y(), normal_P.z(), distance_mm})
    word.fields.push_back(shortest_text(value));
  return word;
}

void Context::retract(SourceRef where) {
  if (!modal.clear_plane)
    return error(where, "RETRCT: there is no clearance plane (CLEARP) before it, in this frame");
  if (!modal.has_position) return error(where, "RETRCT before any position");
  const double rises = modal.axis_A.dot(modal.clear_plane->normal_A);
  const double missing = modal.clear_plane->distance_mm - modal.tip_A.dot(modal.clear_plane->normal_A);
  // RAPID is for this word, whether it has to move or not: what comes next is a cut.
  modal.rapid_next = false;
  if (missing <= 0.0) return;
  constexpr double kAlong = 1e-3;  // flatter, the tool would travel a thousand times the height
  const Vec3 to = modal.tip_A + modal.axis_A * (missing / std::max(rises, kAlong));
  if (rises <= kAlong || !(to.cwiseAbs().maxCoeff() <= kLongest_mm))
    return error(where, "RETRCT: the tool axis does not lead to the clearance plane");
  add_motion(where, {to, modal.axis_A, modal.feed, true});
}

void Context::refuse_under_cycle(SourceRef where, const std::string& what) {
  if (!modal.cycle) return;
  error(where, what + " while CYCLE is in force: CYCLE/OFF is missing before it");
  modal.cycle.reset();
}

void Context::start_from(SourceRef where, const Vec3& tip_A, const Vec3& axis_A) {
  if (modal.new_msys) settle_msys(axis_A);
  constexpr double kThere_mm = 0.001;  // the last digit of most files
  if (motion_count_ > 0 && (tip_A - modal.tip_A).norm() > kThere_mm)
    warning_once(
        "FROM behind motions", where,
        "FROM names another place than the tool has come to: it moves nothing, the next motion begins "
        "where the tool is");
  else
    modal.tip_A = tip_A;
  modal.axis_A = axis_A;
  modal.has_position = true;
  const From from{modal.X_PA * tip_A, modal.X_PA.R * axis_A};
  modal.home = from;
  emit(where, from);
}

void Context::go_home(SourceRef where) {
  if (!modal.home) return error(where, "GOHOME without values, and no FROM before it says where that is");
  const Pose X_AP = modal.X_PA.inverse();
  modal.rapid_next = true;
  move_to(where, X_AP * modal.home->tip_P, X_AP.R * modal.home->axis_P);
}

void Context::add_arc(SourceRef where, const Vec3& end_A, const Vec3& center_A, const Vec3& normal_A,
                      Angle sweep) {
  Arc arc;
  arc.start_P = modal.X_PA * modal.tip_A;
  arc.end_P = modal.X_PA * end_A;
  arc.center_P = modal.X_PA * center_A;
  arc.normal_P = modal.X_PA.R * normal_A;
  arc.axis_P = modal.X_PA.R * modal.axis_A;
  arc.sweep = sweep;
  arc.feed = modal.feed;
  const bool rapid = modal.rapid_next;
  modal.rapid_next = false;
  if (const double chords = chords_of(arc, options_.arc_tolerance_mm); chords > kMostChords) {
    return error(where, "an arc of " + short_text(chords, 3) + " chords within " +
                            short_text(options_.arc_tolerance_mm, 3) + " mm; at most " +
                            short_text(kMostChords, 7) + " are taken");
  }
  modal.tip_A = end_A;
  const std::vector<Vec3> points_P = linearise(arc, options_.arc_tolerance_mm);
  if (options_.mark_shapes && !rapid)
    emit(where, ShapeBegin{std::make_shared<const Shape>(Shape{.motions = points_P.size(), .what = arc})});
  for (const Vec3& point_P : points_P) {
    emit(where, Motion{point_P, arc.axis_P, arc.feed, rapid});
    ++motion_count_;
  }
}

void Context::take_msys(const PendingMsys& msys) {
  modal.new_msys = msys;
  if (modal.first_msys) settle_msys(modal.axis_A);  // settled with the first one
}

void Context::take_mcs(SourceRef where, const Pose& X_PM) {
  const bool same = same_pose(X_PM, Pose::identity());
  if (!same) {
    note(where, "MCS is applied: the points and tool axes behind it are given in it");
  }
  const Pose X_MA = X_PM.inverse() * modal.X_PA;
  modal.tip_A = X_MA * modal.tip_A;
  modal.axis_A = Vec3::UnitZ();
  modal.axis_unsure = false;
  if (!same_pose(modal.X_PA, X_PM)) modal.clear_plane.reset();  // it was given in the frame before
  modal.X_PA = same ? Pose::identity() : X_PM;
  modal.turned = !same;
  emit(where, Frame{"MCS", std::make_shared<const Pose>(X_PM), !same});
}

// Siemens documents the points of a CLSF as those of the MCS, and so they are taken. Files exist whose points
// are in the absolute system all the same: in them the tool would come from below, while in MSYS it comes
// from above.
void Context::settle_msys(const Vec3& axis_A) {
  constexpr double kUpright =
      0.5;  // cosine: within 60 degrees of straight down or up, a choice without doubt
  const PendingMsys msys = *modal.new_msys;
  modal.new_msys.reset();
  const Pose X_MA = msys.X_AM.inverse();
  const bool first = !modal.first_msys;
  if (first) {
    modal.first_msys = msys.X_AM;
    switch (options_.frames) {
      case ReaderOptions::Frames::ignore:
        modal.points_absolute = false;
        break;
      case ReaderOptions::Frames::apply:
        modal.points_absolute = true;
        break;
      case ReaderOptions::Frames::automatic:
        modal.points_absolute = axis_A.z() < -kUpright && (X_MA.R * axis_A).z() > kUpright;
        break;
    }
    if (modal.points_absolute) {
      modal.X_PA = X_MA;
      modal.turned = true;
      note(msys.where,
           "MSYS is applied: the points are in the absolute system (in it the tool axis points down)");
    } else if (!same_pose(msys.X_AM, Pose::identity())) {
      note(msys.where, "MSYS: the points are taken as given in it");
    }
  } else if (options_.frames != ReaderOptions::Frames::ignore) {
    if (!same_pose(msys.X_AM, *modal.first_msys)) {
      warning_once("MSYS again", msys.where,
                   "this MSYS differs from the program's first one: all points are given in the first");
    }
    if (!modal.points_absolute) {
      // From here on the file counts in this frame: the position and the axis, too.
      const Pose X_PM = modal.first_msys->inverse() * msys.X_AM;
      const Pose X_new_old = X_PM.inverse() * modal.X_PA;
      modal.tip_A = X_new_old * modal.tip_A;
      modal.axis_A = X_new_old.R * modal.axis_A;
      if (!same_pose(modal.X_PA, X_PM)) modal.clear_plane.reset();
      modal.X_PA = X_PM;
      modal.turned = true;
    }
  }
  emit(msys.where, Frame{"MSYS", std::make_shared<const Pose>(msys.X_AM), modal.points_absolute});
}

bool Context::plain_motion(const PlainGoto& plain, Record& record) {
  if (modal.ended || modal.new_msys || modal.pending_arc || modal.nurbs || modal.cycle) return false;
  if (plain.count == 3 && (modal.tilted_csys_axis || modal.axis_unsure)) return false;
  const Vec3 tip_A = Vec3(plain.value[0], plain.value[1], plain.value[2]) * modal.mm_per_unit;
  if (!(tip_A.cwiseAbs().maxCoeff() <= kLongest_mm)) return false;
  if (plain.count == 6) {
    const Vec3 v(plain.value[3], plain.value[4], plain.value[5]);
    const double length = length_of(lanes::Triple<double>{v.x(), v.y(), v.z()});
    if (!(std::abs(length - 1.0) <= Direction::kMaxLengthError)) return false;
    modal.axis_A = v / length;
    modal.axis_unsure = false;
    modal.origin.mill = true;
  }
  use_unit(plain.where);
  count_decimals(plain.coordinate_decimals, plain.axis_decimals);
  modal.tip_A = tip_A;
  modal.has_position = true;
  record.where = plain.where;
  if (auto* held = std::get_if<Motion>(&record.data)) {
    *held = motion(tip_A, modal.axis_A, modal.feed, modal.rapid_next);
  } else {
    record.data = motion(tip_A, modal.axis_A, modal.feed, modal.rapid_next);
  }
  modal.rapid_next = false;
  ++motion_count_;
  return true;
}

// As plain_motion, two side by side.
std::size_t Context::plain_cuts(std::span<PlainCut> cuts) {
  std::size_t good = 0;
  for (bool go_on = true; go_on && good < cuts.size();) {
    const bool two = good + 1 < cuts.size();
    PlainCut& a = cuts[good];
    PlainCut& b = cuts[two ? good + 1 : good];
    const auto tip = modal.mm_per_unit * lanes::side_by_side(a.tip_P, b.tip_P);
    const auto axis = lanes::side_by_side(a.axis_P, b.axis_P);
    const Lanes length = length_of(axis);
    const LaneMask plain = (lanes::abs(Lanes(length - 1.0)) <= Direction::kMaxLengthError) &
                           (lanes::abs(tip.x) <= kLongest_mm) & (lanes::abs(tip.y) <= kLongest_mm) &
                           (lanes::abs(tip.z) <= kLongest_mm);
    const lanes::Triple<Lanes> unit{axis.x / length, axis.y / length, axis.z / length};
    const auto put = [&](PlainCut& cut, int lane) {
      cut.tip_P = {tip.x[lane], tip.y[lane], tip.z[lane]};
      cut.axis_P = {unit.x[lane], unit.y[lane], unit.z[lane]};
      ++good;
    };
    if (plain[0] != 0) put(a, 0);
    go_on = two && plain[0] != 0 && plain[1] != 0;
    if (go_on) put(b, 1);
  }
  if (good > 0) {
    modal.tip_A = cuts[good - 1].tip_P;
    modal.axis_A = cuts[good - 1].axis_P;
    modal.has_position = true;
    modal.axis_unsure = false;
    modal.origin.mill = true;
    use_unit(cuts.front().where);
    motion_count_ += good;
  }
  return good;
}

void Context::begin_operation(SourceRef where, std::string_view tool) {
  end_operation();  // where no word has said so
  named_tool_.of_operation = tool;
  named_tool_.where = where;
}

// A control mills with the tool that it has: a name brings no other into the spindle.
void Context::end_operation() {
  NamedTool& tool = named_tool_;
  const bool moved = motion_count_ > std::exchange(tool.motions_before, motion_count_);
  if (!moved || tool.of_operation.empty()) return;
  if (!tool.loaded && !tool.in_spindle.empty() && tool.of_operation != tool.in_spindle) {
    error(tool.where, "the operation is made with tool " + shown_text(tool.of_operation) +
                          ", the one before with " + shown_text(tool.in_spindle) +
                          ", and nothing loads it (LOAD/TOOL,n): write one program for each tool, or let the "
                          "CAM system write its tool changes");
  }
  tool.in_spindle = std::exchange(tool.of_operation, {});
  tool.loaded = false;
}

bool Context::take(Record& record) {
  if (pending_.empty()) return false;
  record = std::move(pending_.front());
  pending_.pop_front();
  return true;
}

void Context::tell_unloaded() {
  const auto unloaded = std::exchange(modal.said.unloaded, std::nullopt);
  if (!unloaded || unloaded->behind == motion_count_) return;
  warning(unloaded->where,
          "UNLOAD is not acted on, and motions follow before another tool is loaded: they are made with the "
          "tool that is in the spindle");
}

void Context::finish(std::size_t lines, std::string_view last_number) {
  if (modal.pending_arc)
    error(modal.pending_arc->where,
          std::string(modal.pending_arc->word) + ": the end (GOTO) of the arc is missing");
  if (gave_up_) return findings_.tell_counts();
  if (normalised_ > 1) {
    note(worst_length_at_, std::to_string(normalised_) +
                               " tool axes were normalised; the length of this one is off by most, " +
                               short_text(worst_length_error_, 3));
  }
  const SourceRef end{static_cast<std::uint32_t>(std::max<std::size_t>(lines, 1)), 0};
  if (!modal.ended && !findings_.has_errors()) {
    const std::string without = modal.closing.empty() ? "" : " without " + std::string(modal.closing);
    const unsigned written = std::min(coordinate_decimals_, axis_decimals_ > 0 ? axis_decimals_ : ~0U);
    if (!last_number.empty() && decimals_of(last_number) < written) {
      error(end, "the file ends" + without + " in a line without an end, and its last number, " +
                     std::string(last_number) +
                     ", has fewer decimals than others: it is cut off, or end the line");
    } else if (const bool bare = modal.said.tool == 0 && modal.said.rpm == 0.0;
               !last_number.empty() && !bare) {
      // Files of points alone end as they like; one with a tool ends with FINI.
      warning(end, "the file ends" + without + " in a line without an end: is its last number, " +
                       std::string(last_number) + ", whole?");
    } else if (!without.empty()) {
      warning(end, "the file ends" + without + ": is it whole?");
    }
  }
  end_operation();
  tell_unloaded();
  if (motion_count_ == 0 && !findings_.has_errors()) error(end, "no motion (GOTO) in the file");
  judge_units();
  findings_.tell_counts();
}

void Context::take_feed_unit(std::string_view unit, SourceRef where) {
  if (unit.starts_with("MM")) {
    modal.units.mm = true;
  } else if (unit.starts_with("IP") || unit.starts_with("FP")) {
    if (!modal.units.inch && !modal.units.word) modal.units.inch = where;
  } else if (unit.starts_with("PER")) {
    use_unit(where);
  }
}

// NX writes no UNITS: its feeds tell the unit of its lengths.
void Context::judge_units() {
  const UnitSigns& signs = modal.units;
  if (signs.word || motion_count_ == 0) return;
  if (signs.inch) {
    error(*signs.inch,
          "a feed in inches, and no UNITS before the points: are they in inches or mm? (--cl-units inch or "
          "mm)");
  } else if (!signs.mm && !findings_.has_errors()) {
    note({}, "nothing in the file says its unit of length: taken as mm (--cl-units mm or inch)");
  }
}

}  // namespace trunnion::cl
