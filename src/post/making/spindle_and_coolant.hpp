#pragma once
#include <optional>

#include "trunnion/cl/record.hpp"

#include "post/making/posting.hpp"

namespace trunnion::post {

/// Spindle and coolant as the CL file asks for them, and when the program has to say so again.
class SpindleAndCoolant {
 public:
  explicit SpindleAndCoolant(Posting& posting) : posting_(posting) {}

  /// Of the tool, for surface speeds. False: the speed at hand was taken with another diameter, and nothing
  /// has moved since: the word comes too late for it.
  bool set_diameter(double mm, SourceRef where);
  double diameter_mm() const { return diameter_mm_; }
  /// The speed that was given last, 0 before the first one.
  double rpm() const { return rpm_; }
  /// In the spindle, where the CL file has loaded one.
  std::optional<std::uint32_t> tool() const { return tool_; }
  /// What is asked of the spindle now.
  const nc::Spindle& spindle() const { return spindle_; }
  /// A tapping cycle leaves the spindle stopped on most controls: it is said again before anything but a tap.
  void tapped() { tapped_ = resumes_ = true; }
  bool has_tapped() const { return tapped_; }
  /// What a record asks of the spindle, if it is anything; stopping it among that.
  Result<std::optional<nc::Spindle>> ask(const cl::Spindle& spindle, SourceRef where);
  void ask(nc::CoolantKind kind);
  /// Not with the tool of the program before: nothing goes on before this one's own is called or moves.
  bool go_on_at_once(bool tool_has_moved) const { return tool_ || tool_has_moved; }
  /// A tool change stops both; what was asked for holds for the next tool. The diameter does not, but where
  /// it was given behind the last motion.
  void tool_called(std::uint32_t number);
  /// A stop of the program has ended both: they are said again before anything moves.
  void stopped() {
    tapped_ = false;
    resumes_ = true;
  }
  /// Before a cut: warns where the CL file has said nothing of the spindle since the tool was loaded, or has
  /// switched it off. Fails with wrong_input where another tool before turned to the left: this one would,
  /// too.
  Result<void> check_before_cut(SourceRef where);
  /// Before the next motion: what was asked for, where a tool change has ended it or none was said yet.
  Result<void> resume();

 private:
  /// A tool moves on with another diameter than it has moved with.
  void tell_new_diameter();

  Posting& posting_;
  double rpm_ = 0.0;
  double diameter_mm_ = 0.0;
  SourceRef diameter_where_;
  double moved_with_mm_ = 0.0;       // the diameter with which the tool at hand has moved; 0: none was known
  bool speed_has_diameter_ = false;  // rpm_ was made from a surface speed and this diameter
  bool has_moved_ = false;           // since the diameter was given
  std::optional<std::uint32_t> tool_, said_for_;  // in the spindle; when SPINDL was said last
  nc::Spindle spindle_;
  unsigned coolant_ = 0;  // bit per kind
  bool is_said_ = false;  // of the spindle, for the tool at hand, or it was warned of
  bool resumes_ = true;
  bool tapped_ = false;
};

}  // namespace trunnion::post
