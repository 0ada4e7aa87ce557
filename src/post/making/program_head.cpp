#include "post/making/program_head.hpp"

#include <filesystem>
#include <tuple>

#include "trunnion/base/number_text.hpp"
#include "trunnion/post/program_zero.hpp"

#include "post/making/program_name.hpp"

namespace trunnion::post {
namespace {

// A shift outlasts an abort, and on some controls a reset and the power, too: the next program is moved by
// it.
std::string after_an_abort(OffsetOutput output, const nc::Controller& controller) {
  const bool shifts = output == OffsetOutput::work_offset || output == OffsetOutput::local_shift;
  const auto& [set, add] = std::tie(controller.offset_shift.set, controller.offset_shift.add);
  if (!shifts || (set.empty() && add.empty())) return {};
  if (output == OffsetOutput::work_offset && !set.empty())
    return "After an abort: set the work offset again before another program";
  return "After an abort: " + add.back().substr(0, add.back().find(' ')) +
         " with zeros before another program";
}

}  // namespace

// A program has one zero: what the CL file says before its first motion counts, where no option says it.
std::int64_t ProgramHead::work_offset_of(const Chunk& chunk) const {
  if (posting_.options.work_offset) return *posting_.options.work_offset;
  for (const Event& event : chunk.events) {
    const auto* offset = std::get_if<cl::WorkOffset>(&event.record.data);
    if (event.before == 0 && offset != nullptr) return offset->index;
  }
  return posting_.machine.work_offset;
}

// Loaded under the number of a macro the program would run where the machine calls that, at a tool change for
// instance. A name is not meant as a number; who says the number may know that it is free.
std::int64_t ProgramHead::number_of(const std::string& name) const {
  const auto& asked = posting_.options.program.number;
  const std::int64_t number = asked.value_or(number_in_name(name));
  const auto& program = posting_.controller.program;
  if (!program.reserves(number)) return number;
  const std::string range =
      std::to_string(program.first_reserved) + " to " + std::to_string(program.last_reserved);
  posting_.warn_once("program number", {},
                     "program numbers " + range +
                         " are those of the machine's macros (tool change, probing): " +
                         (asked ? "make sure that " + std::to_string(number) + " is none of them"
                                : "the program is number 1, not " + std::to_string(number) +
                                      " of the name '" + name + "'; --program-number says another one"));
  return asked ? number : 1;
}

Result<void> ProgramHead::check_work_offset(const cl::WorkOffset& offset, SourceRef where) {
  if (offset.index == posting_.report.head.work_offset) return {};
  if (posting_.options.work_offset) {
    posting_.warn_once("work offset", where,
                       "the CL file calls work offset " + std::to_string(offset.index) + ", the option " +
                           std::to_string(*posting_.options.work_offset) + ": that holds");
    return {};
  }
  return fail(ErrorCode::wrong_input,
              "work offset " + std::to_string(offset.index) + " is called after offset " +
                  std::to_string(posting_.report.head.work_offset) +
                  ": a program can have only one work offset, since the position of a second part on the "
                  "table is unknown. Post the operations one by one",
              posting_.job.cl_file, where);
}

Result<void> ProgramHead::write(const Chunk& chunk) {
  is_written_ = true;
  nc::ProgramStart start;
  std::string name = posting_.options.program.text.value_or("");
  for (const Event& event : chunk.events) {
    const auto* text = std::get_if<cl::Text>(&event.record.data);
    if (name.empty() && text != nullptr && text->kind == cl::Text::Kind::part_name) name = text->text;
  }
  start.name = name_for_control(name);
  if (start.name.empty())
    start.name = name_for_control(std::filesystem::path(posting_.job.output).stem().string());
  start.number = number_of(start.name);
  if (posting_.controller.program.is_numbered()) posting_.report.head.program_number = start.number;
  if (auto r = posting_.write(start); !r) return r;
  const std::int64_t index = work_offset_of(chunk);
  posting_.report.head.work_offset = index;
  if (posting_.job.offsets != nullptr)
    posting_.report.head.offset_sigma_mm = posting_.job.offsets->largest_sigma_mm();
  const bool adds_length =
      posting_.machine.output_point == OutputPoint::tip && chunk.tool.control_adds_length;
  const auto zero = program_zero(posting_.machine, posting_.controller, index,
                                 posting_.options.rtcp ? WordsOf::part
                                 : adds_length         ? WordsOf::tip
                                                       : WordsOf::spindle);
  std::vector<std::string> lines = posting_.job.header;
  lines.push_back(tools_placeholder());
  for (const std::string& line : zero_lines(zero)) lines.push_back(line);
  if (const auto height_mm = posting_.machine.safe.z_mm())
    lines.push_back("Retracts to machine Z" + fixed_text(*height_mm, 3));
  if (posting_.options.smoothing_mm) {
    const std::string by = *posting_.options.smoothing_mm > 0.0
                               ? "by " + shortest_text(*posting_.options.smoothing_mm) + " mm"
                               : "as it is set";
    lines.push_back("Path smoothing: the control rounds corners " + by + ", beside the tolerance");
  }
  if (!posting_.controller.motion.straight_rapids_need.empty())
    lines.push_back("Needs straight rapids: " + posting_.controller.motion.straight_rapids_need);
  const std::string& needs = posting_.controller.feed.per_minute_needs;
  if (posting_.options.feed == FeedOutput::per_minute && !posting_.options.rtcp && !needs.empty())
    lines.push_back("F per minute needs: " + needs);
  if (posting_.job.offsets != nullptr) {
    const std::string line = after_an_abort(posting_.job.offset_output, posting_.controller);
    if (!line.empty()) lines.push_back(line);
  }
  lines.push_back(verdict_placeholder());
  for (const std::string& line : lines) {
    if (auto r = posting_.write(nc::Comment{line}); !r) return r;
  }
  // Which kinematics are active is for the program to say.
  if (posting_.controller.tcp.unknown_at_start) {
    if (auto r = posting_.write(nc::TcpControl{}); !r) return r;
  }
  warn_of_zero(posting_.machine, zero, chunk.tool.length_mm, posting_.diagnostics);
  if (posting_.options.smoothing_mm) {
    const auto within =
        posting_.controller.numbers.axes.quanta(nc::AxisLetter::X, *posting_.options.smoothing_mm);
    if (*posting_.options.smoothing_mm > 0.0 && within < 1) {
      return fail(ErrorCode::wrong_use, "path smoothing within " +
                                            shortest_text(*posting_.options.smoothing_mm) +
                                            " mm is less than the last digit of the control's words");
    }
    if (auto r = posting_.write(nc::PathMode{nc::PathModeKind::continuous, within}); !r) return r;
  }
  // One that somebody asked for must be called; a control without words for any has but one.
  if (!posting_.controller.work_offsets.empty() || index != 1) {
    if (auto r = posting_.write(nc::WorkOffset{index}); !r) return r;
  }
  // The length of the tool that ran before may still be on.
  const bool must_be_off = zero.words == WordsOf::spindle && !posting_.controller.length.off.empty();
  return must_be_off ? posting_.write(nc::LengthCompensation{0}) : Result<void>{};
}

}  // namespace trunnion::post
