#include "trunnion/base/files.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <optional>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace trunnion {
namespace {

namespace fs = std::filesystem;

std::string reason() {
  return std::strerror(errno);
}  // NOLINT(concurrency-mt-unsafe): glibc's is per thread

// Larger texts are refused: a log of ten million rows has a tenth of it.
constexpr std::size_t kLargestText = std::size_t{2} << 30;

Result<std::string> read_descriptor(int descriptor, const std::string& path) {
  std::string out;
  std::array<char, 1 << 16> buffer;
  for (;;) {
    const ssize_t n = ::read(descriptor, buffer.data(), buffer.size());
    if (n == 0) return out;
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return fail(ErrorCode::io_failed, "cannot read: " + reason(), path);
    if (static_cast<std::size_t>(n) > kLargestText - out.size())
      return fail(ErrorCode::io_failed, "is larger than " + std::to_string(kLargestText) + " bytes", path);
    out.append(buffer.data(), static_cast<std::size_t>(n));
  }
}

// What is open there has an end: a file or a pipe.
Result<void> require_end(int descriptor, const std::string& path) {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) return fail(ErrorCode::io_failed, "cannot read: " + reason(), path);
  if (S_ISREG(status.st_mode) || S_ISFIFO(status.st_mode)) return {};
  return fail(ErrorCode::io_failed,
              S_ISDIR(status.st_mode) ? "cannot read: " + std::string(std::strerror(EISDIR))
                                      : "cannot read: is a device, not a file",
              path);
}

// The byte order mark of UTF-8, which editors under Windows write, is no part of the text.
Result<std::string> without_mark(std::string text, const std::string& path) {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
    return fail(ErrorCode::wrong_input, "UTF-16 text: save the file as UTF-8", path);
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
  return text;
}

// A hidden name in the folder of `target`, for what `make` makes there. It is as short for a long name, and
// one that a killed process of the same number left is passed over. Nothing when `make` fails.
template <class Make>
std::optional<std::string> name_beside(const std::string& target, const Make& make) {
  static std::atomic<unsigned> counter{0};
  const fs::path folder = fs::path(target).parent_path();
  for (;;) {
    const std::string name =
        ".trunnion-" + std::to_string(::getpid()) + "-" + std::to_string(counter.fetch_add(1)) + ".tmp";
    std::string beside = (folder / name).string();
    if (make(beside.c_str())) return beside;
    if (errno != EEXIST) return std::nullopt;
  }
}

}  // namespace

Result<std::string> read_file(const std::string& path) {
  const auto unmarked = [&](std::string text) { return without_mark(std::move(text), path); };
  if (path == "-") return read_descriptor(STDIN_FILENO, "<stdin>").and_then(unmarked);
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return fail(ErrorCode::io_failed, "cannot open: " + reason(), path);
  const auto has_end = require_end(descriptor, path);
  auto out =
      has_end ? read_descriptor(descriptor, path) : Result<std::string>(tl::unexpected(has_end.error()));
  ::close(descriptor);
  return std::move(out).and_then(unmarked);
}

std::string resolved_path(const std::string& path) {
  constexpr int kMostLinks = 40;  // where the system gives up, too
  std::error_code ec;
  fs::path target = fs::absolute(path, ec);
  for (int i = 0; i < kMostLinks && !fs::exists(target, ec) && fs::is_symlink(target, ec); ++i)
    target = target.parent_path() / fs::read_symlink(target, ec);
  const auto resolved = fs::weakly_canonical(target, ec);
  return ec ? target.string() : resolved.string();
}

Error AtomicFile::failure(const char* action) const {
  return {ErrorCode::io_failed, std::string("cannot ") + action + ": " + reason(), path_, {}};
}

Result<AtomicFile> AtomicFile::create(const std::string& path) {
  AtomicFile file;
  file.path_ = path;
  if (path == "-") {
    file.descriptor_ = ::dup(STDOUT_FILENO);
    if (file.descriptor_ < 0) return tl::unexpected(file.failure("write"));
    return file;
  }
  if (path.empty()) return fail(ErrorCode::io_failed, "cannot write: the name of the file is empty");
  const std::string target = resolved_path(path);
  struct stat status {};
  const bool exists = ::stat(target.c_str(), &status) == 0;
  if (!exists && errno == ELOOP) return tl::unexpected(file.failure("write"));
  if (exists && S_ISDIR(status.st_mode)) return fail(ErrorCode::io_failed, "cannot write: is a folder", path);
  if (exists && !S_ISREG(status.st_mode)) {
    file.descriptor_ = ::open(target.c_str(), O_WRONLY | O_CLOEXEC);
    if (file.descriptor_ < 0) return tl::unexpected(file.failure("write"));
    return file;
  }
  file.target_ = target;
  if (auto opened = file.open_beside(); !opened) return tl::unexpected(opened.error());
  return file;
}

Result<void> AtomicFile::open_beside() {
  const std::string folder = fs::path(target_).parent_path().string();
  descriptor_ = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0666);
  if (descriptor_ >= 0) return {};
  auto name = name_beside(target_, [&](const char* beside) {
    descriptor_ = ::open(beside, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    return descriptor_ >= 0;
  });
  if (!name) return tl::unexpected(failure("write"));
  temporary_ = std::move(*name);
  return {};
}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      temporary_(std::exchange(other.temporary_, {})),
      held_(std::move(other.held_)),
      spooled_(other.spooled_),
      spool_(std::exchange(other.spool_, -1)),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (spool_ >= 0) ::close(spool_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

Result<void> AtomicFile::write(std::string_view bytes) {
  if (target_.empty()) {
    held_ += bytes;
    constexpr std::size_t kMostHeld = 1 << 20;
    return held_.size() < kMostHeld ? Result<void>{} : spool();
  }
  return write_through(bytes);
}

Result<void> AtomicFile::spool() {
  if (spool_ < 0) {
    std::error_code ec;
    const std::string folder = fs::temp_directory_path(ec).string();
    spool_ = ec ? -1 : ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (spool_ < 0) return {};
  }
  if (auto written = write_to(spool_, held_); !written) return written;
  spooled_ += held_.size();
  held_.clear();
  return {};
}

Result<void> AtomicFile::write_through(std::string_view bytes) {
  return write_to(descriptor_, bytes);
}

Result<void> AtomicFile::write_to(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(descriptor, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return tl::unexpected(failure("write"));
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  return {};
}

Result<void> AtomicFile::overwrite(std::size_t offset, std::string_view bytes) {
  int descriptor = descriptor_;
  if (target_.empty()) {
    const std::size_t in_spool = offset < spooled_ ? std::min(bytes.size(), spooled_ - offset) : 0;
    const std::size_t in_held = offset + in_spool - spooled_;
    if (in_spool < bytes.size()) held_.replace(in_held, bytes.size() - in_spool, bytes.substr(in_spool));
    bytes = bytes.substr(0, in_spool);
    descriptor = spool_;
  }
  while (!bytes.empty()) {
    const ssize_t n = ::pwrite(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return tl::unexpected(failure("write"));
    bytes.remove_prefix(static_cast<std::size_t>(n));
    offset += static_cast<std::size_t>(n);
  }
  return {};
}

Result<void> AtomicFile::read_back(const std::function<void(std::string_view)>& take) const {
  const bool is_held = target_.empty();
  if (is_held && spool_ < 0) {
    take(held_);
    return {};
  }
  std::array<char, 1 << 16> buffer;
  for (off_t at = 0;;) {
    const ssize_t n = ::pread(is_held ? spool_ : descriptor_, buffer.data(), buffer.size(), at);
    if (n == 0) {
      if (is_held) take(held_);
      return {};
    }
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return tl::unexpected(failure("read back"));
    take({buffer.data(), static_cast<std::size_t>(n)});
    at += n;
  }
}

Result<void> AtomicFile::commit() {
  if (target_.empty()) {
    Result<void> out;
    auto done = read_back([&](std::string_view piece) {
      if (out) out = write_through(piece);
    });
    return done ? out : done;
  }
  struct stat status {};
  // Keep who may read the file that is replaced; a failure is no loss of data.
  if (::stat(target_.c_str(), &status) == 0) static_cast<void>(::fchmod(descriptor_, status.st_mode & 07777));
  // fsync tells of a full disk or a lost network share before the old file is gone.
  int synced = ::fsync(descriptor_);
  while (synced != 0 && errno == EINTR) synced = ::fsync(descriptor_);
  if (synced != 0 && errno != EINVAL && errno != EROFS) return tl::unexpected(failure("write"));
  if (temporary_.empty()) {
    const std::string self = "/proc/self/fd/" + std::to_string(descriptor_);
    const auto link_as = [&](const char* name) {
      return ::linkat(AT_FDCWD, self.c_str(), AT_FDCWD, name, AT_SYMLINK_FOLLOW) == 0;
    };
    if (link_as(target_.c_str())) return {};
    // One that stands there can only be replaced by a file that has a name.
    auto name = name_beside(target_, link_as);
    if (!name) return tl::unexpected(failure("write"));
    temporary_ = std::move(*name);
  }
  if (::close(std::exchange(descriptor_, -1)) != 0) return tl::unexpected(failure("write"));
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) return tl::unexpected(failure("rename into place"));
  temporary_.clear();
  return {};
}

Result<void> write_file(const std::string& path, std::string_view bytes) {
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected(file.error());
  if (auto written = file->write(bytes); !written) return written;
  return file->commit();
}

}  // namespace trunnion
