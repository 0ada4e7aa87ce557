#include "trunnion/nc/reader.hpp"

#include <cstring>
#include <utility>

#include "trunnion/base/contract.hpp"

#include "nc/reading/hole_calls.hpp"
#include "nc/reading/line_reader.hpp"
#include "nc/reading/run_reader.hpp"
#include "nc/reading/unfolder.hpp"

namespace trunnion::nc {

struct Reader::State {
  State(const Controller& controller, std::string file, Diagnostics& diagnostics, Sink sink,
        ReaderOptions options)
      : state(controller, std::move(file), diagnostics, std::move(sink), std::move(options)) {
    if (state.options.others) follow_jumps();
  }
  /// A program that somebody else wrote goes through its calls and jumps line by line.
  void follow_jumps();

  ReadState state;
  ShapeReader shapes{state};
  EventReader events{state, shapes};
  LineReader lines{state, shapes, events};
  std::unique_ptr<RunReader> runs;  // where somebody takes runs
  std::optional<HoleCalls> holes;
  std::optional<Unfolder> unfolder;
  std::string carry;  // an unfinished line
};

void Reader::State::follow_jumps() {
  holes.emplace(state.c);
  const auto refuse = [this](std::uint32_t number, const std::string& message) {
    state.findings.line = number;
    state.error(1, message);
  };
  unfolder.emplace(
      state.c,
      [this, refuse](std::string_view text, std::uint32_t number) {
        std::string spelled_out;
        if (lines.spell_out(text, spelled_out)) text = spelled_out;
        const auto read = [&](std::string_view line) {
          state.findings.line = number - 1;
          lines.read(line);
        };
        if (!holes->take(text, number, read))
          read(text);
        else if (!holes->error.empty())
          refuse(holes->error_line, holes->error);
        return !state.program.ended;
      },
      refuse);
}

Reader::Reader(const Controller& controller, std::string file, Diagnostics& diagnostics, Sink sink,
               ReaderOptions options)
    : state_(std::make_unique<State>(controller, std::move(file), diagnostics, std::move(sink),
                                     std::move(options))) {
  const AxisFormat& own = controller.numbers.axes;
  const AxisFormat& format = state_->state.language.format;
  TRUNNION_EXPECTS(format.decimals(AxisLetter::X) >= own.decimals(AxisLetter::X));
  TRUNNION_EXPECTS(format.decimals(AxisLetter::A) >= own.decimals(AxisLetter::A));
}

Reader::~Reader() = default;

void Reader::give_runs_to(RunSink runs) {
  state_->runs = std::make_unique<RunReader>(state_->state, std::move(runs));
}

void Reader::feed(std::string_view text) {
  if (state_->unfolder) return state_->unfolder->feed(text);
  std::string& carry = state_->carry;
  while (!text.empty()) {
    if (carry.empty() && state_->runs) {
      while (const std::size_t taken = state_->runs->read(text)) text.remove_prefix(taken);
    }
    const void* const newline = std::memchr(text.data(), '\n', text.size());
    if (newline == nullptr) {
      carry += text;
      return;
    }
    const auto n = static_cast<std::size_t>(static_cast<const char*>(newline) - text.data());
    if (carry.empty()) {
      state_->lines.read(text.substr(0, n));
    } else {
      carry += text.substr(0, n);
      state_->lines.read(carry);
      carry.clear();
    }
    text.remove_prefix(n + 1);
  }
}

std::uint32_t Reader::line() const {
  return state_->state.findings.line;
}

Result<void> Reader::finish() {
  if (state_->unfolder) {
    state_->unfolder->finish();
    while (state_->unfolder->step()) {
    }
  }
  if (!state_->carry.empty()) state_->lines.read(state_->carry);
  state_->carry.clear();
  ReadState& s = state_->state;
  if (s.program.tape_line != 0 && s.findings.errors == 0 && !std::exchange(s.program.ended, true))
    s.emit(ProgramEnd{});
  if (!s.program.ended && s.findings.errors == 0) {
    ++s.findings.line;
    s.error(0, "the program has no end (" + s.c.program.end.front() + ")");
  }
  if (s.program.frame && s.findings.errors == 0) {
    if (const std::string message = s.program.frame->ends(); !message.empty()) {
      s.findings.line = s.program.frame->first_off_line();
      s.error(1, message);
    }
  }
  if (state_->holes) {
    for (const std::uint32_t line : state_->holes->never_called())
      s.findings.diagnostics.warning(s.findings.file, {line, 1},
                                     "a drilling cycle that is never called: no hole is drilled by it");
  }
  if (s.findings.first) return tl::unexpected(*s.findings.first);
  return {};
}

Result<std::vector<Block>> read_program(const Controller& controller, std::string_view text,
                                        const std::string& file, Diagnostics& diagnostics,
                                        const ReaderOptions& options) {
  std::vector<Block> blocks;
  Reader reader(
      controller, file, diagnostics, [&](const Block& block) { blocks.push_back(block); }, options);
  reader.feed(text);
  if (auto done = reader.finish(); !done) return tl::unexpected(done.error());
  return blocks;
}

}  // namespace trunnion::nc
