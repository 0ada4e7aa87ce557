#pragma once
#include <string_view>

/// Files of src/report/web and the bundled chart library, embedded into the program.
namespace trunnion::report {

std::string_view style_sheet();
std::string_view page_script();
/// The chart library; empty when it was not bundled at build time.
std::string_view chart_library();

}  // namespace trunnion::report
