#pragma once
#include <map>
#include <string>

#include "trunnion/base/result.hpp"

#include "app/file_keys.hpp"

namespace trunnion::app {

/// JSON Schema (draft 2020-12) of one kind of TOML file: what its reader takes, with the meanings of the
/// tables of keys that ship with the program. What the reader refuses as unknown the schema refuses.
Result<std::string> file_schema(const std::string& kind);

/// trunnion-machine(5) and the like: every key with its type, unit and meaning.
Result<std::string> file_page(const std::string& kind);

/// trunnion-measurements(5), trunnion-tools(5) and the like: every column of a CSV file.
Result<std::string> column_page(const std::string& kind);

/// Keys that the reader takes and no table of keys explains, and keys that a table explains and the reader
/// does not take, a line each; empty: none.
Result<std::string> unexplained_keys(const std::string& kind);

}  // namespace trunnion::app
