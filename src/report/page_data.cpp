#include "report/page_data.hpp"

#include <bit>
#include <cstring>

#include "trunnion/base/printable.hpp"

#include "report/packed.hpp"

namespace trunnion::report {
namespace {

using nlohmann::ordered_json;
static_assert(std::endian::native == std::endian::little,
              "base64 arrays are written as they stand in memory");

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
  ordered_json out = {{"kind", "xy"},
                      {"x", scale(plot.x)},
                      {"y", scale(plot.y)},
                      {"equal", plot.equal_scales},
                      {"numbered", plot.numbered}};
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

// Each coordinate by itself: neighbours differ little.
ordered_json corners_of(const Scene::Body& body) {
  constexpr double kFine_mm = 1e-2;
  ordered_json out = ordered_json::array();
  for (std::size_t k = 0; k < 3; ++k) {
    std::vector<double> values;
    values.reserve(body.corners.size());
    for (const auto& corner : body.corners) values.push_back(corner[k]);
    out.push_back({{"step", kFine_mm}, {"count", values.size()}, {"values", packed(values, kFine_mm)}});
  }
  return out;
}

ordered_json scene_data(const Scene& scene) {
  ordered_json out = {{"tool_chain", scene.chains.tool},
                      {"part_chain", scene.chains.part},
                      {"spindle", scene.zero.spindle_M},
                      {"part", scene.zero.part_M},
                      {"tool_length", scene.zero.tool_length_mm},
                      {"size", scene.size_mm},
                      {"worst", scene.worst},
                      {"path_figure", scene.path_figure},
                      {"axes", ordered_json::array()},
                      {"bodies", ordered_json::array()},
                      {"columns", ordered_json::array()},
                      {"colourings", ordered_json::array()}};
  for (const auto& a : scene.axes)
    out["axes"].push_back({{"name", a.name},
                           {"rotary", a.rotary},
                           {"direction", a.direction},
                           {"point", a.point},
                           {"min", a.min},
                           {"max", a.max},
                           {"carries_part", a.carries_part},
                           {"motion", a.motion}});
  for (const auto& b : scene.bodies)
    out["bodies"].push_back({{"name", b.name},
                             {"role", b.role},
                             {"part_side", b.on_part_side},
                             {"axes", b.axes},
                             {"corners", corners_of(b)}});
  for (const auto& c : scene.columns)
    out["columns"].push_back({{"name", c.name},
                              {"unit", c.unit},
                              {"step", c.step},
                              {"count", c.values.size()},
                              {"values", packed(c.values, c.step)}});
  for (const auto& c : scene.colourings)
    out["colourings"].push_back(
        {{"column", c.column}, {"label", c.label}, {"unit", c.unit}, {"largest", c.largest}});
  for (const auto& s : scene.by_hand.stands) out["stands"].push_back({{"text", s.text}, {"q", s.q}});
  if (!scene.by_hand.start.empty()) out["start"] = scene.by_hand.start;
  if (scene.beside) out["beside"] = *scene.beside;
  const auto put_text = [&](const char* name, const Scene::Text& text) {
    if (!text.lines.empty()) out[name] = {{"lines", packed(text.lines)}, {"of_blocks", text.of_blocks}};
  };
  put_text("nc_text", scene.texts.nc);
  put_text("cl_text", scene.texts.cl);
  return out;
}

}  // namespace

ordered_json page_data(const Page& page) {
  ordered_json out = {{"figures", ordered_json::object()}};
  for (const Section& section : page.sections) {
    for (const Item& item : section.items) {
      if (const auto* figure = std::get_if<Figure>(&item))
        out["figures"][figure->id] =
            std::visit([](const auto& plot) { return plot_data(plot); }, figure->plot);
      if (const auto* scene = std::get_if<Scene>(&item)) out["scene"] = scene_data(*scene);
      if (const auto* table = std::get_if<Table>(&item); table != nullptr && !table->go_to.empty())
        out["go_to"][table->id] = table->go_to;
    }
  }
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
