#pragma once
#include <string>

#include "trunnion/post/post.hpp"

namespace trunnion::report {

/// The result of `verify` as one JSON object (fields: README, "Results").
std::string verify_json(const post::VerifyReport& report);
/// The result of `post`: the fields of `verify_json` of the verification, and what the post did.
std::string post_json(const post::PostReport& report);

}  // namespace trunnion::report
