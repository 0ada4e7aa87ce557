#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "trunnion/nc/reader.hpp"
#include "trunnion/post/verify.hpp"

#include "post/judging/machine_judge.hpp"
#include "post/judging/safe_walk.hpp"
#include "post/words_in_force.hpp"

// Private to the verifier.
namespace trunnion::post {

/// The program as its control runs it: follows the words, and hands what the axes do to the judges, in order.
class ProgramReplay {
 public:
  /// References must outlive the replay.
  ProgramReplay(const Machine& machine, const nc::Controller& controller, const VerifyOptions& options,
                const std::string& nc_file, Diagnostics& diagnostics);
  ProgramReplay(const ProgramReplay&) = delete;
  ProgramReplay& operator=(const ProgramReplay&) = delete;

  /// What the words have switched on so far.
  const WordsInForce& words() const { return in_force_; }
  /// One who is handed what the axes do, before any text. The first one is told of the words that are no
  /// motion, too.
  void add(MachineJudge& judge) { judges_.push_back(&judge); }
  /// The CL file loads this tool, of this gauge length.
  void expect_tool(std::uint32_t number, double length_mm) { length_of_[number] = length_mm; }
  /// The control adds no length where the program loads no tool.
  void expect_no_length() {
    if (!tool_was_called_) in_force_.add_length(false);
  }

  void text(std::string_view piece) { reader_.feed(piece); }
  Result<void> finish() { return reader_.finish(); }
  /// The line that was read last.
  std::uint32_t line() const { return reader_.line(); }
  const WordFigures& figures() const { return figures_; }

 private:
  void take(const nc::Block& block);
  /// Rows of a run that a judge has taken already.
  struct Done {
    std::array<std::size_t, 2> rows{};
    std::size_t row = 0;  // at hand
    bool has(std::size_t judge) const { return row < rows[judge]; }
  };
  /// `terms`: the motion with what it adds at run time, or null.
  void take(const nc::Motion& motion, const nc::VariableMotion* terms, const Done& done);
  void take(const nc::MotionRun& run);
  void take(const nc::ToolCall& call);
  void take(const nc::Retract& retract);
  void take(const nc::TiltedPlane& plane);
  void take(const nc::LengthCompensation& length);
  void take(const nc::TcpControl& control);
  void take(const nc::Spindle& spindle);
  void take(const nc::Arc& arc);
  void take(const nc::Hole& hole);
  void take(const nc::LatchValues& latch);
  void end();
  /// A motion at whose end not all axes are known.
  void take_partly(const nc::Motion& motion);
  /// A place on the way of an arc or a cycle.
  void put(BlockEnd end);
  /// False: the position is not known.
  bool words_of_shape(const nc::AxisWords& words, SourceRef source, JointVector& out);
  std::optional<double> length_of(std::uint32_t tool) const;
  template <class Step>
  void hand_on(const Step& step) {
    for (MachineJudge* judge : judges_) judge->add(step);
  }
  void mark(const nc::Block& block) { judges_.front()->mark(block, line()); }

  const Machine& machine_;
  const nc::Controller& controller_;
  const VerifyOptions& options_;
  std::string file_;
  Diagnostics& findings_;
  AxisWordsOf axis_words_;
  WordsInForce in_force_;
  std::map<std::uint32_t, double> length_of_;  // of the tools of the CL file
  std::optional<std::int64_t> unknown_tool_;   // that was called last, until the first motion with it
  bool tool_was_called_ = false;
  bool from_unknown_ = false;  // a motion of which not all positions were known was left out
  WordFigures figures_;
  SafeWalk walk_;
  std::vector<MachineJudge*> judges_;
  nc::Reader reader_;
};

}  // namespace trunnion::post
