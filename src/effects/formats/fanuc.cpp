// Fanuc stored pitch error compensation: whole numbers, one for each interval, that count up from the
// reference point (parameter manual 0i-PB, "pitch error compensation"): the value of point n is what the
// correction grows by over the interval that ends there on the positive side, or begins there on the negative
// side of the reference point. Unit: detection unit times magnification (3623). Data lines `N<10000 + point>
// P<value>`; parameters 3620 to 3624 `N<parameter> P<value>`. Rounding is carried on, so that the sum stays
// within half a unit; for a rotary axis the sum over a turn must be 0.
#include <cmath>
#include <map>

#include "effects/formats/format_support.hpp"

namespace trunnion::formats {
namespace {

constexpr long kFirstPoint = 10000;  // N word of point 0
constexpr std::size_t kMostPoints = 128;

// Number after `letter` in a line such as `N10040 P-2`.
std::optional<long> word(std::string_view text, char letter) {
  const auto at = text.find(letter);
  if (at == std::string_view::npos) return std::nullopt;
  std::string_view digits = text.substr(at + 1);
  const bool negative = digits.starts_with('-');
  if (negative || digits.starts_with('+')) digits.remove_prefix(1);
  const auto value = parse_integer(trim(digits.substr(0, digits.find_first_not_of("0123456789"))));
  constexpr std::uint64_t kLargest = 999999;  // beyond any number of a point and any increment
  if (!value || *value > kLargest) return std::nullopt;
  return negative ? -static_cast<long>(*value) : static_cast<long>(*value);
}

// Of a parameter, the value of one axis: `N3620 P100`, or `N3620 A1 P100 A2 P104` with the control's axes by
// their numbers; nothing where others alone have one.
std::optional<long> of_axis(std::string_view text, std::optional<std::size_t> axis) {
  if (text.find('A') == std::string_view::npos) return word(text, 'P');
  for (auto at = text.find('A'); at != std::string_view::npos; at = text.find('A', at + 1)) {
    const auto number = word(text.substr(at), 'A');
    if (number && axis && static_cast<std::size_t>(*number) == *axis) return word(text.substr(at), 'P');
  }
  return std::nullopt;
}

Result<ControlTables> read_fanuc(std::string_view text, const std::string& file, const Machine& machine,
                                 const FormatOptions& options, Diagnostics& diagnostics) {
  const std::size_t before = diagnostics.error_count();
  if (!machine.axis(options.input_axis))
    return fail(ErrorCode::wrong_use, "this format does not say which axis it is about: give --axis", file);
  if (!(options.interval_mm > 0.0))
    return fail(ErrorCode::wrong_use, "give the interval of the points (parameter 3624) with --step", file);
  std::map<long, long> increments;
  long reference = options.reference_number;
  std::optional<long> first, last;
  const auto own_number = number_of_axis(machine, options, options.input_axis);
  for (const Line& line : lines_of(text)) {
    if (line.text.empty() || line.text.starts_with('%') || line.text.starts_with('(')) continue;
    const auto n = word(line.text, 'N'), p = word(line.text, 'P');
    if (!n || !p) {
      diagnostics.error(file, {line.number, 1}, "expected N<number> P<value> of at most six digits");
      continue;
    }
    if (*n >= kFirstPoint) {
      increments[*n - kFirstPoint] = *p;
      continue;
    }
    if (*n < 3620 || *n > 3622) continue;
    const auto value = of_axis(line.text, own_number);
    if (value && line.text.find('A') != std::string_view::npos)
      diagnostics.warning_once("axis number", file, {line.number, 1},
                               "axis " + options.input_axis + " is taken for number " +
                                   std::to_string(*own_number) +
                                   " of the control, as the machine file or --axes has it");
    if (!value)
      diagnostics.error(
          file, {line.number, 1},
          "N" + std::to_string(*n) + " has no value for axis " + options.input_axis + ", " +
              (own_number ? "number " + std::to_string(*own_number) : "whose number is not known") +
              " of the control (--axes)");
    else if (*n == 3620)
      reference = *value;
    else
      (*n == 3621 ? first : last) = *value;
  }
  // The points of all axes stand in one row.
  const auto beyond = [&](const auto& point) {
    return (first && point.first < *first) || (last && point.first > *last);
  };
  if (const auto others = std::erase_if(increments, beyond); others > 0)
    diagnostics.note(file, {}, std::to_string(others) + " points beyond 3621 and 3622 are of other axes");
  if (increments.empty()) diagnostics.error(file, {}, "no points");
  // Between the two that the file itself names.
  for (long k = first.value_or(0); first && last && k <= *last; ++k) {
    if (increments.contains(k)) continue;
    diagnostics.error(file, {},
                      "the points go from " + std::to_string(*first) + " to " + std::to_string(*last) +
                          " (3621, 3622), and N" + std::to_string(kFirstPoint + k) +
                          " is missing: the table is cut off");
    break;
  }
  if (diagnostics.error_count() > before) return tl::unexpected(diagnostics.first_error());
  const double factor = position_factor(machine.axes[*machine.axis(options.input_axis)]);
  const double unit = (options.negate ? -1.0 : 1.0) * options.unit_mm;
  // corrections[k]: at the coordinate of point k's positive end; the reference point's is 0.
  std::map<long, long> sums{{reference, 0}};
  long sum = 0;
  for (long k = reference + 1; k <= increments.rbegin()->first; ++k)
    sums[k] = sum += increments.contains(k) ? increments[k] : 0;
  sum = 0;
  for (long k = reference; k >= increments.begin()->first; --k)
    sums[k - 1] = sum -= increments.contains(k) ? increments[k] : 0;
  CorrectionMap map;
  map.inputs = {options.input_axis};
  map.nodes.emplace_back();
  CorrectionMap::Output output{.axis = options.input_axis, .up = {}, .down = {}};
  for (const auto& [k, total] : sums) {
    map.nodes[0].push_back((options.reference_mm + static_cast<double>(k - reference) * options.interval_mm) *
                           factor);
    output.up.push_back(unit * static_cast<double>(total));
  }
  map.outputs = {output};
  return ControlTables{.errors = {}, .location = {}, .corrections = {map}};
}

Result<std::string> write_fanuc(const ControlTables& tables, const Machine& machine,
                                const FormatOptions& options) {
  if (tables.corrections.size() != 1 || tables.corrections[0].inputs.size() != 1 ||
      tables.corrections[0].outputs.size() != 1 ||
      tables.corrections[0].outputs[0].axis != tables.corrections[0].inputs[0] ||
      !tables.corrections[0].outputs[0].down.empty())
    return refuse(
        "this format holds the corrections of one axis over its own position, the same in both directions");
  const CorrectionMap& map = tables.corrections[0];
  const auto& nodes = map.nodes[0];
  const auto& values = map.outputs[0].up;
  const auto step = equal_step(nodes, "the increments of " + map.inputs[0]);
  if (!step) return tl::unexpected(step.error());
  const Axis& axis = machine.axes[*machine.axis(map.inputs[0])];
  const double factor = position_factor(axis);
  const double reference = options.reference_mm * factor, place = (reference - nodes.front()) / *step;
  const auto zero = std::lround(place);
  if (std::abs(place - static_cast<double>(zero)) > 1e-6 || zero < 0 ||
      zero >= static_cast<long>(nodes.size()))
    return refuse("the reference point must be a node");
  if (nodes.size() > kMostPoints)
    return refuse(std::to_string(nodes.size()) + " points; the control takes " + std::to_string(kMostPoints));
  const double unit = (options.negate ? -1.0 : 1.0) * options.unit_mm,
               base = values[static_cast<std::size_t>(zero)];
  const auto rounded = [&](std::size_t i) { return std::lround((values[i] - base) / unit); };
  if (axis.kind == AxisKind::rotary && std::abs(nodes.back() - nodes.front() - kTwoPi) < 1e-9 &&
      rounded(nodes.size() - 1) != rounded(0))
    return refuse(
        "the corrections of a turn must end as they begin: the sum of the increments would add up from turn "
        "to turn");
  const long first = options.reference_number - zero + 1;  // number of the interval after the first node
  if (first < 0)
    return refuse("the first point would have the number " + std::to_string(first) +
                  ": give a larger number of the reference point (--reference-number)");
  const auto line = [](long n, long p) { return "N" + std::to_string(n) + " P" + std::to_string(p) + "\n"; };
  std::string out = "%\n";
  out += line(3620, options.reference_number);
  out += line(3621, first);
  out += line(3622, first + static_cast<long>(nodes.size()) - 2);
  for (std::size_t i = 1; i < nodes.size(); ++i)
    out += line(kFirstPoint + first + static_cast<long>(i) - 1, rounded(i) - rounded(i - 1));
  return out + "%\n";
}

}  // namespace

TableFormat fanuc_format() {
  return {"fanuc", "Fanuc stored pitch error: whole increments per interval, one axis", true, read_fanuc,
          write_fanuc};
}

}  // namespace trunnion::formats
