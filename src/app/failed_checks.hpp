#pragma once
#include <string>
#include <vector>

#include "trunnion/post/verify.hpp"

namespace trunnion::app {

/// Why a verification did not pass, a sentence for each reason, with the place and the numbers.
std::vector<std::string> failed_checks(const post::VerifyReport& v, const std::string& cl_file);

}  // namespace trunnion::app
