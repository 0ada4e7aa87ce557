#include <cmath>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/thermal/model.hpp"

#include "thermal/regressors.hpp"

namespace trunnion::thermal {
namespace {

using config::Section;
using config::Table;
using config::Value;
using Eigen::Index;
using Eigen::MatrixXd;

Value text(const std::string& s) {
  return {s, {}};
}

Value texts(const std::vector<std::string>& items) {
  config::Array out;
  for (const auto& item : items) out.push_back(text(item));
  return {std::move(out), {}};
}
Value reals(const std::vector<double>& items) {
  config::Array out;
  for (const double item : items) out.push_back(number_value(item));
  return {std::move(out), {}};
}

// A growth in um per square root of a minute: what a person can picture.
const double kGrowthUnit_mm_per_sqrt_s = kMmPerUm / std::sqrt(kSecondsPerMinute);

void add_sigma(const SigmaModel& sigma, const std::string& prefix, Table& out) {
  out.emplace_back(prefix + "sigma_floor_um", number_value(sigma.floor_mm / kMmPerUm));
  out.emplace_back(prefix + "sigma_growth_um_per_sqrt_min",
                   number_value(sigma.growth_mm_per_sqrt_s / kGrowthUnit_mm_per_sqrt_s));
  out.emplace_back(prefix + "sigma_per_change", number_value(sigma.per_change));
  out.emplace_back(prefix + "sigma_per_move_um", number_value(sigma.per_move_mm / kMmPerUm));
  out.emplace_back(prefix + "sigma_per_krpm_um", number_value(sigma.per_krpm_mm / kMmPerUm));
  out.emplace_back(prefix + "sigma_per_swing_um", number_value(sigma.per_swing_mm / kMmPerUm));
  out.emplace_back(prefix + "sigma_prior_measurements", number_value(sigma.prior_measurements));
  out.emplace_back(prefix + "sigma_coverage_factor", number_value(sigma.coverage.quiet));
  out.emplace_back(prefix + "sigma_coverage_factor_lively", number_value(sigma.coverage.lively));
  out.emplace_back(prefix + "sigma_coverage_shares",
                   numbers(Eigen::Vector2d(sigma.coverage.quiet_at, sigma.coverage.lively_at)));
}

SigmaModel read_sigma(Section& section, const std::string& prefix) {
  SigmaModel out;
  out.floor_mm = section.quantity_or(prefix + "sigma_floor_um", 0.0);
  out.growth_mm_per_sqrt_s =
      section.find_number(prefix + "sigma_growth_um_per_sqrt_min").value_or(0.0) * kGrowthUnit_mm_per_sqrt_s;
  out.per_change = section.find_number(prefix + "sigma_per_change").value_or(0.0);
  out.per_move_mm = section.quantity_or(prefix + "sigma_per_move_um", 0.0);
  out.per_krpm_mm = section.quantity_or(prefix + "sigma_per_krpm_um", 0.0);
  out.per_swing_mm = section.quantity_or(prefix + "sigma_per_swing_um", 0.0);
  out.prior_measurements = section.find_number(prefix + "sigma_prior_measurements").value_or(0.0);
  CoverageFactor& coverage = out.coverage;
  coverage.quiet = section.find_number(prefix + "sigma_coverage_factor").value_or(1.0);
  coverage.lively = section.find_number(prefix + "sigma_coverage_factor_lively").value_or(coverage.quiet);
  if (const auto shares = section.find_numbers(prefix + "sigma_coverage_shares")) {
    if (shares->size() != 2 || !((*shares)[0] <= (*shares)[1]))
      section.error(prefix + "sigma_coverage_shares", "two shares, the smaller one first");
    else
      coverage.quiet_at = (*shares)[0], coverage.lively_at = (*shares)[1];
  }
  if (!(coverage.quiet > 0.0) || !(coverage.lively > 0.0) || !(out.prior_measurements >= 0.0))
    section.error(prefix + "sigma_coverage_factor", "a coverage factor is above zero, a prior not below");
  return out;
}

Table channel_table(const ChannelModel& channel) {
  Table out;
  out.emplace_back("name", text(channel.channel));
  if (!channel.axis.empty()) out.emplace_back("axis", text(channel.axis));
  out.emplace_back("method", text(channel.candidate.name()));
  out.emplace_back("heldout_rmse_um", number_value(channel.heldout_rmse_mm / kMmPerUm));
  out.emplace_back("hold_last_rmse_um", number_value(channel.hold_last_rmse_mm / kMmPerUm));
  add_sigma(channel.sigma, "", out);
  add_sigma(channel.hold_sigma, "hold_", out);
  out.emplace_back("largest_um", number_value(channel.largest_mm / kMmPerUm));
  out.emplace_back("typical_change_um", number_value(channel.typical_change_mm / kMmPerUm));
  if (!channel.regressor) return out;
  out.emplace_back("sensors", texts(channel.features.sensors));
  out.emplace_back("median_s", number_value(channel.features.median_s));
  out.emplace_back("temperature_lags_s", reals(channel.features.temperature_taus_s));
  out.emplace_back("speed_lags_s", reals(channel.features.speed_taus_s));
  out.emplace_back("speed_powers", reals(channel.features.speed_powers));
  out.emplace_back("feed_lags_s", reals(channel.features.feed_taus_s));
  out.emplace_back("features", texts(channel.features.names()));
  out.emplace_back("parameters", Value{channel.regressor->table(), {}});
  out.emplace_back("range", Value{channel.guard.table(), {}});
  return out;
}

Guard read_guard(Section section, std::size_t features) {
  const auto spread = section.find_numbers("spread").value_or(std::vector<double>{});
  const double floor = section.find_number("floor").value_or(0.0);
  const double largest = section.find_number("largest").value_or(0.0);
  if (!(floor > 0.0) || !(largest > 0.0)) section.error("floor", "'floor' and 'largest' must be above zero");
  for (const double s : spread) {
    if (!(s > 0.0)) section.error("spread", "'spread' must hold numbers above zero");
  }
  const MatrixXd directions = read_matrix(section, "directions", spread.size(), features).transpose();
  const Eigen::VectorXd scale = read_numbers(section, "scale", features);
  const Value* listed = section.has("seen") ? section.raw("seen") : nullptr;
  const auto* rows = listed != nullptr ? listed->as_array() : nullptr;
  const MatrixXd seen = rows != nullptr ? read_matrix(section, "seen", rows->size(), features)
                                        : MatrixXd(0, static_cast<Index>(features));
  section.finish();
  const Eigen::Map<const Eigen::VectorXd> spreads(spread.data(), static_cast<Index>(spread.size()));
  return Guard(Guard::Parts{scale, directions, spreads, floor, largest, seen});
}

void read_parts(Section& section, ChannelModel& channel) {
  channel.features.sensors = section.texts("sensors");
  channel.features.median_s = section.quantity_or("median_s", 0.0);
  channel.features.temperature_taus_s =
      section.find_numbers("temperature_lags_s").value_or(std::vector<double>{});
  channel.features.speed_taus_s = section.find_numbers("speed_lags_s").value_or(std::vector<double>{});
  channel.features.speed_powers = section.find_numbers("speed_powers").value_or(std::vector<double>{});
  channel.features.feed_taus_s = section.find_numbers("feed_lags_s").value_or(std::vector<double>{});
  for (const auto* taus : {&channel.features.temperature_taus_s, &channel.features.speed_taus_s,
                           &channel.features.feed_taus_s}) {
    for (const double tau : *taus) {
      if (!(tau >= 0.0)) section.error("sensors", "a time constant must not be negative");
    }
  }
  constexpr double kHighestPower = 10.0;  // friction heat grows as speed^1 to ^2
  for (const double power : channel.features.speed_powers) {
    if (!(power > 0.0 && power <= kHighestPower))
      section.error("speed_powers",
                    "'speed_powers' must hold numbers above 0 and up to " + shortest_text(kHighestPower));
  }
  if (const auto names = section.find_texts("features"); names && *names != channel.features.names()) {
    section.error("features", "'features' does not agree with the sensors and lags of this channel");
  }
  auto parameters = section.find_section("parameters");
  auto range = section.find_section("range");
  if (!parameters || !range) {
    section.error("method", "a channel with a method needs [channel.parameters] and [channel.range]");
    return;
  }
  channel.regressor = read_regressor(channel.candidate.method, channel.features.size(), *parameters);
  parameters->finish();
  channel.guard = read_guard(*range, channel.features.size());
}

ChannelModel read_channel(Section section) {
  ChannelModel out;
  out.channel = section.text("name");
  section.takes("axis", {"dx", "dy", "dz", "none"});
  out.axis = section.find_text("axis").value_or("");
  if (!out.axis.empty() && out.axis != "none" && !offset_component(out)) {
    section.error("axis", "'axis' must be dx, dy, dz or none, not '" + out.axis + "'");
  }
  const std::string method = section.text("method");
  const auto candidate = candidate_of_name(method);
  if (candidate) {
    out.candidate = *candidate;
  } else if (!method.empty()) {
    section.error("method", "unknown method '" + method + "'");
  }
  out.heldout_rmse_mm = section.quantity_or("heldout_rmse_um", 0.0);
  out.hold_last_rmse_mm = section.quantity_or("hold_last_rmse_um", 0.0);
  if (!section.has("sigma_floor_um")) section.error("name", "'sigma_floor_um' is missing");
  out.sigma = read_sigma(section, "");
  out.hold_sigma = read_sigma(section, "hold_");
  // A file of before has no sigma of holding.
  if (!(out.hold_sigma.floor_mm > 0.0)) out.hold_sigma.floor_mm = out.hold_last_rmse_mm;
  out.largest_mm = section.quantity_or("largest_um", 0.0);
  out.typical_change_mm = section.quantity_or("typical_change_um", 0.0);
  if (candidate && candidate->method != Method::none && candidate->method != Method::hold_last)
    read_parts(section, out);
  section.finish();
  return out;
}

}  // namespace

Value number_value(double value) {
  return {value, {}};
}

Value matrix_value(const MatrixXd& matrix) {
  config::Array out;
  for (Index i = 0; i < matrix.rows(); ++i) out.push_back(numbers(matrix.row(i).transpose()));
  return {std::move(out), {}};
}

MatrixXd read_matrix(Section& section, std::string_view key, std::size_t rows, std::size_t columns) {
  MatrixXd out = MatrixXd::Zero(static_cast<Index>(rows), static_cast<Index>(columns));
  const Value* value = section.raw(key);
  const auto* items = value != nullptr ? value->as_array() : nullptr;
  if (items == nullptr || items->size() != rows) {
    section.error(key, "'" + std::string(key) + "' must be an array of " + std::to_string(rows) + " rows");
    return out;
  }
  for (std::size_t i = 0; i < rows; ++i) {
    // Each row is read as a table of one key, so that the messages are those of every other array.
    // (Not as a list of pairs: without memory for its last copy the compiler's own clean-up ends the
    // process.)
    Table cells;
    cells.emplace_back(std::string(key), (*items)[i]);
    const Value row{std::move(cells), (*items)[i].where};
    Section wrapped(row, section.name(), section.file(), section.diagnostics());
    const auto values = wrapped.find_numbers(key);
    if (!values || values->size() != columns) {
      wrapped.error(key,
                    "a row of '" + std::string(key) + "' must have " + std::to_string(columns) + " numbers");
      return out;
    }
    out.row(static_cast<Index>(i)) =
        Eigen::Map<const Eigen::VectorXd>(values->data(), static_cast<Index>(columns)).transpose();
  }
  return out;
}

std::shared_ptr<const Regressor> read_regressor(Method method, std::size_t features, Section& section) {
  switch (method) {
    case Method::svr:
    case Method::svr_all:
      return read_svr(features, section);
    case Method::gp:
      return read_gp(features, section);
    case Method::mean:
      return read_mean(features, section);
    default:
      return read_linear(features, section);
  }
}

std::string model_text(const ThermalModel& model) {
  Table head;
  head.emplace_back("name", text(model.name));
  head.emplace_back("kind", text("thermal"));
  head.emplace_back("data_hash", text(model.data_hash));
  head.emplace_back("files", texts(model.files));
  head.emplace_back("runs", texts(model.runs));
  head.emplace_back("measure_every_min", number_value(model.measure_every_s / kSecondsPerMinute));
  config::Array channels;
  for (const ChannelModel& channel : model.channels) channels.push_back({channel_table(channel), {}});
  Table root;
  root.emplace_back("model", Value{std::move(head), {}});
  root.emplace_back("channel", Value{std::move(channels), {}});
  return config::toml_text({std::move(root), {}});
}

Result<ThermalModel> parse_model(std::string_view toml, const std::string& file, Diagnostics& diagnostics) {
  const auto root = config::parse_toml(toml, file);
  if (!root) return tl::unexpected(root.error());
  const std::size_t errors_before = diagnostics.error_count();
  Section top(*root, "thermal model", file, diagnostics);
  ThermalModel out;
  if (auto head = top.find_section("model")) {
    out.name = head->find_text("name").value_or("");
    head->takes("kind", {"thermal"});
    const std::string kind = head->text("kind");
    if (kind != "thermal")
      head->error("kind", "this is no thermal model: kind is '" + kind + "', not 'thermal'");
    out.data_hash = head->find_text("data_hash").value_or("");
    out.files = head->find_texts("files").value_or(std::vector<std::string>{});
    out.runs = head->find_texts("runs").value_or(std::vector<std::string>{});
    out.measure_every_s = head->quantity("measure_every_min");
    head->finish();
  } else {
    top.error("model", "missing table [model]");
  }
  for (Section& section : top.sections("channel")) out.channels.push_back(read_channel(section));
  if (out.channels.empty()) top.error("channel", "a thermal model needs at least one [[channel]]");
  top.finish();
  if (diagnostics.error_count() > errors_before) return tl::unexpected(diagnostics.first_error());
  return out;
}

Result<ThermalModel> load_model(const std::string& path, Diagnostics& diagnostics) {
  const auto toml = read_file(path);
  if (!toml) return tl::unexpected(toml.error());
  return parse_model(*toml, path, diagnostics);
}

}  // namespace trunnion::thermal
