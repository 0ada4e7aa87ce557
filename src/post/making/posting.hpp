#pragma once
#include <array>
#include <functional>
#include <string>

#include "trunnion/nc/writer.hpp"
#include "trunnion/post/post.hpp"

namespace trunnion::post {

/// What everything that makes the text of one program shares: the order, the text as far as it goes, and what
/// is to be said of it.
struct Posting {
  Posting(const PostJob& of, const PostOptions& with)
      : job(of), options(with), controller(*of.controller), machine(*of.machine), writer(controller, text) {
    for (AxisId id = 0; id < machine.axes.size(); ++id) letters[id] = *nc::axis_letter(machine.axes[id].name);
  }
  Posting(const Posting&) = delete;
  Posting& operator=(const Posting&) = delete;
  ~Posting() = default;

  /// Behind the motions that are held back, which go out first.
  Result<void> write(const nc::Block& block) {
    if (before_block) {
      if (auto r = before_block(); !r) return r;
    }
    return writer.write(block);
  }

  /// At a place of the CL file.
  void warn_once(const std::string& key, SourceRef where, const std::string& what) {
    diagnostics.warning_once(key, job.cl_file, where, what);
  }

  const PostJob& job;
  const PostOptions& options;
  const nc::Controller& controller;
  Machine machine;  // as LIMITS leaves it; the verification has the one that was given
  std::array<nc::AxisLetter, kMaxAxes> letters{};  // of its axes
  std::string text;                                // not handed on yet
  nc::Writer writer;                               // of the text
  std::function<Result<void>()> before_block;      // writes motions that are held back; may be empty
  Diagnostics diagnostics;                         // of generation
  PostReport report;
};

}  // namespace trunnion::post
