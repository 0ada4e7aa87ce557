#include "report/json_figures.hpp"

#include <algorithm>
#include <cmath>

#include "report/svg.hpp"

namespace trunnion::report {

Page opened(const ResultText& result) {
  Page page;
  page.title = result.title;
  page.verdict = result.verdict;
  page.result_json = result.json;
  page.made_by = result.made_by;
  return page;
}

double number_at(const ordered_json& object, std::string_view key) {
  const auto it = object.find(key);
  return it != object.end() && it->is_number() ? it->get<double>() : kGap;
}

std::string text_at(const ordered_json& object, std::string_view key) {
  const auto it = object.find(key);
  return it != object.end() && it->is_string() ? it->get<std::string>() : "";
}

std::string cell_text(const ordered_json& value, int digits) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) return short_number(value.get<double>(), digits);
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_array()) return list_text(value, !value.empty() && value.front().is_array() ? "; " : ", ");
  return value.is_null() ? "–" : value.dump();
}

std::string list_text(const ordered_json& list, const char* between) {
  std::string out;
  for (const auto& item : list) out += (out.empty() ? "" : between) + cell_text(item);
  return out;
}

Table table_of(const ordered_json& rows, const std::vector<Column>& columns) {
  Table out;
  for (const Column& column : columns) {
    out.columns.emplace_back(column.title);
    out.numeric.push_back(std::any_of(rows.begin(), rows.end(), [&](const auto& row) {
      const auto it = row.find(column.key);
      return it != row.end() && it->is_number();
    }));
  }
  for (const auto& row : rows) {
    std::vector<std::string> cells;
    for (const Column& column : columns) {
      const auto it = row.find(column.key);
      cells.push_back(it == row.end() ? "" : cell_text(*it, column.digits));
    }
    out.rows.push_back(std::move(cells));
  }
  return out;
}

ordered_json named_rows(const ordered_json& named) {
  ordered_json out = ordered_json::array();
  for (const auto& [name, row] : named.items()) {
    ordered_json one = {{"name", name}};
    one.update(row);
    out.push_back(std::move(one));
  }
  return out;
}

XyPlot bar_plot(Scale y, std::vector<std::string> categories) {
  XyPlot out;
  out.y = std::move(y);
  out.categories = std::move(categories);
  return out;
}

void add_bars(XyPlot& plot, std::string name, const std::vector<double>& values) {
  Series s;
  s.name = std::move(name);
  s.mark = Mark::bars;
  for (std::size_t i = 0; i < values.size(); ++i) s.x.push_back(static_cast<double>(i));
  s.y = values;
  plot.series.push_back(std::move(s));
}

std::vector<double> numbers_of(const ordered_json& rows, std::string_view key) {
  std::vector<double> out;
  for (const auto& row : rows) out.push_back(number_at(row, key));
  return out;
}

std::vector<std::string> texts_of(const ordered_json& rows, std::string_view key) {
  std::vector<std::string> out;
  for (const auto& row : rows) out.push_back(text_at(row, key));
  return out;
}

std::vector<double> numbers_of(const ordered_json& list) {
  std::vector<double> out;
  for (const auto& v : list) out.push_back(v.is_number() ? v.get<double>() : kGap);
  return out;
}

}  // namespace trunnion::report
