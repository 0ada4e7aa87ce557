#pragma once
#include <nlohmann/json.hpp>
#include <string>

#include "trunnion/report/page.hpp"

namespace trunnion::report {

/// What the page's script draws from: figures by id (float32, base64,
/// little-endian), the scene.
nlohmann::ordered_json page_data(const Page& page);

/// JSON text that can stand inside <script>: no `<` in it.
std::string script_text(const std::string& json);

/// Most points of a series that are drawn; more are thinned, extremes kept, and the caption says so.
inline constexpr std::size_t kDrawnFlat = 4000;
inline constexpr std::size_t kDrawnSpace = 30000;

}  // namespace trunnion::report
