#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "trunnion/base/files.hpp"
#include "trunnion/report/iso230_json.hpp"

#include "app/results.hpp"
#include "app/support.hpp"

namespace trunnion::app {
namespace {

using namespace iso230;

struct Iso230Options {
  std::vector<std::string> data;
  ResultOptions result;
  std::string axis;    // name of the line of a motion log, which does not say it
  std::string centre;  // ISO 230-7
  std::vector<std::string> limits, uncertainties;
};

struct Output {
  std::string text, json;
  report::PageOf page;
  std::vector<NamedValue> values;
};

// Rows of all files together (run names are kept apart by the file's number when there are several).
Result<Readings> read_all(const std::vector<std::string>& files, Diagnostics& diagnostics) {
  Readings all;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const auto text = read_file(files[i]);
    if (!text) return tl::unexpected(text.error());
    auto one = parse_readings(*text, files[i], diagnostics);
    if (!one) return one;
    if (all.file.empty()) all.file = one->file;
    for (Reading& row : one->rows) {
      if (i > 0) row.run = std::to_string(i + 1) + ":" + row.run;
      all.rows.push_back(std::move(row));
    }
  }
  return all;
}

// Motion logs hold one line each; everything else is a measurement file.
Result<std::vector<LineTest>> read_lines(const Iso230Options& options, Diagnostics& diagnostics) {
  std::vector<LineTest> lines;
  std::vector<std::string> rest;
  for (const std::string& file : options.data) {
    const auto text = file == "-" ? Result<std::string>("") : read_file(file);
    if (!text) return tl::unexpected(text.error());
    if (!is_motion_log(*text)) {
      rest.push_back(file);
      continue;
    }
    const std::string name =
        options.axis.empty() ? std::filesystem::path(file).stem().string() : options.axis;
    auto line = parse_motion_log(*text, file, name, diagnostics);
    if (!line) return tl::unexpected(line.error());
    lines.push_back(std::move(*line));
  }
  if (rest.empty()) return lines;
  const auto readings = read_all(rest, diagnostics);
  if (!readings) return tl::unexpected(readings.error());
  auto more = axis_lines(*readings);
  if (!more) return more;
  lines.insert(lines.end(), more->begin(), more->end());
  return lines;
}

Result<Output> positioning(const Iso230Options& options, Diagnostics& diagnostics) {
  const auto lines = read_lines(options, diagnostics);
  if (!lines) return tl::unexpected(lines.error());
  std::vector<Positioning> axes;
  for (const LineTest& line : *lines) {
    auto result = evaluate_positioning(line);
    if (!result) return tl::unexpected(result.error());
    axes.push_back(std::move(*result));
  }
  return Output{report::iso230_2_text(axes), report::iso230_2_json(axes, *lines), report::positioning_page,
                values_of(axes)};
}

Result<Output> diagonals(const Iso230Options& options, Diagnostics& diagnostics) {
  const auto readings = read_all(options.data, diagnostics);
  if (!readings) return tl::unexpected(readings.error());
  const auto lines = diagonal_lines(*readings);
  if (!lines) return tl::unexpected(lines.error());
  const auto result = evaluate_diagonals(*lines);
  if (!result) return tl::unexpected(result.error());
  return Output{report::iso230_6_text(*result), report::iso230_6_json(*result, *lines),
                report::positioning_page, values_of(result->lines)};
}

Result<Output> circles(const Iso230Options& options, Diagnostics& diagnostics) {
  const auto readings = read_all(options.data, diagnostics);
  if (!readings) return tl::unexpected(readings.error());
  const auto paths = circular_paths(*readings);
  if (!paths) return tl::unexpected(paths.error());
  const auto tests = evaluate_circles(*paths);
  if (!tests) return tl::unexpected(tests.error());
  return Output{report::iso230_4_text(*tests), report::iso230_4_json(*tests, *paths), report::circles_page,
                values_of(*tests)};
}

Result<Output> rotation(const Iso230Options& options, Diagnostics& diagnostics) {
  const auto readings = read_all(options.data, diagnostics);
  if (!readings) return tl::unexpected(readings.error());
  const auto motions = error_motions(*readings);
  if (!motions) return tl::unexpected(motions.error());
  std::optional<Centre> centre;
  for (const Centre c : {Centre::polar_chart, Centre::least_squares, Centre::minimum_zone,
                         Centre::maximum_inscribed, Centre::minimum_circumscribed})
    if (text_of(c) == options.centre) centre = c;
  std::vector<report::EvaluatedMotion> evaluated;
  std::vector<NamedValue> named;
  for (const ErrorMotion& motion : *motions) {
    const auto values = evaluate_error_motion(motion, centre);
    if (!values) return tl::unexpected(values.error());
    evaluated.push_back({motion, *values});
    for (NamedValue& value : values_of(motion, *values)) named.push_back(std::move(value));
  }
  return Output{report::iso230_7_text(evaluated), report::iso230_7_json(evaluated), report::rotation_page,
                std::move(named)};
}

using Evaluate = std::function<Result<Output>(const Iso230Options&, Diagnostics&)>;

Result<std::vector<NamedNumber>> named_numbers(const std::vector<std::string>& texts) {
  std::vector<NamedNumber> out;
  for (const std::string& text : texts) {
    auto number = parse_named_number(text);
    if (!number) return tl::unexpected(number.error());
    out.push_back(std::move(*number));
  }
  return out;
}

Result<std::vector<HeldValue>> held(const Iso230Options& options, const std::vector<NamedValue>& values) {
  const auto limits = named_numbers(options.limits);
  if (!limits) return tl::unexpected(limits.error());
  const auto uncertainties = named_numbers(options.uncertainties);
  if (!uncertainties) return tl::unexpected(uncertainties.error());
  return hold_against(values, *limits, *uncertainties);
}

ExitCode run(const Iso230Options& options, const Evaluate& evaluate) {
  Diagnostics diagnostics;
  const auto output = evaluate(options, diagnostics);
  if (!output) return print_failure(diagnostics, output.error());
  const auto judged = held(options, output->values);
  if (!judged) return print_failure(diagnostics, judged.error());
  print(diagnostics);
  if (const ExitCode code = options.result.write(report::with_limits(output->json, *judged),
                                                 {"ISO 230: " + options.data.front(), {}, {}, {}},
                                                 output->page, output->text + report::limits_text(*judged));
      code != kDone)
    return code;
  return all_within(*judged) ? kDone : kCheckFailed;
}

}  // namespace

void add_iso230_command(CLI::App& root, int& exit) {
  CLI::App* command = root.add_subcommand("iso230", "evaluations of the parts of ISO 230");
  command->require_subcommand(1);
  const auto add = [&](const char* part, const char* what, const Evaluate& evaluate) {
    CLI::App* sub = command->add_subcommand(part, what);
    auto options = std::make_shared<Iso230Options>();
    sub->add_option("data", options->data,
                    "measurement files (part 2 also reads the raw data of a motion logger)")
        ->required();
    sub->add_option("--limit", options->limits,
                    "agreed limit of a value, um or urad: A=10 for all, X.A=10 for one; exit code 1 unless "
                    "every limit is proved to be met")
        ->type_name("[OF.]SYMBOL=NUMBER")
        ->delimiter(',');
    sub->add_option("--uncertainty", options->uncertainties,
                    "expanded uncertainty U (k = 2) of a value, in the same form: within U of the limit "
                    "nothing is proved (ISO 14253-1)")
        ->type_name("[OF.]SYMBOL=NUMBER")
        ->delimiter(',');
    options->result.add_to(*sub);
    sub->callback([options, evaluate, &exit] { exit = run(*options, evaluate); });
    return std::pair(sub, options);
  };
  const auto [two, two_options] =
      add("2", "positioning of axes: B, R, E, M, A in both directions", positioning);
  two->add_option("--axis", two_options->axis, "name of the axis of a motion log (else the file's name)");
  add("4", "circles: G, G(b), D, F", circles);
  add("6", "diagonals, each by part 2, and the largest values", diagonals);
  const auto [seven, seven_options] =
      add("7", "error motion of rotary axes: total, synchronous, asynchronous", rotation);
  seven
      ->add_option("--centre", seven_options->centre,
                   "PC, LSC, MZC, MIC or MCC (else LSC for radial, PC for axial and tilt)")
      ->check(CLI::IsMember({"PC", "LSC", "MZC", "MIC", "MCC"}));
}

}  // namespace trunnion::app
