#pragma once
#include <string>

#include "trunnion/report/page.hpp"

namespace trunnion::report {

/// A page of any command's JSON result: numbers and texts become facts, lists of objects tables, and columns
/// in one unit bars; lists of numbers of equal length become a plot against the first. What a command wants
/// to say beyond that has a page of its own (nc_page, model_page).
Page result_page(const std::string& title, const std::string& verdict, const std::string& result_json,
                 const std::string& made_by);

}  // namespace trunnion::report
