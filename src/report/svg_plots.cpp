// The flat plots: lines, points, bars, bands, boxes and matrices.
#include <algorithm>
#include <cmath>
#include <limits>

#include "report/svg.hpp"

namespace trunnion::report {
namespace {

// As large as the chart that replaces it is in a window of 1280 pixels (web/page.css): letters have one size.
constexpr double kWidth = 600;
constexpr double kHeight = 380;
constexpr double kLeft = 74;
constexpr double kRight = 16;
constexpr double kTop = 14;
constexpr double kBottom = 46;
constexpr double kLegendRow = 20;
constexpr double kLetter = 7.2;             // width of one, on paper too
constexpr std::size_t kDrawnPoints = 1600;  // of a line: about three a drawing unit

struct AxisRange {
  double min = std::numeric_limits<double>::infinity();
  double max = -std::numeric_limits<double>::infinity();
  void take(double v) {
    if (!std::isfinite(v)) return;
    min = std::min(min, v);
    max = std::max(max, v);
  }
  void pad(double part) {
    if (!(min <= max)) *this = {0.0, 1.0};
    const double room = (max - min) * part;
    min -= room;
    max += room;
  }
};

int colour_of(const XyPlot& plot, std::size_t i) {
  return plot.series[i].colour.value_or(static_cast<int>(i));
}

double letters_of(const std::string& utf8) {
  return static_cast<double>(std::count_if(
      utf8.begin(), utf8.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

// Height that names take which are too long to stand beside each other, and are turned therefore.
double room_of_names(const std::vector<std::string>& categories) {
  constexpr double kBetween = 8.0;
  constexpr double kSlope = 0.5;  // sine of the angle by which they are turned
  constexpr double kMost = 130.0;
  double longest = 0.0;
  for (const auto& name : categories) longest = std::max(longest, letters_of(name));
  const double pitch =
      (kWidth - kLeft - kRight) / static_cast<double>(std::max<std::size_t>(1, categories.size()));
  const double width = kLetter * longest;
  return width + kBetween < pitch ? 0.0 : std::min(kSlope * width, kMost);
}

void frame(Svg& svg, const DrawnScale& x, const DrawnScale& y, const Scale& x_text, const Scale& y_text,
           double top, double bottom, const std::vector<std::string>& categories) {
  for (const double tick : y.ticks()) {
    svg.line(kLeft, y.at(tick), kWidth - kRight, y.at(tick), "class=\"grid\"");
    svg.text(kLeft - 6, y.at(tick) + 4, short_number(tick), "class=\"tick\" text-anchor=\"end\"");
  }
  if (categories.empty()) {
    for (const double tick : x.ticks()) {
      svg.line(x.at(tick), bottom, x.at(tick), bottom + 4, "class=\"axis\"");
      svg.text(x.at(tick), bottom + 17, short_number(tick), "class=\"tick\" text-anchor=\"middle\"");
    }
  }
  const bool turned = room_of_names(categories) > 0.0;
  for (std::size_t i = 0; i < categories.size(); ++i) {
    const double at = x.at(static_cast<double>(i));
    const std::string where = short_number(at) + " " + short_number(bottom + 15);
    svg.text(at, bottom + (turned ? 15 : 17), categories[i],
             turned ? "class=\"tick\" text-anchor=\"end\" transform=\"rotate(-30 " + where + ")\""
                    : std::string("class=\"tick\" text-anchor=\"middle\""));
  }
  svg.line(kLeft, bottom, kWidth - kRight, bottom, "class=\"axis\"");
  svg.line(kLeft, top, kLeft, bottom, "class=\"axis\"");
  svg.text((kLeft + kWidth - kRight) / 2, bottom + 38 + room_of_names(categories), scale_text(x_text),
           "class=\"label\" text-anchor=\"middle\"");
  const std::string middle = short_number((top + bottom) / 2);
  svg.text(16, (top + bottom) / 2, scale_text(y_text),
           "class=\"label\" text-anchor=\"middle\" transform=\"rotate(-90 16 " + middle + ")\"");
}

// Of a plot without numbers: where its axes point, through the middle.
void cross(Svg& svg, const DrawnScale& x, const DrawnScale& y, const XyPlot& plot) {
  const double right = x.at(x.value_max());
  const double top = y.at(y.value_max());
  svg.line(x.at(x.value_min()), y.at(0.0), right, y.at(0.0), "class=\"grid\"");
  svg.line(x.at(0.0), y.at(y.value_min()), x.at(0.0), top, "class=\"grid\"");
  svg.text(right - 4, y.at(0.0) - 4, scale_text(plot.x), "class=\"label\" text-anchor=\"end\"");
  svg.text(x.at(0.0) + 6, top + 12, scale_text(plot.y), "class=\"label\"");
}

void draw_line(Svg& svg, const Series& s, const DrawnScale& x, const DrawnScale& y,
               const std::string& colour) {
  std::vector<std::array<double, 2>> run;
  const std::string style = "stroke=\"" + colour + "\" stroke-width=\"1.4\"";
  for (const std::size_t i : thinned(s.y, kDrawnPoints)) {
    if (std::isfinite(s.y[i]) && std::isfinite(s.x[i])) {
      run.push_back({x.at(s.x[i]), y.at(s.y[i])});
      continue;
    }
    svg.polyline(run, style);
    run.clear();
  }
  svg.polyline(run, style);
}

void draw_band(Svg& svg, const Series& s, const DrawnScale& x, const DrawnScale& y,
               const std::string& colour) {
  std::vector<std::array<double, 2>> outline;
  for (std::size_t i = 0; i < s.x.size(); ++i) outline.push_back({x.at(s.x[i]), y.at(s.y[i])});
  for (std::size_t i = s.x.size(); i-- > 0;) outline.push_back({x.at(s.x[i]), y.at(s.y2[i])});
  svg.polyline(outline, "fill=\"" + colour + "\" fill-opacity=\"0.2\"", true);
}

void draw_points(Svg& svg, const Series& s, const DrawnScale& x, const DrawnScale& y,
                 const std::string& colour) {
  const double r = s.x.size() > 400 ? 1.4 : 2.8;
  const std::string fill = "fill=\"" + colour + "\"";
  for (const std::size_t i : thinned(s.y, kDrawnPoints)) {
    if (!std::isfinite(s.y[i]) || !std::isfinite(s.x[i])) continue;
    if (i < s.y2.size())
      svg.line(x.at(s.x[i]), y.at(s.y[i] - s.y2[i]), x.at(s.x[i]), y.at(s.y[i] + s.y2[i]),
               "stroke=\"" + colour + "\"");
    svg.circle(x.at(s.x[i]), y.at(s.y[i]), r, fill);
  }
}

void draw_bars(Svg& svg, const XyPlot& plot, std::size_t which, const DrawnScale& x, const DrawnScale& y,
               const std::string& colour) {
  std::size_t groups = 0;
  std::size_t own = 0;
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    if (plot.series[i].mark != Mark::bars) continue;
    if (i < which) ++own;
    ++groups;
  }
  const Series& s = plot.series[which];
  const double pitch = s.x.size() > 1 ? std::abs(x.at(s.x[1]) - x.at(s.x[0])) : 120.0;
  const double width = 0.8 * pitch / static_cast<double>(groups);
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    if (!std::isfinite(s.y[i])) continue;
    const double left = x.at(s.x[i]) + (static_cast<double>(own) - static_cast<double>(groups) / 2) * width;
    const double base = y.at(std::clamp(0.0, y.value_min(), y.value_max()));
    const double top = y.at(s.y[i]);
    svg.rect(left, std::min(base, top), width, std::abs(base - top), "fill=\"" + colour + "\"");
  }
}

// How a series is drawn, before its name.
void legend_mark(Svg& svg, double x, double y, const Series& series, const std::string& colour) {
  constexpr double kWide = 14;
  switch (series.mark) {
    case Mark::line:
      svg.rect(x, y - 1, kWide, 2, "fill=\"" + colour + "\"");
      return;
    case Mark::points:
      svg.circle(x + kWide / 2, y, 3, "fill=\"" + colour + "\"");
      return;
    case Mark::bars:
      svg.rect(x, y - 3, kWide, 6, "fill=\"" + colour + "\"");
      return;
    case Mark::band:
      svg.rect(x, y - 3, kWide, 6, "fill=\"" + colour + "\" opacity=\"0.2\"");
      return;
  }
}

// Names in rows above the plot; returns the height taken.
double legend(Svg& svg, const XyPlot& plot) {
  std::vector<std::size_t> named;
  for (std::size_t i = 0; i < plot.series.size(); ++i)
    if (!plot.series[i].name.empty()) named.push_back(i);
  if (named.size() < 2) return 0.0;
  double at = kLeft;
  double row = kTop;
  for (const std::size_t i : named) {
    const double width = 36.0 + kLetter * letters_of(plot.series[i].name);
    if (at > kLeft && at + width > kWidth) {
      at = kLeft;
      row += kLegendRow;
    }
    legend_mark(svg, at, row - 3, plot.series[i], palette(colour_of(plot, i)));
    svg.text(at + 19, row + 1, plot.series[i].name, "class=\"tick\"");
    at += width;
  }
  return row + kLegendRow - kTop;
}

void ranges_of(const XyPlot& plot, AxisRange& x, AxisRange& y) {
  for (const Series& s : plot.series) {
    for (const double v : s.x) x.take(v);
    for (std::size_t i = 0; i < s.y.size(); ++i) {
      y.take(s.y[i]);
      if (s.mark == Mark::band) y.take(s.y2[i]);
      if (s.mark == Mark::points && i < s.y2.size()) {
        y.take(s.y[i] - s.y2[i]);
        y.take(s.y[i] + s.y2[i]);
      }
      if (s.mark == Mark::bars) y.take(0.0);
    }
  }
  for (const Level& level : plot.levels) y.take(level.value);
  x.pad(plot.categories.empty() ? 0.01 : 0.0);
  if (!plot.y.logarithmic) y.pad(0.05);
  if (!(y.min <= y.max)) y = {0.0, 1.0};
  if (plot.categories.empty()) return;
  x = {-0.5, static_cast<double>(plot.categories.size()) - 0.5};
}

// Widens the range that has room so that a unit is as long on both axes.
void equalise(AxisRange& x, AxisRange& y, double width, double height) {
  const double scale = std::min(width / (x.max - x.min), height / (y.max - y.min));
  const double more_x = (width / scale - (x.max - x.min)) / 2;
  const double more_y = (height / scale - (y.max - y.min)) / 2;
  x = {x.min - more_x, x.max + more_x};
  y = {y.min - more_y, y.max + more_y};
}

}  // namespace

std::string svg_of(const XyPlot& plot, std::string_view title) {
  Svg svg(kWidth, kHeight, title);
  const double top = kTop + legend(svg, plot);
  const double bottom = kHeight - kBottom - room_of_names(plot.categories);
  AxisRange x_range;
  AxisRange y_range;
  ranges_of(plot, x_range, y_range);
  if (plot.equal_scales) equalise(x_range, y_range, kWidth - kLeft - kRight, bottom - top);
  const DrawnScale x(x_range.min, x_range.max, plot.x.logarithmic, kLeft, kWidth - kRight);
  const DrawnScale y(y_range.min, y_range.max, plot.y.logarithmic, bottom, top);
  if (plot.numbered)
    frame(svg, x, y, plot.x, plot.y, top, bottom, plot.categories);
  else
    cross(svg, x, y, plot);
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    const Series& s = plot.series[i];
    const std::string colour = palette(colour_of(plot, i));
    switch (s.mark) {
      case Mark::line:
        draw_line(svg, s, x, y, colour);
        break;
      case Mark::points:
        draw_points(svg, s, x, y, colour);
        break;
      case Mark::bars:
        draw_bars(svg, plot, i, x, y, colour);
        break;
      case Mark::band:
        draw_band(svg, s, x, y, colour);
        break;
    }
  }
  for (const Level& level : plot.levels) {
    svg.line(kLeft, y.at(level.value), kWidth - kRight, y.at(level.value), "class=\"level\"");
    svg.text(kWidth - kRight - 4, y.at(level.value) - 4, level.name, "class=\"tick\" text-anchor=\"end\"");
  }
  return svg.done();
}

std::string svg_of(const BoxPlot& plot, std::string_view title) {
  Svg svg(kWidth, kHeight, title);
  AxisRange range;
  std::vector<std::string> names;
  for (const auto& sample : plot.samples) {
    names.push_back(sample.name);
    for (const double v : sample.values) range.take(v);
  }
  const double bottom = kHeight - kBottom - room_of_names(names);
  range.pad(0.05);
  const DrawnScale x(-0.5, static_cast<double>(std::max<std::size_t>(names.size(), 1)) - 0.5, false, kLeft,
                     kWidth - kRight);
  const DrawnScale y(range.min, range.max, false, bottom, kTop);
  frame(svg, x, y, {}, plot.y, kTop, bottom, names);
  const double half = std::min(22.0, 0.3 * (x.at(1.0) - x.at(0.0)));
  for (std::size_t i = 0; i < plot.samples.size(); ++i) {
    std::vector<double> v = plot.samples[i].values;
    if (v.empty()) continue;
    std::sort(v.begin(), v.end());
    const auto quantile = [&](double p) {
      const double at = p * static_cast<double>(v.size() - 1);
      const auto k = std::min(static_cast<std::size_t>(at), v.size() - 1);
      return v[k] + (at - static_cast<double>(k)) * (v[std::min(k + 1, v.size() - 1)] - v[k]);
    };
    const double q1 = quantile(0.25);
    const double q3 = quantile(0.75);
    const double fence = 1.5 * (q3 - q1);
    const double low = *std::lower_bound(v.begin(), v.end(), q1 - fence);
    const double high = *std::prev(std::upper_bound(v.begin(), v.end(), q3 + fence));
    const double at = x.at(static_cast<double>(i));
    const std::string style =
        "stroke=\"" + palette(0) + "\" fill=\"" + palette(0) + "\" fill-opacity=\"0.2\"";
    svg.line(at, y.at(low), at, y.at(q1), style);
    svg.line(at, y.at(q3), at, y.at(high), style);
    svg.rect(at - half, y.at(q3), 2 * half, y.at(q1) - y.at(q3), style);
    svg.line(at - half, y.at(quantile(0.5)), at + half, y.at(quantile(0.5)), style);
    for (const double value : v) {
      if (value < low || value > high) svg.circle(at, y.at(value), 1.8, "fill=\"" + palette(0) + "\"");
    }
  }
  return svg.done();
}

std::string svg_of(const MatrixPlot& plot, std::string_view title) {
  constexpr double kName = 170;
  const double cell = std::clamp(
      (kWidth - kName - 10) / static_cast<double>(std::max<std::size_t>(plot.columns.size(), 1)), 8.0, 30.0);
  const double height = kName + cell * static_cast<double>(plot.rows.size()) + 10;
  Svg svg(kWidth, height, title);
  for (std::size_t c = 0; c < plot.columns.size(); ++c) {
    const double at = kName + cell * (static_cast<double>(c) + 0.6);
    const std::string where = short_number(at) + " " + short_number(kName - 6);
    svg.text(at, kName - 6, plot.columns[c], "class=\"tick\" transform=\"rotate(-60 " + where + ")\"");
  }
  for (std::size_t r = 0; r < plot.rows.size(); ++r) {
    const double top = kName + cell * static_cast<double>(r);
    svg.text(kName - 6, top + 0.7 * cell, plot.rows[r], "class=\"tick\" text-anchor=\"end\"");
    for (std::size_t c = 0; c < plot.columns.size() && c < plot.values[r].size(); ++c) {
      svg.rect(kName + cell * static_cast<double>(c), top, cell - 1, cell - 1,
               "fill=\"" + scale_colour(plot.values[r][c] / plot.value_max) + "\"");
    }
  }
  return svg.done();
}

}  // namespace trunnion::report
