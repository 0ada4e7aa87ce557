#include "report/json_figures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "trunnion/base/number_text.hpp"

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

namespace {

// Numbers of a column have the same decimals, unless that would show one of them as nothing.
std::optional<int> decimals_of(const ordered_json& rows, const Column& column) {
  double largest = 0.0;
  double least = std::numeric_limits<double>::infinity();
  bool whole = true;
  for (const auto& row : rows) {
    const auto it = row.find(column.key);
    if (it == row.end() || !it->is_number_float()) continue;
    const double size = std::abs(it->template get<double>());
    whole = whole && size == std::floor(size);
    if (size == 0.0) continue;
    largest = std::max(largest, size);
    least = std::min(least, size);
  }
  constexpr double kMostWhole = 1e6;
  if (!(largest > 0.0) || largest >= kMostWhole) return std::nullopt;
  if (whole) return 0;
  const int out = std::max(0, column.digits - 1 - static_cast<int>(std::floor(std::log10(largest))));
  constexpr int kMostDecimals = 6;
  if (out > kMostDecimals || least < 10.0 * std::pow(10.0, -out)) return std::nullopt;
  return out;
}

}  // namespace

Table table_of(const ordered_json& rows, const std::vector<Column>& columns) {
  Table out;
  std::vector<std::optional<int>> decimals;
  for (const Column& column : columns) {
    decimals.push_back(decimals_of(rows, column));
    out.columns.emplace_back(column.title);
    out.numeric.push_back(std::any_of(rows.begin(), rows.end(), [&](const auto& row) {
      const auto it = row.find(column.key);
      return it != row.end() && it->is_number();
    }));
  }
  for (const auto& row : rows) {
    std::vector<std::string> cells;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const auto it = row.find(columns[c].key);
      if (it == row.end())
        cells.emplace_back();
      else if (it->is_number_float() && decimals[c])
        cells.push_back(fixed_text(it->template get<double>(), *decimals[c]));
      else
        cells.push_back(cell_text(*it, columns[c].digits));
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
