#pragma once
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "trunnion/post/post.hpp"

namespace trunnion::post {

/// What came of one CL file.
struct FileOutcome {
  std::optional<PostReport> report;  // nothing when the post failed
  std::optional<Error> error;        // why it failed; findings in the CL file are in `diagnostics`
  Diagnostics diagnostics;
  bool passed = false;   // the program is verified (or verification was switched off)
  bool written = false;  // the output file stands

  /// Deviation alone is a reason that `accept_deviation` overrides; a point that is missed or a limit is not.
  bool only_deviates() const;
};

/// Gets the bytes of a finished program, piece by piece, before its file appears.
using FinishedText = std::function<void(std::string_view)>;

/// Posts `job.cl_file` (`-`: standard input) to `output` (`-`: standard output), which appears complete and
/// verified or not at all. With `accept_deviation` a program that misses its tolerance is written all the
/// same, marked in its header.
FileOutcome post_file(const PostJob& job, const PostOptions& options, const std::string& output,
                      bool accept_deviation, const FinishedText& written = {});

}  // namespace trunnion::post
