// Programs: what `trunnion post` and `trunnion verify` do, with the program as a text.
#include <algorithm>
#include <memory>
#include <optional>
#include <pybind11/stl.h>
#include <string>
#include <vector>

#include "trunnion/base/files.hpp"
#include "trunnion/post/post_file.hpp"
#include "trunnion/report/post_json.hpp"

#include "app/failed_checks.hpp"
#include "app/post_job.hpp"
#include "app/python/calls.hpp"
#include "app/verify_job.hpp"
#include "app/wrong_use.hpp"

namespace trunnion::python {
namespace {

using Words = std::vector<std::string>;

// Reads the words as the program's command line does; the command behind `root` has its options.
void parse(CLI::App& root, Words words, const std::string& command) {
  words.insert(words.begin(), command);
  std::reverse(words.begin(), words.end());  // CLI11 takes them from the end
  try {
    root.parse(std::move(words));
  } catch (const CLI::ParseError& e) {
    throw Refused(ErrorCode::wrong_use, app::wrong_use_text(&root, e));
  }
}

// A text in memory, which it owns.
class OwnText final : public cl::TextSource {
 public:
  explicit OwnText(std::string text) : text_(std::move(text)) {}
  Result<std::size_t> read(char* buffer, std::size_t capacity) override {
    const std::size_t count = text_.copy(buffer, capacity, at_);
    at_ += count;
    return count;
  }

 private:
  std::string text_;
  std::size_t at_ = 0;
};

struct Posted {
  app::PostCommand command;
  std::unique_ptr<app::PostInputs> inputs;
  post::FileOutcome outcome;
  std::string text;
};

// The program in memory instead of a file: nothing is written that Ctrl-C could leave behind.
void make(Posted& p) {
  p.inputs->job.output = p.command.output;
  p.outcome =
      post::post_file(p.inputs->job, p.inputs->options, "/dev/null", p.command.options.accept_deviation,
                      [&](std::string_view piece) { p.text += piece; });
}

std::string why_not(const Posted& p) {
  std::string out;
  for (const std::string& reason : app::failed_checks(*p.outcome.report->verification, p.command.cl_file))
    out += (out.empty() ? "error: " : "\nerror: ") + reason;
  return out;
}

/// (text, result as JSON, passed)
py::tuple post_words(const Words& words) {
  auto posted = std::make_shared<Posted>();
  CLI::App root{"", "trunnion"};
  posted->command.add_to(*root.add_subcommand("post", ""));
  parse(root, words, "post");
  Diagnostics diagnostics;
  posted->inputs = taken(app::read_post_inputs(posted->command, diagnostics), diagnostics);
  warn_of(diagnostics);
  interruptible([posted] { make(*posted); });
  const post::FileOutcome& outcome = posted->outcome;
  if (outcome.error) refuse(outcome.diagnostics, *outcome.error);
  warn_of(outcome.diagnostics);
  if (!outcome.written) throw Refused(ErrorCode::check_failed, why_not(*posted));
  return py::make_tuple(posted->text, report::post_json(*outcome.report), outcome.passed);
}

struct Judged {
  app::VerifyCommand command;
  std::unique_ptr<app::VerifyInputs> inputs;
  std::optional<std::string> text;  // of the program; nothing: it is read from its file
  Diagnostics diagnostics;

  Result<post::VerifyReport> judge() {
    auto path = command.against.open();
    if (!path) return tl::unexpected(path.error());
    std::unique_ptr<cl::TextSource> program;
    if (text) {
      program = std::make_unique<OwnText>(std::move(*text));
    } else {
      auto source = cl::open_source(command.nc_file);
      if (!source) return tl::unexpected(source.error());
      program = std::move(*source);
    }
    return post::verify(std::move(*path), {std::move(program), command.nc_file},
                        {inputs->files.machine, inputs->files.controller, inputs->options}, diagnostics);
  }
};

/// (result as JSON, passed, what failed)
py::tuple verify_words(const Words& words, std::optional<std::string> text) {
  auto judged = std::make_shared<Judged>();
  judged->text = std::move(text);
  CLI::App root{"", "trunnion"};
  judged->command.add_to(*root.add_subcommand("verify", ""));
  parse(root, words, "verify");
  if (!judged->command.of_run.trace.empty())
    throw Refused(ErrorCode::wrong_use, "error: --trace belongs to the program `trunnion verify`");
  judged->inputs = taken(app::read_verify_inputs(judged->command, judged->diagnostics), judged->diagnostics);
  auto result = interruptible([judged] { return judged->judge(); });
  const post::VerifyReport report = taken(std::move(result), judged->diagnostics);
  warn_of(judged->diagnostics);
  const std::vector<std::string> failed =
      report.passed() ? std::vector<std::string>{} : app::failed_checks(report, judged->command.against.file);
  return py::make_tuple(report::verify_json(report), report.passed(), failed);
}

}  // namespace

void add_programs(py::module_& m) {
  m.def("post", &post_words, py::arg("words"));
  m.def("verify", &verify_words, py::arg("words"), py::arg("text") = py::none());
  m.def(
      "write_file",
      [](const std::string& file, const std::string& text) {
        if (const auto written = write_file(file, text); !written) refuse({}, written.error());
      },
      py::arg("file"), py::arg("text"));
}

}  // namespace trunnion::python
