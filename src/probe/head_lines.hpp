#pragma once
#include <optional>
#include <string>
#include <vector>

#include "trunnion/probe/program.hpp"

// Lines in the head of a probing program that its reader needs again.
namespace trunnion::probe {

std::vector<std::string> head_lines(const Ball& ball);

/// Collects these lines; capital and small letters are the same.
class HeadReader {
 public:
  /// True where `comment` is one of them.
  bool take(const std::string& comment);
  /// The first line that was not there, or nothing.
  std::optional<std::string> missing() const;
  const Ball& ball() const { return ball_; }

 private:
  Ball ball_;
  unsigned seen_ = 0;  // a bit for each line
};

}  // namespace trunnion::probe
