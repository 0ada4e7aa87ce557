#pragma once
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "trunnion/effects/course_errors.hpp"
#include "trunnion/effects/model.hpp"
#include "trunnion/machine/error_kinematics.hpp"
#include "trunnion/nc/blocks.hpp"
#include "trunnion/path/certificate.hpp"
#include "trunnion/path/error_course.hpp"
#include "trunnion/path/flute.hpp"
#include "trunnion/path/station_run.hpp"

#include "post/offset_tracker.hpp"
#include "post/program_state.hpp"

namespace trunnion::post {

/// The end of a motion block as it was read.
struct BlockEnd {
  JointVector q;
  std::uint32_t nc_line = 0;
  bool rapid = false;
  nc::FeedMode feed_mode = nc::FeedMode::per_minute;
  std::int64_t feed = 0;  // quanta
  bool tcp =
      false;  // reached under tool-centre-point control: the control moves the tip on a straight line in P
  Vec3 word_tip_P = Vec3::Zero();  // under it: X Y Z as the words have them
  bool from_unknown = false;       // the position before it is not known
  bool in_cycle = false;           // a stroke of a drilling cycle
  bool to_bottom = false;          // the last one that goes as deep as any of them
  bool up = false;                 // at the safe height, on the way between two cuts
  float off_chord_mm = 0.0F;       // by which the block itself may leave the straight way to here: an arc
};

/// A position of the program, evaluated.
struct Vertex : BlockEnd, ToolPose {
  path::Station station;  // of q on the nominal machine, where bounds are proved
  ChainErrors errors;     // of the machine at q, where it is verified on one with errors
  bool placed = false;    // found on the CL path, where the verifier stands: Place::off_tip_mm is of it
};

/// A point of the CL path.
struct Target {
  Vec3 tip_P = Vec3::Zero();
  Vec3 axis_P = Vec3::UnitZ();
  std::uint32_t line = 0;
  bool rapid = false;
  cl::Motion::Step step = cl::Motion::Step::none;
  bool ends_cut = false;  // a rapid, another tool or a turned table comes behind it
  double along_mm = 0.0;  // way of the tip from the start of the file, from point to point
  double way_mm = 0.0;    // of it from the point before
  double turn = 0.0;      // of the tool axis from there, rad
  bool in_cone = false;   // of the pole, where one has a tolerance of its own
  double flute_mm = 0.0;  // of the tool that the way to it is cut with
};

/// Weight of the tool axis beside the tip when a position is matched to a place of the CL path, mm per rad:
/// about a tool's length, so that a turn about the tip counts as much as the motion of the holder.
inline constexpr double kAxisWeight_mm = 50.0;
/// The same where a block passes a CL point: the tip decides which place is nearest, and where it stands
/// still the tool axis. A heavier axis would pull the place along the path, away from where the tip is
/// nearest.
inline constexpr double kAxisBesideTip_mm = 1.0;

/// The angle between unit vectors whose difference has this square, rad: 2 arcsin(c / 2), the first term left
/// out below 1e-12 of it. For squares below kSmallChord2.
inline constexpr double kSmallChord2 = 1e-3;
template <class T>
T turn_of_chord(const T& chord2) {
  return lanes::sqrt(chord2) * (1.0 + chord2 * (1.0 / 24.0 + chord2 * (3.0 / 640.0)));
}

/// angle_between for unit vectors, rad; mostly they are near each other. `chord2`: the square of their
/// difference.
inline double turn_between(const Vec3& u, const Vec3& v, double chord2) {
  return chord2 < kSmallChord2 ? turn_of_chord(chord2) : angle_between(u, v).rad();
}
inline double turn_between(const Vec3& u, const Vec3& v) {
  return turn_between(u, v, (u - v).squaredNorm());
}

inline double combined_distance(const ToolPose& v, const Vec3& tip_P, const Vec3& axis_P) {
  const double turned_mm = kAxisWeight_mm * turn_between(v.axis_P, axis_P);
  return std::sqrt((v.tip_P - tip_P).squaredNorm() + turned_mm * turned_mm);
}

/// Angle from the unit vector u to the arc of the great circle from a to b, rad.
double angle_to_arc(const Vec3& u, const Vec3& a, const Vec3& b);

/// Deviation of motions on the machine that is verified, the nominal one or one with errors: proved bounds,
/// samples where an effect of the model knows no bound.
class DeviationMeter {
 public:
  struct Interval {
    double lower = 0.0;
    double upper = 0.0;
  };
  struct Deviation {
    Interval tip_mm;
    Interval axis_rad;
    bool proved = true;
    const Effect* unbounded = nullptr;  // the effect that prevented the proof, if it was one
  };

  /// What the machine is beside its nominal chain: nothing on the nominal one.
  struct Errors {
    const ModelEvaluator* truth = nullptr;
    const OffsetTracker* offsets = nullptr;
  };
  /// A proved upper bound is a little above the truth; where it straddles a tolerance the question is
  /// decided.
  struct Limits {
    double tip_mm;
    Angle axis;
    bool certify;  // else samples will do
  };
  DeviationMeter(const Machine& machine, const Vec3& tool_mm, const Errors& errors, const Limits& limits)
      : machine_(machine),
        tool_mm_(tool_mm),
        truth_(errors.truth),
        offsets_(errors.offsets),
        asked_(limits.certify),
        certify_(limits.certify && truth_ == nullptr && offsets_ == nullptr),
        tolerance_mm_(limits.tip_mm),
        axis_tolerance_(limits.axis),
        certifier_(TableKinematics(machine, tool_mm)),
        with_errors_(machine, tool_mm) {
    if (truth_ == nullptr) return;
    fixed_ = offsets_ == nullptr && truth_->depends_on() <= DependsOn::position;
    knows_motion_ = truth_->depends_on() >= DependsOn::motion;
    datum_P_ = datum_shift_P(machine, *truth_);
    with_errors_.hold(truth_->constant(), truth_->varying());
    course_.emplace(machine_, tool_mm_, *truth_);
  }
  DeviationMeter(const DeviationMeter&) = delete;
  DeviationMeter& operator=(const DeviationMeter&) = delete;

  /// `bow_at_most` knows a bound: the machine stands where a position was placed, whatever comes after it.
  bool may_bow(const Vertex& from, const Vertex& to) const {
    return (certify_ || (asked_ && fixed_)) && !from.tcp && !to.tcp;
  }
  /// How far such a motion leaves the straight line between the places of its ends, at most: from norms
  /// (`nominal`) and from what the errors are at most anywhere, no value of either on the way. Nothing where
  /// none is known.
  std::optional<path::Certifier::Bows> bow_at_most(const Vertex& from, const Vertex& to,
                                                   const path::Certifier::Bows& nominal) const;
  /// Positions of a run on the machine that is verified, and how far the motions between them leave straight
  /// lines at most, as `bow_at_most`: in the run itself, or put into `with_errors`. Null where no bound is
  /// known. For motions that `may_bow`.
  const path::PoseRun* place(const path::StationRun& run, path::PoseRun& with_errors) const;
  /// The errors at the position of the vertex, for machines that stand where a position was placed.
  void put_errors(Vertex& vertex) const;
  /// It is proved that the tip keeps to the segment a-b within this; for motions of which `bow_at_most` knows
  /// a bound.
  bool keeps_tip(const Vertex& from, const Vertex& to, const Target& a, const Target& b,
                 double limit_mm) const;
  /// The same of the tool axis.
  bool keeps_axis(const Vertex& from, const Vertex& to, const Target& a, const Target& b,
                  double limit_rad) const;

  /// A part of a motion, and the fractions of the segment at which its ends are taken to be.
  struct Stretch {
    const Vertex& from;
    const Vertex& to;
    double t0, t1;
    bool is_point() const { return &from == &to; }
  };
  /// The same of the tool from its tip to its flute length.
  bool keeps_flute(const Stretch& part, const Target& a, const Target& b, double limit_mm) const {
    return keeps_flute(part, path::FluteSegment({a.tip_P, b.tip_P, a.axis_P, b.axis_P}, b.flute_mm),
                       limit_mm);
  }
  bool keeps_flute(const Stretch& part, const path::FluteSegment& segment, double limit_mm) const;

  /// Proofs were asked for.
  bool proves() const { return asked_; }
  /// A bound on what the errors leave of a straight course over a motion, from what they are at most
  /// anywhere; nothing where none is known.
  std::optional<path::ErrorCourse::Bend> bend_at_most(const JointVector& from, const JointVector& to) const;
  const path::Certifier& certifier() const { return certifier_; }
  /// What the machine does at a position never changes: no lags, temperatures or senses of motion.
  bool is_fixed() const { return fixed_; }

  /// Fills in where the tool stands at `vertex.q`, on the way to `to`.
  void place(Vertex& vertex, const JointVector& to, const ProgramState& program) const;
  /// The same where its station is there already.
  void place_at_station(Vertex& vertex, const JointVector& to, const ProgramState& program) const;
  /// The position between two vertices of a block that comes nearest to a CL point.
  Vertex nearest_between(const Vertex& from, const Vertex& to, const Target& corner,
                         const ProgramState& program) const;
  /// Of the CL path, from one point to the other.
  struct Segment {
    const Target& a;
    const Target& b;
  };
  /// Largest deviation of the motion from `from` to `to` from the segment. Where it is proved to be no
  /// larger than `uninteresting` that bound is given instead of the figure: a decision costs a tenth of a
  /// figure.
  Deviation of(const Vertex& from, const Vertex& to, const Segment& segment, const ProgramState& program,
               const Deviation& uninteresting) const;
  Deviation sampled(const Vertex& from, const Vertex& to, const Segment& segment,
                    const ProgramState& program) const;

  /// The tool on a motion beside the place of the path at which its tip is.
  struct Beside {
    Interval axis_rad;  // the tool axis, from the path's there
    Interval flute_mm;  // the tool from its tip to its flute length, from the nearest place of the path
    bool proved = true;
  };
  /// Of the motion along a part of the segment a-b. What is proved to change nothing of `uninteresting` is
  /// left out.
  Beside beside(const Stretch& part, const Target& a, const Target& b, const ProgramState& program,
                const Beside& uninteresting) const;

  /// Half way from `from` to `to`, as the control moves the axes.
  Vertex middle_of(const Vertex& from, const Vertex& to, const ProgramState& program) const;
  /// Where the axes are on the way from `from` to `to`, as the control moves them.
  JointVector between(const Vertex& from, const Vertex& to, double t) const;
  const TableKinematics& kinematics() const { return certifier_.kinematics(); }

  /// The block takes up lost motion: micrometres, in which an axis reverses.
  bool takes_up(const Vertex& from, const Vertex& to, const ProgramState& program) const;

 private:
  Vertex nearest_on_way(const Vertex& from, const Vertex& to, const Target& corner,
                        const ProgramState& program) const;
  ToolPose pose(const MachineState& state, const RotarySines& sines, std::span<const double> lagged) const;
  /// The same, with the errors of the machine there (not used on the nominal one).
  ToolPose pose(const JointVector& q, const RotarySines& sines, const ChainErrors& errors) const;
  /// Bounds for a motion between two stations, off which the tool may be by `slack` (mm, rad).
  Interval tip_interval(const path::Station& from, const path::Station& to, const path::Reference& reference,
                        double slack_mm, double uninteresting_mm) const;
  template <class Within>
  bool keeps(const Vertex& from, const Vertex& to, const Within& within) const;
  bool tip_is_within(const path::Station& from, const path::Station& to, const path::Reference& reference,
                     double slack_mm, double limit_mm) const;
  bool axis_is_within(const path::Station& from, const path::Station& to, const path::Reference& reference,
                      double slack_rad, double limit_rad) const;
  struct BesidePath;
  void look_at_axis(const Stretch& part, const BesidePath& path, int halvings, Beside& sum) const;
  void look_at_flute(const Stretch& part, const BesidePath& path, int halvings, Beside& sum) const;
  bool runs_evenly(const Stretch& part, const BesidePath& path, double room_rad) const;
  bool prove_flute(const Vertex& from, const Vertex& to, const BesidePath& path,
                   const path::FluteCertifier::Places& about, Beside& sum) const;
  static void take(Interval& largest, double lower, double upper);
  std::optional<path::Certifier::Bows> bows_between(const Vertex& from, const Vertex& to) const;
  Interval axis_interval(const path::Station& from, const path::Station& to, const path::Reference& reference,
                         double slack_rad, double uninteresting_rad) const;
  /// A place of a motion on the machine with errors.
  struct Stop {
    const MachineState& state;
    const ChainErrors& errors;
    const path::Station& actual;
  };
  /// The station `nominal` as it is at `state`; `errors` are those there.
  path::Station actual(const MachineState& state, const path::Station& nominal,
                       std::span<const double> lagged, ChainErrors& errors) const;
  /// The position as it was placed.
  static path::Station actual(const Vertex& x);
  path::ErrorCourse::Bend bend(const Stop& from, const Stop& to) const;
  /// What is asked along a motion that is halved.
  struct Course {
    std::span<const double> lagged;
    const path::Reference& reference;
    const Deviation& uninteresting;
  };
  void between_stops(const Stop& from, const Stop& to, const Course& course, int depth, Deviation& sum) const;
  template <class T>
  static void add_bends(const path::PoseRun& nominal, std::size_t row, path::PoseRun& out);
  /// The poses of the rows of the run.
  template <class T>
  void place_with_errors(const path::StationRun& run, path::PoseRun& out) const;
  template <class T>
  void ask_each(const path::StationRun& run, std::size_t row, ChainErrorsOf<T>& out) const;
  void place_one(const path::StationRun& run, std::size_t row, path::PoseRun& out) const;
  const Machine& machine_;
  Vec3 tool_mm_;
  const ModelEvaluator* truth_;
  const OffsetTracker* offsets_;
  bool asked_;
  bool certify_;  // on the nominal machine
  lanes::Way way_ = lanes::way();
  bool fixed_ = false;         // what the machine does at a position never changes
  bool knows_motion_ = false;  // there are effects of the sense of motion
  double tolerance_mm_;
  Angle axis_tolerance_;
  path::Certifier certifier_;
  ErrorKinematics with_errors_;
  std::optional<path::ErrorCourse> course_;
  Vec3 datum_P_ = Vec3::Zero();
};

}  // namespace trunnion::post
