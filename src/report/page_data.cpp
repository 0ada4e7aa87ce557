#include "report/page_data.hpp"

#include <bit>
#include <cstring>

#include "trunnion/base/printable.hpp"

namespace trunnion::report {
namespace {

using nlohmann::ordered_json;
static_assert(std::endian::native == std::endian::little,
              "base64 arrays are written as they stand in memory");

std::string base64(const void* data, std::size_t bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const auto* in = static_cast<const unsigned char*>(data);
  std::string out;
  out.reserve((bytes + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes; i += 3) {
    const std::size_t have = std::min<std::size_t>(3, bytes - i);
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = (group << 8U) | (k < have ? in[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      out += k <= have ? kDigits[(group >> (18U - 6U * static_cast<unsigned>(k))) & 63U] : '=';
  }
  return out;
}

std::string floats(const std::vector<float>& values) {
  return base64(values.data(), values.size() * sizeof(float));
}

std::string floats(const std::vector<double>& values, const std::vector<std::size_t>& kept) {
  std::vector<float> out;
  out.reserve(kept.size());
  for (const std::size_t i : kept) out.push_back(static_cast<float>(values[i]));
  return floats(out);
}

std::vector<std::string> chosen(const std::vector<std::string>& texts, const std::vector<std::size_t>& kept) {
  std::vector<std::string> out;
  for (const std::size_t i : kept) {
    if (i < texts.size()) out.push_back(texts[i]);
  }
  return out;
}

ordered_json scale(const Scale& s) {
  return {{"label", s.label}, {"unit", s.unit}, {"log", s.logarithmic}};
}

const char* mark_name(Mark mark) {
  switch (mark) {
    case Mark::line:
      return "line";
    case Mark::points:
      return "points";
    case Mark::bars:
      return "bars";
    case Mark::band:
      return "band";
  }
  return "line";
}

ordered_json series(const Series& s, std::size_t index) {
  const auto kept = thinned(s.y, kDrawnFlat);
  ordered_json out = {{"name", s.name},
                      {"mark", mark_name(s.mark)},
                      {"colour", s.colour.value_or(static_cast<int>(index))},
                      {"x", floats(s.x, kept)},
                      {"y", floats(s.y, kept)}};
  if (!s.y2.empty()) out["y2"] = floats(s.y2, kept);
  if (!s.labels.empty()) out["labels"] = chosen(s.labels, kept);
  return out;
}

ordered_json plot_data(const XyPlot& plot) {
  ordered_json out = {
      {"kind", "xy"}, {"x", scale(plot.x)}, {"y", scale(plot.y)}, {"equal", plot.equal_scales}};
  out["series"] = ordered_json::array();
  for (std::size_t i = 0; i < plot.series.size(); ++i) out["series"].push_back(series(plot.series[i], i));
  out["levels"] = ordered_json::array();
  for (const Level& level : plot.levels)
    out["levels"].push_back({{"name", level.name}, {"value", level.value}});
  if (!plot.categories.empty()) out["categories"] = plot.categories;
  return out;
}

ordered_json plot_data(const BoxPlot& plot) {
  ordered_json out = {{"kind", "box"}, {"y", scale(plot.y)}, {"samples", ordered_json::array()}};
  for (const auto& sample : plot.samples) {
    out["samples"].push_back(
        {{"name", sample.name}, {"y", floats(sample.values, thinned(sample.values, kDrawnFlat))}});
  }
  return out;
}

ordered_json plot_data(const SpacePlot& plot) {
  const auto kept = thinned(plot.value, kDrawnSpace);
  ordered_json out = {{"kind", plot.kind == SpacePlot::Kind::path ? "path" : "vectors"},
                      {"unit", plot.unit},
                      {"frame", plot.frame},
                      {"colour", scale(plot.colour)},
                      {"max", plot.value_max},
                      {"x", floats(plot.x, kept)},
                      {"y", floats(plot.y, kept)},
                      {"z", floats(plot.z, kept)},
                      {"value", floats(plot.value, kept)}};
  if (plot.kind == SpacePlot::Kind::vectors) {
    out["u"] = floats(plot.u, kept);
    out["v"] = floats(plot.v, kept);
    out["w"] = floats(plot.w, kept);
    out["magnification"] = plot.magnification;
  }
  if (!plot.labels.empty()) out["labels"] = chosen(plot.labels, kept);
  return out;
}

ordered_json plot_data(const MatrixPlot& plot) {
  return {{"kind", "matrix"}, {"rows", plot.rows},     {"columns", plot.columns},
          {"z", plot.values}, {"max", plot.value_max}, {"colour", scale(plot.colour)}};
}

ordered_json machine_data(const MachineView& view) {
  std::vector<float> pose;
  std::vector<float> tip;
  std::vector<float> axes;
  std::vector<float> path;
  std::vector<float> deviation;
  std::vector<std::uint32_t> nc_line;
  std::vector<std::uint32_t> cl_line;
  for (const auto& stop : view.stops) {
    pose.insert(pose.end(), stop.part_in_machine.begin(), stop.part_in_machine.end());
    tip.insert(tip.end(), stop.tip_P.begin(), stop.tip_P.end());
    axes.insert(axes.end(), stop.axes.begin(), stop.axes.end());
    path.push_back(stop.path_mm);
    deviation.push_back(stop.deviation_um);
    nc_line.push_back(stop.nc_line);
    cl_line.push_back(stop.cl_line);
  }
  ordered_json out = {{"axis_names", view.axis_names},
                      {"axis_units", view.axis_units},
                      {"tool_length", view.tool_length_mm},
                      {"space_figure", view.space_figure},
                      {"path_figure", view.path_figure},
                      {"pose", floats(pose)},
                      {"tip", floats(tip)},
                      {"axes", floats(axes)},
                      {"path", floats(path)},
                      {"deviation", floats(deviation)},
                      {"nc_line", nc_line},
                      {"cl_line", cl_line},
                      {"outlines", ordered_json::array()}};
  for (const auto& outline : view.outlines) {
    std::vector<float> points;
    for (const auto& p : outline.points) points.insert(points.end(), p.begin(), p.end());
    out["outlines"].push_back(
        {{"name", outline.name}, {"moves", outline.moves_with_part}, {"points", floats(points)}});
  }
  return out;
}

}  // namespace

ordered_json page_data(const Page& page) {
  ordered_json out = {{"figures", ordered_json::object()}, {"arrays", ordered_json::object()}};
  for (const Section& section : page.sections) {
    for (const Item& item : section.items) {
      if (const auto* figure = std::get_if<Figure>(&item))
        out["figures"][figure->id] =
            std::visit([](const auto& plot) { return plot_data(plot); }, figure->plot);
      if (const auto* view = std::get_if<MachineView>(&item)) out["machine"] = machine_data(*view);
      if (const auto* table = std::get_if<Table>(&item); table != nullptr && !table->go_to.empty())
        out["go_to"][table->id] = table->go_to;
    }
  }
  for (const auto& [name, values] : page.arrays) out["arrays"][name] = floats(values);
  return out;
}

std::string script_text(const std::string& json) {
  std::string out;
  out.reserve(json.size());
  for (const char c : printable_json(json)) {
    if (c == '<') {
      out += "\\u003c";
    } else {
      out += c;
    }
  }
  return out;
}

}  // namespace trunnion::report
