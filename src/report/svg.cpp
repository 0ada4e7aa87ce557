#include "report/svg.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/printable.hpp"

namespace trunnion::report {
namespace {

// Ticks at 1, 2 or 5 times a power of ten, about six of them.
std::vector<double> linear_ticks(double min, double max) {
  const double raw = (max - min) / 6.0;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double ratio = raw / power;
  const double step = power * (ratio <= 1.0 ? 1.0 : ratio <= 2.0 ? 2.0 : ratio <= 5.0 ? 5.0 : 10.0);
  std::vector<double> out;
  for (double i = std::ceil(min / step - 1e-9); i * step <= max + 1e-9 * step; i += 1.0)
    out.push_back(i * step);
  return out;
}

std::vector<double> decade_ticks(double min, double max) {
  std::vector<double> out;
  const int first = static_cast<int>(std::ceil(std::log10(min) - 1e-9));
  const int last = static_cast<int>(std::floor(std::log10(max) + 1e-9));
  const int step = std::max(1, (last - first) / 6);
  for (int power = first; power <= last; power += step) out.push_back(std::pow(10.0, power));
  return out;
}

std::string coordinate(double value) {
  return fixed_text(std::clamp(value, -1e5, 1e5), 1);
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (const char c : printable(text, "\n\t")) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string short_number(double value, int digits) {
  if (!std::isfinite(value)) return "";
  const double magnitude = std::abs(value);
  const bool plain = value == 0.0 || (magnitude >= 1e-4 && magnitude < 1e6);
  std::array<char, 40> buffer;
  const auto r =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::general, digits);
  std::string text(buffer.data(), r.ptr);
  // general switches to an exponent where the digits do not reach the point.
  if (plain && text.find('e') != std::string::npos) text = fixed_text(value, 0);
  return text == "-0" ? "0" : text;
}

std::string scale_text(const Scale& scale) {
  return scale.unit.empty() ? scale.label : scale.label + " / " + scale.unit;
}

std::string palette(int i) {
  constexpr int kColours = 8;
  if (i == kRuleColour) return "var(--rule)";
  return "var(--c" + std::to_string(i % kColours) + ")";
}

std::string scale_colour(double t) {
  // Cividis at nine places (Nunez, Anderton, Renslow 2018, doi 10.1371/journal.pone.0199239).
  constexpr std::array<std::array<int, 3>, 9> kCividis = {{{0, 34, 78},
                                                           {18, 53, 112},
                                                           {59, 73, 108},
                                                           {87, 93, 109},
                                                           {112, 113, 115},
                                                           {138, 134, 120},
                                                           {165, 156, 116},
                                                           {195, 179, 105},
                                                           {254, 232, 56}}};
  const double at = std::clamp(std::isfinite(t) ? t : 0.0, 0.0, 1.0) * (kCividis.size() - 1);
  const auto i = std::min<std::size_t>(static_cast<std::size_t>(at), kCividis.size() - 2);
  const double part = at - static_cast<double>(i);
  std::string out = "#";
  for (std::size_t k = 0; k < 3; ++k) {
    const auto value = static_cast<unsigned>(
        std::lround(kCividis.at(i).at(k) + part * (kCividis.at(i + 1).at(k) - kCividis.at(i).at(k))));
    constexpr std::string_view kHex = "0123456789abcdef";
    out += {kHex[value / 16], kHex[value % 16]};
  }
  return out;
}

DrawnScale::DrawnScale(double min, double max, bool logarithmic, double from, double to)
    : logarithmic_{logarithmic}, min_{min}, max_{max}, from_{from}, to_{to} {
  if (logarithmic_) {
    if (max_ <= 0.0) max_ = 1.0;
    if (min_ <= 0.0) min_ = max_ * 1e-4;
    if (min_ >= max_) min_ = max_ / 10.0;
    ticks_ = decade_ticks(min_, max_);
  } else {
    if (!(max_ > min_)) {
      const double half = min_ == 0.0 ? 1.0 : std::abs(min_) * 0.5;
      min_ -= half;
      max_ = min_ + 2 * half;
    }
    ticks_ = linear_ticks(min_, max_);
  }
}

double DrawnScale::at(double value) const {
  const double t = logarithmic_ ? (std::log(std::max(value, min_ * 1e-3)) - std::log(min_)) /
                                      (std::log(max_) - std::log(min_))
                                : (value - min_) / (max_ - min_);
  return from_ + t * (to_ - from_);
}

Svg::Svg(double width, double height, std::string_view title) {
  out_ = "<svg viewBox=\"0 0 " + coordinate(width) + " " + coordinate(height) +
         "\" role=\"img\" aria-label=\"" + escaped(title) + "\">";
}

void Svg::line(double x1, double y1, double x2, double y2, std::string_view attributes) {
  out_ += "<line x1=\"" + coordinate(x1) + "\" y1=\"" + coordinate(y1) + "\" x2=\"" + coordinate(x2) +
          "\" y2=\"" + coordinate(y2) + "\" ";
  out_ += attributes;
  out_ += "/>";
}

void Svg::polyline(const std::vector<std::array<double, 2>>& points, std::string_view attributes,
                   bool closed) {
  if (points.size() < 2) return;
  out_ += closed ? "<polygon points=\"" : "<polyline fill=\"none\" points=\"";
  for (const auto& p : points) out_ += coordinate(p[0]) + "," + coordinate(p[1]) + " ";
  out_.back() = '"';
  out_ += " ";
  out_ += attributes;
  out_ += "/>";
}

void Svg::circle(double x, double y, double r, std::string_view attributes) {
  out_ += "<circle cx=\"" + coordinate(x) + "\" cy=\"" + coordinate(y) + "\" r=\"" + coordinate(r) + "\" ";
  out_ += attributes;
  out_ += "/>";
}

void Svg::rect(double x, double y, double width, double height, std::string_view attributes) {
  out_ += "<rect x=\"" + coordinate(x) + "\" y=\"" + coordinate(y) + "\" width=\"" +
          coordinate(std::max(0.0, width)) + "\" height=\"" + coordinate(std::max(0.0, height)) + "\" ";
  out_ += attributes;
  out_ += "/>";
}

void Svg::text(double x, double y, std::string_view text, std::string_view attributes) {
  out_ += "<text x=\"" + coordinate(x) + "\" y=\"" + coordinate(y) + "\" ";
  out_ += attributes;
  out_ += ">" + escaped(text) + "</text>";
}

std::string Svg::done() {
  out_ += "</svg>";
  return std::move(out_);
}

std::string svg_of(const Figure& figure) {
  return std::visit([&](const auto& plot) { return svg_of(plot, figure.title); }, figure.plot);
}

}  // namespace trunnion::report
