#pragma once
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "trunnion/cl/reader.hpp"
#include "trunnion/nc/expand.hpp"
#include "trunnion/post/nc_origin.hpp"
#include "trunnion/post/post.hpp"

#include "post/feeds/control_times.hpp"
#include "post/intake/path_source.hpp"
#include "post/words_in_force.hpp"

namespace trunnion::post {

/// What an NC program does on the machine that it was made for, as records of a CL path: blocks in, records
/// out. Where the tool is and what it points to is in P; the program's own way to and from the part is its
/// machine's business and is left out but for its ends: whoever posts the path makes a way of its own.
///
/// What changes where the tool goes and has no record is rejected, with its line.
class NcWalk {
 public:
  /// What the records are to keep to.
  struct Keep {
    cl::ReaderOptions reading;  // arcs, FromPath::motion, shapes, cutter compensation, unit
    PathReading with;
    /// Of the course of the tool axis: a share as of arcs.
    double chords_rad() const { return 0.1 * with.axis_tolerance.rad(); }
  };
  /// `origin` with the controller as it is read: its digits are those of the blocks. References must outlive
  /// the object.
  NcWalk(const NcOrigin& origin, const Keep& keep, const std::string& file, Diagnostics& diagnostics);

  /// The next block; `where` of those that do not know their place.
  void take(const nc::Block& block, SourceRef where);
  /// What has been made and not taken away.
  std::vector<cl::Record>& records() { return records_; }
  /// A motion was among them.
  bool has_moved() const { return moved_.ever; }

 private:
  std::string unknown_place(const std::string& what, std::uint16_t missing) const;
  void take(const nc::Motion& motion);
  void take(const nc::Arc& arc);
  void take(const nc::Hole& hole);
  void take(const nc::ToolCall& call, SourceRef where);
  void take(const nc::Retract& retract, SourceRef where);
  void take(const nc::TiltedPlane& plane, SourceRef where);
  void refuse_shifted_plane(SourceRef where);
  void take(const nc::CutterCompensation& cutter, SourceRef where);
  void take_setting(const nc::Block& block, SourceRef where);
  void take_process(const nc::Block& block, SourceRef where);

  /// False, with a message: the tip of a cut hangs on what the program has not said.
  bool may_cut(SourceRef where);
  bool stands_in_plane(const ToolPose& pose, SourceRef where);
  /// False, with a message: a rotary axis beyond its travel.
  bool stands_in_travel(const BlockEnd& end, const nc::Motion& motion);
  bool turns_between(const BlockEnd& from, const JointVector& words) const;
  ToolPose pose_of(const BlockEnd& end) const;
  ToolPose pose_at(const JointVector& words) const { return pose_of(in_force_.end_at(words)); }
  cl::Feed feed_of(const BlockEnd& end, const nc::Motion& motion) const;
  cl::Feed feed_of(std::int64_t per_minute) const;
  cl::Feed feed_of(const nc::Hole& hole) const;
  /// Where the machine is at a share `t` of the way from `at_`.
  ToolPose pose_on_way(const BlockEnd& end, double t) const { return pose_of(on_way(end, t)); }
  BlockEnd on_way(const BlockEnd& end, double t) const;
  /// Of all rotary axes together, in rad.
  double turn_to(const BlockEnd& end) const;
  /// What the way of the machine to `end` is off by, beside the straight line of the tip and the great circle
  /// of the tool axis, as far as places on it show.
  struct OffLine {
    double tip_mm = 0.0;
    double axis_rad = 0.0;
    bool within(const OffLine& limit) const { return tip_mm <= limit.tip_mm && axis_rad <= limit.axis_rad; }
  };
  OffLine off_line(const BlockEnd& end) const;
  /// So many pieces of the way keep to `limit`.
  double pieces_to(const BlockEnd& end, const OffLine& limit) const;
  /// False, with a message: what the program means by this cut its ends do not say.
  bool says_its_way(const BlockEnd& end, SourceRef where);
  void put_way(const BlockEnd& end, const cl::Motion& last, double pieces, SourceRef where);
  void put_stroke(const nc::Stroke& stroke, const JointVector& words, const cl::Feed& feed,
                  cl::Motion::Step step, SourceRef where);
  /// The spindle as a tapping cycle turns it; false, with a message, where it contradicts what was said.
  bool put_spindle_of(const nc::Hole& tap);
  void put_shape(const nc::Hole& hole, const JointVector& words, bool across, std::size_t motions);
  void put(SourceRef where, const cl::Motion& motion);
  /// Behind the tool that is being changed to.
  template <class T>
  void put(SourceRef where, const T& data) {
    if (!change_.tool) put_approach();
    (change_.tool ? change_.behind : records_).push_back({where, data});
  }
  void put_tool();
  bool is_straight_down(const cl::Motion& motion) const;
  void put_approach();
  /// A cut straight down from where a retract left the tool, as programs begin whose CL file has no rapid.
  bool comes_down(const nc::Motion& motion, const JointVector& words) const;
  /// What follows comes from the safe height: how the program gets there its blocks have not said.
  void come_from_above(SourceRef where);
  /// Straight up to the safe height of its machine, where tool-centre-point control ends.
  bool rises_to_height(const BlockEnd& from, const BlockEnd& to) const;
  void put_rotary(const BlockEnd& end, SourceRef where);
  /// A tool keeps the length register that it began with.
  void hold_register(std::int64_t number, SourceRef where);
  /// Each kind of fault once.
  void refuse(SourceRef where, const std::string& kind, const std::string& message);

  const NcOrigin& origin_;
  Keep keep_;
  std::string file_;
  Diagnostics& diagnostics_;
  AxisWordsOf axis_words_;
  WordsInForce in_force_;
  ControlTimes times_;
  std::vector<cl::Record> records_;
  std::optional<cl::Record> approach_;  // the rapid that came from an unknown place, if it was the last
  /// What stands behind the change waits for the tool's register.
  struct Change {
    std::optional<cl::Record> tool;
    std::vector<cl::Record> behind;
    std::optional<std::int64_t> register_used;  // by the tool in the spindle
    bool length_on = false;                     // a word said so, for this tool
    bool length_open = false;                   // for the tool before it, and nothing since
    bool ever = false;
    bool turned = false;        // the spindle has, for any tool
    bool spindle_open = false;  // it did for a tool before, and nothing is said since
  } change_;
  nc::Spindle spindle_;
  JointVector rotary_;          // as STANDS had them, or the motions since
  std::optional<BlockEnd> at_;  // where the tool is, as far as all axes are known
  std::set<std::string> told_;
  struct Moved {
    bool ever = false;
    bool low = false;                 // since it came from the safe height last
    bool above = false;               // a retract took Z to its height, and nothing has said Z since
    std::size_t risen = 0;            // records with the rapid that rose to the safe height; 0: none
    std::optional<JointVector> over;  // and there rapids have said all other axes: the words, Z left out
  } moved_;
};

}  // namespace trunnion::post
