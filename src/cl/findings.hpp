#pragma once
#include <cstddef>
#include <map>
#include <set>
#include <string>

#include "trunnion/base/diagnostics.hpp"

namespace trunnion::cl {

/// What is said of one CL file. Of each kind of message (the same words, other numbers) the first ten are
/// kept and the rest counted, so that a broken file of millions of lines fills neither the screen nor the
/// memory. Bytes of the file that are not printable ASCII are shown as `\xNN`: nothing of it acts on a
/// terminal.
class Findings {
 public:
  Findings(std::string file, Diagnostics& diagnostics);

  void error(SourceRef where, const std::string& message);
  void warning(SourceRef where, const std::string& message);
  void note(SourceRef where, const std::string& message);
  void warning_once(const std::string& key, SourceRef where, const std::string& message);
  /// How many more there were of each kind that was counted.
  void tell_counts();

  bool has_errors() const { return errors_ > 0; }
  /// So many different ones that nothing more is worth reading.
  bool too_many() const { return kept_errors_ >= kMostErrors; }

  static constexpr std::size_t kMostOfAKind = 10;
  static constexpr std::size_t kMostErrors = 1000;
  static constexpr std::size_t kMostWarnings = 100;  // of those that are said once

 private:
  struct Kind {
    std::size_t count = 0;
    SourceRef last;
    std::string message;
  };
  bool keeps(const std::string& message, SourceRef where);

  std::string file_;
  Diagnostics& diagnostics_;
  std::map<std::string, Kind> kinds_;
  std::set<std::string> seen_;
  std::size_t errors_ = 0;
  std::size_t kept_errors_ = 0;
  std::size_t more_warnings_ = 0;
};

}  // namespace trunnion::cl
