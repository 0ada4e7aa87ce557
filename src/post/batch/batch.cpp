#include "trunnion/post/batch.hpp"

#include <chrono>
#include <filesystem>
#include <memory>
#include <new>
#include <oneapi/tbb/info.h>
#include <optional>
#include <sstream>
#include <system_error>
#include <thread>
#include <xxhash.h>

#include "trunnion/base/failure.hpp"
#include "trunnion/base/files.hpp"

namespace trunnion::post {
namespace {

namespace fs = std::filesystem;

// Of a text that comes in pieces.
class ContentHash {
 public:
  ContentHash() : state_(XXH3_createState(), XXH3_freeState) {
    if (!state_) throw std::bad_alloc();
    XXH3_128bits_reset(state_.get());
  }
  void take(std::string_view bytes) { XXH3_128bits_update(state_.get(), bytes.data(), bytes.size()); }
  std::string text() const {
    const XXH128_hash_t h = XXH3_128bits_digest(state_.get());
    return std::to_string(h.high64) + "-" + std::to_string(h.low64);
  }

 private:
  std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state_;
};

std::string stamp_path(const std::string& output) {
  const fs::path p(output);
  return (p.parent_path() / ("." + p.filename().string() + ".stamp")).string();
}

// What an output was made from, and what it was when it was made.
struct Stamp {
  std::string inputs_hash, output_hash;
  std::int64_t program_number = 0;

  std::string text() const {
    return inputs_hash + " " + output_hash + " " + std::to_string(program_number) + "\n";
  }
};

// Where the item is unchanged. Anything missing or different means that it has to be posted.
std::optional<Stamp> unchanged_stamp(const BatchItem& item, const std::string& inputs_hash) {
  const auto text = read_file(stamp_path(item.output));
  if (!text) return std::nullopt;
  std::istringstream in(*text);
  Stamp stamp;
  if (!(in >> stamp.inputs_hash >> stamp.output_hash >> stamp.program_number)) return std::nullopt;
  const auto output = read_file(item.output);
  if (!output || stamp.inputs_hash != inputs_hash || stamp.output_hash != content_hash(*output))
    return std::nullopt;
  return stamp;
}

struct Context {
  const PostJob& job;
  const BatchOptions& options;
};

// What has to be a file because it is read twice, or replaced: a pipe would be waited for, or be empty.
Result<void> require_file(const std::string& path) {
  std::error_code ec;
  const fs::file_status status = fs::status(path, ec);
  if (!fs::exists(status) || fs::is_regular_file(status)) return {};
  return fail(ErrorCode::wrong_input, "is no file (a folder, a pipe or a device)", path);
}

// The CL text of an item that can be posted.
Result<std::string> read_input(const BatchItem& item) {
  for (const std::string& path : {item.input, item.output}) {
    if (auto file = require_file(path); !file) return tl::unexpected(file.error());
  }
  return read_file(item.input);
}

Result<void> make_folder_of(const std::string& output) {
  const fs::path folder = fs::path(output).parent_path();
  std::error_code ec;
  fs::create_directories(folder, ec);
  if (ec) return fail(ErrorCode::io_failed, "cannot make the folder: " + ec.message(), folder.string());
  return {};
}

void fail_item(BatchResult& result, const Error& error) {
  result.state = BatchState::failed;
  result.outcome.error = error;
}

void run_item(const Context& context, BatchResult& result) {
  const auto text = read_input(result.item);
  if (!text) return fail_item(result, text.error());
  const std::string inputs_hash = content_hash(content_hash(*text) + context.options.fingerprint);
  const auto stamp = unchanged_stamp(result.item, inputs_hash);
  if (!context.options.force && stamp) {
    result.state = BatchState::skipped;
    result.program_number = stamp->program_number;
    return;
  }
  if (context.options.dry_run) {
    result.state = BatchState::would_post;
    return;
  }
  if (const auto folder = make_folder_of(result.item.output); !folder)
    return fail_item(result, folder.error());
  PostJob job = context.job;
  job.cl_file = result.item.input;
  const bool is_program = job.from != nullptr && is_nc_file(result.item.input);
  if (!is_program) job.from = nullptr;
  job.header.push_back((is_program ? "NC program " : "CL file ") +
                       fs::path(result.item.input).filename().string());
  // Of the program as it was made, not as it is found: another batch may have put its own there by then.
  ContentHash made;
  result.outcome = post_file(job, context.options.post, result.item.output, context.options.accept_deviation,
                             [&](std::string_view bytes) { made.take(bytes); });
  result.state = result.outcome.passed && result.outcome.written ? BatchState::posted : BatchState::failed;
  if (result.state != BatchState::posted) return;
  result.program_number = result.outcome.report->head.program_number;
  // Without a stamp the item is posted again next time: no reason to fail.
  static_cast<void>(write_file(stamp_path(result.item.output),
                               Stamp{inputs_hash, made.text(), result.program_number}.text()));
}

// One item's failure is its own, whatever it is.
void run_item_alone(const Context& context, BatchResult& result) {
  try {
    run_item(context, result);
  } catch (const std::exception& e) {
    fail_item(result, error_of(e).value_or(Error{
                          ErrorCode::defect, std::string("defect of the program: ") + e.what(), {}, {}}));
    if (result.outcome.error->file.empty()) result.outcome.error->file = result.item.input;
  }
}

// Calls work(i) for all i below `count`, in as many threads as the system gives of those that are asked for.
void in_threads(std::size_t count, std::size_t threads, const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next = 0;
  const auto take_items = [&] {
    for (std::size_t i = next++; i < count; i = next++) work(i);
  };
  std::vector<std::jthread> others;
  others.reserve(threads);
  try {
    while (others.size() + 1 < std::min(threads, count)) others.emplace_back(take_items);
  } catch (const std::system_error&) {  // fewer do it too
  }
  take_items();
}

}  // namespace

std::string content_hash(std::string_view bytes) {
  ContentHash hash;
  hash.take(bytes);
  return hash.text();
}

std::vector<BatchResult> run_batch(const std::vector<BatchItem>& items, const PostJob& job,
                                   const BatchOptions& options,
                                   const std::function<void(const BatchResult&)>& progress,
                                   const std::atomic<bool>& stop) {
  std::vector<BatchResult> results(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) results[i].item = items[i];
  const Context context{job, options};
  const auto cores = static_cast<std::size_t>(oneapi::tbb::info::default_concurrency());
  in_threads(items.size(), options.threads > 0 ? options.threads : cores, [&](std::size_t i) {
    if (stop) return;
    const auto start = std::chrono::steady_clock::now();
    run_item_alone(context, results[i]);
    results[i].seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    progress(results[i]);
  });
  return results;
}

}  // namespace trunnion::post
