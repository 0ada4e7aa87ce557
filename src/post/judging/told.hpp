#pragma once
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "trunnion/nc/blocks.hpp"
#include "trunnion/nc/controller.hpp"

// Private to the verifier: what the words of a program have set on the control.
namespace trunnion::post {

/// The state of the control beside the motions, block by block. What no word has set yet is not known.
class Told {
 public:
  explicit Told(const nc::Controller& controller) : controller_(controller) {}

  void take(const nc::Block& block);

  const std::optional<std::int64_t>& work_offset() const { return work_offset_; }
  const std::optional<std::int64_t>& tool() const { return tool_; }
  /// Register of the length that the control adds; 0: it adds none.
  const std::optional<std::int64_t>& length() const { return length_; }
  const nc::Spindle& spindle() const { return spindle_; }
  /// Behind a tapping cycle: whether it turns is for the control to say.
  bool spindle_is_open() const { return spindle_is_open_; }
  /// Of the tapping cycle at hand.
  const std::optional<nc::Thread>& thread() const { return thread_; }
  const std::optional<unsigned>& coolant() const { return coolant_; }  // bit per kind
  /// What words had switched on before the last stop, whether it ends that or not.
  struct AtStop {
    nc::Spindle spindle;
    unsigned coolant = 0U;  // bit per kind
  };
  const AtStop& at_stop() const { return at_stop_; }
  const std::optional<nc::PathMode>& path_mode() const { return path_mode_; }
  const nc::CutterCompensation& cutter() const { return cutter_; }
  /// Compensation was switched on or off, and no motion has come since; asked once.
  bool take_new_cutter() { return std::exchange(cutter_is_new_, false); }
  /// Registers of wear so far that are entries of tools which the program loads, where the control takes the
  /// diameter of an entry (Controller::wear_register_is_tool).
  std::vector<std::int64_t> wear_of_tools() const;

 private:
  void take_tcp(const nc::TcpControl& control);

  const nc::Controller& controller_;
  std::optional<std::int64_t> work_offset_, tool_, length_;
  nc::Spindle spindle_;
  bool spindle_is_open_ = false;
  std::optional<nc::Thread> thread_;
  std::optional<unsigned> coolant_ = 0U;  // a program begins without
  AtStop at_stop_;
  std::optional<nc::PathMode> path_mode_;
  nc::CutterCompensation cutter_;
  bool cutter_is_new_ = false;
  std::set<std::int64_t> tools_, wear_registers_;  // all of the program so far
};

}  // namespace trunnion::post
