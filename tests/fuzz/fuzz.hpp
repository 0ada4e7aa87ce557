#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <unistd.h>

#include "trunnion/base/failure.hpp"

#include "support/cl_text.hpp"
#include "support/controllers.hpp"
#include "support/machines.hpp"

// What the targets share. A target is LLVMFuzzerTestOneInput: any exception but Failure ends it, as does a
// law that does not hold.
namespace trunnion::fuzz {

/// Ends the process as a crash of the target, with the words.
[[noreturn]] inline void broken(const std::string& what) {
  std::fprintf(stderr, "law broken: %s\n", what.c_str());
  std::abort();
}
inline void hold(bool law, const std::string& what) {
  if (!law) broken(what);
}

/// The input, taken from its front.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}
  bool empty() const { return left_ == 0; }
  std::uint8_t byte() {
    if (left_ == 0) return 0;
    --left_;
    return *data_++;
  }
  /// Below `count`.
  std::size_t choice(std::size_t count) { return byte() % count; }
  /// From `low` to `high`, in steps of a 65535th.
  double number(double low, double high) {
    const unsigned both = (unsigned{byte()} << 8U) | byte();
    return low + (high - low) * both / 65535.0;
  }
  std::string rest() {
    std::string out(data_, data_ + left_);
    data_ += left_;
    left_ = 0;
    return out;
  }

 private:
  const std::uint8_t* data_;
  std::size_t left_;
};

inline const Machine& machine() {
  static const Machine shipped = test::shipped_machine("trunnion_offset");
  return shipped;
}

inline std::string& folder_name() {
  static std::string name;
  return name;
}

/// A file of this process with that text, for what is read by its name; written over by the next.
inline std::string file_of(const std::string& text, const std::string& ending) {
  static const std::filesystem::path folder = [] {
    std::string name = "/dev/shm/trunnion_fuzz_XXXXXX";
    if (::mkdtemp(name.data()) == nullptr) std::abort();
    folder_name() = name;
    std::atexit([] { std::filesystem::remove_all(folder_name()); });
    return std::filesystem::path(name);
  }();
  const std::string path = (folder / ("input" + ending)).string();
  std::ofstream(path, std::ios::binary) << text;
  return path;
}

}  // namespace trunnion::fuzz
