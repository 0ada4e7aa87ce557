// The static drawing of points in space: a parallel projection, seen from 30 degrees above, 35 degrees beside
// -Y.
#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/base/units.hpp"
#include "trunnion/geom/vec.hpp"

#include "report/nc_figures.hpp"
#include "report/svg.hpp"

namespace trunnion::report {
namespace {

constexpr double kSpaceWidth = 600;  // as the chart, like the flat plots
constexpr double kSpaceHeight = 520;
constexpr double kScaleBar = 90;  // room for the colour scale on the right
constexpr std::size_t kDrawnSpacePoints = 4000;
constexpr int kColours = 24;

struct Projection {
  double sin_turn, cos_turn, sin_rise, cos_rise;
  std::array<double, 2> operator()(double x, double y, double z) const {
    const double right = x * cos_turn + y * sin_turn;
    const double away = -x * sin_turn + y * cos_turn;
    return {right, -(z * cos_rise + away * sin_rise)};
  }
};

Projection view() {
  using namespace literals;
  const double turn = (35_deg).rad();
  const double rise = (30_deg).rad();
  return {std::sin(turn), std::cos(turn), std::sin(rise), std::cos(rise)};
}

struct Fit {
  double scale = 1.0, x = 0.0, y = 0.0;
  std::array<double, 2> operator()(std::array<double, 2> p) const {
    return {x + scale * p[0], y + scale * p[1]};
  }
};

Fit fit_into(const std::vector<std::array<double, 2>>& points, double width, double height) {
  constexpr double kMargin = 24;
  std::array<double, 2> low{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  std::array<double, 2> high{-low[0], -low[1]};
  for (const auto& p : points) {
    for (std::size_t k = 0; k < 2; ++k) {
      low.at(k) = std::min(low.at(k), p.at(k));
      high.at(k) = std::max(high.at(k), p.at(k));
    }
  }
  const double scale = std::min((width - 2 * kMargin) / std::max(high[0] - low[0], 1e-9),
                                (height - 2 * kMargin) / std::max(high[1] - low[1], 1e-9));
  return {scale, width / 2 - scale * (low[0] + high[0]) / 2, height / 2 - scale * (low[1] + high[1]) / 2};
}

void colour_bar(Svg& svg, const Scale& scale, double value_max) {
  constexpr double kSpaceTop = 60;
  constexpr double kBar = 320;
  const double left = kSpaceWidth - kScaleBar + 20;
  for (int i = 0; i < kColours; ++i) {
    const double t = (i + 0.5) / kColours;
    svg.rect(left, kSpaceTop + kBar * (1 - (i + 1.0) / kColours), 14, kBar / kColours + 0.5,
             "fill=\"" + scale_colour(t) + "\"");
  }
  for (const double part : {0.0, 0.5, 1.0}) {
    svg.text(left + 20, kSpaceTop + kBar * (1 - part) + 4, short_number(part * value_max, 3),
             "class=\"tick\"");
  }
  svg.text(kSpaceWidth - 8, kSpaceTop - 14, scale_text(scale), "class=\"label\" text-anchor=\"end\"");
}

// A length of 1, 2 or 5 times a power of ten, and the directions of the axes.
void scale_bar(Svg& svg, const Projection& project, const Fit& fit, const std::string& unit) {
  const double raw = 90.0 / fit.scale;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double length = power * (raw / power >= 5 ? 5 : raw / power >= 2 ? 2 : 1);
  svg.line(20, kSpaceHeight - 14, 20 + length * fit.scale, kSpaceHeight - 14,
           "class=\"axis\" stroke-width=\"2\"");
  svg.text(20, kSpaceHeight - 20, short_number(length) + " " + unit, "class=\"tick\"");
  constexpr double kArrow = 30;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto tip = project(k == 0 ? kArrow : 0, k == 1 ? kArrow : 0, k == 2 ? kArrow : 0);
    const double x = 50;
    const double y = kSpaceHeight - 76;
    svg.line(x, y, x + tip[0], y + tip[1], "class=\"axis\"");
    svg.text(x + 1.25 * tip[0] - 3, y + 1.25 * tip[1] + 4, std::string(1, "XYZ"[k]), "class=\"tick\"");
  }
}

double largest(const SpacePlot& plot) {
  if (plot.value_max > 0.0) return plot.value_max;
  double out = 0.0;
  for (const double v : plot.value) out = std::max(out, std::isfinite(v) ? v : 0.0);
  return out > 0.0 ? out : 1.0;
}

// Neighbouring pieces of one colour are one line: smaller, and drawn without seams.
void draw_path(Svg& svg, const SpacePlot& plot, const std::vector<std::size_t>& kept,
               const std::vector<std::array<double, 2>>& points, const Fit& fit, double value_max) {
  std::vector<std::array<double, 2>> run;
  int run_colour = -1;
  const auto flush = [&] {
    if (run_colour >= 0)
      svg.polyline(run,
                   "stroke=\"" + scale_colour((run_colour + 0.5) / kColours) + "\" stroke-width=\"1.2\"");
    run.clear();
  };
  for (std::size_t i = 1; i < kept.size(); ++i) {
    const double value = plot.value[kept[i]];
    const bool gap = !std::isfinite(value);
    const int colour = gap ? -1 : std::min(kColours - 1, static_cast<int>(value / value_max * kColours));
    if (colour != run_colour || run.empty()) {
      flush();
      run_colour = colour;
      run.push_back(fit(points[i - 1]));
    }
    run.push_back(fit(points[i]));
  }
  flush();
}

}  // namespace

std::string svg_of(const SpacePlot& plot, std::string_view title) {
  Svg svg(kSpaceWidth, kSpaceHeight, title);
  const Projection project = view();
  const std::vector<std::size_t> kept = thinned(plot.value, kDrawnSpacePoints);
  std::vector<std::array<double, 2>> points;
  points.reserve(kept.size());
  for (const std::size_t i : kept) points.push_back(project(plot.x[i], plot.y[i], plot.z[i]));
  if (points.empty()) return svg.done();
  const Fit fit = fit_into(points, kSpaceWidth - kScaleBar, kSpaceHeight);
  const double value_max = largest(plot);
  if (plot.kind == SpacePlot::Kind::path) {
    draw_path(svg, plot, kept, points, fit, value_max);
  } else {
    for (std::size_t k = 0; k < kept.size(); ++k) {
      const std::size_t i = kept[k];
      const double m = plot.magnification;
      const auto from = fit(points[k]);
      const auto to =
          fit(project(plot.x[i] + m * plot.u[i], plot.y[i] + m * plot.v[i], plot.z[i] + m * plot.w[i]));
      const std::string colour = scale_colour(plot.value[i] / value_max);
      svg.line(from[0], from[1], to[0], to[1], "stroke=\"" + colour + "\" stroke-width=\"1.4\"");
      svg.circle(from[0], from[1], 1.6, "fill=\"" + colour + "\"");
    }
  }
  colour_bar(svg, plot.colour, value_max);
  scale_bar(svg, project, fit, plot.unit);
  return svg.done();
}

std::string svg_of(const Scene& scene) {
  if (scene.still) return svg_of(*scene.still, scene.title);
  struct Drawn {
    std::array<std::array<double, 2>, 3> corners;
    double away;
    int grey;
  };
  const Projection project = view();
  std::vector<Drawn> all;
  std::vector<std::array<double, 2>> points;
  for (const Scene::Body& body : scene.bodies) {
    const Pose stands = standing(scene, body);
    const auto place = [&](std::size_t i) -> Vec3 {
      return stands * Vec3(body.corners[i][0], body.corners[i][1], body.corners[i][2]);
    };
    for (std::size_t i = 0; i + 2 < body.corners.size(); i += 3) {
      const std::array<Vec3, 3> at = {place(i), place(i + 1), place(i + 2)};
      Drawn one{{}, 0.0, 0};
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3& p = at.at(k);
        one.corners.at(k) = project(p.x(), p.y(), p.z());
        one.away += -p.x() * project.sin_turn + p.y() * project.cos_turn - p.z() * project.sin_rise;
      }
      const auto& [a, b, c] = one.corners;
      // Downwards is positive: what runs clockwise here looks to the eye.
      const double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
      if (area >= 0.0) continue;
      const Vec3 normal = (at[1] - at[0]).cross(at[2] - at[0]).normalized();
      constexpr double kDark = 90.0;
      constexpr double kLight = 130.0;
      one.grey = static_cast<int>(kDark + kLight * std::abs(normal.dot(Vec3(0.3, -0.5, 0.8))));
      points.insert(points.end(), one.corners.begin(), one.corners.end());
      all.push_back(one);
    }
  }
  Svg svg(kSpaceWidth, kSpaceHeight, scene.title);
  if (all.empty()) return svg.done();
  std::stable_sort(all.begin(), all.end(), [](const Drawn& a, const Drawn& b) { return a.away > b.away; });
  const Fit fit = fit_into(points, kSpaceWidth, kSpaceHeight);
  for (const Drawn& one : all) {
    const std::string grey = std::to_string(std::min(one.grey, 255));
    const std::string colour = "rgb(" + grey + "," + grey + "," + grey + ")";
    svg.polyline({fit(one.corners[0]), fit(one.corners[1]), fit(one.corners[2])},
                 "fill=\"" + colour + "\" stroke=\"" + colour + "\" stroke-width=\"0.5\"", true);
  }
  scale_bar(svg, project, fit, "mm");
  return svg.done();
}

}  // namespace trunnion::report
