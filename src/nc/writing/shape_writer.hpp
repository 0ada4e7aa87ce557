#pragma once
#include "nc/writing/write_state.hpp"

namespace trunnion::nc {

/// Arcs, drilling cycles and touches of a probe.
class ShapeWriter {
 public:
  explicit ShapeWriter(WriteState& state) : s_(state) {}

  Result<void> write(const Arc& b);
  Result<void> write(const Hole& b);
  Result<void> write(const Probe& b);
  Result<void> write(const ProbeLog& b);
  Result<void> end_cycle();

 private:
  std::string per_minute_words(std::int64_t quanta, bool with_number);
  Result<void> check_shape(std::int64_t feed_quanta, SourceRef where) const;
  bool continues_cycle(const Hole& b) const;
  Result<void> put_cycle(const Template& words, const Hole& b, const Template* in_front);
  Result<void> put_next_hole(const Hole& b);

  WriteState& s_;
};

}  // namespace trunnion::nc
