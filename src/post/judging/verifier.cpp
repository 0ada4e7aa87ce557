#include <array>
#include <utility>

#include "trunnion/machine/iso841.hpp"
#include "trunnion/post/verify.hpp"

#include "post/intake/path_source.hpp"
#include "post/judging/program_replay.hpp"
#include "post/making/post_words.hpp"

namespace trunnion::post {

struct Verifier::Parts {
  Parts(const Machine& m, const nc::Controller& c, const VerifyOptions& o, const std::string& nc_file,
        Diagnostics& diagnostics)
      : options(o),
        replay(m, c, options, nc_file, diagnostics),
        judge({m, c, options}, replay.words(), points),
        flute(options.tools) {
    judge.judge_program();
    replay.add(judge);
  }

  VerifyOptions options;
  PathPoints points;  // of the CL file
  ProgramReplay replay;
  MachineJudge judge;  // on the machine with its errors, and of the words beside the path
  std::optional<MachineJudge> nominal;
  FluteLength flute;  // of the CL motions at hand
};

Verifier::Verifier(const Machine& machine, const nc::Controller& controller, const VerifyOptions& options,
                   const std::string& nc_file, Diagnostics& diagnostics)
    : parts_(std::make_unique<Parts>(machine, controller, options, nc_file, diagnostics)) {}
Verifier::~Verifier() = default;

void Verifier::judge_nominal_too() {
  JudgedMachine nominal = parts_->judge.judged();
  VerifyOptions& options = nominal.options;
  options.truth = nullptr;
  options.offsets = nullptr;
  options.temperatures.of_program = nullptr;
  options.collect = false;
  parts_->nominal.emplace(nominal, parts_->replay.words(), parts_->points);
  parts_->judge.lead(*parts_->nominal);
  parts_->replay.add(*parts_->nominal);
}

void Verifier::expect(const ExpectedMotions& motions) {
  Parts& p = *parts_;
  p.points.add(motions, p.judge.path().limits(), p.flute.mm());
  p.judge.expect_motions(motions.points.size());
  p.judge.program_judge()->asked().take(motions);
  if (p.nominal) p.nominal->expect_motions(motions.points.size());
}

void Verifier::expect(const cl::Record& record) {
  if (const auto* change = std::get_if<cl::ToolChange>(&record.data)) parts_->flute.take(*change);
  if (const auto* cutter = std::get_if<cl::ToolGeometry>(&record.data)) parts_->flute.take(*cutter);
  const auto* word = std::get_if<cl::PostWord>(&record.data);
  if (std::holds_alternative<cl::ToolChange>(record.data) || (word != nullptr && word->word == kStands))
    parts_->points.end_cut();
  parts_->judge.program_judge()->asked().take(record);
}

void Verifier::expect_tool(std::uint32_t number, double length_mm) {
  parts_->replay.expect_tool(number, length_mm);
}

void Verifier::expect_no_length() {
  parts_->replay.expect_no_length();
  parts_->judge.program_judge()->expect_no_length();
}

void Verifier::text(std::string_view piece) {
  parts_->points.settle();
  parts_->replay.text(piece);
}

Result<Verifier::Found> Verifier::finish() {
  Parts& p = *parts_;
  p.points.settle();
  if (auto read = p.replay.finish(); !read) return tl::unexpected(read.error());
  Found out;
  out.report = p.judge.finish(p.replay.figures(), p.replay.line());
  if (p.nominal) out.nominal = p.nominal->finish(p.replay.figures(), p.replay.line());
  return out;
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

Result<VerifyReport> verify(PathText path, ProgramText program, const VerifySetup& setup,
                            Diagnostics& diagnostics) {
  const auto& [machine, controller, options] = setup;
  Verifier verifier(machine, controller, options, program.file, diagnostics);
  ProgramTools tools(machine, options.tools,
                     controller.adds_length_of_register() && machine.output_point == OutputPoint::tip);
  const std::size_t errors = diagnostics.error_count();
  const std::string cl_file = path.file;
  path.reading = reading_within(path.reading, options.tolerance_mm);
  const auto records = records_of(std::move(path), {&options.tools, options.axis_tolerance}, diagnostics);
  cl::Record record;
  while (records->next(record)) {
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
    const path::ChoicePoint point{{motion->tip_P, motion->axis_P}, record.where, motion->rapid};
    verifier.expect({{&point, 1}, {}, motion->feed, motion->step});
  }
  if (records->read_failure()) return tl::unexpected(*records->read_failure());
  if (diagnostics.error_count() > errors) return tl::unexpected(diagnostics.first_error());
  tools.warn(cl_file, diagnostics);
  for (const std::string& doubt : directions_beside_iso841(machine))
    diagnostics.warning_once(doubt, machine.file, {}, doubt);
  std::array<char, 1 << 16> buffer;
  for (;;) {
    const auto size = program.source->read(buffer.data(), buffer.size());
    if (!size) return tl::unexpected(size.error());
    if (*size == 0) break;
    verifier.text({buffer.data(), *size});
  }
  auto found = verifier.finish();
  if (!found) return tl::unexpected(found.error());
  if (diagnostics.error_count() > errors) return tl::unexpected(diagnostics.first_error());
  return std::move(found->report);
}

}  // namespace trunnion::post
