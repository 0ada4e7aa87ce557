#pragma once
#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include "trunnion/base/result.hpp"
#include "trunnion/base/source_ref.hpp"

namespace trunnion {

enum class Severity { note, warning, error };

/// One thing that a reader or a stage has to say about the user's data.
struct Finding {
  Severity severity = Severity::error;
  std::string file;
  SourceRef where;
  std::string message;

  /// `file:line:column: severity: message`, leaving out what is not known.
  std::string text() const;
};

/// Collects all findings of a stage, in the order in which they were made. Nothing here prints.
class Diagnostics {
 public:
  void note(std::string file, SourceRef where, std::string message);
  void warning(std::string file, SourceRef where, std::string message);
  void error(std::string file, SourceRef where, std::string message);
  /// A warning that is kept only the first time that `key` is seen: one word of a CL file may stand there a
  /// thousand times.
  void warning_once(const std::string& key, std::string file, SourceRef where, std::string message);

  bool has_errors() const { return error_count_ > 0; }
  std::size_t error_count() const { return error_count_; }
  const std::vector<Finding>& findings() const { return findings_; }
  /// Appends the findings of another stage.
  void append(const Diagnostics& other);
  /// The first error as an Error with code wrong_input. Requires has_errors().
  Error first_error() const;

 private:
  void add(Severity severity, std::string file, SourceRef where, std::string message);
  std::vector<Finding> findings_;
  std::set<std::string> seen_;
  std::size_t error_count_ = 0;
};

}  // namespace trunnion
