// Sinumerik interpolatory compensation, $AN_CEC (Function Manual Extended Functions, K3): the value of a
// table, interpolated over the set position of its base axis and held outside its range, is added to the set
// position of the compensation axis ("difference between the position measured by the encoder and the
// programmed position of the ideal machine"): a correction. $AN_CEC_MULT_BY_TABLE[t] = m + 1: the product of
// tables t and m is added. The manual's example (a tilt times a height, the height itself hundreds of mm)
// only makes sense when tables that take part in a product add nothing else; that is how they are read and
// written here. The manual names no formula, so a file with products carries the request to try two points on
// the machine before use.
#include <algorithm>
#include <cmath>
#include <map>

#include "trunnion/geom/linear_algebra.hpp"

#include "effects/formats/format_support.hpp"

namespace trunnion::formats {
namespace {

struct Table {
  std::map<std::size_t, double> values;
  std::string input, output;
  double step = 0.0, min = 0.0;
  std::optional<double> max;
  int direction = 0;
  std::size_t times = 0;  // table number (index + 1), 0: none
  bool modulo = false;
  std::uint32_t line = 0;
};

class Reader {
 public:
  Reader(const std::string& file, const Machine& machine, const FormatOptions& options,
         Diagnostics& diagnostics)
      : file_(file), machine_(machine), options_(options), diagnostics_(diagnostics) {}

  void take(const Line& line) {
    std::string_view text = trim(line.text.substr(0, line.text.find(';')));
    if (!text.starts_with("$AN_CEC")) return;  // %_N_..._INI, CHANDATA, M17, other data
    text.remove_prefix(7);
    const auto open = text.find('['), close = text.find(']'), equals = text.find('=');
    if (open == std::string_view::npos || close == std::string_view::npos ||
        equals == std::string_view::npos || close < open)
      return error(line, "expected $AN_CEC...[...] = value");
    const std::string_view what = trim(text.substr(0, open)), value = trim(text.substr(equals + 1));
    const auto indices = words_of(text.substr(open + 1, close - open - 1), " ,");
    const auto t = indices.empty() ? std::nullopt : parse_integer(indices[0]);
    if (!t) return error(line, "table index expected in brackets");
    Table& table = tables_[static_cast<std::size_t>(*t)];
    if (table.line == 0) table.line = line.number;
    if (what == "_INPUT_AXIS" || what == "_OUTPUT_AXIS")
      return axis(line, value, what == "_INPUT_AXIS" ? table.input : table.output);
    const auto number = number_of(value, file_, line.number, diagnostics_);
    if (!number) return;
    constexpr double kLargest = 1e12;  // mm or deg: far beyond any machine
    if (std::abs(*number) > kLargest) return error(line, "a number beyond " + plain(kLargest));
    if (what.empty()) {
      const auto n = indices.size() > 1 ? parse_integer(indices[1]) : std::nullopt;
      if (!n) return error(line, "point number expected in brackets");
      table.values[static_cast<std::size_t>(*n)] = *number;
    } else if (what == "_STEP") {
      table.step = *number;
    } else if (what == "_MIN") {
      table.min = *number;
    } else if (what == "_MAX") {
      table.max = *number;
    } else if (what == "_DIRECTION") {
      if (*number != -1.0 && *number != 0.0 && *number != 1.0)
        return error(line, "$AN_CEC_DIRECTION is -1, 0 or 1");
      table.direction = static_cast<int>(*number);
    } else if (what == "_MULT_BY_TABLE") {
      constexpr double kMostTables = 1e6;
      if (!(*number >= 0.0 && *number <= kMostTables) || *number != std::floor(*number))
        return error(line, "$AN_CEC_MULT_BY_TABLE is the number of a table, or 0");
      table.times = static_cast<std::size_t>(*number);
    } else if (what == "_IS_MODULO") {
      table.modulo = *number != 0.0;
    } else {
      error(line, "unknown variable $AN_CEC" + std::string(what));
    }
  }

  ControlTables finish() {
    ControlTables out;
    const double sign = options_.negate ? -1.0 : 1.0;
    std::map<std::size_t, bool> factor;  // tables that others are multiplied by
    for (const auto& [t, table] : tables_)
      if (table.times > 0) factor[table.times - 1] = true;
    for (const auto& [t, table] : tables_) {
      if (table.times == 0 && factor.contains(t)) continue;
      const auto one = map_of(table);
      if (!one) continue;
      if (table.times == 0) {
        out.corrections.push_back(*one);
      } else {
        const auto it = tables_.find(table.times - 1);
        if (it == tables_.end()) {
          diagnostics_.error(file_, {table.line, 1},
                             "table " + std::to_string(t) + " is multiplied by table " +
                                 std::to_string(table.times - 1) + ", which is not there");
          continue;
        }
        const auto two = map_of(it->second);
        if (!two) continue;
        out.corrections.push_back(product(*one, *two));
      }
      for (auto& output : out.corrections.back().outputs)
        for (auto* values : {&output.up, &output.down})
          for (double& value : *values) value *= sign;
    }
    return out;
  }

 private:
  void error(const Line& line, const std::string& message) {
    diagnostics_.error(file_, {line.number, 1}, message);
  }

  void axis(const Line& line, std::string_view value, std::string& into) {
    auto words = words_of(value, "() ");
    const auto names = axis_numbers(machine_, options_);
    if (words.size() == 1 && words[0].starts_with("AX")) {
      const auto number = parse_integer(words[0].substr(2));
      if (number && *number >= 1 && *number <= names.size()) {
        into = names[*number - 1];
        return;
      }
    } else if (words.size() == 1 && machine_.axis(words[0].substr(0, 1))) {
      into = words[0].substr(0, 1);  // X1 -> X
      return;
    }
    error(line, "'" + std::string(value) + "' is no axis of this machine (axis numbers: give --axes)");
  }

  std::optional<CorrectionMap> map_of(const Table& table) {
    const auto wrong = [&](const std::string& message) {
      diagnostics_.error(file_, {table.line, 1}, message);
      return std::nullopt;
    };
    if (table.input.empty() || table.output.empty() || !machine_.axis(table.input))
      return wrong("the table lacks its axes");
    if (table.values.size() < 2 || table.values.rbegin()->first + 1 != table.values.size())
      return wrong("points are missing");
    constexpr double kLeastStep = 1e-12;  // mm or deg: far below the resolution of any axis
    if (!(table.step >= kLeastStep)) return wrong("$AN_CEC_STEP must be above " + shortest_text(kLeastStep));
    constexpr double kRounding = 1e-6;
    if (const auto given = static_cast<double>(table.values.size()); table.max) {
      const double points = std::floor((*table.max - table.min) / table.step + kRounding) + 1.0;
      if (given < points)
        return wrong("the table has " + plain(given) + " values and goes to $AN_CEC_MAX with " +
                     plain(points) + ": it is cut off");
    }
    if (table.modulo)
      diagnostics_.warning(file_, {table.line, 1},
                           "modulo table: held outside its range here, repeated by the control");
    CorrectionMap map;
    map.inputs = {table.input};
    const double factor = position_factor(machine_.axes[*machine_.axis(table.input)]);
    map.nodes.emplace_back();
    CorrectionMap::Output output{.axis = table.output, .up = {}, .down = {}};
    std::vector<double> values;
    for (const auto& [n, value] : table.values) {
      const double place = table.min + static_cast<double>(n) * table.step;
      // What stands beyond it is not used: the control holds the value at the end.
      if (table.max && n > 1 && place > *table.max + kRounding * table.step) break;
      map.nodes[0].push_back(place * factor);
      values.push_back(value);
    }
    const std::vector<double> nothing(values.size(), 0.0);
    output.up = table.direction < 0 ? nothing : values;
    if (table.direction != 0) output.down = table.direction < 0 ? values : nothing;
    map.outputs = {output};
    return map;
  }

  static CorrectionMap product(const CorrectionMap& f, const CorrectionMap& g) {
    CorrectionMap out;
    out.inputs = {f.inputs[0], g.inputs[0]};
    out.nodes = {f.nodes[0], g.nodes[0]};
    CorrectionMap::Output output{.axis = f.outputs[0].axis, .up = {}, .down = {}};
    for (const double a : f.outputs[0].up)
      for (const double b : g.outputs[0].up) output.up.push_back(a * b);
    out.outputs = {output};
    return out;
  }

  const std::string& file_;
  const Machine& machine_;
  const FormatOptions& options_;
  Diagnostics& diagnostics_;
  std::map<std::size_t, Table> tables_;
};

Result<ControlTables> read_siemens(std::string_view text, const std::string& file, const Machine& machine,
                                   const FormatOptions& options, Diagnostics& diagnostics) {
  const std::size_t before = diagnostics.error_count();
  Reader reader(file, machine, options, diagnostics);
  for (const Line& line : lines_of(text)) reader.take(line);
  auto out = reader.finish();
  if (diagnostics.error_count() > before) return tl::unexpected(diagnostics.first_error());
  if (out.corrections.empty()) return fail(ErrorCode::wrong_input, "no $AN_CEC table", file);
  return out;
}

class Writer {
 public:
  Writer(const Machine& machine, const FormatOptions& options) : machine_(machine), options_(options) {}

  Result<void> table(const std::string& input, const std::vector<double>& nodes, const std::string& output,
                     const std::vector<double>& values, int direction, std::size_t times) {
    const auto from = number_of_axis(machine_, options_, input),
               to = number_of_axis(machine_, options_, output);
    if (!from || !to || !machine_.axis(input))
      return refuse("axis " + (from ? output : input) + " has no number (give --axes)");
    const double factor = position_factor(machine_.axes[*machine_.axis(input)]);
    const auto step = equal_step(nodes, "a $AN_CEC table over " + input);
    if (!step) return tl::unexpected(step.error());
    const std::string t = std::to_string(count_++);
    for (std::size_t n = 0; n < values.size(); ++n)
      text_ += "$AN_CEC[" + t + "," + std::to_string(n) + "]=" + plain(values[n]) + "\n";
    text_ += "$AN_CEC_INPUT_AXIS[" + t + "]=(AX" + std::to_string(*from) + ")\n";
    text_ += "$AN_CEC_OUTPUT_AXIS[" + t + "]=(AX" + std::to_string(*to) + ")\n";
    text_ += "$AN_CEC_STEP[" + t + "]=" + plain(*step / factor) + "\n";
    text_ += "$AN_CEC_MIN[" + t + "]=" + plain(nodes.front() / factor) + "\n";
    text_ += "$AN_CEC_MAX[" + t + "]=" + plain(nodes.back() / factor) + "\n";
    text_ += "$AN_CEC_DIRECTION[" + t + "]=" + std::to_string(direction) + "\n";
    text_ += "$AN_CEC_MULT_BY_TABLE[" + t + "]=" + std::to_string(times) + "\n";
    // "The compensation table is repeated cyclically": the value at MAX is followed by that at MIN, and both
    // should be the same (Function Manual Extended Functions 03/2013, K3, page 249).
    const bool is_turn =
        machine_.axes[*machine_.axis(input)].cyclic && std::abs(nodes.back() - nodes.front() - kTwoPi) < 1e-9;
    text_ += "$AN_CEC_IS_MODULO[" + t + "]=" + (is_turn ? "1" : "0") + "\n";
    return {};
  }

  // A map over two axes as f(u) + g(v) + products: the pure parts as plain tables, the rest by its singular
  // values.
  Result<void> surface(const CorrectionMap& map, const CorrectionMap::Output& output, double sign) {
    if (!output.down.empty()) return refuse("a two-axis table for one direction only cannot be written");
    const auto rows = static_cast<Eigen::Index>(map.nodes[0].size()),
               columns = static_cast<Eigen::Index>(map.nodes[1].size());
    Eigen::MatrixXd F(rows, columns);
    for (Eigen::Index i = 0; i < rows; ++i)
      for (Eigen::Index j = 0; j < columns; ++j)
        F(i, j) = sign * output.up[static_cast<std::size_t>(i * columns + j)];
    const Eigen::VectorXd over_u = F.rowwise().mean();
    const Eigen::VectorXd over_v = F.colwise().mean().transpose().array() - F.mean();
    const auto list = [](const Eigen::VectorXd& v) {
      return std::vector<double>(v.data(), v.data() + v.size());
    };
    if (auto ok = table(map.inputs[0], map.nodes[0], output.axis, list(over_u), 0, 0); !ok) return ok;
    if (auto ok = table(map.inputs[1], map.nodes[1], output.axis, list(over_v), 0, 0); !ok) return ok;
    Eigen::MatrixXd rest =
        F - over_u * Eigen::RowVectorXd::Ones(columns) - Eigen::VectorXd::Ones(rows) * over_v.transpose();
    const Svd svd = thin_svd(rest);
    constexpr int kMostProducts = 3;
    constexpr double kSmallRest_mm = 0.0001;
    for (int k = 0; k < kMostProducts && k < svd.s.size(); ++k) {
      if (rest.cwiseAbs().maxCoeff() <= kSmallRest_mm) break;
      // Shared out evenly, so that neither factor by itself is a large number of mm.
      const double root = std::sqrt(svd.s[k]);
      const Eigen::VectorXd f = svd.U.col(k) * root, g = svd.V.col(k) * root;
      rest -= f * g.transpose();
      if (auto ok = table(map.inputs[0], map.nodes[0], output.axis, list(f), 0, count_ + 2); !ok) return ok;
      if (auto ok = table(map.inputs[1], map.nodes[1], output.axis, list(g), 0, 0); !ok) return ok;
      products_ = true;
    }
    largest_rest_ = std::max(largest_rest_, rest.cwiseAbs().maxCoeff());
    return {};
  }

  std::string finish() const {
    std::string head = "%_N_NC_CEC_INI\n; corrections in mm, added to the set position\n";
    if (largest_rest_ > 0.0)
      head += "; what the products leave: at most " + plain(largest_rest_) + " mm at a node\n";
    if (products_)
      head +=
          "; tables that take part in a product must add nothing by themselves: try two points on the "
          "machine before use\n";
    return head + "CHANDATA(1)\n" + text_ + "M17\n";
  }

 private:
  const Machine& machine_;
  const FormatOptions& options_;
  std::string text_;
  std::size_t count_ = 0;
  double largest_rest_ = 0.0;
  bool products_ = false;
};

Result<std::string> write_siemens(const ControlTables& tables, const Machine& machine,
                                  const FormatOptions& options) {
  const double sign = options.negate ? -1.0 : 1.0;
  Writer writer(machine, options);
  for (const CorrectionMap& map : tables.corrections)
    for (const auto& output : map.outputs) {
      if (map.inputs.size() == 2) {
        if (auto ok = writer.surface(map, output, sign); !ok) return tl::unexpected(ok.error());
        continue;
      }
      const auto signed_values = [&](std::vector<double> values) {
        for (double& value : values) value *= sign;
        return values;
      };
      const bool both = output.down.empty();
      if (auto ok = writer.table(map.inputs[0], map.nodes[0], output.axis, signed_values(output.up),
                                 both ? 0 : 1, 0);
          !ok)
        return tl::unexpected(ok.error());
      if (both) continue;
      if (auto ok = writer.table(map.inputs[0], map.nodes[0], output.axis, signed_values(output.down), -1, 0);
          !ok)
        return tl::unexpected(ok.error());
    }
  return writer.finish();
}

}  // namespace

TableFormat siemens_format() {
  return {"siemens", "Sinumerik $AN_CEC: corrections of axes; over two axes as products (MULT_BY_TABLE)",
          true, read_siemens, write_siemens};
}

}  // namespace trunnion::formats
