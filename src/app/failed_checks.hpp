#pragma once
#include <string>
#include <vector>

#include "trunnion/post/verify.hpp"

namespace trunnion::app {

/// Why a verification did not pass, a sentence for each reason, with the place and the numbers.
std::vector<std::string> failed_checks(const post::VerifyReport& v, const std::string& cl_file);

/// What was compared, a line for each check.
std::vector<std::string> check_table(const post::VerifyReport& v);

/// How far the tip leaves the straight lines of rapids, and where it does so most.
std::string rapid_text(const post::VerifyReport& v);

/// From where to where each axis goes, rapids included: machine positions. Turns where it is more than one.
/// Empty for a program without a block.
std::string travel_text(const post::VerifyReport& v);

}  // namespace trunnion::app
