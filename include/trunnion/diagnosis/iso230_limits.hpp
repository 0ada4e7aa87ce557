#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/result.hpp"
#include "trunnion/diagnosis/iso230_2.hpp"
#include "trunnion/diagnosis/iso230_4.hpp"
#include "trunnion/diagnosis/iso230_7.hpp"

/// Values of ISO 230 against limits that were agreed on.
namespace trunnion::iso230 {

/// A value that may have a limit: what it belongs to and its symbol, as the JSON result names them.
struct NamedValue {
  std::string of;      // "X", "XY" (a circle's plane), "C radial X"
  std::string symbol;  // "A", "R_up", "G_clockwise", "total"
  bool angle = false;
  std::optional<double> value;  // mm or rad; nothing where the standard gives none for these data
};
std::vector<NamedValue> values_of(const std::vector<Positioning>& lines);
std::vector<NamedValue> values_of(const std::vector<CircularTest>& circles);
std::vector<NamedValue> values_of(const ErrorMotion& motion, const ErrorMotionValues& values);

/// "X.A=10", or "A=10" for that symbol of everything: um, urad of an angle.
struct NamedNumber {
  std::string of;  // empty: of all
  std::string symbol;
  double number = 0.0;
};
/// Fails where it has another form, or the number is not above zero.
Result<NamedNumber> parse_named_number(std::string_view text);

/// The rule of ISO 14253-1 for whoever has to prove that a limit is kept: with the expanded uncertainty U of
/// the value, `within` for value + U <= limit, `beyond` for value - U > limit, between them neither is
/// proved. Only sizes count: a signed value is held against both sides.
enum class Conformity : std::uint8_t { within, undecided, beyond, no_value };
std::string_view text_of(Conformity conformity);

struct HeldValue {
  NamedValue value;
  double limit = 0.0;        // mm or rad
  double uncertainty = 0.0;  // U; 0: not known
  Conformity conformity = Conformity::no_value;
};
/// Every value that has a limit, in the order of `values`; of several limits the last that names its line,
/// else the last that names none. Fails for a limit or an uncertainty of a value that is not there.
Result<std::vector<HeldValue>> hold_against(const std::vector<NamedValue>& values,
                                            const std::vector<NamedNumber>& limits,
                                            const std::vector<NamedNumber>& uncertainties);
/// Each of them is proved to be within.
bool all_within(const std::vector<HeldValue>& held);

}  // namespace trunnion::iso230
