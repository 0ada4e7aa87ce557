#include "trunnion/base/diagnostics.hpp"

#include <algorithm>
#include <utility>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/printable.hpp"

namespace trunnion {
namespace {

const char* severity_name(Severity severity) {
  switch (severity) {
    case Severity::note:
      return "note";
    case Severity::warning:
      return "warning";
    case Severity::error:
      break;
  }
  return "error";
}

}  // namespace

std::string Finding::text() const {
  std::string out;
  if (!file.empty()) {
    out += printable(file);
    if (where.line > 0) {
      out += ':' + std::to_string(where.line);
      if (where.column > 0) out += ':' + std::to_string(where.column);
    }
    out += ": ";
  }
  out += severity_name(severity);
  out += ": ";
  out += printable(message);
  return out;
}

void Diagnostics::add(Severity severity, std::string file, SourceRef where, std::string message) {
  if (severity == Severity::error) ++error_count_;
  findings_.push_back({severity, std::move(file), where, std::move(message)});
}

void Diagnostics::note(std::string file, SourceRef where, std::string message) {
  add(Severity::note, std::move(file), where, std::move(message));
}

void Diagnostics::warning(std::string file, SourceRef where, std::string message) {
  add(Severity::warning, std::move(file), where, std::move(message));
}

void Diagnostics::error(std::string file, SourceRef where, std::string message) {
  add(Severity::error, std::move(file), where, std::move(message));
}

void Diagnostics::warning_once(const std::string& key, std::string file, SourceRef where,
                               std::string message) {
  if (seen_.insert(key).second) add(Severity::warning, std::move(file), where, std::move(message));
}

void Diagnostics::append(const Diagnostics& other) {
  findings_.insert(findings_.end(), other.findings_.begin(), other.findings_.end());
  seen_.insert(other.seen_.begin(), other.seen_.end());
  error_count_ += other.error_count_;
}

Error Diagnostics::first_error() const {
  const auto it = std::find_if(findings_.begin(), findings_.end(),
                               [](const Finding& f) { return f.severity == Severity::error; });
  TRUNNION_EXPECTS(it != findings_.end());
  return {ErrorCode::wrong_input, it->message, it->file, it->where};
}

}  // namespace trunnion
