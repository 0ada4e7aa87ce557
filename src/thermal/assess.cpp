#include "trunnion/thermal/assess.hpp"

#include <algorithm>
#include <array>
#include <map>

#include "trunnion/base/units.hpp"
#include "trunnion/config/csv.hpp"
#include "trunnion/thermal/offsets.hpp"

namespace trunnion::thermal {
namespace {

constexpr std::array kComponents = {"dx_um", "dy_um", "dz_um"};

// Columns that a file must have, in order; nothing when one is missing.
std::optional<std::vector<std::size_t>> need(const config::CsvRows& rows,
                                             const std::vector<std::string>& names,
                                             Diagnostics& diagnostics) {
  std::vector<std::size_t> out;
  for (const auto& name : names) {
    if (const auto column = rows.column(name))
      out.push_back(*column);
    else
      diagnostics.error(rows.file(), {rows.header_line(), 1}, "no column '" + name + "'");
  }
  return out.size() == names.size() ? std::optional(out) : std::nullopt;
}

Vec3 vector_of(config::CsvRows& rows, const std::vector<std::size_t>& columns, std::size_t first) {
  Vec3 out;
  for (std::size_t i = 0; i < 3; ++i)
    out[static_cast<Eigen::Index>(i)] = rows.number(columns[first + i]).value_or(0.0) * kMmPerUm;
  return out;
}

std::map<std::string, OffsetTable> read_offsets(std::string_view text, const std::string& file,
                                                Diagnostics& diagnostics) {
  std::map<std::string, OffsetTable> out;
  config::CsvRows rows(text, file, diagnostics);
  const auto columns = need(rows, {"time_s", kComponents[0], kComponents[1], kComponents[2]}, diagnostics);
  if (!columns) return out;
  const auto run = rows.column("run_id");
  while (rows.next()) {
    Offset row;
    row.time_s = rows.number((*columns)[0]).value_or(0.0);
    row.deviation_mm = vector_of(rows, *columns, 1);
    out[run ? std::string(rows.fields()[*run]) : ""].rows.push_back(std::move(row));
  }
  return out;
}

}  // namespace

Result<std::vector<BladeResult>> assess_files(const FileText& truth, const FileText& offsets, Sending sending,
                                              Diagnostics& diagnostics) {
  Diagnostics own;
  const auto tables = read_offsets(offsets.text, offsets.file, own);
  config::CsvRows rows(truth.text, truth.file, own);
  const auto columns =
      need(rows, {"run_id", "time_s", "blade", kComponents[0], kComponents[1], kComponents[2]}, own);
  std::vector<BladeResult> out;
  Vec3 sent = Vec3::Zero();
  while (columns && rows.next()) {
    const std::string run(rows.fields()[(*columns)[0]]);
    const double time_s = rows.number((*columns)[1]).value_or(0.0);
    const int blade = static_cast<int>(rows.number((*columns)[2]).value_or(0.0));
    const Vec3 drift = vector_of(rows, *columns, 3);
    if (blade == 0) continue;
    const bool begins = out.empty() || out.back().run != run || out.back().blade != blade;
    if (begins) out.emplace_back(run, blade);
    const auto table = tables.contains(run) ? tables.find(run) : tables.find("");
    if (begins || sending == Sending::always)
      sent = table == tables.end() ? Vec3::Zero() : table->second.at_time(time_s);
    out.back().take(drift, drift - sent);
  }
  if (out.empty() && !own.has_errors()) own.error(truth.file, {1, 1}, "no blades");
  diagnostics.append(own);
  if (own.has_errors()) return tl::unexpected(own.first_error());
  return out;
}

}  // namespace trunnion::thermal
