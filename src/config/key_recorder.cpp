#include "config/key_recorder.hpp"

#include <algorithm>
#include <regex>

namespace trunnion::config {

KeyRecorder*& KeyRecorder::active() {
  thread_local KeyRecorder* recorder = nullptr;
  return recorder;
}

namespace {

// A key that a pattern covers is written down as "*".
std::string covered(const TableRecord& record, std::string_view key) {
  const std::string name(key);
  const bool is_free =
      std::any_of(record.patterns.begin(), record.patterns.end(),
                  [&](const std::string& pattern) { return std::regex_search(name, std::regex(pattern)); });
  return is_free && !record.keys.contains(name) ? "*" : name;
}

}  // namespace

TableRecord* KeyRecorder::record_of(const Value& table) {
  const auto path = paths_.find(&table);
  return path == paths_.end() ? nullptr : &record_[path->second];
}

void KeyRecorder::enter(const Value& table) {
  if (paths_.empty()) {
    paths_.emplace(&table, "");
    ++record_[""].seen;
  }
}

void KeyRecorder::step(const Value& table, std::string_view key, const Value& child) {
  const auto path = paths_.find(&table);
  if (path == paths_.end()) return;
  std::string name = path->second + (path->second.empty() ? "" : ".") + covered(record_[path->second], key);
  const auto [place, is_new] = paths_.emplace(&child, std::move(name));
  if (is_new) ++record_[place->second].seen;
}

void KeyRecorder::asked(const Value& table, std::string_view key, KeyType type) {
  if (auto* record = record_of(table)) record->keys[covered(*record, key)].types.insert(type);
}

void KeyRecorder::required(const Value& table, std::string_view key) {
  auto* record = record_of(table);
  if (record != nullptr && counted_.emplace(&table, key).second)
    ++record->keys[covered(*record, key)].required;
}

void KeyRecorder::choices(const Value& table, std::string_view key, const std::vector<std::string>& names) {
  if (auto* record = record_of(table)) record->keys[std::string(key)].choices = names;
}

void KeyRecorder::pattern(const Value& table, std::string_view pattern) {
  if (auto* record = record_of(table); record != nullptr && !pattern.empty())
    record->patterns.emplace(pattern);
}

KeyRecording::KeyRecording(FileRecord& record) : recorder_(std::make_unique<KeyRecorder>(record)) {
  KeyRecorder::active() = recorder_.get();
}

KeyRecording::~KeyRecording() {
  KeyRecorder::active() = nullptr;
}

}  // namespace trunnion::config
