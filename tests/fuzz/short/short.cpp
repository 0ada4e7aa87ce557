// short TARGET FOLDER SECONDS [SEED]: a fuzz target for a moment, with random changes of the files in FOLDER
// and without coverage, so that it can be built by any compiler. The input at hand stands in FOLDER.input: it
// is left there when the target crashes, hangs or breaks a law.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <string>
#include <sys/mman.h>
#include <unistd.h>
#include <vector>

#include "fcntl.h"

#define TARGET(name) extern "C" int fuzz_##name(const std::uint8_t* data, std::size_t size);
#include "fuzz_targets.inc"
#undef TARGET

namespace {

constexpr std::size_t kLargest = 20000;
constexpr unsigned kMostSeconds = 25;  // of one input

using Bytes = std::vector<std::uint8_t>;

std::map<std::string, int (*)(const std::uint8_t*, std::size_t)> targets() {
  return {
#define TARGET(name) {#name, fuzz_##name},
#include "fuzz_targets.inc"
#undef TARGET
  };
}

std::vector<Bytes> files_of(const std::string& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.push_back(entry.path().string());
  std::sort(names.begin(), names.end());
  std::vector<Bytes> out;
  for (const std::string& name : names) {
    std::ifstream in(name, std::ios::binary);
    out.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    if (out.back().size() > kLargest) out.back().resize(kLargest);
  }
  return out;
}

class Changer {
 public:
  Changer(std::vector<Bytes> files, std::uint64_t seed) : files_(std::move(files)), random_(seed) {}

  Bytes next() {
    Bytes out = files_[below(files_.size())];
    for (std::size_t n = 1 + below(6); n > 0; --n) change(out);
    if (out.size() > kLargest) out.resize(kLargest);
    return out;
  }

 private:
  std::size_t below(std::size_t n) { return n == 0 ? 0 : random_() % n; }
  // A piece of a file, or numbers and signs that readers stumble over.
  Bytes piece() {
    static const std::vector<std::string> kHard = {"-",        "1e308",
                                                   "-1e-320",  "nan",
                                                   "inf",      "9223372036854775808",
                                                   "0x1p9999", "\"\"\"",
                                                   "[[",       "]",
                                                   "\xff",     "\n",
                                                   "/",        ",,",
                                                   "1e19",     "-0",
                                                   "%",        "(",
                                                   ";",        "=",
                                                   "$\n",      "\r",
                                                   "\xe2\x80", "G91\n",
                                                   "Z-9999",   "[effect.parameters]",
                                                   "=\n",      "\0"};
    if (below(2) == 0) {
      const std::string& hard = kHard[below(kHard.size())];
      return {hard.begin(), hard.end()};
    }
    const Bytes& other = files_[below(files_.size())];
    const std::size_t begin = below(other.size());
    const std::size_t end = std::min(other.size(), begin + 1 + below(60));
    return {other.begin() + static_cast<std::ptrdiff_t>(begin),
            other.begin() + static_cast<std::ptrdiff_t>(end)};
  }
  void change(Bytes& bytes) {
    const std::size_t at = below(bytes.size() + 1);
    const auto place = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    switch (below(5)) {
      case 0: {
        const Bytes more = piece();
        bytes.insert(place, more.begin(), more.end());
        return;
      }
      case 1:
        bytes.erase(place, place + static_cast<std::ptrdiff_t>(std::min(bytes.size() - at, 1 + below(30))));
        return;
      case 2:
        if (at < bytes.size()) bytes[at] = static_cast<std::uint8_t>(random_());
        return;
      case 3: {  // digits
        for (std::size_t i = at; i < std::min(bytes.size(), at + 40); ++i) {
          if (bytes[i] >= '0' && bytes[i] <= '9') {
            bytes[i] = static_cast<std::uint8_t>('0' + below(10));
            return;
          }
        }
        return;
      }
      default: {
        const Bytes more = piece();
        for (std::size_t i = 0; i < more.size() && at + i < bytes.size(); ++i) bytes[at + i] = more[i];
      }
    }
  }

  std::vector<Bytes> files_;
  std::mt19937_64 random_;
};

// A file that holds what the target is given, whatever becomes of the process.
std::uint8_t* shown_in(const std::string& name) {
  const int file = ::open(name.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file < 0 || ::ftruncate(file, static_cast<off_t>(kLargest)) != 0) return nullptr;
  void* const memory = ::mmap(nullptr, kLargest, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  ::close(file);
  return memory == MAP_FAILED ? nullptr : static_cast<std::uint8_t*>(memory);
}

}  // namespace

int main(int argc, char** argv) {
  const auto known = targets();
  const auto target = argc < 4 ? known.end() : known.find(argv[1]);
  if (target == known.end()) {
    std::fprintf(stderr, "usage: short TARGET FOLDER SECONDS [SEED]\n");
    return 2;
  }
  const std::string input = std::string(argv[2]) + ".input";
  std::vector<Bytes> files = files_of(argv[2]);
  std::uint8_t* const shown = shown_in(input);
  if (shown == nullptr) {
    std::fprintf(stderr, "%s cannot be written\n", input.c_str());
    return 2;
  }
  if (files.empty()) files.emplace_back();
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(std::atof(argv[3]));
  const auto run = [&](const Bytes& bytes) {
    std::memset(shown, 0, kLargest);
    std::copy(bytes.begin(), bytes.end(), shown);
    ::alarm(kMostSeconds);
    static_cast<void>(target->second(bytes.data(), bytes.size()));
  };
  std::size_t count = 0;
  for (const Bytes& bytes : files) run(bytes), ++count;
  Changer changer(std::move(files), argc > 4 ? std::strtoull(argv[4], nullptr, 10) : 1);
  for (; std::chrono::steady_clock::now() < until; ++count) run(changer.next());
  ::alarm(0);
  std::remove(input.c_str());
  std::printf("%s: %zu executions, no finding\n", argv[1], count);
  return 0;
}
