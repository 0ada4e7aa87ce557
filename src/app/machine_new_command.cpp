#include <array>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "trunnion/base/files.hpp"
#include "trunnion/base/nearest_name.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/texts.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/machine/maker_machine.hpp"
#include "trunnion/probe/control_numbers.hpp"
#include "trunnion/report/command_pages.hpp"

#include "app/command_tree.hpp"
#include "app/options.hpp"

namespace trunnion::app {
namespace {

struct MachineNewCommand {
  std::string output;
  /// What is known of it already: in its control, or of all machines of its kind.
  struct Known {
    std::string ini, numbers;
    std::string unit = "mm";  // of the numbers
    std::string like;
  } from;
  std::string name;
  std::string controller;
  std::string rotary;
  std::string positive;
  std::vector<std::string> points;
  std::vector<std::string> travel;
  std::vector<double> part_zero_mm;
  std::optional<double> rapid_mm_min, rapid_deg_min, tool_length_mm;
  bool ask = false;
  ResultOptions result;
};

// "A=0,0.4,-65" in two.
Result<std::pair<char, std::vector<double>>> letter_and_numbers(const std::string& text, char between,
                                                                std::size_t count, const char* option) {
  const auto wrong = [&](const std::string& why) {
    return fail(ErrorCode::wrong_use, std::string(option) + " " + text + ": " + why);
  };
  if (text.size() < 3 || text[1] != '=' || std::string_view("XYZABC").find(text[0]) == std::string_view::npos)
    return wrong("write the axis, =, and the numbers");
  std::vector<double> out;
  for (std::size_t at = 2; at <= text.size();) {
    const auto end = std::min(text.find(between, at), text.size());
    const auto number = parse_number(std::string_view(text).substr(at, end - at));
    if (!number) return wrong("'" + text.substr(at, end - at) + "' is no number");
    out.push_back(number.value);
    at = end + 1;
  }
  if (out.size() != count)
    return wrong(std::to_string(count) + " numbers are needed, these are " + std::to_string(out.size()));
  return std::pair{text[0], std::move(out)};
}

Result<void> take_point(const std::string& text, NewMachine& machine) {
  const auto p = letter_and_numbers(text, ',', 3, "--point-mm");
  if (!p) return tl::unexpected(p.error());
  machine.points_mm[p->first] = Vec3(p->second[0], p->second[1], p->second[2]);
  return {};
}

Result<void> take_travel(const std::string& text, NewMachine& machine) {
  if (text.size() == 8 && text.ends_with("=cyclic") &&
      std::string_view("ABC").find(text[0]) != std::string_view::npos) {
    machine.travel[text[0]] = {0.0, 0.0, true};
    return {};
  }
  const auto t = letter_and_numbers(text, ':', 2, "--travel");
  if (!t) return tl::unexpected(t.error());
  const double unit = t->first <= 'C' ? kRadPerDegree : 1.0;
  if (!(t->second[0] < t->second[1]))
    return fail(ErrorCode::wrong_use, "--travel " + text + ": the smaller number stands first");
  machine.travel[t->first] = {t->second[0] * unit, t->second[1] * unit, false};
  return {};
}

Result<void> take_rotary(const std::string& text, NewMachine& machine) {
  constexpr std::array kKnown = {"AC", "BC", "AB", "BA", "CA", "CB", "A", "B", "C"};
  if (std::find(kKnown.begin(), kKnown.end(), text) == kKnown.end())
    return fail(ErrorCode::wrong_use,
                "--rotary " + text + ": one or two of A B C, the one on the bed first, as AC");
  machine.rotary = text;
  return {};
}

// What is known of the machine so far.
struct Draft {
  NewMachine machine;
  bool sense_known = false;
  bool control_known = false;
  std::optional<MakerMachine> like = std::nullopt;
};

Result<void> take_controller(const std::string& text, Draft& draft) {
  const auto found = nc::find_controller(text, postconfigs_folder() + "/controllers");
  if (!found) return tl::unexpected(found.error());
  draft.machine.controller = text;
  draft.control_known = true;
  return {};
}

Result<void> take_positive(const std::string& text, Draft& draft) {
  if (text != "table" && text != "tool")
    return fail(ErrorCode::wrong_use, "--positive " + text + ": table or tool");
  draft.machine.table_turns_positively = text == "table";
  draft.sense_known = true;
  return {};
}

// One question: asked where somebody sits at a terminal, else named as missing.
struct Question {
  std::string option;
  std::string text;
  std::function<Result<void>(const std::string& answer, Draft& draft)> take;
};

// Asked where other questions are: who gives all else, and no control, gets what `post` takes then.
Question control_question() {
  std::string names;
  for (const std::string& name : shipped_names("controllers")) {
    if (name != "iso") names += (names.empty() ? "" : ", ") + name;
  }
  return {"--controller", "Which control does it have (" + names + ", or a file)?", take_controller};
}

std::vector<Question> questions_of(const Draft& draft) {
  const NewMachine& machine = draft.machine;
  std::vector<Question> out;
  if (machine.rotary.empty()) {
    out.push_back({"--rotary", "Which rotary axes carry the part, the one on the bed first (AC, BC, C)?",
                   [](const std::string& answer, Draft& d) { return take_rotary(answer, d.machine); }});
  }
  if (!draft.sense_known) {
    out.push_back(
        {"--positive",
         "What does a + command turn by the right-hand rule (thumb along +X, +Y, +Z): the table itself "
         "(table), or the tool relative to the part (tool: ISO 841, the table then turns the other way)?",
         [](const std::string& answer, Draft& d) { return take_positive(answer, d); }});
  }
  for (const char letter : machine.rotary) {
    if (machine.points_mm.contains(letter)) continue;
    const std::string name(1, letter);
    out.push_back(
        {"--point-mm " + name + "=X,Y,Z",
         "Where does the " + name +
             " axis stand: X,Y,Z of a point on it in mm, as the spindle's gauge point in machine "
             "coordinates?",
         [name](const std::string& answer, Draft& d) { return take_point(name + "=" + answer, d.machine); }});
  }
  for (const char letter : "XYZ" + machine.rotary) {
    if (machine.travel.contains(letter)) continue;
    const std::string name(1, letter);
    std::string published;
    if (draft.like && draft.like->length_mm.contains(letter))
      published =
          " (" + shortest_text(draft.like->length_mm.at(letter)) + " mm from end to end, as published)";
    out.push_back({"--travel " + name + "=MIN:MAX",
                   "Travel of " + name +
                       (letter <= 'C' ? " in degrees, as -30:120, or cyclic?"
                                      : " in mm, as -300:300" + published + "?"),
                   [name](const std::string& answer, Draft& d) {
                     return take_travel(name + "=" + answer, d.machine);
                   }});
  }
  return out;
}

// A line of standard input; nothing at its end.
std::optional<std::string> answer_line() {
  std::string out;
  int c = std::fgetc(stdin);
  if (c == EOF) return std::nullopt;
  for (; c != EOF && c != '\n'; c = std::fgetc(stdin)) out += static_cast<char>(c);
  return out;
}

// Asks until the answer can be taken.
Result<void> ask(const Question& question, Draft& draft) {
  for (;;) {
    std::fprintf(stderr, "%s\n> ", question.text.c_str());
    const auto answer = answer_line();
    if (!answer) return fail(ErrorCode::wrong_use, "no answer to: " + question.text);
    const auto taken = question.take(*answer, draft);
    if (taken) return {};
    std::fprintf(stderr, "%s\n", taken.error().message.c_str());
  }
}

// Answers open further questions.
Result<void> ask_all(Draft& draft) {
  auto questions = questions_of(draft);
  if (!questions.empty() && !draft.control_known) {
    if (auto asked = ask(control_question(), draft); !asked) return asked;
  }
  for (; !questions.empty(); questions = questions_of(draft)) {
    if (auto asked = ask(questions.front(), draft); !asked) return asked;
  }
  return {};
}

// The control's own list of numbers: where its axes are, and which way they turn. What was given otherwise
// stands.
Result<void> take_numbers(const MachineNewCommand& c, Draft& draft, Diagnostics& diagnostics) {
  if (c.from.numbers.empty()) return {};
  NewMachine& machine = draft.machine;
  if (!machine.controller || machine.rotary.size() != 2)
    return fail(ErrorCode::wrong_use, "--numbers needs -c, whose numbers they are, and two axes in --rotary");
  const auto text = read_file(c.from.numbers);
  if (!text) return tl::unexpected(text.error());
  const std::string folder = postconfigs_folder() + "/controllers";
  const auto file = nc::find_controller(*machine.controller, folder);
  if (!file) return tl::unexpected(file.error());
  const auto controller = nc::load_controller(*file, diagnostics, folder);
  if (!controller) return tl::unexpected(controller.error());
  const auto places = probe::axis_places({c.from.numbers, *text, c.from.unit == "inch" ? kMmPerInch : 1.0},
                                         machine.rotary, *controller, diagnostics);
  if (!places) return tl::unexpected(places.error());
  for (const auto& [letter, point] : places->points_mm) machine.points_mm.emplace(letter, point);
  if (!draft.sense_known && places->table_turns_positively) {
    machine.table_turns_positively = *places->table_turns_positively;
    draft.sense_known = true;
  }
  return {};
}

// Of a machine that a maker sells: travel and speeds, where they are public.
Result<void> take_like(const std::string& name, Draft& draft, Diagnostics& diagnostics) {
  const std::string file = name.find_first_of("/.") != std::string::npos
                               ? name
                               : postconfigs_folder() + "/makers/" + name + ".toml";
  const auto names = shipped_names("makers");
  if (file != name && std::find(names.begin(), names.end(), name) == names.end())
    return fail(ErrorCode::wrong_use, "--like " + name + ": no machine of that name is known" +
                                          did_you_mean(name, names) + "; there are: " + joined(names, ", "));
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  auto like = parse_maker_machine(*text, file, diagnostics);
  if (!like) return tl::unexpected(like.error());
  draft.machine = like->machine;
  draft.control_known = like->machine.controller.has_value();
  draft.like = std::move(*like);
  return {};
}

// The ends of the travel are those of one machine: longer than any that was sold is a slip.
void compare_travel(const Draft& draft, Diagnostics& diagnostics) {
  if (!draft.like) return;
  constexpr double kRounding_mm = 1.0;  // data sheets are in whole mm
  for (const auto& [letter, length] : draft.like->length_mm) {
    const auto travel = draft.machine.travel.find(letter);
    if (travel == draft.machine.travel.end()) continue;
    const double given = travel->second.max - travel->second.min;
    if (given > length + kRounding_mm)
      diagnostics.warning({}, {},
                          std::string("the travel of ") + letter + " is " + shortest_text(given) +
                              " mm, longer than the " + shortest_text(length) + " mm that are published");
  }
}

Result<Draft> from_options(const MachineNewCommand& c, Diagnostics& diagnostics) {
  Draft draft;
  draft.machine.name = "new machine";
  if (!c.from.like.empty()) {
    if (auto known = take_like(c.from.like, draft, diagnostics); !known) return tl::unexpected(known.error());
  }
  if (!c.from.ini.empty()) {
    const auto text = read_file(c.from.ini);
    if (!text) return tl::unexpected(text.error());
    auto read = machine_of_ini(*text, c.from.ini, diagnostics);
    if (!read) return tl::unexpected(read.error());
    draft.machine = std::move(*read);
    draft.sense_known = draft.control_known = true;
  }
  if (!c.name.empty()) draft.machine.name = c.name;
  if (!c.controller.empty()) {
    const std::string folder = postconfigs_folder() + "/controllers";
    const auto file = nc::find_controller(c.controller, folder);
    const auto control =
        file ? nc::load_controller(*file, diagnostics, folder) : tl::unexpected(file.error());
    if (!control) return tl::unexpected(control.error());
    draft.machine.switchable_kinematics =
        draft.machine.switchable_kinematics && control->tcp.switches_kinematics;
    draft.machine.controller = c.controller;
    draft.control_known = true;
  }
  Result<void> taken;
  if (!c.rotary.empty()) taken = take_rotary(c.rotary, draft.machine);
  const bool table_of_ini = draft.machine.table_turns_positively;
  if (taken && !c.positive.empty()) taken = take_positive(c.positive, draft);
  if (taken && !c.from.ini.empty() && !c.positive.empty() &&
      draft.machine.table_turns_positively != table_of_ini)
    taken = fail(ErrorCode::wrong_use, "--positive " + c.positive + ": by the kinematics in " + c.from.ini +
                                           " it is the " + (table_of_ini ? "table" : "tool"));
  for (std::size_t i = 0; taken && i < c.points.size(); ++i) taken = take_point(c.points[i], draft.machine);
  for (std::size_t i = 0; taken && i < c.travel.size(); ++i) taken = take_travel(c.travel[i], draft.machine);
  if (!taken) return tl::unexpected(taken.error());
  if (taken = take_numbers(c, draft, diagnostics); !taken) return tl::unexpected(taken.error());
  return draft;
}

// What nobody can be asked for.
ExitCode print_missing(const std::vector<Question>& missing) {
  spdlog::error("error: machine new needs");
  for (const Question& q : missing) spdlog::error("  {}\n      {}", q.option, q.text);
  spdlog::error("(--ask reads the answers from standard input, a line each)");
  return kWrongUse;
}

Result<void> fill_in(const MachineNewCommand& c, Draft& draft) {
  if (auto asked = ask_all(draft); !asked) return asked;
  for (const char letter : "XYZ" + draft.machine.rotary) {
    const auto& rapid = letter <= 'C' ? c.rapid_deg_min : c.rapid_mm_min;
    if (rapid)
      draft.machine.rapid[letter] = *rapid * (letter <= 'C' ? kRadPerDegree : 1.0) / kSecondsPerMinute;
  }
  if (!c.part_zero_mm.empty())
    draft.machine.part_zero_mm = Vec3(c.part_zero_mm[0], c.part_zero_mm[1], c.part_zero_mm[2]);
  if (c.tool_length_mm) draft.machine.tool_length_mm = *c.tool_length_mm;
  return {};
}

// For the head of the file: figures that nobody measured.
std::string published(const MakerMachine& like) {
  std::string out =
      "\nTravel and speeds that were not answered are those of a " + like.machine.name + ", as published in:";
  for (const std::string& source : like.sources) out += "\n- " + source;
  if (!like.differs.empty()) out += "\nThese differ in, or do not say: " + like.differs + ".";
  return out + "\nCompare them with the machine's plate.";
}

ExitCode run(const MachineNewCommand& command) {
  Diagnostics diagnostics;
  auto draft = from_options(command, diagnostics);
  if (!draft) return print_failure(diagnostics, draft.error());
  const auto missing = questions_of(*draft);
  if (!missing.empty() && !command.ask && ::isatty(STDIN_FILENO) != 1) {
    print(diagnostics);
    return print_missing(missing);
  }
  if (const auto filled = fill_in(command, *draft); !filled) return print_error(filled.error());
  // Answers that come from a file, and are one too many, were meant for questions that are not asked.
  if (command.ask && ::isatty(STDIN_FILENO) != 1) {
    if (const auto more = answer_line(); more && more->find_first_not_of(" \t\r") != std::string::npos)
      return print_error({ErrorCode::wrong_use, "--ask: an answer is left over: " + *more, {}, {}});
  }
  const auto name_of = [](const std::string& path) {
    return std::filesystem::path(path).filename().string();
  };
  std::string source = !command.from.ini.empty() ? "From " + name_of(command.from.ini) + "."
                       : !command.from.numbers.empty()
                           ? "From the control's numbers in " + name_of(command.from.numbers) +
                                 " and what was answered to `trunnion machine new`."
                           : "From what was answered to `trunnion machine new`.";
  if (draft->like) source += published(*draft->like);
  compare_travel(*draft, diagnostics);
  const std::string text = machine_file_text(draft->machine, source);
  // A file that cannot be read is not written: two axes may be parallel, a travel may be too large.
  const auto read = parse_machine(text, command.output, diagnostics);
  if (!read) return print_failure(diagnostics, read.error());
  print(diagnostics);
  if (const auto code = write_output(command.output, text); code != kDone) return code;
  const std::string next = "next: trunnion machine check " + command.output + "; then trunnion machine " +
                           command.output + " -o proving.nc, and run that at the machine\n";
  const nlohmann::ordered_json json = {
      {"name", draft->machine.name}, {"file", command.output}, {"text", text}};
  return command.result.write(
      json.dump(),
      [&] {
        return report::machine_new_page(
            *read, {draft->machine.name + ", a new machine file", {}, json.dump(), made_by()});
      },
      command.output == "-" ? "" : next);
}

}  // namespace

void add_machine_new_command(CLI::App& machine, int& exit) {
  auto command = std::make_shared<MachineNewCommand>();
  CLI::App* c = machine.add_subcommand("new",
                                       "make a machine file: from options, answers at the terminal, a "
                                       "control's ini, or published data of a machine");
  c->add_option("-o,--output", command->output, "machine file to write (- is standard output)")->required();
  CLI::Option* ini = c->add_option(
      "--ini", command->from.ini,
      "read it from a configuration with kinematics xyzac-trt-kins or xyzbc-trt-kins, and the HAL "
      "files beside it");
  c->add_option("--like", command->from.like,
                "a maker's machine, by its name or file: travel and speeds as published, the rest is asked "
                "for; the positions of the rotary axes must be measured at each machine")
      ->type_name(kMakerName)
      ->excludes(ini);
  c->add_option("--numbers", command->from.numbers,
                "the control's own numbers for its rotary axes, a line each, as `machine calibrate "
                "--parameters` writes them (settings, machine data, kinematics): points and senses are read "
                "from it");
  c->add_option("--numbers-unit", command->from.unit, "unit of the lengths in --numbers")
      ->check(CLI::IsMember({"mm", "inch"}))
      ->capture_default_str();
  c->add_flag(
      "--ask", command->ask,
      "ask for missing values and read the answers from standard input (without it: only at a terminal)");
  c->add_option("--name", command->name, "name of the machine, for messages and programs");
  c->add_option("-c,--controller", command->controller,
                "control of the machine: controller file, or the name of one in postconfigs/controllers")
      ->type_name(kControllerName);
  c->add_option("--rotary", command->rotary,
                "rotary axes that carry the part, the one on the bed first: AC, BC, C");
  c->add_option("--positive", command->positive,
                "what a + command turns about X, Y, Z by the right-hand rule: the table itself (table), or "
                "the tool relative to the part (tool: ISO 841)")
      ->check(CLI::IsMember({"table", "tool"}));
  c->add_option("--point-mm", command->points,
                "a point on a rotary axis, as A=0,0.4,-65: machine coordinates (mm) that the spindle's gauge "
                "point would have there")
      ->expected(1, 2);
  c->add_option("--travel", command->travel,
                "travel of each axis, as X=-300:300 A=-30:120 C=cyclic (mm, deg)")
      ->expected(1, 5);
  c->add_option(
       "--part-zero-mm", command->part_zero_mm,
       "machine position of the CL file's zero, as 0,0,-30 (default: the point of the innermost rotary axis)")
      ->delimiter(',')
      ->expected(3);
  c->add_option("--rapid-mm-min", command->rapid_mm_min, "rapid speed of the linear axes")
      ->check(above_zero());
  c->add_option("--rapid-deg-min", command->rapid_deg_min, "rapid speed of the rotary axes")
      ->check(above_zero());
  c->add_option("--tool-length-mm", command->tool_length_mm,
                "default gauge length, for tools without one in a tool file or the CL file")
      ->check(above_zero());
  command->result.add_to(*c);
  c->callback([command, &exit] { exit = run(*command); });
}

}  // namespace trunnion::app
