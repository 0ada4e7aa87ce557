#include "trunnion/post/batch.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <xxhash.h>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/config/section.hpp"

namespace trunnion::post {
namespace {

namespace fs = std::filesystem;

bool is_cl_file(const fs::path& path) {
  static const std::vector<std::string> kEndings = {".cls",       ".clsf", ".cl", ".apt",
                                                    ".aptsource", ".ncl",  ".as", ".nci"};
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end();
}

std::string output_for(const fs::path& relative, const std::string& folder) {
  return (fs::path(folder) / relative).replace_extension(".nc").string();
}

Result<void> add_folder(const fs::path& root, const std::string& folder, std::vector<BatchItem>& items) {
  const std::size_t before = items.size();
  std::error_code ec;
  for (fs::recursive_directory_iterator it(root, ec), end; !ec && it != end; it.increment(ec)) {
    if (it->is_regular_file(ec) && is_cl_file(it->path())) {
      items.push_back({it->path().string(), output_for(fs::relative(it->path(), root, ec), folder)});
    }
  }
  if (ec) return fail(ErrorCode::io_failed, "cannot read the folder: " + ec.message(), root.string());
  if (items.size() == before) return fail(ErrorCode::wrong_input, "no CL file in this folder", root.string());
  return {};
}

Result<void> add_manifest(const std::string& file, const std::string& folder, std::vector<BatchItem>& items,
                          Diagnostics& diagnostics) {
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  const auto value = config::parse_toml(*text, file);
  if (!value) return tl::unexpected(value.error());
  const std::size_t errors = diagnostics.error_count();
  config::Section root(*value, "file", file, diagnostics);
  const fs::path base = fs::path(file).parent_path();
  for (config::Section& part : root.sections("part")) {
    const std::string name = part.text("file");
    const auto output = part.find_text("output");
    part.finish();
    const fs::path out =
        output ? fs::path(folder) / *output : fs::path(output_for(fs::path(name).filename(), folder));
    items.push_back({(base / name).string(), out.string()});
  }
  root.finish();
  if (diagnostics.error_count() > errors) return tl::unexpected(diagnostics.first_error());
  return {};
}

std::string hash_text(std::string_view bytes) {
  const XXH128_hash_t h = XXH3_128bits(bytes.data(), bytes.size());
  return std::to_string(h.high64) + "-" + std::to_string(h.low64);
}

std::string stamp_path(const std::string& output) {
  const fs::path p(output);
  return (p.parent_path() / ("." + p.filename().string() + ".stamp")).string();
}

// `inputs output` hashes; anything missing or different means that the item has to be posted.
bool is_unchanged(const BatchItem& item, const std::string& inputs_hash) {
  const auto stamp = read_file(stamp_path(item.output));
  if (!stamp) return false;
  const auto output = read_file(item.output);
  return output && *stamp == inputs_hash + " " + hash_text(*output) + "\n";
}

struct Context {
  const Machine& machine;
  const nc::Controller& controller;
  const Model* model;
  const std::vector<std::string>& header;
  const BatchOptions& options;
};

void write_stamp(const BatchItem& item, const std::string& inputs_hash) {
  // Without a stamp the item is posted again next time: no reason to fail.
  if (const auto output = read_file(item.output)) {
    static_cast<void>(write_file(stamp_path(item.output), inputs_hash + " " + hash_text(*output) + "\n"));
  }
}

void run_item(const Context& context, BatchResult& result) {
  const auto text = read_file(result.item.input);
  if (!text) {
    result.state = BatchState::failed;
    result.outcome.error = text.error();
    return;
  }
  const std::string inputs_hash = hash_text(hash_text(*text) + context.options.fingerprint);
  if (!context.options.force && is_unchanged(result.item, inputs_hash)) {
    result.state = BatchState::skipped;
    return;
  }
  if (context.options.dry_run) {
    result.state = BatchState::would_post;
    return;
  }
  std::error_code ec;
  fs::create_directories(fs::path(result.item.output).parent_path(), ec);
  PostJob job;
  job.cl_file = result.item.input;
  job.machine = &context.machine;
  job.controller = &context.controller;
  job.model = context.model;
  job.header = context.header;
  job.header.push_back("CL file " + fs::path(result.item.input).filename().string());
  result.outcome = post_file(job, context.options.post, result.item.output, context.options.accept_deviation);
  result.state = result.outcome.passed && result.outcome.written ? BatchState::posted : BatchState::failed;
  if (result.state == BatchState::posted) write_stamp(result.item, inputs_hash);
}

}  // namespace

Result<std::vector<BatchItem>> batch_items(const std::vector<std::string>& inputs, const std::string& folder,
                                           Diagnostics& diagnostics) {
  std::vector<BatchItem> items;
  for (const std::string& input : inputs) {
    std::error_code ec;
    Result<void> added;
    if (fs::is_directory(input, ec)) {
      added = add_folder(input, folder, items);
    } else if (!fs::exists(input, ec)) {
      added = fail(ErrorCode::io_failed, "cannot open: No such file or directory", input);
    } else if (fs::path(input).extension() == ".toml") {
      added = add_manifest(input, folder, items, diagnostics);
    } else {
      items.push_back({input, output_for(fs::path(input).filename(), folder)});
    }
    if (!added) return tl::unexpected(added.error());
  }
  std::sort(items.begin(), items.end(), [](const BatchItem& a, const BatchItem& b) {
    return std::pair(a.output, a.input) < std::pair(b.output, b.input);
  });
  for (std::size_t i = 1; i < items.size(); ++i) {
    if (items[i].output == items[i - 1].output) {
      return fail(ErrorCode::wrong_input,
                  "would be written to the same file " + items[i].output + " as " + items[i - 1].input,
                  items[i].input);
    }
  }
  return items;
}

std::vector<BatchItem> shard(const std::vector<BatchItem>& items, std::size_t index, std::size_t count) {
  std::vector<BatchItem> out;
  for (std::size_t i = index - 1; i < items.size(); i += count) out.push_back(items[i]);
  return out;
}

std::vector<BatchResult> run_batch(const std::vector<BatchItem>& items, const Machine& machine,
                                   const nc::Controller& controller, const Model* model,
                                   const std::vector<std::string>& header, const BatchOptions& options,
                                   const std::function<void(const BatchResult&)>& progress,
                                   const std::atomic<bool>& stop) {
  std::vector<BatchResult> results(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) results[i].item = items[i];
  const Context context{machine, controller, model, header, options};
  std::optional<oneapi::tbb::global_control> limit;
  if (options.threads > 0)
    limit.emplace(oneapi::tbb::global_control::max_allowed_parallelism, options.threads);
  oneapi::tbb::parallel_for(std::size_t{0}, items.size(), [&](std::size_t i) {
    if (stop) return;
    const auto start = std::chrono::steady_clock::now();
    run_item(context, results[i]);
    results[i].seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    progress(results[i]);
  });
  return results;
}

}  // namespace trunnion::post
