#pragma once
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <string>
#include <sys/wait.h>

#include "trunnion/base/files.hpp"

#include "support/folder_test.hpp"
#include "support/folders.hpp"

namespace trunnion::test {

/// The program as a user runs it, in a folder of its own.
class CommandTest : public FolderTest {
 protected:
  struct Outcome {
    int code = -1;
    std::string messages, output;
  };

  std::string text(const std::string& name) const {
    return read_file((folder_ / name).string()).value_or("");
  }
  void write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name) << bytes;
  }
  /// Runs `words` in the folder, after `before` (for the shell).
  Outcome run(const std::string& words, const std::string& before = "",
              const std::string& program = binary_folder() + "/trunnion") const {
    const std::string line =
        "cd '" + folder_.string() + "' && " + before + " '" + program + "' " + words + " 2>messages >output";
    const int status = std::system(line.c_str());  // NOLINT(concurrency-mt-unsafe): one thread
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text("messages"), text("output")};
  }
};

}  // namespace trunnion::test
