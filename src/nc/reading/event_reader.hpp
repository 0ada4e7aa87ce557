#pragma once
#include <map>
#include <set>

#include "nc/reading/read_state.hpp"
#include "nc/reading/shape_reader.hpp"

namespace trunnion::nc {

/// What the words of a line do that are no motion.
class EventReader {
 public:
  EventReader(ReadState& state, ShapeReader& shapes) : s_(state), shapes_(shapes) {}

  void run(const FoundEvent& found);

 private:
  void run_program_start(const FoundEvent& found);
  void run_program_end(const FoundEvent& found);
  /// With a message: tool-centre-point control is on, and this control wants it off for that.
  bool forbids_tcp(const FoundEvent& found, const char* what, bool wants_it_off);
  void run_spindle(const FoundEvent& found);
  void run_coolant(CoolantKind kind);
  void run_clamp(int argument);
  void run_tool(const FoundEvent& found);
  void run_length(std::int64_t number);
  void run_tcp(bool on, std::int64_t offset);
  void run_work_offset(std::int64_t index);
  void run_offset_shift(const FoundEvent& found);
  void run_latch_begin(const FoundEvent& found);
  void run_latch(const FoundEvent& found);
  void run_run_time_step(const FoundEvent& found);
  void run_path_mode(const FoundEvent& found);
  void run_cutter(const FoundEvent& found);
  void run_plane(const FoundEvent& found);
  void check_origin(const FoundEvent& found);
  void run_dwell(const FoundEvent& found);
  void run_retract(const FoundEvent& found);
  void run_tape(const FoundEvent& found);
  void keep_captures(const FoundEvent& found);
  void check_limits_of_latch(const FoundEvent& found);

  ReadState& s_;
  ShapeReader& shapes_;
  bool latched_ = false;                              // values at run time have been
  std::set<int> begun_;                               // lines of [run_time] begin, by their numbers
  std::map<Placeholder, std::int64_t> limits_;        // that the lines of a latch have said so far
  std::optional<std::array<std::int64_t, 3>> shift_;  // beside the work offset
};

}  // namespace trunnion::nc
