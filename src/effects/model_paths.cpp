#include "trunnion/effects/model_paths.hpp"

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

}  // namespace trunnion
