#pragma once
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include "trunnion/base/result.hpp"

namespace trunnion {

/// Whole content of a file without the byte order mark of UTF-8; `-` is standard input. Fails with io_failed
/// (missing, a folder, a device, unreadable), and with wrong_input for text in UTF-16.
Result<std::string> read_file(const std::string& path);

/// The place that a path names, absolute and with symbolic links followed, those to a file that does not
/// exist yet too: equal for two paths of one file.
std::string resolved_path(const std::string& path);

/// A file that either appears complete or not at all: bytes go to an unnamed file in the folder of `path` (a
/// hidden name where the file system has no unnamed files), `commit` flushes to the disk and renames into
/// place. Destroyed or killed without commit, it leaves nothing behind; killed in the instant of replacing a
/// file, the complete new one under a hidden name. Symbolic links at `path` are followed. For `-` (standard
/// output), a device or a pipe the bytes are held, from a megabyte on in an unnamed file of the folder for
/// temporary files, and written at commit.
class AtomicFile {
 public:
  static Result<AtomicFile> create(const std::string& path);
  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&&) = delete;
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();

  /// Fails with io_failed, naming the reason (disk full, ...).
  Result<void> write(std::string_view bytes);
  /// Replaces bytes that were written already, from `offset` on. Only before commit.
  Result<void> overwrite(std::size_t offset, std::string_view bytes);
  /// Gives everything that was written, piece by piece. Only before commit.
  Result<void> read_back(const std::function<void(std::string_view)>& take) const;
  Result<void> commit();

 private:
  AtomicFile() = default;
  Result<void> open_beside();
  Result<void> write_through(std::string_view bytes);
  Result<void> write_to(int descriptor, std::string_view bytes);
  /// What is held goes to the unnamed file; where there is none it stays.
  Result<void> spool();
  Error failure(const char* action) const;
  std::string path_;       // as the user wrote it, for messages
  std::string target_;     // resolved; empty when bytes are held
  std::string temporary_;  // hidden name that exists on the disk; empty while the file is unnamed
  std::string held_;       // behind what was spooled
  std::size_t spooled_ = 0;
  int spool_ = -1;
  int descriptor_ = -1;
};

/// Writes `bytes` to `path` through an AtomicFile.
Result<void> write_file(const std::string& path, std::string_view bytes);

}  // namespace trunnion
