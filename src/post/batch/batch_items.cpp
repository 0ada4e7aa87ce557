#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>

#include "trunnion/base/files.hpp"
#include "trunnion/config/section.hpp"
#include "trunnion/post/batch.hpp"

namespace trunnion::post {
namespace {

namespace fs = std::filesystem;

std::string lower_case_ending(const fs::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

bool is_cl_file(const fs::path& path) {
  static const std::vector<std::string> kEndings = {".cls",       ".clsf", ".cl", ".apt",
                                                    ".aptsource", ".ncl",  ".as", ".nci"};
  return std::find(kEndings.begin(), kEndings.end(), lower_case_ending(path)) != kEndings.end();
}

// Which files of a folder are its inputs.
struct Wanted {
  bool nc_too = false;
  // Hidden files are somebody else's: copies of editors, what a Mac puts beside each file (._part.cls).
  bool takes(const fs::path& path) const {
    if (path.filename().string().starts_with('.')) return false;
    return is_cl_file(path) || (nc_too && is_nc_file(path.string()));
  }
};

std::string output_for(const fs::path& relative, const std::string& folder) {
  return (fs::path(folder) / relative).replace_extension(".nc").string();
}

// The CL files at and below `folder`, links to files among them. Links to folders may lead in a circle.
Result<void> find_cl_files(const fs::path& folder, Wanted wanted, std::vector<fs::path>& files,
                           Diagnostics& diagnostics) {
  std::error_code ec;
  for (fs::directory_iterator it(folder, ec), end; !ec && it != end; it.increment(ec)) {
    std::error_code unknown;
    if (!it->is_directory(unknown)) {
      if (wanted.takes(it->path())) files.push_back(it->path());
    } else if (it->is_symlink(unknown)) {
      diagnostics.warning(it->path().string(), {},
                          "a link to a folder is not followed: name it as an input of its own");
    } else if (auto below = find_cl_files(it->path(), wanted, files, diagnostics); !below) {
      return below;
    }
  }
  if (ec) return fail(ErrorCode::io_failed, "cannot read the folder: " + ec.message(), folder.string());
  return {};
}

Result<void> add_folder(const fs::path& root, const std::string& folder, Wanted wanted,
                        std::vector<BatchItem>& items, Diagnostics& diagnostics) {
  std::vector<fs::path> files;
  if (auto found = find_cl_files(root, wanted, files, diagnostics); !found) return found;
  if (files.empty()) return fail(ErrorCode::wrong_input, "no CL file in this folder", root.string());
  for (const fs::path& file : files)
    items.push_back({file.string(), output_for(file.lexically_relative(root), folder)});
  return {};
}

// Below the folder of the outputs, whatever links there are in it.
bool stays_below(const fs::path& output) {
  const fs::path normal = output.lexically_normal();
  return output.is_relative() && normal.has_filename() && normal != "." && *normal.begin() != "..";
}

void add_part(config::Section& part, const fs::path& base, const std::string& folder,
              std::vector<BatchItem>& items) {
  const std::string name = part.text("file");
  const auto output = part.find_text("output");
  if (part.has("file") && name.empty()) part.error("file", "'file' is empty");
  if (output && !stays_below(*output))
    part.error("output", "'" + *output + "' names no file below the output folder");
  part.finish();
  const fs::path out =
      output ? fs::path(folder) / *output : fs::path(output_for(fs::path(name).filename(), folder));
  items.push_back({(base / name).string(), out.string()});
}

Result<void> add_manifest(const std::string& file, const std::string& folder, std::vector<BatchItem>& items,
                          Diagnostics& diagnostics) {
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  const auto value = config::parse_toml(*text, file);
  if (!value) return tl::unexpected(value.error());
  const std::size_t errors = diagnostics.error_count();
  config::Section root(*value, "file", file, diagnostics);
  auto parts = root.sections("part");
  for (config::Section& part : parts) add_part(part, fs::path(file).parent_path(), folder, items);
  root.finish();
  if (diagnostics.error_count() > errors) return tl::unexpected(diagnostics.first_error());
  if (parts.empty()) return fail(ErrorCode::wrong_input, "no [[part]] in this manifest", file);
  return {};
}

Result<void> add_input(const std::string& input, const std::string& folder, Wanted wanted,
                       std::vector<BatchItem>& items, Diagnostics& diagnostics) {
  std::error_code ec;
  if (fs::is_directory(input, ec)) return add_folder(input, folder, wanted, items, diagnostics);
  if (!fs::exists(input, ec)) {
    return fail(ErrorCode::io_failed, "cannot open: No such file or directory",
                input.empty() ? "(empty name)" : input);
  }
  if (lower_case_ending(input) == ".toml") return add_manifest(input, folder, items, diagnostics);
  items.push_back({input, output_for(fs::path(input).filename(), folder)});
  return {};
}

// No program over another one, none over a CL file, however their paths are written.
Result<void> keep_apart(const std::vector<BatchItem>& items) {
  std::map<std::string, const BatchItem*> inputs;
  std::map<std::string, const BatchItem*> outputs;
  for (const BatchItem& item : items) inputs.emplace(resolved_path(item.input), &item);
  for (const BatchItem& item : items) {
    const std::string place = resolved_path(item.output);
    if (const auto [other, is_new] = outputs.emplace(place, &item); !is_new) {
      const bool twice = resolved_path(item.input) == resolved_path(other->second->input);
      return fail(ErrorCode::wrong_input,
                  twice ? "is given twice, for the same program " + item.output + "; nothing was posted"
                        : "would be written to the same file " + item.output + " as " + other->second->input +
                              "; nothing was posted: rename one of the two",
                  item.input);
    }
    if (const auto input = inputs.find(place); input != inputs.end()) {
      return fail(ErrorCode::wrong_input,
                  "its program " + item.output + " would overwrite the input " + input->second->input,
                  item.input);
    }
  }
  return {};
}

}  // namespace

bool is_nc_file(const std::string& path) {
  static const std::vector<std::string> kEndings = {".nc",  ".ngc", ".tap", ".cnc",   ".eia", ".min",
                                                    ".mpf", ".spf", ".h",   ".gcode", ".iso", ".ptp"};
  return std::find(kEndings.begin(), kEndings.end(), lower_case_ending(path)) != kEndings.end();
}

Result<std::vector<BatchItem>> batch_items(const std::vector<std::string>& inputs, const std::string& folder,
                                           Diagnostics& diagnostics, bool nc_too) {
  std::vector<BatchItem> items;
  for (const std::string& input : inputs) {
    if (auto added = add_input(input, folder, {nc_too}, items, diagnostics); !added)
      return tl::unexpected(added.error());
  }
  std::sort(items.begin(), items.end(), [](const BatchItem& a, const BatchItem& b) {
    return std::pair(a.output, a.input) < std::pair(b.output, b.input);
  });
  if (auto apart = keep_apart(items); !apart) return tl::unexpected(apart.error());
  return items;
}

std::vector<BatchItem> shard(const std::vector<BatchItem>& items, std::size_t index, std::size_t count) {
  std::vector<BatchItem> out;
  for (std::size_t i = index - 1; i < items.size(); i += count) out.push_back(items[i]);
  return out;
}

}  // namespace trunnion::post
