#include "trunnion/effects/model_paths.hpp"

#include <algorithm>
#include <filesystem>

#include "effects/table_effect.hpp"

namespace trunnion {
namespace {

namespace fs = std::filesystem;

fs::path folder_of(const std::string& file) {
  return file == "-" ? fs::current_path() : fs::absolute(fs::path(file)).parent_path();
}

}  // namespace

Model written_to(const Model& model, const std::string& new_file) {
  Model out = model;
  if (model.file.empty()) return out;
  for (ModelEffect& e : out.effects) {
    const auto* table = dynamic_cast<const effects::TableEffect*>(e.effect.get());
    if (table == nullptr || fs::path(table->spec().file).is_absolute()) continue;
    const fs::path there = folder_of(model.file) / table->spec().file;
    e.effect = table->with_file(there.lexically_proximate(folder_of(new_file)).generic_string());
  }
  out.file = new_file;
  return out;
}

std::vector<std::string> table_files(const Model& model) {
  std::vector<std::string> out;
  for (const ModelEffect& e : model.effects) {
    const auto* table = dynamic_cast<const effects::TableEffect*>(e.effect.get());
    if (table == nullptr) continue;
    const fs::path file = table->spec().file;
    const std::string path = (file.is_absolute() ? file : folder_of(model.file) / file).string();
    if (std::find(out.begin(), out.end(), path) == out.end()) out.push_back(path);
  }
  return out;
}

}  // namespace trunnion
