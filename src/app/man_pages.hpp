#pragma once
#include <CLI/CLI.hpp>
#include <map>
#include <string>

namespace trunnion::app {

/// The man pages of the program and of each of its commands, from the tables that the command line is parsed
/// with: file name ("trunnion-model-fit.1") and text.
std::map<std::string, std::string> command_pages(const CLI::App& root);

/// What stands in man pages for `text`: no character of it is an instruction.
std::string man_text(std::string_view text);
/// First line of a page of `section`.
std::string man_head(const std::string& name, int section);

}  // namespace trunnion::app
