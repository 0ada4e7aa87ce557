#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/diagnosis/measurement.hpp"

namespace trunnion::diagnosis {

/// A line of another program's text, without blanks at its ends.
struct ForeignLine {
  std::string_view text;
  std::uint32_t number = 0;
  std::uint32_t column = 1;  // of its first character
};
std::vector<ForeignLine> lines_of(std::string_view text);
std::string_view trimmed(std::string_view text);
/// Words between blanks.
std::vector<std::string_view> words_of(std::string_view text);
/// The words of a line as numbers; a finding for each that is none.
std::vector<double> numbers_of(const ForeignLine& line, const std::string& file, Diagnostics& diagnostics);

/// Readings that are dealt to `parts` runs in turn, point by point, so that some can be held out.
class DealtReadings {
 public:
  DealtReadings(const Machine& machine, std::size_t parts);
  /// A position; the readings that follow belong to it.
  void at(const JointVector& q);
  void add(Quantity quantity, const Vec3& n, double value, double u_random);  // n in M; mm, rad
  std::size_t points() const { return states_.size(); }
  /// As a measurement file; they were not read in the order of time.
  std::string text(const std::vector<std::string>& comments);

 private:
  const Machine& machine_;
  EffectContext context_;
  std::vector<MachineState> states_;
  std::vector<RowOrigin> rows_;
  std::vector<Reading> readings_;
};

}  // namespace trunnion::diagnosis
