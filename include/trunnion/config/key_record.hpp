#pragma once
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

// What the readers of TOML files ask for, written down while they read: tables of keys, JSON schemas and man
// pages are made of it, so that no list of keys stands beside the readers.
namespace trunnion::config {

/// What may stand behind a key.
enum class KeyType {
  number,
  integer,
  text,
  flag,
  vector,
  numbers,
  texts,
  table,
  tables,
  text_or_texts,
  other
};

struct KeyRecord {
  std::set<KeyType> types;           // all that the readers asked for
  std::vector<std::string> choices;  // of a text: all that may stand there; empty: any
  std::size_t required = 0;          // tables in which the reader required it
};

/// One table of a file, by its path: "", "machine", "axis" for each [[axis]], "channel.range".
struct TableRecord {
  std::map<std::string, KeyRecord> keys;
  std::set<std::string> patterns;  // regular expressions of further keys that the reader takes
  std::size_t seen = 0;            // tables of this path that were read
};

using FileRecord = std::map<std::string, TableRecord>;

/// While it lives, sections of this thread write into `record` what is asked of them. Only the first document
/// that is read counts: what a reader makes itself, or reads on the way, does not.
class KeyRecording {
 public:
  explicit KeyRecording(FileRecord& record);
  ~KeyRecording();
  KeyRecording(const KeyRecording&) = delete;
  KeyRecording& operator=(const KeyRecording&) = delete;

 private:
  std::unique_ptr<class KeyRecorder> recorder_;
};

}  // namespace trunnion::config
