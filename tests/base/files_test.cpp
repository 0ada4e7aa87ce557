#include "trunnion/base/files.hpp"

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <sys/stat.h>

namespace trunnion {
namespace {

namespace fs = std::filesystem;

class Files : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("trunnion_files_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const char* name) const { return (folder_ / name).string(); }
  std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator{}));
  }
  fs::path folder_;
};

TEST_F(Files, WrittenFileReadsBack) {
  ASSERT_TRUE(write_file(path("a.nc"), "G1 X1\n"));
  EXPECT_EQ(read_file(path("a.nc")).value(), "G1 X1\n");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(Files, WithoutCommitNothingAppears) {
  {
    auto file = AtomicFile::create(path("a.nc"));
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->write("half"));
  }
  EXPECT_EQ(entries(), 0u);
}

TEST_F(Files, OldContentStaysUntilCommit) {
  ASSERT_TRUE(write_file(path("a.nc"), "old"));
  auto file = AtomicFile::create(path("a.nc"));
  ASSERT_TRUE(file->write("new"));
  EXPECT_EQ(read_file(path("a.nc")).value(), "old");
  ASSERT_TRUE(file->commit());
  EXPECT_EQ(read_file(path("a.nc")).value(), "new");
}

TEST_F(Files, WrittenBytesCanBeOverwrittenBeforeCommit) {
  auto file = AtomicFile::create(path("a.nc"));
  ASSERT_TRUE(file->write("(PENDING)\n"));
  ASSERT_TRUE(file->write("G1 X1\n"));
  ASSERT_TRUE(file->overwrite(1, "PASSED!"));
  ASSERT_TRUE(file->write("M2\n"));
  ASSERT_TRUE(file->commit());
  EXPECT_EQ(read_file(path("a.nc")).value(), "(PASSED!)\nG1 X1\nM2\n");
}

TEST_F(Files, LinkIsFollowedAndStays) {
  ASSERT_TRUE(write_file(path("real.nc"), "old"));
  fs::create_symlink(path("real.nc"), path("link.nc"));
  ASSERT_TRUE(write_file(path("link.nc"), "new"));
  EXPECT_TRUE(fs::is_symlink(path("link.nc")));
  EXPECT_EQ(read_file(path("real.nc")).value(), "new");
}

TEST_F(Files, LinkToAFileThatDoesNotExistIsFollowedAndStays) {
  fs::create_directory(path("programs"));
  fs::create_symlink("programs/real.nc", path("link.nc"));
  fs::create_symlink("link.nc", path("link_to_it.nc"));
  ASSERT_TRUE(write_file(path("link_to_it.nc"), "new"));
  EXPECT_TRUE(fs::is_symlink(path("link.nc")));
  EXPECT_TRUE(fs::is_symlink(path("link_to_it.nc")));
  EXPECT_EQ(read_file(path("programs/real.nc")).value(), "new");
  fs::create_symlink("missing/real.nc", path("lost.nc"));
  EXPECT_EQ(write_file(path("lost.nc"), "").error().message, "cannot write: No such file or directory");
  fs::create_symlink("circle.nc", path("circle.nc"));
  EXPECT_FALSE(write_file(path("circle.nc"), ""));
  EXPECT_TRUE(fs::is_symlink(path("circle.nc")));
}

TEST_F(Files, EmptyNameIsAnError) {
  EXPECT_EQ(write_file("", "lost").error().message, "cannot write: the name of the file is empty");
}

TEST_F(Files, LongestNameIsWritten) {
  const std::string name(255, 'n');
  ASSERT_TRUE(write_file(path(name.c_str()), "text"));
  EXPECT_EQ(read_file(path(name.c_str())).value(), "text");
}

TEST_F(Files, WhatAKilledProcessOfTheSameNumberLeftIsNotInTheWay) {
  constexpr int kLeft = 200;  // more than this program has written by now
  for (int i = 0; i < kLeft; ++i) {
    std::ofstream(folder_ / (".trunnion-" + std::to_string(::getpid()) + "-" + std::to_string(i) + ".tmp"))
        << "left";
  }
  ASSERT_TRUE(write_file(path("a.nc"), "text"));
  EXPECT_EQ(entries(), kLeft + 1u);
}

TEST_F(Files, PathsOfOneFileResolveToOnePlace) {
  fs::create_directory(path("real"));
  fs::create_directory_symlink("real", path("linked"));
  EXPECT_EQ(resolved_path(path("real/../linked/a.nc")), resolved_path(path("real/a.nc")));
  EXPECT_NE(resolved_path(path("real/a.nc")), resolved_path(path("real/b.nc")));
  EXPECT_EQ(resolved_path("no_such_folder/a.nc"), resolved_path("./no_such_folder//a.nc"));
}

TEST_F(Files, OnlyWhatHasAnEndIsRead) {
  for (const std::string device : {"/dev/zero", "/dev/null"}) {
    const auto text = read_file(device);
    ASSERT_FALSE(text);
    EXPECT_EQ(text.error().text(), device + ": error: cannot read: is a device, not a file");
    EXPECT_EQ(text.error().code, ErrorCode::io_failed);
  }
}

TEST_F(Files, DevicesAreWrittenNotReplaced) {
  ASSERT_TRUE(write_file("/dev/null", "x"));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  const auto full = write_file("/dev/full", "x");
  ASSERT_FALSE(full);
  EXPECT_EQ(full.error().code, ErrorCode::io_failed);
  EXPECT_EQ(full.error().text(), "/dev/full: error: cannot write: No space left on device");
}

TEST_F(Files, MissingFolderAndFolderAreNamed) {
  EXPECT_EQ(write_file(path("no/such/a.nc"), "").error().code, ErrorCode::io_failed);
  EXPECT_EQ(write_file(folder_.string(), "").error().message, "cannot write: is a folder");
  EXPECT_EQ(read_file(path("missing.cls")).error().message, "cannot open: No such file or directory");
}

// Beyond a megabyte the text waits outside memory: it comes back as it was written, and changed where it was.
TEST(AtomicFile, ALargeTextForADeviceIsHeldWhole) {
  auto file = AtomicFile::create("/dev/null");
  ASSERT_TRUE(file);
  std::string wanted;
  for (int i = 0; i < 60; ++i) {
    const std::string piece(50021, static_cast<char>('a' + i % 26));
    ASSERT_TRUE(file->write(piece));
    wanted += piece;
  }
  for (const std::size_t at : {std::size_t{7}, std::size_t{(1 << 20) - 3}, std::size_t{1050400},
                               std::size_t{2100870}, wanted.size() - 9}) {
    const std::string mark = "[" + std::to_string(at % 1000) + "]";
    ASSERT_TRUE(file->overwrite(at, mark));
    wanted.replace(at, mark.size(), mark);
  }
  // Across every place where what is spooled may end.
  for (std::size_t at = 50021; at + 50021 < wanted.size(); at += 50021) {
    ASSERT_TRUE(file->overwrite(at - 2, "12345"));
    wanted.replace(at - 2, 5, "12345");
  }
  std::string got;
  ASSERT_TRUE(file->read_back([&](std::string_view piece) { got += piece; }));
  EXPECT_TRUE(got == wanted);
  EXPECT_TRUE(file->commit());
}

}  // namespace
}  // namespace trunnion
