#include "trunnion/report/result_page.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "report/json_figures.hpp"
#include "report/svg.hpp"

namespace trunnion::report {
namespace {

using nlohmann::ordered_json;

// "rmse_um" -> {"rmse", "µm"}: the unit at the end of a key, as the files have it.
Scale scale_of_key(const std::string& key) {
  constexpr std::pair<std::string_view, const char*> kUnits[] = {
      {"_um", "µm"},   {"_urad", "µrad"}, {"_mm", "mm"}, {"_deg", "°"},
      {"_degC", "°C"}, {"_min", "min"},   {"_s", "s"}};
  for (const auto& [suffix, unit] : kUnits) {
    if (key.size() > suffix.size() && key.ends_with(suffix))
      return {key.substr(0, key.size() - suffix.size()), unit};
  }
  return {key, ""};
}

std::string text_of(const ordered_json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) return short_number(value.get<double>(), 5);
  if (value.is_null()) return "–";
  return value.dump();
}

bool is_table(const ordered_json& value) {
  if (!value.is_array() || value.empty()) return false;
  return std::all_of(value.begin(), value.end(), [](const auto& row) { return row.is_object(); });
}

// {"X0C": {"value": .., "sigma": ..}, ..}: rows with names.
bool is_named_rows(const ordered_json& value) {
  if (!value.is_object() || value.empty()) return false;
  return std::all_of(value.begin(), value.end(), [](const auto& row) {
    return row.is_object() && !row.empty() &&
           std::none_of(row.begin(), row.end(), [](const auto& v) { return v.is_structured(); });
  });
}

bool is_series(const ordered_json& value) {
  if (!value.is_array() || value.size() < 3) return false;
  return std::all_of(value.begin(), value.end(), [](const auto& v) { return v.is_number() || v.is_null(); });
}

class Builder {
 public:
  explicit Builder(Page& page) : page_{page} {}

  void object(const std::string& path, const ordered_json& value) {
    Section section{path.empty() ? "Result" : path, {}};
    plot(path, value, section);
    for (const auto& [key, item] : value.items()) {
      const std::string name = path.empty() ? key : path + ", " + key;
      if (is_table(item)) table(name, item, section);
      if (is_named_rows(item)) table(name, named_rows(item), section);
    }
    if (!section.items.empty()) page_.sections.push_back(std::move(section));
    for (const auto& [key, item] : value.items()) {
      const std::string name = path.empty() ? key : path + ", " + key;
      if (item.is_object() && !is_named_rows(item)) object(name, item);
      if (!item.is_structured()) fact(name, item);
      if (!is_table(item)) continue;
      for (std::size_t i = 0; i < item.size(); ++i) nested(name, item[i], i);
    }
  }

 private:
  std::string next_id(const char* kind) { return kind + std::to_string(++count_); }

  void fact(const std::string& name, const ordered_json& value) {
    const std::optional<double> number =
        value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
    const Scale scale = scale_of_key(name);
    page_.facts.push_back(
        {name, scale.label, text_of(value) + (scale.unit.empty() ? "" : " " + scale.unit), number});
  }

  // Objects and lists inside the rows of a table get sections of their own, named by the row.
  void nested(const std::string& name, const ordered_json& row, std::size_t index) {
    std::string title = name + " " + std::to_string(index + 1);
    for (const auto& item : row) {
      if (item.is_string()) {
        title = name + ": " + item.get<std::string>();
        break;
      }
    }
    unit_ = row.contains("unit") && row["unit"].is_string() ? row["unit"].get<std::string>() : "";
    Section section{title, {}};
    plot(title, row, section);
    for (const auto& [key, item] : row.items()) {
      if (is_table(item)) table(title + ", " + key, item, section);
      if (is_named_rows(item))
        table(title + ", " + key, named_rows(item), section);
      else if (item.is_object())
        plot(title + ", " + key, item, section);
    }
    if (!section.items.empty()) page_.sections.push_back(std::move(section));
  }

  // Lists of numbers as long as the first one, against it.
  void plot(const std::string& title, const ordered_json& value, Section& section) {
    XyPlot plot;
    std::vector<double> x;
    for (const auto& [key, item] : value.items()) {
      if (!is_series(item)) continue;
      std::vector<double> numbers;
      for (const auto& v : item) numbers.push_back(v.is_null() ? std::nan("") : v.get<double>());
      if (x.empty()) {
        x = std::move(numbers);
        plot.x = scale_of_key(key);
      } else if (numbers.size() == x.size()) {
        Series s;
        s.name = scale_of_key(key).label;
        s.x = x;
        s.y = std::move(numbers);
        plot.y = {"value", scale_of_key(key).unit.empty() ? unit_ : scale_of_key(key).unit};
        plot.series.push_back(std::move(s));
      }
    }
    if (!plot.series.empty())
      section.items.emplace_back(Figure{next_id("figure-"), title, "", std::move(plot)});
  }

  void table(const std::string& title, const ordered_json& rows, Section& section) {
    Table out;
    out.id = next_id("table-");
    out.title = title;
    std::vector<std::string> keys;
    for (const auto& [key, item] : rows.front().items()) {
      if (item.is_structured()) continue;
      keys.push_back(key);
      out.columns.push_back(scale_text(scale_of_key(key)));
      out.numeric.push_back(item.is_number());
    }
    for (const auto& row : rows) {
      std::vector<std::string> cells;
      cells.reserve(keys.size());
      for (const auto& key : keys) cells.push_back(row.contains(key) ? text_of(row[key]) : "");
      out.rows.push_back(std::move(cells));
    }
    bars(title, rows, keys, section);
    if (!keys.empty()) section.items.emplace_back(std::move(out));
  }

  // Columns in micrometres beside each other, when the rows have names.
  void bars(const std::string& title, const ordered_json& rows, const std::vector<std::string>& keys,
            Section& section) {
    constexpr std::size_t kMost = 24;
    if (keys.empty() || !rows.front()[keys.front()].is_string() || rows.size() > kMost) return;
    XyPlot plot{{"", ""}, {"value", "µm"}, {}, {}, {}, false};
    for (const auto& row : rows)
      plot.categories.push_back(row.contains(keys.front()) ? text_of(row[keys.front()]) : "");
    for (const auto& key : keys) {
      if (scale_of_key(key).unit != "µm") continue;
      Series s;
      s.name = scale_of_key(key).label;
      s.mark = Mark::bars;
      for (std::size_t i = 0; i < rows.size(); ++i) {
        s.x.push_back(static_cast<double>(i));
        const bool number = rows[i].contains(key) && rows[i][key].is_number();
        s.y.push_back(number ? rows[i][key].get<double>() : std::nan(""));
      }
      plot.series.push_back(std::move(s));
    }
    if (plot.series.size() == 1) plot.y.label = plot.series.front().name;
    if (!plot.series.empty())
      section.items.emplace_back(Figure{next_id("figure-"), title, "", std::move(plot)});
  }

  Page& page_;
  std::string unit_;  // of the row whose lists are drawn
  std::size_t count_ = 0;
};

}  // namespace

Page result_page(const std::string& title, const std::string& verdict, const std::string& result_json,
                 const std::string& made_by) {
  Page page;
  page.title = title;
  page.verdict = verdict;
  page.result_json = result_json;
  page.made_by = made_by;
  const auto json = ordered_json::parse(result_json, nullptr, false);
  Builder builder(page);
  if (json.is_object()) builder.object("", json);
  if (json.is_array()) builder.object("", {{"results", json}});
  return page;
}

}  // namespace trunnion::report
