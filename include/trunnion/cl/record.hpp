#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "trunnion/base/source_ref.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/geom/pose.hpp"

/// What a CL file says, record by record, after units, modal words and frames have been resolved: lengths in
/// mm, everything in the part frame P, feeds in mm/s, mm/rev or 1/s.
namespace trunnion::cl {

enum class FeedMode : std::uint8_t { none, per_minute, per_revolution, inverse };

/// The modal feed of a motion. `none`: the file has not given one yet.
struct Feed {
  FeedMode mode = FeedMode::none;
  double value =
      0.0;  // mm/s (per_minute), mm per revolution (per_revolution), 1/s (inverse); > 0 unless mode is none
  bool operator==(const Feed&) const = default;
};

/// A straight motion of the tip to `tip_P`, at the end of which the tool axis is `axis_P`.
struct Motion {
  Vec3 tip_P = Vec3::Zero();
  Vec3 axis_P = Vec3::UnitZ();  // unit, from the tip to the spindle
  Feed feed;
  bool rapid = false;
  /// Within a hole that is drilled in steps, before its bottom is reached: between them the tool stays in it
  /// (chips are broken), or leaves it (and takes them out).
  enum class Step : std::uint8_t { none, stays, leaves };
  Step step = Step::none;
  /// One of the equal parts into which a path stage (post/path_stages) has divided a motion of the text.
  struct Part {
    double share = 1.0;        // of the time that the motion is given; 1: the motion is whole
    bool ends_inside = false;  // not where the motion of the text ends
    bool operator==(const Part&) const = default;
  };
  Part part{};
};

/// A straight motion at the modal feed, no rapid.
struct PlainCut {
  Vec3 tip_P = Vec3::Zero();
  Vec3 axis_P = Vec3::UnitZ();  // unit, from the tip to the spindle
  SourceRef where;
};

/// FROM: where the tool stands at the start; no motion is asked for.
struct From {
  Vec3 tip_P = Vec3::Zero();
  Vec3 axis_P = Vec3::UnitZ();
};

/// A circular motion from `start_P` (the tip before it) to `end_P`, the tool axis held. It turns by `sweep`
/// (> 0) about `normal_P` by the right-hand rule. `end_P` may lie off the plane through the start: then the
/// arc is a helix, uniform in its angle.
struct Arc {
  Vec3 start_P = Vec3::Zero();
  Vec3 end_P = Vec3::Zero();
  Vec3 center_P = Vec3::Zero();
  Vec3 normal_P = Vec3::UnitZ();  // unit
  Vec3 axis_P = Vec3::UnitZ();    // unit
  Angle sweep;
  Feed feed;
};

/// A hole along the tool axis. Heights are above the point at which it begins.
struct Hole {
  enum class Kind : std::uint8_t { drill, peck, chip_break, feed_out, tap };
  Kind kind = Kind::drill;
  Vec3 top_P = Vec3::Zero();    // where it begins
  Vec3 axis_P = Vec3::UnitZ();  // unit, out of the hole
  double depth_mm = 0.0;
  double clear_mm = 0.0;  // where the feed begins
  double leave_mm = 0.0;  // to which the tool returns, >= clear_mm
  double step_mm = 0.0;   // of `peck` and `chip_break`
  double first_step_mm = 0.0;
  double dwell_s = 0.0;
  Feed feed;
  bool across = false;  // the first of the motions is the rapid to above it
};

/// The next `motions` motions (and dwells between them) are this arc or this hole
/// (ReaderOptions::mark_shapes). A tap is always told of: its motions alone are no thread.
struct Shape {
  std::size_t motions = 0;
  std::size_t added = 0;  // further ones among them, of path stages (Motion::part)
  std::variant<Arc, Hole> what;

  std::size_t all_motions() const { return motions + added; }
};
struct ShapeBegin {
  std::shared_ptr<const Shape> shape;  // never null
};

struct Spindle {
  enum class State : std::uint8_t { on, off, orient };
  State state = State::on;
  /// Nothing: as before (SPINDL/ON after SPINDL/OFF).
  std::optional<double> speed_rpm;
  std::optional<double> surface_speed_mm_s;
  std::optional<double> max_rpm;
  bool counterclockwise = false;
};

struct Coolant {
  enum class Kind : std::uint8_t { off, on, flood, mist, tap, through, air };
  Kind kind = Kind::on;
};

/// LOADTL/n, LOAD/TOOL,n and TURRET/n: this tool goes into the spindle now.
struct ToolChange {
  std::uint32_t number = 0;
  std::optional<std::uint32_t> length_register;  // ADJUST, OSETNO
  std::optional<double> gauge_length_mm{};       // LENGTH: from the spindle gauge point to the tip
};
/// SELECT/TOOL,n: the next tool, to be made ready.
struct ToolSelect {
  std::uint32_t number = 0;
};

/// SET/OFSETL,n (a fixture's offset): work offset 1 (G54), 2, ...
struct WorkOffset {
  std::uint32_t index = 1;
};

/// CUTTER and TLDATA. Values that the file does not give are empty.
struct ToolGeometry {
  std::optional<double> diameter_mm;
  std::optional<double> corner_radius_mm;
  std::optional<double> length_mm;
  std::optional<double> flute_length_mm{};  // height h of CUTTER's seven numbers
};

/// CUTCOM, where the points are those of the tool's centre and the control is to add the wear that stands in
/// its register (ReaderOptions::CutterCompensation::wear). The motions are as the file gives them.
struct CutterCompensation {
  enum class Side : std::uint8_t {
    off,
    left,
    right
  };  // of the contour, seen along the motion from the spindle
  Side side = Side::off;
  std::optional<std::uint32_t> wear_register;  // nothing: the tool's number
};

/// DELAY/t: the tool stands still.
struct Dwell {
  double seconds = 0.0;
  std::optional<double> revolutions;  // when given, `seconds` is 0
};

struct Stop {
  bool optional = false;  // OPSTOP
};

/// A word whose rest of line is text: PARTNO, PPRINT, INSERT ... `text` without the separator, otherwise as
/// it stands.
struct Text {
  enum class Kind : std::uint8_t { part_name, print, insert, other };
  Kind kind = Kind::other;
  std::string text;
};

/// TOOL PATH/name,... of NX, or a CATIA operation comment.
struct OperationBegin {
  std::string name;
};
struct OperationEnd {};

/// LINTOL: what the file demands of the linearisation.
struct Tolerance {
  enum class Applies : std::uint8_t { feed, rapid, axis };
  Applies applies = Applies::feed;
  bool on = true;
  std::optional<double> value_mm;    // feed, rapid
  std::optional<double> axis_angle;  // axis, rad
};

/// A coordinate system that the file names. `X_AP`: pose of the frame P (in which all motions are given) in
/// the file's absolute system A when `applied`; otherwise the frame as the file gives it, which did not
/// change the coordinates.
struct Frame {
  std::string word;  // MSYS, CSYS, CATIA0
  std::shared_ptr<const Pose> pose;
  bool applied = false;
};

/// A word for the post-processor with its fields as they stand (upper case, no blanks): ROTABL, LIMITS and
/// such.
struct PostWord {
  std::string word;
  std::vector<std::string> fields;
};

struct End {};

/// One thing that the file says. Motions come first in the variant: they are nearly all of a file.
struct Record {
  SourceRef where;  // of the major word
  std::variant<Motion, From, Spindle, Coolant, ToolChange, ToolSelect, WorkOffset, ToolGeometry,
               CutterCompensation, Dwell, Stop, Text, OperationBegin, OperationEnd, Tolerance, Frame,
               PostWord, ShapeBegin, End>
      data;
};

}  // namespace trunnion::cl
