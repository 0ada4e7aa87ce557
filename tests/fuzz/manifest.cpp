// Manifests of batches: no program outside the folder. And tool files.
#include "trunnion/post/batch.hpp"
#include "trunnion/post/tools.hpp"

#include "fuzz/fuzz.hpp"

using namespace trunnion;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Diagnostics diagnostics;
  fuzz::Bytes bytes(data, size);
  const std::size_t which = bytes.choice(3);
  const std::string text = bytes.rest();
  if (which > 0) {
    static_cast<void>(post::parse_tools(text, which == 1 ? "input.csv" : "input.tbl", diagnostics));
    return 0;
  }
  const std::string path = fuzz::file_of(text, ".toml");
  const auto items = post::batch_items({path}, "/nonexistent/out", diagnostics);
  if (!items) return 0;
  for (const post::BatchItem& item : *items) {
    const std::string normal = std::filesystem::path(item.output).lexically_normal().string();
    fuzz::hold(normal.starts_with("/nonexistent/out/"), "a program stays below its folder: " + normal);
  }
  return 0;
}
