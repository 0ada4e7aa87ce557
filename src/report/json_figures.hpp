#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/report/command_pages.hpp"
#include "trunnion/report/page.hpp"

/// Figures and tables of a command's JSON result: what a page shows is what the JSON says.
namespace trunnion::report {

using nlohmann::ordered_json;

/// A page with the title and the sentence of the command, and no section yet.
Page opened(const ResultText& result);

/// The number of this key; not-a-number where there is none.
double number_at(const ordered_json& object, std::string_view key);
/// The text of this key; "" where there is none.
std::string text_at(const ordered_json& object, std::string_view key);
/// A number, a text or a truth as a cell: "–" for null.
std::string cell_text(const ordered_json& value, int digits = 4);
/// All texts of a list, "" for none.
std::string list_text(const ordered_json& list, const char* between = ", ");

/// A column of a table: the key in each row, its heading, and how many digits a number gets.
struct Column {
  const char* key;
  const char* title;
  int digits = 4;
};
/// One row for each object of `rows`; columns that hold numbers stand on the right.
Table table_of(const ordered_json& rows, const std::vector<Column>& columns);

/// {"X": {..}, "Y": {..}} as rows with a key "name".
ordered_json named_rows(const ordered_json& named);

/// Bars beside each other, one group for each category.
XyPlot bar_plot(Scale y, std::vector<std::string> categories);
void add_bars(XyPlot& plot, std::string name, const std::vector<double>& values);
/// The numbers of one key of all rows.
std::vector<double> numbers_of(const ordered_json& rows, std::string_view key);
std::vector<std::string> texts_of(const ordered_json& rows, std::string_view key);
/// A list of numbers, null as not-a-number.
std::vector<double> numbers_of(const ordered_json& list);

}  // namespace trunnion::report
