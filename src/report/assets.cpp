#include "report/assets.hpp"

// Embedded by the assembler: no conversion step, and megabytes cost no compile time. The paths come from
// CMake.
#define TRUNNION_EMBED(symbol, path)                      \
  asm(".section .rodata\n"                                \
      ".global trunnion_" #symbol                         \
      "_begin\n"                                          \
      ".global trunnion_" #symbol                         \
      "_end\n"                                            \
      "trunnion_" #symbol "_begin:\n.incbin \"" path      \
      "\"\n"                                              \
      "trunnion_" #symbol "_end:\n.byte 0\n.previous\n"); \
  extern "C" const char trunnion_##symbol##_begin[];      \
  extern "C" const char trunnion_##symbol##_end[]

TRUNNION_EMBED(style, TRUNNION_WEB "/page.css");
// One after the other: each uses those before it.
#define TRUNNION_MODULE(name) TRUNNION_WEB "/" name ".js\"\n.incbin \""
TRUNNION_EMBED(script, TRUNNION_MODULE("core") TRUNNION_MODULE("figures") TRUNNION_MODULE("kinematics")
                           TRUNNION_MODULE("surface") TRUNNION_MODULE("gl") TRUNNION_MODULE("program")
                               TRUNNION_MODULE("scene") TRUNNION_MODULE("story") TRUNNION_WEB "/page.js");
TRUNNION_EMBED(charts, TRUNNION_CHARTS);

namespace trunnion::report {

std::string_view style_sheet() {
  return {trunnion_style_begin, trunnion_style_end};
}
std::string_view page_script() {
  return {trunnion_script_begin, trunnion_script_end};
}
std::string_view chart_library() {
  return {trunnion_charts_begin, trunnion_charts_end};
}

}  // namespace trunnion::report
