#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

/// A self-contained HTML page: what it says and draws, as plain data. Layout, colours and behaviour are the
/// renderer's (README of this layer, "Pages"). Texts are plain text, escaped by the renderer; not-a-number in
/// a series is a gap.
namespace trunnion::report {

/// What stands at an axis or a colour scale: quantity and unit ("" where it has none).
struct Scale {
  std::string label;
  std::string unit;
  bool logarithmic = false;
};

enum class Mark : std::uint8_t {
  line,
  points,
  bars,  // one a category or x
  band   // between y and y2
};

struct Series {
  std::string name;
  Mark mark = Mark::line;
  std::vector<double> x;
  std::vector<double> y;
  std::vector<double> y2;           // band: upper edge; points: half-length of the error bar
  std::vector<std::string> labels;  // of the points, shown on hovering; may be empty
  std::optional<int> colour;        // index of the palette; nothing: by order
};

/// A named level at which something is drawn across a plot: a tolerance, a limit.
struct Level {
  std::string name;
  double value = 0.0;
};

struct XyPlot {
  Scale x;
  Scale y;
  std::vector<Series> series;
  std::vector<Level> levels;            // horizontal
  std::vector<std::string> categories;  // names of x = 0, 1, 2 ... instead of numbers
  bool equal_scales = false;            // one unit of x is as long as one of y (circles stay round)
  bool numbered = true;                 // numbers and grid at the axes; a polar plot has rings
};

/// Box, whiskers to 1.5 interquartile ranges, and what lies beyond, of each sample.
struct BoxPlot {
  struct Sample {
    std::string name;
    std::vector<double> values;
  };
  Scale y;
  std::vector<Sample> samples;
};

/// Points in space, joined to a path or each with a vector, coloured by a value.
struct SpacePlot {
  enum class Kind : std::uint8_t { path, vectors };
  Kind kind = Kind::path;
  std::string unit = "mm";  // of the coordinates
  std::string frame;        // "part frame P"
  std::vector<double> x, y, z;
  std::vector<double> u, v, w;  // vectors, in the unit of `colour`
  double magnification = 1.0;   // drawn length of a vector: value times this, in the unit of the coordinates
  Scale colour;
  std::vector<double> value;
  double value_max =
      0.0;  // end of the colour scale; 0: the largest value. Fixed where two plots are compared
  std::vector<std::string> labels;
};

/// A matrix of numbers from 0 to `value_max`, as coloured cells.
struct MatrixPlot {
  std::vector<std::string> rows, columns;
  std::vector<std::vector<double>> values;
  Scale colour;
  double value_max = 1.0;
};

struct Figure {
  std::string id;  // unique on the page: letters, digits, '-'
  std::string title;
  std::string caption;
  std::variant<XyPlot, BoxPlot, SpacePlot, MatrixPlot> plot;
};

struct Table {
  std::string id;
  std::string title;
  std::string caption;
  std::vector<std::string> columns;
  std::vector<bool> numeric;  // right-aligned; empty: none
  std::vector<std::vector<std::string>> rows;
  /// Row i moves the scene to block `go_to[i]`; empty: rows do nothing.
  std::vector<std::size_t> go_to;
};

/// Numbers of every block of a program: whole multiples of `step`, which is as fine as they are known.
struct BlockColumn {
  std::string name;
  std::string unit;
  double step = 1.0;
  std::vector<double> values;
};

/// A machine as solids that its axes move, and with a program the path, the surface that it cuts and its
/// text. Frames: all corners in M with the axes at zero, mm.
struct Scene {
  struct SceneAxis {
    std::string name;
    bool rotary = false;
    std::array<float, 3> direction{};  // of a positive command, as Axis::direction
    std::array<float, 3> point{};      // on the rotary axis, mm
    double min = 0.0, max = 0.0;       // mm, degrees; equal: none
    bool carries_part = false;
    std::string motion;  // what a positive command does, in words
  };
  struct Body {
    std::string name;
    std::string role;  // chooses its colour: "bed", "slide", "cradle", "table", "spindle", "holder", "tool",
                       // "flute", "ball"
    bool on_part_side =
        false;  // carried by the first `axes` axes of that side's chain, from the bed outwards
    std::size_t axes = 0;
    std::vector<std::array<float, 3>> corners;  // three a triangle, counter-clockwise from outside
  };
  /// A value by which the surface can be coloured: one of `columns`, and its largest value for the scale.
  struct Colouring {
    std::string column;
    std::string label;
    std::string unit;
    double largest = 0.0;
  };
  /// Where things stand with the axes at zero.
  struct Zero {
    std::array<float, 3> spindle_M{};  // S
    std::array<float, 3> part_M{};     // the part's origin
    double tool_length_mm = 0.0;       // S to the tip
  };
  /// A place to stand at: positions of all axes, mm and degrees.
  struct Stand {
    std::string text;
    std::vector<double> q;
  };
  /// A machine without a program: where it stands at the beginning (empty: at zero), and a list beside it
  /// that moves it.
  struct ByHand {
    std::vector<double> start;
    std::vector<Stand> stands;
  };
  /// The files, lines as they are; empty: not at hand. `of_blocks`: line i is that of block i, where the
  /// whole file is too long for a page.
  struct Text {
    std::string lines;
    bool of_blocks = false;
  };
  struct Texts {
    Text nc;
    Text cl;
  };
  std::string title;
  std::string caption;
  std::vector<SceneAxis> axes;
  /// Indices of `axes`, from the bed outwards.
  struct Chains {
    std::vector<std::size_t> tool, part;
  };
  Chains chains;
  Zero zero;
  double size_mm = 100.0;  // of what is looked at: arrows and the first view
  std::vector<Body> bodies;
  /// Block by block: "nc_line", "cl_line", "rapid", "path_mm", the positions of the axes by their names, and
  /// those of `colourings`. Empty: no program, the axes are moved by hand.
  std::vector<BlockColumn> columns;
  std::vector<Colouring> colourings;
  std::optional<std::size_t> beside;  // the colouring that stands right of the first one at the beginning
  std::vector<std::size_t> worst;     // blocks, worst first
  ByHand by_hand;
  Texts texts;
  std::string path_figure;         // a flat figure over path length that follows
  std::optional<SpacePlot> still;  // on paper, and where nothing in space can be drawn
};

struct Paragraph {
  std::string text;
};

/// A result in one line. `value` is the exact number behind `text`.
struct Fact {
  std::string id;
  std::string label;
  std::string text;
  std::optional<double> value;
};

/// Text that keeps its lines: a program.
struct Listing {
  std::string id;
  std::string title;
  std::string text;
};

using Item = std::variant<Paragraph, Figure, Table, Listing, Scene>;

struct Section {
  std::string title;
  std::vector<Item> items;
  /// One of several steps that follow each other: a screen shows one at a time, paper all of them.
  bool step = false;
};

enum class Tone : std::uint8_t { good, bad, neutral };

struct Page {
  std::string title;
  std::string verdict;  // one sentence
  Tone tone = Tone::neutral;
  std::vector<Fact> facts;
  std::vector<Section> sections;
  std::string result_json;  // the result of the command as `--json` gives it; may be empty
  std::string made_by;      // program, version, command line
};

/// The page as one HTML document: nothing in it is fetched from anywhere.
std::string page_html(const Page& page);

/// True when the chart library was bundled at build time; without it the pages hold the drawn (SVG) plots
/// only.
bool has_interactive_charts();

/// Indices of at most about `most` of the values, first and last among them and the smallest and largest of
/// every stretch: what a plot needs to look as with all of them.
std::vector<std::size_t> thinned(const std::vector<double>& values, std::size_t most);

}  // namespace trunnion::report
