#pragma once
#include <CLI/CLI.hpp>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"
#include "trunnion/post/nc_origin.hpp"
#include "trunnion/post/post.hpp"

#include "app/from_options.hpp"
#include "app/options.hpp"
#include "app/results.hpp"

namespace trunnion::app {

/// The command line of `post`.
struct PostCommand {
  std::string cl_file;
  std::string output;
  MachineOptions machine;
  PostCliOptions options;
  FromOptions from;
  ResultOptions result;
  std::size_t threads = 1;
  bool filter = false;  // called by a control that opens a CL file

  /// The part, -o and all options that say how it is posted.
  void add_to(CLI::App& command);
};

/// Everything that a part is posted with, read from its files. `job` and `options` point into it.
struct PostInputs {
  MachineFiles files;
  std::optional<MachineFiles> made_for;  // of an NC program that is posted
  post::NcOrigin origin;
  std::optional<Model> model;
  std::optional<post::TemperatureHistory> temperatures;
  std::optional<post::ToolTable> tools;
  std::optional<post::RunTimeDrift> drift;
  std::optional<thermal::OffsetTable> offsets;
  post::PostJob job;
  post::PostOptions options;
};

/// Reads the files that the command names, but for the part itself.
Result<std::unique_ptr<PostInputs>> read_post_inputs(const PostCommand& command, Diagnostics& diagnostics);

}  // namespace trunnion::app
