#pragma once
#include <string>
#include <vector>

#include "trunnion/base/result.hpp"
#include "trunnion/config/key_record.hpp"

namespace trunnion::app {

/// Tables of one path that differ by what stands behind a key: an axis by its `type`, an effect by its `id`.
struct KeyVariant {
  std::string table;    // "axis"
  std::string key;      // "type"
  std::string pattern;  // regular expression of its value; empty: any, the key must only be there
  config::FileRecord record;
};

/// Every key that the reader of one kind of TOML file takes.
struct FileKeys {
  config::FileRecord record;         // of all variants together
  std::vector<KeyVariant> variants;  // the last of a path is the one where no condition holds
};

/// "machine", "controller", "model", "plan", "thermal", "batch", "maker".
const std::vector<std::string>& file_kinds();

/// Lets the reader of this kind read probes, in which every table stands once, and writes down what it asks
/// for. Fails with io_failed where no temporary file can be written.
Result<FileKeys> keys_of_file(const std::string& kind);

}  // namespace trunnion::app
