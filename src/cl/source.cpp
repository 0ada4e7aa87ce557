#include "cl/source.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace trunnion::cl {

namespace {

class FileSource final : public TextSource {
 public:
  FileSource(std::string path, int descriptor, bool owned)
      : path_(std::move(path)), descriptor_(descriptor), owned_(owned) {}
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;
  ~FileSource() override {
    if (owned_) ::close(descriptor_);
  }

  Result<std::size_t> read(char* buffer, std::size_t capacity) override {
    for (;;) {
      const ssize_t count = ::read(descriptor_, buffer, capacity);
      if (count >= 0) return static_cast<std::size_t>(count);
      if (errno != EINTR) {
        return fail(ErrorCode::io_failed, std::string("cannot read: ") + std::strerror(errno), path_);
      }
    }
  }

 private:
  std::string path_;
  int descriptor_;
  bool owned_;
};

}  // namespace

Result<std::size_t> MemorySource::read(char* buffer, std::size_t capacity) {
  const std::size_t count = std::min(capacity, text_.size() - offset_);
  std::memcpy(buffer, text_.data() + offset_, count);
  offset_ += count;
  return count;
}

Result<std::unique_ptr<TextSource>> open_source(const std::string& path) {
  if (path == "-") return std::make_unique<FileSource>(path, STDIN_FILENO, false);
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    return fail(ErrorCode::io_failed, std::string("cannot open: ") + std::strerror(errno), path);
  }
  auto source = std::make_unique<FileSource>(path, descriptor, true);
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) return source;
  if (S_ISDIR(status.st_mode)) return fail(ErrorCode::io_failed, "is a folder, not a file", path);
  if (S_ISCHR(status.st_mode) || S_ISBLK(status.st_mode))
    return fail(ErrorCode::io_failed, "is a device, not a file", path);
  return source;
}

}  // namespace trunnion::cl
