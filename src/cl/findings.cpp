#include "cl/findings.hpp"

#include <string_view>
#include <utility>

namespace trunnion::cl {

namespace {

// Words that nobody knows can be as many as the file has lines.
constexpr std::size_t kMostKinds = 2000;

/// The message without what differs between two of a kind: numbers and what is quoted from the file.
std::string kind_of(std::string_view message) {
  std::string kind;
  bool quoted = false;
  for (const char c : message) {
    if (c == '\'') quoted = !quoted;
    if (!quoted && std::string_view("0123456789.+-'").find(c) == std::string_view::npos) kind += c;
  }
  return kind;
}

std::string printable(std::string_view message) {
  constexpr std::string_view kHexDigits = "0123456789ABCDEF";
  std::string out;
  out.reserve(message.size());
  for (const char c : message) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte < 0x7F) {
      out += c;
    } else {
      out += "\\x";
      out += kHexDigits[byte / 16];
      out += kHexDigits[byte % 16];
    }
  }
  return out;
}

}  // namespace

Findings::Findings(std::string file, Diagnostics& diagnostics)
    : file_(std::move(file)), diagnostics_(diagnostics) {}

bool Findings::keeps(const std::string& message, SourceRef where) {
  auto found = kinds_.find(kind_of(message));
  if (found == kinds_.end()) {
    // Beyond so many kinds they are counted together.
    const std::string key = kinds_.size() < kMostKinds ? kind_of(message) : std::string();
    found = kinds_.try_emplace(key).first;
  }
  Kind& kind = found->second;
  if (++kind.count <= kMostOfAKind) return true;
  kind.last = where;
  if (kind.message.empty()) kind.message = printable(message);
  return false;
}

void Findings::error(SourceRef where, const std::string& message) {
  ++errors_;
  if (too_many() || !keeps(message, where)) return;
  if (++kept_errors_ < kMostErrors) {
    diagnostics_.error(file_, where, printable(message));
  } else {
    diagnostics_.error(file_, where,
                       std::to_string(kMostErrors) + " errors: the rest of the file is not read");
  }
}

void Findings::warning(SourceRef where, const std::string& message) {
  if (keeps(message, where)) diagnostics_.warning(file_, where, printable(message));
}

void Findings::note(SourceRef where, const std::string& message) {
  diagnostics_.note(file_, where, printable(message));
}

void Findings::warning_once(const std::string& key, SourceRef where, const std::string& message) {
  if (seen_.size() >= kMostWarnings) {
    if (!seen_.contains(key)) ++more_warnings_;
    return;
  }
  if (seen_.insert(key).second)
    diagnostics_.warning_once(file_ + ":" + key, file_, where, printable(message));
}

void Findings::tell_counts() {
  for (const auto& [key, kind] : kinds_) {
    if (kind.count <= kMostOfAKind) continue;
    note(kind.last,
         std::to_string(kind.count - kMostOfAKind) + " more of these, the last one here: " + kind.message);
  }
  kinds_.clear();
  if (more_warnings_ > 0) note({}, std::to_string(more_warnings_) + " more warnings");
  more_warnings_ = 0;
}

}  // namespace trunnion::cl
