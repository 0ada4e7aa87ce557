#pragma once
#include "nc/reading/line_motion.hpp"
#include "nc/reading/read_state.hpp"

namespace trunnion::nc {

/// Arcs, drilling cycles and touches of a probe.
class ShapeReader {
 public:
  explicit ShapeReader(ReadState& state) : s_(state) {}

  void run_arc(const FoundEvent& found);
  void run_cycle(const FoundEvent& found);
  /// Motion words and F of a line under a cycle; false: refused.
  bool take_modes_under_cycle(const LineMotion& m);
  /// Axis words without a word of their own under a cycle.
  void run_next_hole(const LineMotion& m);
  void run_probe(const FoundEvent& found);

 private:
  bool shape_may_begin(const FoundEvent& found);
  void run_arcs_of_others(const FoundEvent& found);
  void run_arc_of_others(const FoundEvent& found, Arc arc);
  const Template& words_of_cycle(int argument) const;
  /// Pitch, speed and feed of a tap; false, with a message, where the program does not say them.
  bool gear(const FoundEvent& found, const Template& words, Hole& hole);
  void run_hole(std::int64_t x, std::int64_t y, std::uint32_t column);

  ReadState& s_;
};

}  // namespace trunnion::nc
