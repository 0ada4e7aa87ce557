#pragma once
#include <atomic>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/post/post_file.hpp"

namespace trunnion::post {

/// One conversion of a batch.
struct BatchItem {
  std::string input;   // CL file
  std::string output;  // NC file
};

/// The file is an NC program by its ending.
bool is_nc_file(const std::string& path);

/// Finds the CL files of `inputs`: files as they stand, folders with all CL files below them (by their
/// endings, with `nc_too` those of NC programs, too; links to folders are not followed, each is a warning),
/// manifests (`.toml`: `[[part]] file =
/// "...", output = "..."`, `file` relative to the manifest, `output` to `folder`, below which it stays).
/// Outputs go to `folder`, with the path below the input folder kept. Fails when an input does not exist, a
/// folder holds no CL file or a manifest no part, two inputs would write one output, or an output is an
/// input.
Result<std::vector<BatchItem>> batch_items(const std::vector<std::string>& inputs, const std::string& folder,
                                           Diagnostics& diagnostics, bool nc_too = false);

/// The items of shard `index` (from 1) of `count`: every count-th item, so that the shards together are the
/// whole, each item once.
std::vector<BatchItem> shard(const std::vector<BatchItem>& items, std::size_t index, std::size_t count);

/// Of a file's content, as the stamps have it.
std::string content_hash(std::string_view bytes);

enum class BatchState : std::uint8_t { posted, skipped, failed, would_post, not_run };

struct BatchResult {
  BatchItem item;
  BatchState state = BatchState::not_run;
  FileOutcome outcome;  // of a posted or failed item
  double seconds = 0.0;
  /// That the program in the output file begins with, of a posted or skipped item; 0: none, or not known.
  std::int64_t program_number = 0;
};

struct BatchOptions {
  PostOptions post;
  bool accept_deviation = false;
  bool dry_run = false;
  bool force = false;       // post unchanged inputs too
  std::size_t threads = 0;  // 0: all cores
  /// Everything but the CL file that decides about the output: contents of machine, controller and model,
  /// options, the program itself.
  std::string fingerprint;
};

/// Posts the items in parallel. One item's failure does not stop the others. Unchanged ones are skipped: a
/// stamp beside the output (`.<name>.stamp`) holds the hash of what it was made from and of itself. Killed at
/// any moment and run again it ends with the same files; two batches at once in one folder do no harm, since
/// every file appears by a rename.
/// @param job      what is the same for all items; `from` is taken for those with the ending of an NC program
/// @param progress called after each item, from any thread
/// @param stop     set by a signal: items that have not begun are not run
std::vector<BatchResult> run_batch(const std::vector<BatchItem>& items, const PostJob& job,
                                   const BatchOptions& options,
                                   const std::function<void(const BatchResult&)>& progress,
                                   const std::atomic<bool>& stop);

/// Warns once where programs of a batch have the same number on a control that knows them by it: there each
/// takes the place of the one that was loaded before, or is not loaded, and the other part's program runs.
void warn_of_equal_numbers(const std::vector<BatchResult>& results, Diagnostics& diagnostics);

}  // namespace trunnion::post
