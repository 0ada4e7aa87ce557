#pragma once
#include <array>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/report/page.hpp"

namespace trunnion::report {

/// A place where a line is interrupted.
inline constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

/// `&`, `<`, `>` and quotes as entities.
std::string escaped(std::string_view text);

/// Short text of a number for ticks and hovering: at most `digits` significant digits, no exponent between
/// 1e-4 and 1e6.
std::string short_number(double value, int digits = 5);

/// "label / unit", or the label alone.
std::string scale_text(const Scale& scale);

/// CSS colour of palette index i: a variable of the style sheet (Okabe-Ito order, one set for light and one
/// for dark).
inline constexpr int kRuleColour = -1;  // of lines that only guide the eye
std::string palette(int i);

/// Colour of `t` in [0, 1] on the scale that the interactive plots use too (cividis: even in brightness and
/// the same to colour-blind eyes).
std::string scale_colour(double t);

/// A linear or logarithmic scale from data to drawing units, with ticks at 1, 2 or 5 times a power of ten.
class DrawnScale {
 public:
  DrawnScale(double min, double max, bool logarithmic, double from, double to);
  double at(double value) const;
  double value_min() const { return min_; }
  double value_max() const { return max_; }
  const std::vector<double>& ticks() const { return ticks_; }

 private:
  bool logarithmic_;
  double min_, max_, from_, to_;
  std::vector<double> ticks_;
};

/// Collects SVG elements; coordinates with one decimal.
class Svg {
 public:
  Svg(double width, double height, std::string_view title);
  void line(double x1, double y1, double x2, double y2, std::string_view attributes);
  void polyline(const std::vector<std::array<double, 2>>& points, std::string_view attributes,
                bool closed = false);
  void circle(double x, double y, double r, std::string_view attributes);
  void rect(double x, double y, double width, double height, std::string_view attributes);
  void text(double x, double y, std::string_view text, std::string_view attributes);
  void raw(std::string_view element) { out_ += element; }
  std::string done();

 private:
  std::string out_;
};

/// The static drawing of a figure.
std::string svg_of(const Figure& figure);
std::string svg_of(const XyPlot& plot, std::string_view title);
std::string svg_of(const BoxPlot& plot, std::string_view title);
std::string svg_of(const SpacePlot& plot, std::string_view title);
std::string svg_of(const MatrixPlot& plot, std::string_view title);
/// The path of a scene, or its machine with the axes at zero: triangles from the farthest to the nearest.
std::string svg_of(const Scene& scene);

}  // namespace trunnion::report
