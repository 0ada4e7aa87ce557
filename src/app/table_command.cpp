#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/post/post.hpp"
#include "trunnion/report/command_pages.hpp"
#include "trunnion/report/table_json.hpp"

#include "app/command_tree.hpp"
#include "app/options.hpp"
#include "app/results.hpp"
#include "app/support.hpp"

namespace trunnion::app {
namespace {

using namespace diagnosis;

struct TableOptions {
  std::string format;
  std::vector<std::string> files;  // data, tables
  std::string machine, output, truth;
  std::vector<std::string> inputs, outputs, checks, held_out;
  std::string remove_line;
  std::vector<double> measured_at;  // mm
  std::vector<std::string> at;      // "Z=100"
  double step = 0.0;
  double unit_um = 1.0;
  bool force = false;
  ResultOptions result;
  std::uint64_t seed = 1;
  FormatOptions of_format;
};

// What a command has to say, for people and as JSON.
struct Said {
  std::string text, json, title, verdict;
  report::PageOf page = nullptr;  // nothing: that of `tables`
  std::vector<ErrorTable> tables = {};
};

Result<Machine> table_machine(const TableOptions& options, Diagnostics& diagnostics) {
  return load_machine_or_named(options.machine, diagnostics);
}

// OUT.csv for one table; OUT_<arguments>.csv for each of several.
std::string name_of(const TableOptions& options, const std::vector<ErrorTable>& tables, std::size_t i) {
  if (tables.size() == 1) return options.output;
  const std::filesystem::path path(options.output);
  std::string arguments;
  for (const std::string& a : tables[i].arguments) arguments += a;
  for (std::size_t k = 0; k < i; ++k)
    if (tables[k].arguments == tables[i].arguments) arguments += "_" + std::to_string(i + 1);
  return (path.parent_path() / (path.stem().string() + "_" + arguments + path.extension().string())).string();
}

// Keys of the model file beside the table's name.
std::string interpolation_keys(const ErrorTable& table, const InterpolationOptions& two) {
  if (table.arguments.size() == 1 || two.method == Interpolation::linear) return {};
  std::string out = "  interpolation = \"" + std::string(text_of(two.method)) + "\"";
  if (two.smoothing > 0.0) out += "  smoothing = " + shortest_text(two.smoothing);
  return out;
}

// `two`: how a table over two axes is meant to be interpolated.
Result<void> write_tables(const TableOptions& options, const std::vector<ErrorTable>& tables,
                          const Machine& machine, std::string& said, const InterpolationOptions& two = {}) {
  for (std::size_t i = 0; i < tables.size(); ++i) {
    const std::string name = name_of(options, tables, i);
    auto written = write_file(name, error_table_text(tables[i], machine));
    if (!written) return written;
    if (name == "-") continue;
    for (const auto& component : tables[i].components)
      said += "[[effect]]  id = \"component:" + component.name + "\"  table = \"" +
              std::filesystem::path(name).filename().string() + "\"" + interpolation_keys(tables[i], two) +
              "\n";
  }
  return {};
}

// A table of errors is one for both directions.
void tell_directions(const CorrectionMap& map, const std::string& file, Diagnostics& diagnostics) {
  double most_mm = 0.0;
  for (const CorrectionMap::Output& output : map.outputs) {
    for (std::size_t i = 0; i < output.down.size(); ++i)
      most_mm = std::max(most_mm, std::abs(output.up[i] - output.down[i]));
  }
  if (most_mm > 0.0)
    diagnostics.warning(
        file, {},
        "its corrections differ by up to " + fixed_text(most_mm / kMmPerUm, 2) +
            " um by the direction of the motion: the mean of both is taken, and what is between "
            "them is lost (lost motion is an effect of its own: backlash:X)");
}

// Where the axis turns on from there the control holds the last value.
void tell_open_turns(const std::vector<CorrectionMap>& maps, const Machine& machine,
                     Diagnostics& diagnostics) {
  constexpr double kWhole = 1e-6;  // rad
  for (const CorrectionMap& map : maps) {
    for (std::size_t k = 0; k < map.inputs.size(); ++k) {
      const std::vector<double>& nodes = map.nodes[k];
      if (!machine.axes[*machine.axis(map.inputs[k])].cyclic ||
          nodes.back() - nodes.front() > kTwoPi - kWhole)
        continue;
      diagnostics.warning_once(
          map.inputs[k], "", {},
          "the table over " + map.inputs[k] + " goes from " + fixed_text(nodes.front() * kDegreePerRad, 3) +
              " to " + fixed_text(nodes.back() * kDegreePerRad, 3) +
              " deg, and the axis turns on: the control holds the value of the end there");
    }
  }
}

Result<Said> import(const TableOptions& options, Diagnostics& diagnostics) {
  const auto machine = table_machine(options, diagnostics);
  if (!machine) return tl::unexpected(machine.error());
  std::vector<ErrorTable> tables;
  std::string said;
  for (const std::string& file : options.files) {
    if (options.format == "csv") {
      auto table = load_error_table(file, *machine, diagnostics);
      if (!table) return tl::unexpected(table.error());
      tables.push_back(std::move(*table));
      continue;
    }
    const auto text = read_file(file);
    if (!text) return tl::unexpected(text.error());
    auto read = table_format(options.format)->read(*text, file, *machine, options.of_format, diagnostics);
    if (!read) return tl::unexpected(read.error());
    for (ErrorTable& table : read->errors) tables.push_back(std::move(table));
    for (const CorrectionMap& map : read->corrections) {
      auto errors = errors_of(*machine, map);
      if (!errors) return tl::unexpected(errors.error());
      tell_directions(map, file, diagnostics);
      for (ErrorTable& table : *errors) tables.push_back(std::move(table));
    }
    for (const auto& [name, value] : read->location) {
      const bool length = name[0] >= 'X' && name[0] <= 'Z';
      said += "location error " + name + (length ? "_um = " : "_urad = ") +
              shortest_text(value / (length ? kMmPerUm : kRadPerUrad)) + "\n";
    }
  }
  for (ErrorTable& table : tables) {
    if (!options.measured_at.empty()) {
      auto moved =
          abbe_transferred(*machine, std::move(table),
                           Vec3(options.measured_at[0], options.measured_at[1], options.measured_at[2]));
      if (!moved) return tl::unexpected(moved.error());
      table = std::move(*moved);
    }
    if (!options.remove_line.empty()) {
      auto bare = without_line(std::move(table), *reference_line_of(options.remove_line));
      if (!bare) return tl::unexpected(bare.error());
      table = std::move(*bare);
    }
  }
  if (const auto written = write_tables(options, tables, *machine, said); !written)
    return tl::unexpected(written.error());
  return Said{options.output == "-" ? "" : said,
              report::tables_json(options.format, tables),
              options.files.front() + " as error tables",
              "",
              nullptr,
              std::move(tables)};
}

// `X=..,Y=..`: where the axes stand that the export does not move.
Result<JointVector> rest_of(const TableOptions& options, const Machine& machine) {
  JointVector rest;
  for (const std::string& entry : options.at) {
    const auto equals = entry.find('=');
    const auto id = machine.axis(entry.substr(0, equals));
    const auto value = equals == std::string::npos ? ParsedNumber{0.0, NumberFault::empty}
                                                   : parse_number(entry.substr(equals + 1));
    if (!id || !value) return fail(ErrorCode::wrong_use, "--at wants AXIS=position, not '" + entry + "'");
    rest[*id] = value.value * (machine.axes[*id].kind == AxisKind::rotary ? kRadPerDegree : 1.0);
  }
  return rest;
}

// Nodes at equal steps (mm, deg) from the first to the last of those that the table has.
Result<std::vector<double>> even_nodes(const Machine& machine, const std::string& input,
                                       const std::vector<double>& nodes, double step) {
  const auto id = machine.axis(input);
  const double unit = id && machine.axes[*id].kind == AxisKind::rotary ? kRadPerDegree : 1.0;
  const double range = (nodes.back() - nodes.front()) / unit;
  const double count = std::round(range / step);
  constexpr double kSame = 1e-6;      // of a step: decimals of the file
  constexpr double kMostNodes = 1e5;  // controls have some thousand
  if (!(count >= 1.0 && count <= kMostNodes) || std::abs(count * step - range) > kSame * step)
    return fail(ErrorCode::wrong_use, "--step " + shortest_text(step) + " does not divide the " +
                                          shortest_text(range) + (unit == 1.0 ? " mm" : " deg") +
                                          " of the table over " + input + ": its last node would be lost");
  std::vector<double> out;
  for (int i = 0; i <= static_cast<int>(count); ++i) out.push_back(nodes.front() + i * step * unit);
  out.back() = nodes.back();
  return out;
}

// A control moves its axes by what stands there, whatever it is.
Result<void> check_size(const std::vector<CorrectionMap>& maps, const Machine& machine) {
  const double most_mm = post::PostOptions{}.largest_correction_mm;
  for (const CorrectionMap& map : maps) {
    for (const CorrectionMap::Output& output : map.outputs) {
      const auto id = machine.axis(output.axis);
      if (!id || machine.axes[*id].kind != AxisKind::linear) continue;
      for (const auto* values : {&output.up, &output.down}) {
        for (const double value : *values) {
          if (std::abs(value) <= most_mm) continue;
          return fail(ErrorCode::check_failed,
                      "the table would move " + output.axis + " by " + fixed_text(value, 3) +
                          " mm; more than " + shortest_text(most_mm) +
                          " mm is no error of a machine: are the values in the unit that their column says? "
                          "(--force writes)");
        }
      }
    }
  }
  return {};
}

// One map per set of arguments of the tables (or the one that is asked for).
Result<std::vector<CorrectionMap>> corrections(const TableOptions& options, const Machine& machine,
                                               const std::vector<ErrorTable>& tables,
                                               const JointVector& rest) {
  std::vector<std::string> outputs = options.outputs;
  if (outputs.empty())
    for (const Axis& axis : machine.axes)
      if (axis.kind == AxisKind::linear) outputs.push_back(axis.name);
  std::vector<std::pair<std::vector<std::string>, std::vector<std::vector<double>>>> domains;
  std::vector<std::vector<ErrorTable>> parts;
  for (const ErrorTable& table : tables) {
    const auto it = std::find_if(domains.begin(), domains.end(),
                                 [&](const auto& d) { return d.first == table.arguments; });
    if (it == domains.end()) {
      domains.push_back({table.arguments, table.nodes});
      parts.push_back({table});
    } else {
      parts[static_cast<std::size_t>(it - domains.begin())].push_back(table);
    }
  }
  if (!options.inputs.empty()) {  // all tables together over the axes asked for
    std::vector<std::vector<double>> nodes;
    for (const std::string& input : options.inputs) {
      const auto found = std::find_if(tables.begin(), tables.end(), [&](const ErrorTable& t) {
        return std::find(t.arguments.begin(), t.arguments.end(), input) != t.arguments.end();
      });
      if (found == tables.end()) return fail(ErrorCode::wrong_use, "no table has the argument " + input);
      nodes.push_back(found->nodes[static_cast<std::size_t>(
          std::find(found->arguments.begin(), found->arguments.end(), input) - found->arguments.begin())]);
    }
    domains = {{options.inputs, nodes}};
    parts = {tables};
  }
  std::vector<CorrectionMap> out;
  for (std::size_t d = 0; d < domains.size(); ++d) {
    auto& [inputs, nodes] = domains[d];
    for (std::size_t i = 0; options.step > 0.0 && i < nodes.size(); ++i) {
      auto even = even_nodes(machine, inputs[i], nodes[i], options.step);
      if (!even) return tl::unexpected(even.error());
      nodes[i] = std::move(*even);
    }
    auto map = corrections_of(machine, parts[d], {inputs, nodes, outputs, rest, machine.tool_vector()});
    if (!map) return tl::unexpected(map.error());
    // An axis that this domain does not correct has no table.
    std::erase_if(map->outputs, [](const CorrectionMap::Output& o) {
      return std::all_of(o.up.begin(), o.up.end(), [](double v) { return std::abs(v) < 1e-9; });
    });
    if (map->outputs.empty()) continue;
    close_turns(machine, *map);
    out.push_back(std::move(*map));
  }
  return out;
}

/// What is exported, and where the axes stand that it does not ask for.
struct Exported {
  const std::vector<ErrorTable>& errors;
  const std::vector<CorrectionMap>& maps;
  const JointVector& rest;
};

// The largest difference between corrections of one axis over the same inputs, mm; of one that only `a` has,
// its own size.
double largest_difference_mm(const Machine& machine, const std::vector<CorrectionMap>& a,
                             const std::vector<CorrectionMap>& b) {
  double out = 0.0;
  for (const CorrectionMap& map : a) {
    const auto same =
        std::find_if(b.begin(), b.end(), [&](const CorrectionMap& m) { return m.inputs == map.inputs; });
    for (const CorrectionMap::Output& output : map.outputs) {
      if (machine.axes[*machine.axis(output.axis)].kind != AxisKind::linear) continue;
      const CorrectionMap::Output* other = same == b.end() ? nullptr : same->output(output.axis);
      for (std::size_t i = 0; i < output.up.size(); ++i)
        out = std::max(out, std::abs(output.up[i] - (other == nullptr ? 0.0 : other->up[i])));
    }
  }
  return out;
}

// A table of a control asks for one or two axes; an error that turns the tool moves its tip by what the
// others make of it. Elsewhere the table may be worse than none.
void warn_of_other_poses(const TableOptions& options, const Machine& machine, const Exported& exported,
                         Diagnostics& diagnostics) {
  constexpr double kSeen_mm = 0.001;  // less is nothing that such a table is made for
  double largest_mm = 0.0;
  std::string where;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const Axis& axis = machine.axes[id];
    if (!axis.has_limits()) continue;
    for (const double end : {axis.min, axis.max}) {
      JointVector rest = exported.rest;
      rest[id] = end;
      const auto there = corrections(options, machine, exported.errors, rest);
      if (!there) continue;
      const double apart_mm = std::max(largest_difference_mm(machine, exported.maps, *there),
                                       largest_difference_mm(machine, *there, exported.maps));
      if (apart_mm <= largest_mm) continue;
      largest_mm = apart_mm;
      const bool rotary = axis.kind == AxisKind::rotary;
      where =
          axis.name + " at " + shortest_text(rotary ? end * kDegreePerRad : end) + (rotary ? " deg" : " mm");
    }
  }
  if (largest_mm <= kSeen_mm) return;
  std::string at;
  for (AxisId id = 0; id < machine.axes.size(); ++id)
    at +=
        (id == 0 ? "" : " ") + machine.axes[id].name +
        shortest_text(exported.rest[id] * (machine.axes[id].kind == AxisKind::rotary ? kDegreePerRad : 1.0));
  diagnostics.warning(options.output, {},
                      "the corrections hold where the axes that the table does not ask for stand at " + at +
                          " (--at); with " + where + " they are wrong by up to " +
                          fixed_text(largest_mm / kMmPerUm, 1) +
                          " um, and may be worse than none: such errors are for post --model");
}

Result<std::vector<NamedLine>> read_lines(const std::vector<std::string>& files, const Machine& machine,
                                          Diagnostics& diagnostics) {
  const auto data = load_measurements(files, machine, diagnostics);
  if (!data) return tl::unexpected(data.error());
  return named_lines(*data);
}

Result<Said> export_tables(const TableOptions& options, Diagnostics& diagnostics) {
  const auto machine = table_machine(options, diagnostics);
  if (!machine) return tl::unexpected(machine.error());
  ControlTables tables;
  for (const std::string& file : options.files) {
    auto table = load_error_table(file, *machine, diagnostics);
    if (!table) return tl::unexpected(table.error());
    tables.errors.push_back(std::move(*table));
  }
  std::string said;
  if (!options.checks.empty()) {
    const auto lines = read_lines(options.checks, *machine, diagnostics);
    if (!lines) return tl::unexpected(lines.error());
    TableCandidate candidate{.name = "export", .tables = tables.errors, .one = {}, .two = {}};
    candidate.two.method = Interpolation::bilinear;  // what the controls do between nodes
    const auto verdict = gate(*machine, candidate, *lines);
    if (!verdict) return tl::unexpected(verdict.error());
    said = verdict->text();
    if (!verdict->passed() && !options.force)
      return fail(ErrorCode::check_failed,
                  "the tables make an independent line worse; nothing is written (--force writes)\n" + said);
  }
  const TableFormat* format = table_format(options.format);
  if (format->holds_corrections) {
    const auto rest = rest_of(options, *machine);
    if (!rest) return tl::unexpected(rest.error());
    auto maps = corrections(options, *machine, tables.errors, *rest);
    if (!maps) return tl::unexpected(maps.error());
    warn_of_other_poses(options, *machine, {tables.errors, *maps, *rest}, diagnostics);
    if (const auto sized = check_size(*maps, *machine); !sized && !options.force)
      return tl::unexpected(sized.error());
    tell_open_turns(*maps, *machine, diagnostics);
    tables.corrections = std::move(*maps);
  }
  const auto text = format->write(tables, *machine, options.of_format);
  if (!text) return tl::unexpected(text.error());
  if (const auto written = write_file(options.output, *text); !written)
    return tl::unexpected(written.error());
  if (!format->beside.empty()) diagnostics.warning(options.output, {}, std::string(format->beside));
  return Said{options.output == "-" ? "" : said,
              report::tables_json(options.format, tables.errors),
              "Error tables for a control",
              "Written to " + options.output + ".",
              nullptr,
              std::move(tables.errors)};
}

Result<Said> evaluate(const TableOptions& options, Diagnostics& diagnostics) {
  const auto machine = table_machine(options, diagnostics);
  if (!machine) return tl::unexpected(machine.error());
  const auto data = load_measurements(options.files, *machine, diagnostics);
  if (!data) return tl::unexpected(data.error());
  const auto map = planar_map(*data, *machine);
  if (!map) return tl::unexpected(map.error());
  std::vector<CheckReading> others;
  if (!options.held_out.empty()) {
    const auto more = load_measurements(options.held_out, *machine, diagnostics);
    if (!more) return tl::unexpected(more.error());
    others = check_readings(*more);
  }
  const auto choice = choose_table(*machine, *map, others);
  if (!choice) return tl::unexpected(choice.error());
  const TableCandidate& best = choice->rows[choice->best].candidate;
  std::optional<Gate> verdict;
  if (!options.checks.empty()) {
    const auto lines = read_lines(options.checks, *machine, diagnostics);
    if (!lines) return tl::unexpected(lines.error());
    auto checked = gate(*machine, best, *lines);
    if (!checked) return tl::unexpected(checked.error());
    verdict = std::move(*checked);
  }
  std::string said;
  if (!options.output.empty()) {
    if (verdict && !verdict->passed() && !options.force)
      return fail(ErrorCode::check_failed,
                  "the chosen tables make an independent line worse; nothing is written (--force writes)\n" +
                      verdict->text());
    if (const auto written = write_tables(options, best.tables, *machine, said, best.two); !written)
      return tl::unexpected(written.error());
  }
  return Said{report::table_choice_text(*choice, verdict) + said, report::table_choice_json(*choice, verdict),
              "Which table suits " + map->u + map->v + " of " + machine->name,
              "Best on held-out points: " + best.name + ".", report::table_choice_page};
}

Result<Said> study(const TableOptions& options, Diagnostics& diagnostics) {
  const auto machine = table_machine(options, diagnostics);
  if (!machine) return tl::unexpected(machine.error());
  const auto truth = load_model(options.truth, *machine, {}, diagnostics);
  if (!truth) return tl::unexpected(truth.error());
  CrossTalkPlan plan;
  plan.seed = options.seed;
  const auto result = study_cross_talk(*machine, *truth, plan);
  if (!result) return tl::unexpected(result.error());
  const StudiedModel& best = result->models[result->best];
  return Said{
      report::cross_talk_text(*result), report::cross_talk_json(*result), "Cross-talk on " + machine->name,
      "Best by held-out data: " + best.name + " at " + std::to_string(best.nodes) +
          " nodes an axis, which removes " + fixed_text(100.0 * best.reduction(), 1) + " % at random points.",
      report::cross_talk_page};
}

using Work = Result<Said> (*)(const TableOptions&, Diagnostics&);

ExitCode run(const TableOptions& options, Work work) {
  Diagnostics diagnostics;
  const auto said = work(options, diagnostics);
  if (!said) return print_failure(diagnostics, said.error());
  print(diagnostics);
  if (said->page != nullptr)
    return options.result.write(said->json, {said->title, said->verdict, {}, {}}, said->page, said->text);
  return options.result.write(
      said->json,
      [&] {
        return report::tables_page({said->title, said->verdict, said->json, made_by()}, said->tables);
      },
      said->text);
}

void add_format_options(CLI::App& command, TableOptions& options) {
  command
      .add_option("--axes", options.of_format.axis_numbers,
                  "names of the control's axes 1, 2, 3, ... (default: those of the machine file)")
      ->delimiter(',');
  command.add_option("--axis", options.of_format.input_axis, "axis of a file that does not name it");
  command
      .add_option("--type", options.of_format.file_type,
                  "files with a COMP_FILE_TYPE: 0 actual positions, 1 trims")
      ->check(CLI::Range(0, 1));
  command.add_option("--unit-um", options.unit_um, "files of increments: value of one increment, um")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command.add_option("--reference-number", options.of_format.reference_number,
                     "files of increments: number of the reference point (parameter 3620)");
  command.add_option("--reference", options.of_format.reference_mm,
                     "files of increments: coordinate of the reference point (mm, deg)");
  command.add_flag("--negate", options.of_format.negate, "opposite sign of all values");
}

}  // namespace

void add_table_command(CLI::App& root, int& exit) {
  CLI::App* command = root.add_subcommand("table", "error tables of controls and of measuring systems");
  command->require_subcommand(1);
  auto options = std::make_shared<TableOptions>();
  const auto add = [&](const char* name, const char* what, Work work) {
    CLI::App* sub = command->add_subcommand(name, what);
    sub->add_option("-m,--machine", options->machine,
                    "machine file, or the name of one in postconfigs/machines")
        ->type_name(kMachineName)
        ->required();
    options->result.add_to(*sub);
    sub->callback([options, work, &exit] {
      options->of_format.unit_mm = options->unit_um * kMmPerUm;
      options->of_format.interval_mm = options->step;
      exit = run(*options, work);
    });
    return sub;
  };
  std::vector<std::string> formats;
  std::string list = "one of:";
  for (const TableFormat& format : table_formats()) {
    formats.emplace_back(format.name);
    list += "\n  " + std::string(format.name) + ": " + std::string(format.what);
  }
  CLI::App* in =
      add("import", "a table of a control or of a measuring system into the project's CSV", import);
  std::vector<std::string> readable = formats;
  readable.emplace_back("csv");
  in->add_option("format", options->format, list + "\n  csv: the project's own")
      ->required()
      ->check(CLI::IsMember(readable));
  in->add_option("files", options->files, "files to read")->required();
  in->add_option("-o,--output", options->output, "CSV file (several tables: with the axes' names appended)")
      ->required();
  in->add_option("--remove-line", options->remove_line, "take a reference line out and record it in the file")
      ->check(CLI::IsMember({"least-squares", "end-points", "minimum-zone"}));
  in->add_option("--measured-at", options->measured_at,
                 "where the line was measured, from the carriage point (mm): Abbe transfer")
      ->expected(3);
  in->add_option("--step", options->step,
                 "files of increments: interval of the points (parameter 3624; mm, deg)")
      ->check(CLI::PositiveNumber);
  add_format_options(*in, *options);

  CLI::App* out = add("export", "error tables as a control takes them", export_tables);
  out->add_option("format", options->format, list)->required()->check(CLI::IsMember(formats));
  out->add_option("tables", options->files, "error tables (CSV)")->required();
  out->add_option("-o,--output", options->output, "file to write")->required();
  out->add_option("--input", options->inputs, "axes over which corrections run (else the tables' own)")
      ->delimiter(',')
      ->expected(1, 2);
  out->add_option("--output-axes", options->outputs, "axes to correct (else all linear ones)")
      ->delimiter(',');
  out->add_option("--at", options->at, "where the other axes stand: Z=100,...")->delimiter(',');
  out->add_option("--step", options->step, "equal steps instead of the tables' nodes (mm, deg)")
      ->check(CLI::PositiveNumber);
  out->add_option("--check", options->checks,
                  "independent lines (measurement files) that the tables must not make worse");
  out->add_flag("--force", options->force,
                "write even if a line gets worse, or a correction is too large for an error of a machine");
  add_format_options(*out, *options);

  CLI::App* evaluated =
      add("evaluate", "which table suits a measured map: all models on held-out points", evaluate);
  evaluated->add_option("data", options->files, "measurement files: readings on a grid of two linear axes")
      ->required();
  evaluated->add_option("--held-out", options->held_out,
                        "readings that choose the model (else nodes left out)");
  evaluated->add_option("--check", options->checks, "independent lines for the gate");
  evaluated->add_option("-o,--output", options->output, "write the chosen tables");
  evaluated->add_flag("--force", options->force, "write them even if a line gets worse");

  CLI::App* studied = add("study", "the study of cross-talk on a simulated three-axis machine", study);
  studied->add_option("--truth", options->truth, "model file with the true errors")->required();
  studied->add_option("--seed", options->seed, "random seed of the noise")->capture_default_str();
}

}  // namespace trunnion::app
