#pragma once
#include <string>

namespace trunnion::report {

/// An indented JSON document. Bytes that are no UTF-8 (names of files may hold any) become U+FFFD.
template <class Json>
std::string json_text(const Json& json, int indent = 2) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace trunnion::report
