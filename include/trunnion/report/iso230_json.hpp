#pragma once
#include <string>
#include <vector>

#include "trunnion/diagnosis/iso230_2.hpp"
#include "trunnion/diagnosis/iso230_4.hpp"
#include "trunnion/diagnosis/iso230_7.hpp"
#include "trunnion/diagnosis/iso230_limits.hpp"

namespace trunnion::report {

/// One error motion with its evaluation.
struct EvaluatedMotion {
  iso230::ErrorMotion motion;
  iso230::ErrorMotionValues values;
};

/// JSON text of an evaluation: the standard with its year, the unit (um, urad), every symbol; what the
/// standard does not give for these data is null. Symbols: `_up`, `_down` are the arrows. With the readings
/// that were evaluated (`readings_up`: [target][run]), in the order of the results.
std::string iso230_2_json(const std::vector<iso230::Positioning>& axes,
                          const std::vector<iso230::LineTest>& lines);
std::string iso230_6_json(const iso230::Diagonals& diagonals, const std::vector<iso230::LineTest>& lines);
/// Each circle with its paths (`angle_deg`; `read`, and `radial` about the least-squares centre, in um) and
/// what shapes it: shares of the mean square of the deviations from the least-squares circle.
std::string iso230_4_json(const std::vector<iso230::CircularTest>& tests,
                          const std::vector<iso230::CircularPath>& paths);
std::string iso230_7_json(const std::vector<EvaluatedMotion>& motions);

/// Adds `limits` (of, symbol, value, limit, uncertainty, result) and `passed` to such a JSON text, and a
/// table of them for people. Nothing is added without a limit.
std::string with_limits(const std::string& json, const std::vector<iso230::HeldValue>& held);
std::string limits_text(const std::vector<iso230::HeldValue>& held);

/// The same as text for people, symbols with their arrows.
std::string iso230_2_text(const std::vector<iso230::Positioning>& axes);
std::string iso230_6_text(const iso230::Diagonals& diagonals);
std::string iso230_4_text(const std::vector<iso230::CircularTest>& tests);
std::string iso230_7_text(const std::vector<EvaluatedMotion>& motions);

}  // namespace trunnion::report
