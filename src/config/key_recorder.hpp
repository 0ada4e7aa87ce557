#pragma once
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/config/key_record.hpp"
#include "trunnion/config/value.hpp"

namespace trunnion::config {

/// Where the sections write what is asked of them; nothing happens without a KeyRecording.
class KeyRecorder {
 public:
  explicit KeyRecorder(FileRecord& record) : record_(record) {}
  /// The one of this thread; null where nobody records.
  static KeyRecorder*& active();

  /// A section of `table` is made. The first of all is the root of the document.
  void enter(const Value& table);
  /// `child` is the table that stands behind `key`, or one of them.
  void step(const Value& table, std::string_view key, const Value& child);
  void asked(const Value& table, std::string_view key, KeyType type);
  void required(const Value& table, std::string_view key);
  void choices(const Value& table, std::string_view key, const std::vector<std::string>& names);
  void pattern(const Value& table, std::string_view pattern);

 private:
  TableRecord* record_of(const Value& table);
  FileRecord& record_;
  std::map<const Value*, std::string> paths_;
  std::set<std::pair<const Value*, std::string>> counted_;  // required once in this table
};

}  // namespace trunnion::config
