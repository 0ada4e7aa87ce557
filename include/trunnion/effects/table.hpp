#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"
#include "trunnion/machine/machine.hpp"

namespace trunnion {

/// Values over a grid of one or two arguments: node (i, j) stands at values[i * v.size() + j]. One argument:
/// v is empty, j = 0.
struct Grid {
  std::vector<double> u;  // ascending
  std::vector<double> v;  // ascending; empty for one argument
  std::vector<double> values;
  std::size_t columns() const { return v.empty() ? 1 : v.size(); }
  double at(std::size_t i, std::size_t j = 0) const { return values[i * columns() + j]; }
};

enum class Interpolation : std::uint8_t { linear, bilinear, nurbs, spline };
std::string_view text_of(Interpolation method);
std::optional<Interpolation> interpolation_of(std::string_view text);

struct InterpolationOptions {
  Interpolation method = Interpolation::linear;
  /// NURBS: degrees in u and v; lowered to the number of nodes less one.
  std::array<int, 2> degree{3, 3};
  /// NURBS: weights of the control points, one per node; empty: all 1.
  std::vector<double> weights = {};
  /// Spline: weight of the roughness (integral of the squared second derivative in u, v, scaled to unit
  /// spacing); 0 interpolates.
  double smoothing = 0.0;
};

/// A function through (or near) the nodes of a grid; inside the range only: arguments beyond it are held at
/// its end.
class Interpolant {
 public:
  virtual ~Interpolant() = default;
  virtual double value(double u, double v) const = 0;
  /// Proved bound on how far the value leaves its straight course while the arguments run on a straight line
  /// from (u0, v0) to (u1, v1); nothing when none is known.
  virtual std::optional<double> bend(double u0, double v0, double u1, double v1) const;
  /// Proved bounds for all arguments: of the value's size, and of its slope in either; nothing when none are
  /// known.
  struct Range {
    double largest = 0.0;
    double slope_u = 0.0;
    double slope_v = 0.0;
  };
  virtual std::optional<Range> range() const;
  /// Its nodes and values, where it takes one argument, is straight between the nodes and held beyond them;
  /// null: it is another function.
  virtual const Grid* straight() const { return nullptr; }
};

/// linear takes one argument, bilinear two; nurbs and spline either. Fails (wrong_input) on fewer than 2
/// nodes in an argument, nodes not ascending, a grid whose size does not fit, non-positive weights.
Result<std::shared_ptr<const Interpolant>> make_interpolant(const Grid& grid,
                                                            const InterpolationOptions& options);

/// Error components over one or two axes, as in the CSV of `component:` effects. Internal units (mm, rad).
struct ErrorTable {
  struct Component {
    std::string name;            // "EXX"
    std::vector<double> values;  // as Grid::values; mm or rad
  };
  std::string file;
  std::vector<std::string> arguments;      // axis names, one or two
  std::vector<std::vector<double>> nodes;  // ascending, one list per argument; mm or rad
  std::vector<Component> components;
  std::vector<std::string> comments;  // without the `#`

  const Component* component(std::string_view name) const;
  Grid grid(std::string_view component) const;  // requires that it exists
};

/// Reads header and rows of an error table: columns `<axis>_mm|_deg` are arguments, `E??_um|_urad` (also _mm,
/// _rad) components; the full grid in any order of rows. Findings with file:line:column: unknown axes or
/// units, a node twice, a node missing.
Result<ErrorTable> parse_error_table(std::string_view csv, const std::string& file, const Machine& machine,
                                     Diagnostics& diagnostics);
Result<ErrorTable> load_error_table(const std::string& path, const Machine& machine,
                                    Diagnostics& diagnostics);

/// CSV text that parse_error_table reads back to the same numbers (shortest round-trip text in um and urad).
std::string error_table_text(const ErrorTable& table, const Machine& machine);

}  // namespace trunnion
