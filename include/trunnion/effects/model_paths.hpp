#pragma once
#include <string>
#include <vector>

#include "trunnion/effects/model.hpp"

namespace trunnion {

/// The model as it must be written to `new_file`: error tables stand beside the file that it was read from
/// (`Model::file`), and their relative paths are rewritten so that they are found from the folder of
/// `new_file` too. Absolute paths, and models that were not read from a file, stay as they are. `-` (standard
/// output) counts as the current folder.
Model written_to(const Model& model, const std::string& new_file);

/// The files of the model's error tables, as paths from the current folder, each once.
std::vector<std::string> table_files(const Model& model);

}  // namespace trunnion
