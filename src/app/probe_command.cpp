#include <algorithm>
#include <filesystem>
#include <memory>
#include <spdlog/spdlog.h>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/post/program_zero.hpp"
#include "trunnion/probe/planned.hpp"
#include "trunnion/probe/program.hpp"
#include "trunnion/probe/reading.hpp"
#include "trunnion/probe/strokes.hpp"
#include "trunnion/report/probe_json.hpp"

#include "app/number_list.hpp"
#include "app/options.hpp"

namespace trunnion::app {
namespace {

constexpr double kOtherLength_mm = 1.0;

struct ProgramCommand {
  MachineOptions machine;
  std::string out, log;
  // A measuring plan that says ball and poses.
  struct FromPlan {
    std::string file, run;
  } plan;
  struct Surroundings {
    std::string ball, stem, body;
  } around;
  double ball_radius_mm = 0.0, stylus_radius_mm = 0.0;
  std::optional<double> stylus_length_mm, within_mm;
  double clearance_mm = 2.0, largest_tilt_deg = 60.0;
  // At each pose.
  struct Touches {
    double slow_mm_min = 60.0, fast_mm_min = 200.0;
    std::int64_t sides = 4;
  } touches;
  std::int64_t poses = 12, tool = 99;
  ResultOptions result;
};

// What stands beside the ball and over the stylus, as far as it is given.
Result<void> take_surroundings(const ProgramCommand::Surroundings& given, probe::Ball& ball) {
  if (!given.stem.empty()) {
    const auto n = numbers_of("--stem-mm", given.stem, "X,Y,Z,RADIUS");
    if (!n) return tl::unexpected(n.error());
    ball.stem = probe::Stem{{(*n)[0], (*n)[1], (*n)[2]}, (*n)[3]};
    if (!(ball.stem->radius_mm > 0.0) || ball.stem->radius_mm >= ball.radius_mm)
      return fail(ErrorCode::wrong_use, "--stem-mm: the stem's radius must be above 0 and below the ball's");
    if ((ball.stem->end_P - ball.place_P).norm() <= ball.radius_mm)
      return fail(ErrorCode::wrong_use,
                  "--stem-mm: the far end of the stem lies within the ball; it is a place "
                  "in the part frame, as --ball-mm");
  }
  if (!given.body.empty()) {
    const auto n = numbers_of("--probe-body-mm", given.body, "RADIUS,ABOVE");
    if (!n) return tl::unexpected(n.error());
    ball.body = probe::ProbeBody{(*n)[0], (*n)[1]};
    if (!(ball.body->radius_mm > 0.0) || !(ball.body->above_mm > 0.0) ||
        ball.body->above_mm > ball.stylus_length_mm)
      return fail(ErrorCode::wrong_use,
                  "--probe-body-mm: RADIUS must be above 0, and ABOVE between 0 and the length "
                  "of the stylus, " +
                      shortest_text(ball.stylus_length_mm) + " mm");
  }
  return {};
}

// What the control's log is called where nobody says: the program's own name, of characters that any control
// takes.
std::string log_name(const std::string& program, const std::string& suffix) {
  std::string name = program == "-" ? "" : std::filesystem::path(program).stem().string();
  std::erase_if(name, [](char ch) {
    return !((ch >= 'a' && ch <= 'z') || (ch >= 'A' && ch <= 'Z') || (ch >= '0' && ch <= '9'));
  });
  return (name.empty() ? "touches" : name) + suffix;
}

// The run of the plan that is asked for; without a name the first that is a ball.
Result<probe::PlannedBall> planned_of(const ProgramCommand& command, const Machine& machine,
                                      Diagnostics& diagnostics) {
  const auto plan = diagnosis::load_plan(command.plan.file, machine, diagnostics);
  if (!plan) return tl::unexpected(plan.error());
  std::string ids;
  std::optional<Error> why;
  for (const diagnosis::PlanRun& run : plan->runs) {
    ids += (ids.empty() ? "'" : ", '") + run.id + "'";
    if (!command.plan.run.empty() && run.id != command.plan.run) continue;
    auto ball = probe::planned_ball(run, machine, command.plan.file);
    if (ball || !command.plan.run.empty()) return ball;
    if (!why) why = ball.error();
  }
  if (why) return tl::unexpected(*why);
  return fail(ErrorCode::wrong_use, "--run: the plan has no run '" + command.plan.run + "'; it has " + ids);
}

Result<probe::ProgramOptions> options_of(const ProgramCommand& command, const Machine& machine,
                                         const nc::Controller& controller, Diagnostics& diagnostics) {
  probe::ProgramOptions out;
  std::optional<probe::PlannedBall> planned;
  if (!command.plan.file.empty()) {
    auto ball = planned_of(command, machine, diagnostics);
    if (!ball) return tl::unexpected(ball.error());
    planned = std::move(*ball);
    out.ball.place_P = planned->place_P;
    out.planned = planned->poses;
    out.both_senses = planned->both_directions;
  }
  if (!command.around.ball.empty()) {
    const auto n = numbers_of("--ball-mm", command.around.ball, "X,Y,Z");
    if (!n) return tl::unexpected(n.error());
    out.ball.place_P = {(*n)[0], (*n)[1], (*n)[2]};
  }
  out.ball.radius_mm = command.ball_radius_mm;
  out.ball.stylus_radius_mm = command.stylus_radius_mm;
  out.ball.stylus_length_mm = command.stylus_length_mm.value_or(machine.tool_length_mm);
  if (planned && std::abs(planned->stylus_length_mm - out.ball.stylus_length_mm) > kOtherLength_mm)
    spdlog::warn("the plan has a stylus of {} mm, the program one of {} mm: it may tell other things",
                 shortest_text(planned->stylus_length_mm), shortest_text(out.ball.stylus_length_mm));
  out.ball.clearance_mm = command.clearance_mm;
  if (const auto taken = take_surroundings(command.around, out.ball); !taken)
    return tl::unexpected(taken.error());
  constexpr double kUsualShare = 0.45;
  constexpr double kUsualMost_mm = 8.0;
  out.ball.within_mm = command.within_mm.value_or(std::min(kUsualShare * out.ball.reach_mm(), kUsualMost_mm));
  const double most = probe::most_within_mm(out.ball.reach_mm());
  if (out.ball.within_mm > most)
    return fail(ErrorCode::wrong_use, "--ball-uncertainty-mm: a ball that may be " +
                                          shortest_text(out.ball.within_mm) +
                                          " mm from its place can be missed; with this ball and stylus " +
                                          fixed_text(most, 3) + " mm are the most");
  if (command.touches.slow_mm_min >= command.touches.fast_mm_min)
    return fail(ErrorCode::wrong_use, "--slow-mm-min must be below --fast-mm-min");
  out.poses = static_cast<std::size_t>(command.poses);
  out.sides = static_cast<std::size_t>(command.touches.sides);
  out.tool = command.tool;
  out.log = command.log.empty() ? log_name(command.out, controller.probing.suffix) : command.log;
  out.slow_mm_s = command.touches.slow_mm_min / kSecondsPerMinute;
  out.fast_mm_s = command.touches.fast_mm_min / kSecondsPerMinute;
  out.first_mm_s = std::max(out.first_mm_s, out.fast_mm_s);
  out.largest_tilt = Angle::degrees(command.largest_tilt_deg);
  const auto words = machine.output_point == OutputPoint::tip ? post::WordsOf::tip : post::WordsOf::spindle;
  out.head = post::zero_lines(post::program_zero(machine, controller, machine.work_offset, words));
  return out;
}

// A fault of the program's own text is none of the user's.
Result<void> read_back(const Machine& machine, const nc::Controller& controller, const std::string& text) {
  Diagnostics diagnostics;
  const auto strokes = probe::read_strokes(machine, controller, text, "the program", diagnostics);
  if (!strokes) return fail(ErrorCode::check_failed, strokes.error().text());
  const auto faults = probe::faults_of(machine, *strokes);
  if (faults.empty()) return {};
  for (std::size_t i = 1; i < faults.size(); ++i) spdlog::error("{}", faults[i]);
  return fail(ErrorCode::check_failed, faults.front() + "; nothing written");
}

ExitCode run(const ProgramCommand& command) {
  Diagnostics diagnostics;
  const auto files = load_with_controller(command.machine, diagnostics);
  if (!files) return print_failure(diagnostics, files.error());
  const auto& [machine, controller] = *files;
  print(diagnostics);
  const auto options = options_of(command, machine, controller, diagnostics);
  if (!options) return print_failure(diagnostics, options.error());
  if (!machine.safe.table)
    spdlog::warn("the machine file gives no [table]: nothing is known of what stands around the ball");
  else if (command.around.body.empty())
    spdlog::warn(
        "without --probe-body-mm only the stylus is kept clear of the table, not the probe and the spindle "
        "over it");
  if (!controller.probing.confirmed)
    spdlog::warn(
        "nobody has run the probing words of {} on such a control yet ([probing] in {}): read them, and make "
        "the first touch in single block with a finger on the feed hold",
        controller.name, controller.file);
  const auto program = probe::make_program(machine, controller, *options);
  if (!program) return print_error(program.error());
  if (const std::size_t left =
          options->planned.size() - std::min(options->planned.size(), program->chosen.poses.size());
      left > 0)
    spdlog::warn(
        "{} of the plan's {} poses cannot be reached with the stylus on all sides of the ball; they are left "
        "out",
        left, options->planned.size());
  if (!program->before_start.empty())
    spdlog::warn(
        "{}: turn them to the first pose by hand before the program begins; its own turns are checked",
        program->before_start);
  if (const auto checked = read_back(machine, controller, program->text); !checked)
    return print_error(checked.error());
  if (const auto code = write_output(command.out, program->text); code != kDone) return code;
  const std::string text = report::probe_program_text(machine, *program);
  return command.result.write(report::probe_program_json(machine, *program),
                              {"Touching a ball on " + machine.name, {}, {}, {}}, report::probe_program_page,
                              command.out == "-" ? "" : text);
}

void add_program(CLI::App& probe, int& exit) {
  auto command = std::make_shared<ProgramCommand>();
  CLI::App* c =
      probe.add_subcommand("program", "NC program that touches a ball on the table from many poses");
  command->machine.add_to(*c, true);
  auto* ball = c->add_option("--ball-mm", command->around.ball,
                             "X,Y,Z of the ball's centre in the part frame, roughly");
  auto* plan = c->add_option("--plan", command->plan.file,
                             "measuring plan, as 'trunnion model plan -o' writes it: ball and poses of its "
                             "run; --ball-mm says where the ball really stands");
  c->add_option("--run", command->plan.run, "run of the plan (default: the first run with a ball)")
      ->needs(plan);
  c->add_option("--ball-radius-mm", command->ball_radius_mm, "radius of the ball")
      ->required()
      ->check(between(0.5, 200.0));
  c->add_option("--stylus-radius-mm", command->stylus_radius_mm, "radius of the stylus ball")
      ->required()
      ->check(between(0.1, 50.0));
  c->add_option("--stylus-length-mm", command->stylus_length_mm,
                "length from the spindle's gauge point to the CENTRE of the stylus ball (default: the "
                "machine file's tool length)")
      ->check(between(1.0, 2000.0));
  c->add_option(
      "--stem-mm", command->around.stem,
      "X,Y,Z,RADIUS: far end of the rod that holds the ball, in the part frame, and its radius; the "
      "stylus keeps clear of it");
  c->add_option(
      "--probe-body-mm", command->around.body,
      "RADIUS,ABOVE of the probe over its stylus: a cylinder that begins ABOVE the centre of the stylus "
      "ball; it keeps clear of ball, stem and [table]");
  c->add_option("--poses", command->poses, "number of poses of the rotary axes")
      ->check(CLI::Range(std::int64_t{4}, std::int64_t{200}))
      ->capture_default_str()
      ->excludes(plan);
  c->add_option("--sides", command->touches.sides,
                "touches from the side at each pose; 8 separate the lobes of a three-lobed probe from a "
                "shift of the ball, 4 do not")
      ->check(CLI::Range(std::int64_t{4}, std::int64_t{12}))
      ->capture_default_str();
  c->add_option("--ball-uncertainty-mm", command->within_mm,
                "largest expected distance of the ball from its place by the machine file, at any pose; must "
                "cover the errors of points and directions of the axes; smaller is faster (default: 0.45 "
                "times the sum of the radii, 8 at most)")
      ->check(above_zero());
  c->add_option("--clearance-mm", command->clearance_mm,
                "clearance of the stylus, in addition to --ball-uncertainty-mm")
      ->check(between(0.5, 100.0))
      ->capture_default_str();
  c->add_option("--largest-tilt-deg", command->largest_tilt_deg,
                "largest angle between the normal of the table and the spindle")
      ->check(between(0.0, 90.0))
      ->capture_default_str();
  c->add_option("--slow-mm-min", command->touches.slow_mm_min, "feed of the measuring touches")
      ->check(between(0.1, 2000.0))
      ->capture_default_str();
  c->add_option("--fast-mm-min", command->touches.fast_mm_min, "feed of the fast touches before them")
      ->check(between(0.1, 2000.0))
      ->capture_default_str();
  c->add_option("--tool", command->tool, "tool number of the stylus, and of its length register")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{99999}))
      ->capture_default_str();
  c->add_option("--log", command->log,
                "name of the log file on the control, for the touches (default: the program's name, .txt)");
  c->add_option("-o,--output", command->out, "NC program to write")->required();
  command->result.add_to(*c);
  c->callback([command, ball, plan, &exit] {
    if (ball->count() == 0 && plan->count() == 0) throw CLI::RequiredError("--ball-mm or --plan");
    exit = run(*command);
  });
}

struct ReadCommand {
  MachineOptions machine;
  std::string log, program, out;
  probe::ReadingOptions options;
  ResultOptions result;
};

ExitCode run(const ReadCommand& command) {
  Diagnostics diagnostics;
  const auto files = load_with_controller(command.machine, diagnostics);
  if (!files) return print_failure(diagnostics, files.error());
  const auto& [machine, controller] = *files;
  const auto program = read_file(command.program);
  if (!program) return print_error(program.error());
  const auto log = read_file(command.log);
  if (!log) return print_error(log.error());
  const auto strokes = probe::read_strokes(machine, controller, *program, command.program, diagnostics);
  if (!strokes) return print_failure(diagnostics, strokes.error());
  const auto reading = probe::read_touches(machine, *strokes, *log, command.log, command.options);
  if (!reading) return print_failure(diagnostics, reading.error());
  print(diagnostics);
  const std::vector<std::string> comments = {" touches of a ball on '" + machine.name + "', " + command.log,
                                             " value: the ball's centre in the part frame as assumed, less "
                                             "the place of the stylus ball's centre by the "
                                             "machine file"};
  if (const auto code = write_output(command.out, measurements_text(reading->data, machine, comments));
      code != kDone)
    return code;
  return command.result.write(
      report::probe_reading_json(machine, *strokes, *reading), {"Touches of " + command.log, {}, {}, {}},
      report::probe_reading_page,
      command.out == "-" ? "" : report::probe_reading_text(machine, *strokes, *reading));
}

void add_read(CLI::App& probe, int& exit) {
  auto command = std::make_shared<ReadCommand>();
  CLI::App* c =
      probe.add_subcommand("read", "the control's log of a probing program into the measurement format");
  c->add_option("log", command->log, "log file of the control with the touches")->required();
  command->machine.add_to(*c, true);
  c->add_option("--program", command->program, "the program that was run")->required();
  c->add_option("--radius-tolerance-mm", command->options.radius_tolerance_mm,
                "allowed difference of the measured radius from the sum of ball and stylus radius (covers "
                "the pre-travel of the probe)")
      ->check(above_zero())
      ->capture_default_str();
  c->add_option("-o,--output", command->out, "measurement file to write")->required();
  command->result.add_to(*c);
  c->callback([command, &exit] { exit = run(*command); });
}

}  // namespace

void add_probe_command(CLI::App& root, int& exit) {
  CLI::App* probe =
      root.add_subcommand("probe", "one ball on the table, a touch probe in the spindle: program and log");
  probe->require_subcommand(1);
  add_program(*probe, exit);
  add_read(*probe, exit);
}

}  // namespace trunnion::app
