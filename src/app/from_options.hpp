#pragma once
#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "trunnion/post/nc_origin.hpp"

#include "app/options.hpp"

namespace trunnion::app {

/// `--from`, `--from-machine`, `--from-path`: an NC program in place of a CL file.
struct FromOptions {
  std::string controller;
  std::string machine;
  std::string path;
  std::string words;
  std::string input;

  /// `input`: what is an NC program then, for the help.
  void add_to(CLI::App& command, const std::string& input = "the input");
  bool is_asked() const { return !controller.empty(); }
  /// What the program was made for: without `--from-machine` the machine that is posted for. Nothing without
  /// `--from`. Fails with wrong_use where the other two stand without it.
  Result<std::optional<MachineFiles>> load(const MachineOptions& target, Diagnostics& diagnostics) const;
  /// `files` must outlive it.
  post::NcOrigin resolve(const MachineFiles& files) const {
    return {&files.machine, &files.controller,
            path == "motion"   ? post::FromPath::motion
            : path == "points" ? post::FromPath::points
                               : post::FromPath::near_points,
            words == "tip"       ? post::FromWords::tip
            : words == "spindle" ? post::FromWords::spindle
                                 : post::FromWords::refused};
  }
  /// The line of a program's header.
  std::string line(const MachineFiles& files) const;
  /// The options as they stand, for "unchanged inputs are skipped".
  std::string text() const { return controller + " " + machine + " " + path + " " + words + "\n"; }
};

}  // namespace trunnion::app
