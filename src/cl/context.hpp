#pragma once
#include <array>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/cl/reader.hpp"
#include "trunnion/cl/record.hpp"

#include "cl/findings.hpp"
#include "cl/statement.hpp"

namespace trunnion::cl {

/// A CIRCLE or MOVARC that waits for the GOTO to its end.
struct PendingArc {
  std::string_view word = "CIRCLE";
  SourceRef where;
  Vec3 center_A = Vec3::Zero();
  Vec3 normal_A = Vec3::UnitZ();  // the tool turns about it by the right-hand rule
  double radius_mm = 0.0;         // 0: not given
  std::uint32_t turns = 1;
  bool full_when_closed = false;
  std::optional<Angle> sweep;  // as the file gives it: it has to agree with the end
};

/// A drilling cycle that is switched on: its holes, where each is said with the GOTO to it.
struct Cycle : Hole {
  double return_mm = 0.0;
  bool has_depth = false;
  bool has_clear = false;
  bool return_as_came = false;
  bool has_rapto = false;       // RAPTO goes before CLEAR, which CAMplete gives as an absolute height
  bool clear_by_place = false;  // a value without a word: true until the tool has stood there above a hole
  std::optional<Feed> own_feed;
  double pitch_mm = 0.0;  // of a tap whose feed is per minute, once the first hole has it

  bool in_pecks() const { return kind == Kind::peck || kind == Kind::chip_break; }
};

/// NURBS of NX while its knots and points are read.
struct NurbsCurve {
  SourceRef where;
  bool good = false;  // false: it had a fault, which is told already
  std::vector<double> knots;
  std::vector<Vec3> points_A;  // control points behind the position
};

/// CLEARP: the plane `normal . p = distance` in the file's coordinates.
struct ClearPlane {
  Vec3 normal_A = Vec3::UnitZ();  // unit
  double distance_mm = 0.0;
};

/// MSYS of NX as it was read: how its points are meant is settled with the first tool axis.
struct PendingMsys {
  SourceRef where;
  Pose X_AM;
};

/// What the file says of its unit of length before the first length that needs it.
struct UnitSigns {
  bool word = false;                   // UNITS, or --cl-units
  bool mm = false;                     // a feed in mm
  std::optional<SourceRef> inch;       // a feed in inches or feet
  std::optional<SourceRef> first_use;  // a length that was read without UNITS
};

/// What is known of the system that wrote the file, and of the machine that it is for.
struct Origin {
  bool points_in_part = false;  // TRNTYP/WORLD: whatever CSYS says
  bool mill = false;            // MODE/MILL, a tool axis, a milling cutter: this is no lathe's file
  bool catia = false;           // its comments say so
  bool fusion = false;          // MODE/MILL: the ISO 4343 posts of Fusion and HSMWorks
};

/// The lines of a `$$*CATIA0` while they are read.
struct CatiaMatrix {
  SourceRef where;
  int lines = 0;  // 0: none is being read
  std::size_t count = 0;
  std::array<double, 12> values{};
};
struct CatiaSystem {
  CatiaMatrix matrix;
  std::optional<std::array<double, 12>> first;  // of the file
};

/// What earlier words of the file left behind. Coordinates here are those of the file's own system A (mm),
/// not of P.
struct Modal {
  double mm_per_unit = 1.0;
  UnitSigns units;
  Origin origin;
  Vec3 tip_A = Vec3::Zero();
  Vec3 axis_A = Vec3::UnitZ();
  bool has_position = false;
  /// The tool axis behind MULTAX/OFF: systems differ in it, and the file does not say which wrote it.
  bool axis_unsure = false;
  Feed feed;
  /// What holds where SPINDL and COOLNT do not say it.
  struct SaidBefore {
    bool counterclockwise = false;
    std::uint32_t tool = 0;                     // that is loaded
    std::uint32_t of_tool = 0;                  // for which the sense was said
    std::uint32_t length_register = 0;          // of the tool
    Coolant::Kind coolant = Coolant::Kind::on;  // what COOLNT/ON brings back
    double rpm = 0.0;                           // of the spindle; 0: not known
    std::optional<std::size_t> tool_changed;    // behind so many motions
    struct Unloaded {
      SourceRef where;
      std::size_t behind = 0;  // so many motions
    };
    std::optional<Unloaded> unloaded;
  } said;
  bool rapid_next = false;
  std::optional<From> home;  // FROM

  /// Pose of A, in which the points at hand are given, in P.
  Pose X_PA;
  bool turned = false;  // X_PA is not the identity
  /// P is this frame: all of a program is in one P.
  std::optional<Pose> first_msys;
  bool points_absolute = false;  // MSYS is applied to the points
  std::optional<PendingMsys> new_msys;

  std::optional<PendingArc> pending_arc;
  std::optional<NurbsCurve> nurbs;
  std::optional<Cycle> cycle;
  std::optional<Cycle> last_cycle;
  std::optional<ClearPlane> clear_plane;
  bool points_on_center = false;  // the file says that its points are those of the tool's center (Creo)

  /// CSYS (SolidWorks) with a Z axis other than the file's: a GOTO without an axis is ambiguous then.
  std::optional<Vec3> tilted_csys_axis;
  std::optional<std::uint32_t> work_offset;  // ZERO

  CatiaSystem catia;
  std::optional<Vec3> start_direction_A;  // INDIRV

  /// Words that SYN has renamed.
  std::map<std::string, std::string, std::less<>> synonyms;
  bool ended = false;
  std::string_view closing;  // word that ends what PARTNO or TOOL PATH began; empty when nothing is open
};

/// The tool that NX names with its operations (TOOL PATH), beside the words that load one.
struct NamedTool {
  std::string of_operation;
  SourceRef where;
  std::string in_spindle;          // under which the operation before moved
  bool loaded = false;             // a tool was, since then
  std::size_t motions_before = 0;  // of the operation at hand
};

/// What the words of a CL file act on: the modal state, the records made, the findings. One for each file.
class Context {
 public:
  Context(std::string file, const ReaderOptions& options, Diagnostics& diagnostics);

  void error(SourceRef where, const std::string& message) { findings_.error(where, message); }
  void warning(SourceRef where, const std::string& message) { findings_.warning(where, message); }
  void note(SourceRef where, const std::string& message) { findings_.note(where, message); }
  void warning_once(const std::string& key, SourceRef where, const std::string& message) {
    findings_.warning_once(key, where, message);
  }
  /// An error behind which nothing of the file means anything: the rest is not read.
  void give_up(SourceRef where, const std::string& message) {
    error(where, message);
    gave_up_ = true;
  }
  Findings& findings() { return findings_; }

  /// The unit of a feed: it tells that of the lengths where UNITS is missing.
  void take_feed_unit(std::string_view unit, SourceRef where);
  /// A length is read here in the file's unit: from now on UNITS may not change it unnoticed.
  void use_unit(SourceRef where) {
    if (!modal.units.first_use) modal.units.first_use = where;
  }

  /// The number in a field; an error and nothing when it is none. Counts as decimals of nothing.
  std::optional<double> number(const Statement& statement, std::size_t index);
  /// A number > 0.
  std::optional<double> positive(const Statement& statement, std::size_t index);
  /// A whole number >= 0.
  std::optional<std::uint32_t> whole(const Statement& statement, std::size_t index);
  /// `count` numbers from `first` on; false with an error for each that is wrong.
  bool numbers(const Statement& statement, std::size_t first, std::size_t count, double* out);
  /// Three lengths of the file in mm, each at most kLongest_mm. They count for the resolution of the
  /// coordinates.
  std::optional<Vec3> point(const Statement& statement, std::size_t first);
  /// A tool axis, normalised: nothing (and an error) when it is no direction. It counts for the resolution of
  /// the axis.
  std::optional<Vec3> axis(const Statement& statement, std::size_t first);

  /// A record that is no motion.
  template <class Data>
  void emit(SourceRef where, Data&& data) {
    if constexpr (std::is_same_v<std::remove_cvref_t<Data>, ToolChange>) {
      tell_unloaded();
      modal.said.tool_changed = motion_count_;
    }
    Record record;
    record.where = where;
    record.data = std::forward<Data>(data);
    pending_.push_back(std::move(record));
  }
  /// Whether the tool stands where it was changed: what moves first comes from there.
  bool comes_from_change() const { return modal.said.tool_changed == motion_count_; }
  /// A warning where something moves behind UNLOAD, and forgets it.
  void tell_unloaded();
  /// A motion, given in A: its end becomes the position.
  void add_motion(SourceRef where, const Motion& in_A);
  /// As add_motion, with the modal feed; takes RAPID.
  void move_to(SourceRef where, const Vec3& tip_A, const Vec3& axis_A);
  /// An arc from the position to `end_A`, or the motions that stand for it. `sweep` > 0 about `normal_A`.
  /// Takes RAPID.
  void add_arc(SourceRef where, const Vec3& end_A, const Vec3& center_A, const Vec3& normal_A, Angle sweep);
  /// CLEARP, its lengths in mm, in A. The same word in P, for the post.
  PostWord take_clear_plane(PostWord word);
  /// RETRCT: a rapid along the tool axis to the clearance plane; none when the tool is beyond it. An error
  /// without a plane, or when the tool axis does not lead there.
  void retract(SourceRef where);
  /// GOHOME without values: a rapid to where FROM stood; an error without FROM.
  void go_home(SourceRef where);
  /// All points behind it would be holes of what begins: an error where a CYCLE is in force, which ends.
  void refuse_under_cycle(SourceRef where, const std::string& what);
  /// A position without a motion; behind motions the tool stays where it is.
  void start_from(SourceRef where, const Vec3& tip_A, const Vec3& axis_A);
  /// A motion of the plain kind straight into `record`; false when it is none and has to be read word by
  /// word.
  bool plain_motion(const PlainGoto& plain, Record& record);
  /// Plain cuts may come now: motions at the modal feed, with nothing to do but what `plain_cuts` does.
  bool takes_cuts() const {
    return pending_.empty() && !modal.ended && !modal.new_msys && !modal.pending_arc && !modal.nurbs &&
           !modal.cycle && !modal.turned && !modal.rapid_next;
  }
  /// Makes motions of numbers as they stand in the file, in place; how many of them are of the plain kind.
  std::size_t plain_cuts(std::span<PlainCut> cuts);
  /// An MSYS was read: how its points are meant is settled with the first tool axis behind it.
  void take_msys(const PendingMsys& msys);
  /// MCS: the frame in which everything behind it is given; its z is the tool axis of points without one.
  void take_mcs(SourceRef where, const Pose& X_PM);
  /// The next record made by the words read so far.
  bool take(Record& record);

  void count_decimals(unsigned coordinate, unsigned axis);
  /// What can be said only in the end.
  /// `last_number`: Scanner::last_number.
  void finish(std::size_t lines, std::string_view last_number);
  /// An operation begins, which is made with this tool; empty: the file does not name it.
  void begin_operation(SourceRef where, std::string_view tool);
  /// It ends. An error where it moved with another tool than the one before, and none was loaded.
  void end_operation();
  void tool_loaded() { named_tool_.loaded = true; }

  Modal modal;
  const ReaderOptions& options() const { return options_; }
  const Resolution& resolution() const { return resolution_; }
  std::size_t motion_count() const { return motion_count_; }
  bool reads_on() const { return !gave_up_ && !findings_.too_many(); }

  static constexpr double kLongest_mm = 1e6;  // 1 km: larger than any machine; beyond it, a fault of the file

 private:
  bool in_range(const Statement& statement, std::size_t index, double mm);
  Motion motion(const Vec3& tip_A, const Vec3& axis_A, const Feed& feed, bool rapid) const;
  void settle_msys(const Vec3& axis_A);
  void judge_units();

  ReaderOptions options_;
  NamedTool named_tool_;
  Findings findings_;
  std::deque<Record> pending_;
  Resolution resolution_;
  unsigned coordinate_decimals_ = 0;
  unsigned axis_decimals_ = 0;
  std::size_t motion_count_ = 0;
  bool gave_up_ = false;
  std::size_t normalised_ = 0;
  double worst_length_error_ = 0.0;
  SourceRef worst_length_at_;
};

/// The same frame to the digits of a CL file.
bool same_pose(const Pose& a, const Pose& b);

/// The decimal places of a number as written: 3 for `1.250`, 5 for `1.25e-3`.
unsigned decimals_of(std::string_view text);

/// `value` with `digits` significant digits, for messages.
std::string short_text(double value, int digits = 6);

}  // namespace trunnion::cl
