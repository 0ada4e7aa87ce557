#include "trunnion/thermal/offsets.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/config/csv.hpp"

namespace trunnion::thermal {
namespace {

constexpr std::array kKnown = {"time_s", "operation", "dx_um", "dy_um", "dz_um", "sigma_um", "frame"};

struct OffsetColumns {
  std::optional<std::size_t> time, operation, sigma, frame;
  std::array<std::optional<std::size_t>, 3> component;
};

OffsetColumns find_columns(const config::CsvRows& rows, Diagnostics& diagnostics) {
  OffsetColumns out;
  out.time = rows.column("time_s");
  out.operation = rows.column("operation");
  out.sigma = rows.column("sigma_um");
  out.frame = rows.column("frame");
  out.component = {rows.column("dx_um"), rows.column("dy_um"), rows.column("dz_um")};
  const SourceRef header{rows.header_line(), 1};
  if (out.time.has_value() == out.operation.has_value()) {
    diagnostics.error(rows.file(), header,
                      "an offset table has either a column 'time_s' or a column 'operation'");
  }
  if (!out.component[0] && !out.component[1] && !out.component[2]) {
    diagnostics.error(rows.file(), header, "none of the columns dx_um, dy_um, dz_um");
  }
  for (std::size_t i = 0; i < rows.columns().size(); ++i) {
    const std::string& name = rows.columns()[i];
    if (name == "run_id") {
      diagnostics.error(rows.file(), {rows.header_line(), static_cast<std::uint32_t>(i + 1)},
                        "the table holds several runs; a program has one: predict it with --run");
      continue;
    }
    if (std::find(kKnown.begin(), kKnown.end(), name) != kKnown.end()) continue;
    const SourceRef where{rows.header_line(), static_cast<std::uint32_t>(i + 1)};
    // A channel without an axis (`thermal predict` writes those too) moves nothing.
    if (name.ends_with("_um"))
      diagnostics.warning(rows.file(), where, "column '" + name + "' is no offset and is not used");
    else
      diagnostics.error(
          rows.file(), where,
          "column '" + name + "' is none of time_s, operation, dx_um, dy_um, dz_um, sigma_um, frame");
  }
  return out;
}

// `frame` must be the same everywhere: a table is applied as a whole.
void read_frame(const config::CsvRows& rows, std::size_t column, OffsetTable& table,
                Diagnostics& diagnostics) {
  const std::string_view word = rows.fields()[column];
  const SourceRef where{rows.line(), static_cast<std::uint32_t>(column + 1)};
  if (word != "machine" && word != "part" && !word.empty()) {
    diagnostics.error(rows.file(), where,
                      "frame must be 'machine' or 'part', not '" + std::string(word) + "'");
    return;
  }
  const OffsetFrame frame = word == "part" ? OffsetFrame::part : OffsetFrame::machine;
  if (table.rows.empty()) table.frame = frame;
  if (table.frame != frame) diagnostics.error(rows.file(), where, "the frame changes within the table");
}

}  // namespace

double OffsetTable::largest_sigma_mm() const {
  double out = 0.0;
  for (const Offset& row : rows) out = std::max(out, row.sigma_mm);
  return out;
}

Vec3 OffsetTable::at_time(double time_s) const {
  TRUNNION_EXPECTS(key == Key::time && !rows.empty());
  const auto after = std::upper_bound(rows.begin(), rows.end(), time_s,
                                      [](double t, const Offset& row) { return t < row.time_s; });
  if (after == rows.begin()) return rows.front().deviation_mm;
  if (after == rows.end()) return rows.back().deviation_mm;
  const Offset& a = *(after - 1);
  const double t = (time_s - a.time_s) / (after->time_s - a.time_s);
  return a.deviation_mm + t * (after->deviation_mm - a.deviation_mm);
}

const Offset* OffsetTable::of_operation(std::string_view name) const {
  const auto it =
      std::find_if(rows.begin(), rows.end(), [&](const Offset& row) { return row.operation == name; });
  return it == rows.end() ? nullptr : &*it;
}

const Offset* OffsetTable::of_comment(std::string_view text) const {
  const auto plain = [](char c) {
    if (c == '(') return '[';
    if (c == ')') return ']';
    if (c < ' ' || c > '~') return '?';
    return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  };
  const auto it = std::find_if(rows.begin(), rows.end(), [&](const Offset& row) {
    return std::equal(row.operation.begin(), row.operation.end(), text.begin(), text.end(),
                      [&](char a, char b) { return plain(a) == plain(b); });
  });
  if (it != rows.end()) return &*it;
  // The control may not have had all characters of the name: its letters and digits, where they are of one
  // name only.
  const auto letters_of = [](std::string_view name) {
    std::string out;
    for (const char c : name) {
      if (c >= 'a' && c <= 'z') out += static_cast<char>(c - 'a' + 'A');
      if ((c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9')) out += c;
    }
    return out;
  };
  const std::string letters = letters_of(text);
  const Offset* found = nullptr;
  for (const Offset& row : rows) {
    if (letters.empty() || letters_of(row.operation) != letters) continue;
    if (found != nullptr && found->operation != row.operation) return nullptr;
    if (found == nullptr) found = &row;
  }
  return found;
}

Result<OffsetTable> parse_offsets(std::string_view text, const std::string& file, Diagnostics& diagnostics) {
  const std::size_t errors_before = diagnostics.error_count();
  config::CsvRows rows(text, file, diagnostics);
  if (diagnostics.error_count() > errors_before) return tl::unexpected(diagnostics.first_error());
  const OffsetColumns columns = find_columns(rows, diagnostics);
  if (diagnostics.error_count() > errors_before) return tl::unexpected(diagnostics.first_error());
  OffsetTable table;
  table.file = file;
  table.key = columns.time ? OffsetTable::Key::time : OffsetTable::Key::operation;
  while (rows.next()) {
    Offset row;
    if (columns.time) row.time_s = rows.number(*columns.time).value_or(0.0);
    if (columns.operation) row.operation = rows.fields()[*columns.operation];
    for (Eigen::Index i = 0; i < 3; ++i) {
      const auto& column = columns.component[static_cast<std::size_t>(i)];
      if (column) row.deviation_mm[i] = rows.number(*column).value_or(0.0) * kMmPerUm;
    }
    if (columns.sigma) row.sigma_mm = rows.number(*columns.sigma).value_or(0.0) * kMmPerUm;
    if (columns.frame) read_frame(rows, *columns.frame, table, diagnostics);
    const SourceRef where{rows.line(), 1};
    if (columns.time && !table.rows.empty() && row.time_s <= table.rows.back().time_s) {
      diagnostics.error(file, where,
                        "time " + shortest_text(row.time_s) + " s does not come after " +
                            shortest_text(table.rows.back().time_s) + " s");
    }
    if (columns.operation && table.of_operation(row.operation) != nullptr) {
      diagnostics.error(file, where, "operation '" + row.operation + "' stands twice");
    }
    table.rows.push_back(std::move(row));
  }
  if (table.rows.empty()) diagnostics.error(file, {rows.header_line(), 1}, "the offset table has no rows");
  if (diagnostics.error_count() > errors_before) return tl::unexpected(diagnostics.first_error());
  return table;
}

Result<OffsetTable> load_offsets(const std::string& path, Diagnostics& diagnostics) {
  const auto text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  return parse_offsets(*text, path, diagnostics);
}

Vec3 OffsetFollower::follow(const Vec3& wanted_mm, double dt_s) {
  if (!limits_.enabled) return Vec3::Zero();
  const Vec3 limit = Vec3::Constant(limits_.clamp_mm);
  Vec3 target = wanted_mm.cwiseMax(-limit).cwiseMin(limit);
  clamped_ = clamped_ || target != wanted_mm;
  if (!applied_mm_) {
    applied_mm_ = target;
    return target;
  }
  const double elapsed_s = std::max(0.0, dt_s);
  for (Eigen::Index i = 0; i < 3; ++i) {
    stood_s_[i] += elapsed_s;
    const double change = target[i] - (*applied_mm_)[i];
    if (std::abs(change) <= limits_.dead_band_mm) continue;
    const double now = limits_.slew_mm_s * elapsed_s;
    const double gathered = std::min(limits_.slew_mm_s * stood_s_[i], limits_.dead_band_mm + now);
    const double step = std::abs(change) <= gathered ? gathered : now;
    slew_limited_ = slew_limited_ || std::abs(change) > step;
    (*applied_mm_)[i] += std::clamp(change, -step, step);
    stood_s_[i] = 0.0;
  }
  return *applied_mm_;
}

}  // namespace trunnion::thermal
