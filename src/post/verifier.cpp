#include <algorithm>
#include <utility>

#include "post/verifier_state.hpp"

namespace trunnion::post {

namespace {

// A hair for the rounding errors of the evaluation itself.
constexpr double kRounding_mm = 1e-9;

}  // namespace

bool VerifyReport::cuts_within_tolerance() const {
  constexpr double kRounding_rad = 1e-12;
  return certified_tip_deviation_mm <= tolerance_mm + kRounding_mm &&
         max_point_deviation_mm <= tolerance_mm + kRounding_mm &&
         (flute_mm == 0.0 || certified_flute_deviation_mm <= tolerance_mm + kRounding_mm) &&
         max_axis_deviation.rad() <= axis_tolerance.rad() + kRounding_rad &&
         max_pole_axis_deviation.rad() <= axis_tolerance.rad() + pole_tolerance.rad() + kRounding_rad;
}

bool VerifyReport::within_tolerance() const {
  return cuts_within_tolerance() && max_rapid_deviation_mm <= rapid_tolerance_mm + kRounding_mm;
}

Verifier::State::State(const Machine& m, const nc::Controller& c, const VerifyOptions& o,
                       const std::string& nc_file, Diagnostics& diagnostics)
    : machine(m),
      controller(c),
      file(nc_file),
      findings(diagnostics),
      options(o),
      in_force(m, c, axis_words,
               {o.tools.length_mm.value_or(m.tool_length_mm), m.output_point == OutputPoint::tip}),
      planner(m, c, FeedOutput::inverse),
      as_run(m, c, o),
      reader(
          c, nc_file, diagnostics,
          [this](const nc::Block& block) {
            take(block);
            if (shared.follower != nullptr) shared.follower->take(block);
          },
          reader_options(o),
          [this](const nc::MotionRun& run) {
            take(run);
            if (shared.follower != nullptr) shared.follower->take(run);
          }) {
  report.tolerance_mm = o.tolerance_mm;
  report.axis_tolerance = o.axis_tolerance;
  report.pole_tolerance = o.pole.tolerance;
  report.rapid_tolerance_mm = o.rapid_tolerance_mm;
  report.on_truth = o.truth != nullptr || o.offsets != nullptr;
  put_in_spindle(in_force.tool.length_mm);
  report.certified = o.certify;
  limits = {o.tolerance_mm,
            o.axis_tolerance.rad(),
            report.on_truth,
            o.pole.tolerance.rad() > 0.0 && in_force.kinematics.rotary_count() >= 2,
            in_force.kinematics.direction(1),
            std::cos(o.pole.cone.rad())};
  program_judge.emplace(machine, controller, options, own_points);
  at_once.quiet = QuietRun(limits);
}

Verifier::Verifier(const Machine& machine, const nc::Controller& controller, const VerifyOptions& options,
                   const std::string& nc_file, Diagnostics& diagnostics)
    : state_(std::make_unique<State>(machine, controller, options, nc_file, diagnostics)) {}
Verifier::~Verifier() = default;

void Verifier::expect(const cl::Motion& motion, SourceRef where) {
  State& s = *state_;
  ++s.report.points_in;
  s.points->add(motion, where.line, s.in_cone(motion.axis_P), s.tools.flute.mm());
  if (s.program_judge) s.program_judge->asked().take(motion, where);
  if (s.shared.follower != nullptr) ++s.shared.follower->report.points_in;
}

void Verifier::expect(const cl::Record& record) {
  if (const auto* change = std::get_if<cl::ToolChange>(&record.data)) state_->tools.flute.take(*change);
  if (const auto* cutter = std::get_if<cl::ToolGeometry>(&record.data)) state_->tools.flute.take(*cutter);
  if (state_->program_judge) state_->program_judge->asked().take(record);
}

void Verifier::expect_tool(std::uint32_t number, double length_mm) {
  for (State* s = state_.get(); s != nullptr; s = s->shared.follower) s->tools.length_of[number] = length_mm;
}

void Verifier::expect_no_length() {
  for (State* s = state_.get(); s != nullptr; s = s->shared.follower) {
    if (!s->tools.any) s->in_force.add_length(false);
    if (s->program_judge) s->program_judge->expect_no_length();
  }
}

void Verifier::text(std::string_view piece) {
  state_->points->settle();
  state_->reader.feed(piece);
}

void Verifier::share_with(Verifier& other) {
  state_->shared.follower = other.state_.get();
  other.state_->program_judge.reset();
  other.state_->shared.leader = state_.get();
  other.state_->points = state_->points;
  // Nothing that only one of them knows of changes where its words lead.
  const auto only_words = [](const State& s) {
    return !s.as_run.offsets && s.options.run_time_temperatures == nullptr;
  };
  other.state_->shared.same_words = only_words(*state_) && only_words(*other.state_);
}

Result<VerifyReport> Verifier::finish() {
  State& s = *state_;
  s.points->settle();
  if (s.shared.leader == nullptr) {
    if (auto read = s.reader.finish(); !read) return tl::unexpected(read.error());
  }
  s.progress.all_expected = true;
  s.work();
  s.settle_rapid_end();
  s.match_end_of_cut();
  if (s.progress.started && s.at.segment + 1 < s.targets().size()) {
    const Target& next = s.targets()[s.at.segment + 1];
    if (combined_distance(*s.previous, next.tip_P, next.axis_P) <= s.near_point_mm()) s.mark_programmed();
  }
  // CL points behind the last block were met if the tool stands there (a repeated point), else they are
  // missed.
  for (std::size_t i = s.progress.started ? s.at.segment + 1 : 0; i < s.targets().size(); ++i) {
    const Target& target = s.targets()[i];
    const Angle allowed =
        s.options.axis_tolerance + (s.in_cone(target.axis_P) ? s.options.pole.tolerance : Angle{});
    const double d = s.progress.started ? (s.previous->tip_P - target.tip_P).norm()
                                        : std::numeric_limits<double>::infinity();
    if (d <= s.options.tolerance_mm && angle_between(s.previous->axis_P, target.axis_P) <= allowed) {
      s.point_hit(d);
    } else {
      ++s.report.points_missed;
    }
  }
  s.report_travel();
  s.report.flute_mm = s.targets().longest_flute_mm();
  if (s.program_judge) s.program_judge->finish(s.report, s.reader.line());
  return std::move(s.report);
}

cl::ReaderOptions reading_within(cl::ReaderOptions reading, double tolerance_mm) {
  constexpr double kShare = 0.1;
  reading.arc_tolerance_mm = std::min(reading.arc_tolerance_mm, kShare * tolerance_mm);
  return reading;
}

namespace {

Result<void> expect_tool(const cl::ToolChange& change, SourceRef where, ProgramTools& tools,
                         const std::string& cl_file, Verifier& verifier) {
  const auto loaded = tools.load(change, cl_file, where);
  if (!loaded) return tl::unexpected(loaded.error());
  verifier.expect_tool(loaded->number, *loaded->gauge_length_mm);
  verifier.expect(cl::Record{where, *loaded});
  return {};
}

// What `post` makes of a file that moves and has loaded no tool.
Result<void> expect_without_tool(const ToolOptions& options, SourceRef where, ProgramTools& tools,
                                 const std::string& cl_file, Verifier& verifier) {
  if (options.tool)
    return expect_tool({*options.tool, std::nullopt, std::nullopt}, where, tools, cl_file, verifier);
  tools.move_without_tool();
  if (options.length_mm) verifier.expect_no_length();
  return {};
}

}  // namespace

Result<VerifyReport> verify(std::unique_ptr<cl::TextSource> cl, const std::string& cl_file,
                            std::unique_ptr<cl::TextSource> nc, const std::string& nc_file,
                            const Machine& machine, const nc::Controller& controller,
                            const cl::ReaderOptions& reading, const VerifyOptions& options,
                            Diagnostics& diagnostics) {
  Verifier verifier(machine, controller, options, nc_file, diagnostics);
  ProgramTools tools(machine, options.tools);
  const std::size_t errors = diagnostics.error_count();
  cl::Reader reader(std::move(cl), cl_file, reading_within(reading, options.tolerance_mm), diagnostics);
  cl::Record record;
  while (reader.next(record)) {
    if (const auto* change = std::get_if<cl::ToolChange>(&record.data)) {
      if (auto done = expect_tool(*change, record.where, tools, cl_file, verifier); !done)
        return tl::unexpected(done.error());
    }
    const auto* motion = std::get_if<cl::Motion>(&record.data);
    if (motion == nullptr) {
      if (!std::holds_alternative<cl::ToolChange>(record.data)) verifier.expect(record);
      continue;
    }
    if (tools.loaded().empty()) {
      if (auto done = expect_without_tool(options.tools, record.where, tools, cl_file, verifier); !done)
        return tl::unexpected(done.error());
    }
    verifier.expect(*motion, record.where);
  }
  if (reader.read_failure()) return tl::unexpected(*reader.read_failure());
  if (diagnostics.error_count() > errors) return tl::unexpected(diagnostics.first_error());
  tools.warn_of_machine_file(cl_file, diagnostics);
  std::array<char, 1 << 16> buffer;
  for (;;) {
    const auto size = nc->read(buffer.data(), buffer.size());
    if (!size) return tl::unexpected(size.error());
    if (*size == 0) break;
    verifier.text({buffer.data(), *size});
  }
  auto report = verifier.finish();
  if (report && diagnostics.error_count() > errors) return tl::unexpected(diagnostics.first_error());
  return report;
}

}  // namespace trunnion::post
