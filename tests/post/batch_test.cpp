#include "trunnion/post/batch.hpp"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <sys/stat.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include "trunnion/base/files.hpp"

#include "support/controllers.hpp"
#include "support/folders.hpp"
#include "support/machines.hpp"

namespace trunnion::post {
namespace {

namespace fs = std::filesystem;

class Batch : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("trunnion_batch_" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "in" / "deep");
    for (int i = 0; i < 6; ++i) {
      std::ofstream(folder_ / "in" / (i < 3 ? "" : "deep") / ("p" + std::to_string(i) + ".cls"))
          << (i == 5 ? "GOTO/1,2\n" : normalised(i));
    }
    Diagnostics d;
    controller_ = *nc::load_controller(test::source_folder() + "/postconfigs/controllers/linuxcnc.toml", d);
    machine_ = test::shipped_machine("paper");
    options_.fingerprint = "a";
    options_.post.tools.tool = 1;
  }
  void TearDown() override { fs::remove_all(folder_); }

  static std::string normalised(int part) {
    std::string text = "FEDRAT/MMPM,1000\nRAPID\n";
    for (int k = 0; k < 200; ++k) {
      const double tilt = 0.4 + 0.002 * k + 0.01 * part;
      text += "GOTO/" + std::to_string(10 + 0.1 * k) + ",5,1," + std::to_string(std::sin(tilt)) + ",0," +
              std::to_string(std::cos(tilt)) + "\n";
    }
    return text;
  }

  std::vector<BatchItem> items(const char* out = "out") {
    Diagnostics d;
    auto found = batch_items({(folder_ / "in").string()}, (folder_ / out).string(), d);
    EXPECT_TRUE(found);
    return found.value_or(std::vector<BatchItem>{});
  }
  std::vector<BatchResult> run(const std::vector<BatchItem>& list) {
    PostJob job;
    job.machine = &machine_;
    job.controller = &controller_;
    return run_batch(
        list, job, options_, [](const BatchResult&) {}, stop_);
  }
  std::map<std::string, std::string> files(const char* name) const {
    std::map<std::string, std::string> out;
    for (const auto& entry : fs::recursive_directory_iterator(folder_ / name)) {
      if (entry.is_regular_file())
        out[fs::relative(entry.path(), folder_ / name).string()] = *read_file(entry.path().string());
    }
    return out;
  }
  static std::size_t count(const std::vector<BatchResult>& results, BatchState state) {
    return static_cast<std::size_t>(std::count_if(results.begin(), results.end(),
                                                  [&](const BatchResult& r) { return r.state == state; }));
  }

  fs::path folder_;
  Machine machine_;
  nc::Controller controller_;
  BatchOptions options_;
  std::atomic<bool> stop_{false};
};

// A control that knows programs by their number keeps one of two: p0 has none of its own, and is 1 as p1 is.
TEST_F(Batch, WarnsOfEqualProgramNumbers) {
  Diagnostics named, first, again;
  warn_of_equal_numbers(run(items("named")), named);
  EXPECT_TRUE(named.findings().empty());  // linuxcnc knows programs by the names of their files
  controller_ = test::shipped_controller("iso");
  warn_of_equal_numbers(run(items()), first);
  ASSERT_EQ(first.findings().size(), 1U);
  EXPECT_THAT(first.findings()[0].message,
              testing::HasSubstr("2 programs of this batch have number 1 (p0.nc, p1.nc)"));
  const auto skipped = run(items());
  EXPECT_EQ(count(skipped, BatchState::skipped), 5U);
  warn_of_equal_numbers(skipped, again);
  ASSERT_EQ(again.findings().size(), 1U);
  EXPECT_EQ(again.findings()[0].message, first.findings()[0].message);
}

TEST_F(Batch, OneFailureDoesNotStopTheOthersAndUnchangedFilesAreSkipped) {
  auto results = run(items());
  EXPECT_EQ(count(results, BatchState::posted), 5u);
  EXPECT_EQ(count(results, BatchState::failed), 1u);
  EXPECT_TRUE(fs::exists(folder_ / "out" / "deep" / "p4.nc"));
  EXPECT_FALSE(fs::exists(folder_ / "out" / "deep" / "p5.nc"));
  results = run(items());
  EXPECT_EQ(count(results, BatchState::skipped), 5u);
  std::ofstream(folder_ / "out" / "p0.nc", std::ios::app) << "touched";
  options_.fingerprint = "a";
  EXPECT_EQ(count(run(items()), BatchState::posted), 1u);
  options_.fingerprint = "another machine";
  EXPECT_EQ(count(run(items()), BatchState::posted), 5u);
}

TEST_F(Batch, ShardsTogetherAreTheWhole) {
  run(items("whole"));
  for (std::size_t i = 1; i <= 3; ++i) run(shard(items("parts"), i, 3));
  EXPECT_EQ(files("whole"), files("parts"));
}

TEST_F(Batch, DryRunWritesNothing) {
  options_.dry_run = true;
  EXPECT_EQ(count(run(items()), BatchState::would_post), 6u);
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

TEST_F(Batch, ThreadsDoNotChangeAByte) {
  options_.threads = 1;
  run(items("one"));
  options_.threads = 2;
  run(items("two"));
  EXPECT_EQ(files("one"), files("two"));
}

TEST_F(Batch, TwoInputsForOneOutputAreRefused) {
  Diagnostics d;
  const std::string file = (folder_ / "in" / "p0.cls").string();
  EXPECT_FALSE(batch_items({file, file}, (folder_ / "out").string(), d));
}

TEST_F(Batch, PathsOfOneOutputAreOneOutput) {
  std::ofstream(folder_ / "m.toml") << "[[part]]\nfile = 'in/p0.cls'\noutput = 'a.nc'\n"
                                       "[[part]]\nfile = 'in/p1.cls'\noutput = 'b/.././a.nc'\n";
  Diagnostics d;
  const auto found = batch_items({(folder_ / "m.toml").string()}, (folder_ / "out").string(), d);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().text(), testing::HasSubstr("would be written to the same file"));
}

TEST_F(Batch, NoProgramGoesOverACLFile) {
  fs::copy(folder_ / "in" / "p0.cls", folder_ / "in" / "p1.nc");
  const std::string in = (folder_ / "in").string();
  Diagnostics d;
  EXPECT_FALSE(batch_items({in + "/p1.nc"}, in, d));
  EXPECT_FALSE(batch_items({in + "/p0.cls", in + "/p1.nc", in + "/p1.cls"}, in, d));
  EXPECT_TRUE(batch_items({in + "/p0.cls"}, in, d));
}

TEST_F(Batch, ManifestThatLeadsOutOfTheFolderOrNowhereIsAnErrorWithItsLine) {
  const std::string manifest = (folder_ / "m.TOML").string();
  const auto error_of = [&](const std::string& text) {
    std::ofstream(manifest) << text;
    Diagnostics d;
    const auto found = batch_items({manifest}, (folder_ / "out").string(), d);
    return found ? "none" : found.error().text();
  };
  const std::string part = "[[part]]\nfile = 'in/p0.cls'\noutput = ";
  for (const char* output : {"'../a.nc'", "'b/../../a.nc'", "'/tmp/a.nc'", "''", "'.'", "'sub/'"}) {
    EXPECT_THAT(error_of(part + output), testing::StartsWith(manifest + ":3:1: error: ")) << output;
  }
  EXPECT_EQ(error_of(part + "'sub/a.nc'"), "none");
  EXPECT_EQ(error_of("[[part]]\nfile = ''\n"), manifest + ":2:1: error: 'file' is empty");
  EXPECT_EQ(error_of("# nothing yet\n"), manifest + ": error: no [[part]] in this manifest");
}

// A link to a file stands for the file, and its program is in the folder; one to a folder is said.
TEST_F(Batch, LinksInAFolderAreNotLeftOutInSilence) {
  fs::create_directories(folder_ / "elsewhere");
  fs::copy(folder_ / "in" / "p0.cls", folder_ / "elsewhere" / "far.cls");
  fs::create_symlink("../elsewhere/far.cls", folder_ / "in" / "link.cls");
  fs::create_symlink("nothing", folder_ / "in" / "lost.cls");
  fs::create_directory_symlink("../elsewhere", folder_ / "in" / "folder");
  fs::create_directory_symlink(".", folder_ / "in" / "deep" / "circle");
  Diagnostics d;
  const auto found = batch_items({(folder_ / "in").string()}, (folder_ / "out").string(), d);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->size(), 8u);
  EXPECT_EQ(d.findings().size(), 2u);
  const auto results = run(*found);
  EXPECT_EQ(count(results, BatchState::posted), 6u);
  EXPECT_EQ(count(results, BatchState::failed), 2u);  // p5, lost
  EXPECT_TRUE(fs::exists(folder_ / "out" / "link.nc"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "elsewhere"), fs::directory_iterator{}), 1);
}

TEST_F(Batch, FolderThatCannotBeMadeIsNamed) {
  fs::create_directories(folder_ / "out");
  std::ofstream(folder_ / "out" / "deep") << "no folder";
  const auto results = run(items());
  EXPECT_EQ(count(results, BatchState::posted), 3u);
  EXPECT_EQ(results[0].outcome.error->text(),
            (folder_ / "out" / "deep").string() + ": error: cannot make the folder: Not a directory");
}

TEST_F(Batch, PipeIsNotWaitedFor) {
  ASSERT_EQ(::mkfifo((folder_ / "in" / "pipe.cls").c_str(), 0600), 0);
  fs::create_directories(folder_ / "out");
  ASSERT_EQ(::mkfifo((folder_ / "out" / "p0.nc").c_str(), 0600), 0);
  EXPECT_EQ(count(run(items()), BatchState::posted), 4u);
}

// While a batch works on a file something else, another batch, puts its own program there all the time: what
// stands there in the end is never taken for the batch's own.
TEST_F(Batch, ProgramOfAnotherBatchIsNeverTakenForOnesOwn) {
  const auto put = [&](int round) {
    std::ofstream(folder_ / "out" / ".next") << "(program " << round << " of another batch)\n";
    fs::rename(folder_ / "out" / ".next", folder_ / "out" / "p0.nc");
  };
  fs::create_directories(folder_ / "out");
  for (int round = 0; round < 100; ++round) {
    {
      const std::jthread at_work([&](const std::stop_token& done) {
        while (!done.stop_requested()) put(round);
      });
      run(items());
    }
    put(round);
    ASSERT_EQ(count(run(items()), BatchState::posted), 1u) << "round " << round;
  }
}

// Killed at 50 random moments and run again: the files of an undisturbed run, and nothing else.
TEST_F(Batch, KilledAndRunAgainEndsWithTheSameFiles) {
  run(items("undisturbed"));
  const auto expected = files("undisturbed");
  std::mt19937_64 random(1);
  for (int i = 0; i < 50; ++i) {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      options_.threads = 1;
      run(items("killed"));
      ::_exit(0);
    }
    ::usleep(static_cast<useconds_t>(std::uniform_int_distribution<int>(0, 12000)(random)));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    for (const auto& [name, text] :
         fs::exists(folder_ / "killed") ? files("killed") : std::map<std::string, std::string>{}) {
      if (!name.ends_with(".nc")) continue;
      ASSERT_EQ(text, expected.at(name)) << "after kill " << i;
    }
    if (i % 10 == 9) fs::remove_all(folder_ / "killed");
  }
  run(items("killed"));
  auto after = files("killed");
  for (auto it = after.begin(); it != after.end();)
    it = it->first.ends_with(".tmp") ? after.erase(it) : std::next(it);
  EXPECT_EQ(after, expected);
}

}  // namespace
}  // namespace trunnion::post
