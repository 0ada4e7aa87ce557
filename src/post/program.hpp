#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "trunnion/cl/reader.hpp"
#include "trunnion/post/post.hpp"

#include "post/feeds/feed_ahead.hpp"
#include "post/intake/intake.hpp"
#include "post/judging/read_back.hpp"
#include "post/making/pipeline.hpp"

namespace trunnion::post {

/// One program on its way through the stages (`stages`): the intake reads and chooses, what follows gets one
/// chunk after the other. One thread runs the stages in turn; with several, chunks are on their way at once.
/// The stages do not see the difference, so that the text is the same.
class Program {
 public:
  Program(std::unique_ptr<cl::TextSource> source, const PostJob& job, const PostOptions& options,
          const TextSink& sink, Diagnostics& diagnostics);

  Result<PostReport> run();

 private:
  /// The next chunk of the file; null at its end. Behind an error there are none, but the file is read on:
  /// all findings in it are to be told.
  std::unique_ptr<Chunk> next();
  /// The next record; a tolerance in it that the words cannot keep is an error.
  bool read();
  /// The smallest rounding error of the words of such axes, mm or rad; 0 where they are not rounded.
  double half_a_digit(AxisKind kind) const;
  Result<void> may_keep_tolerances() const;
  /// What is done with a chunk.
  struct Stage {
    enum class Order : std::uint8_t { of_file, any };
    Order order = Order::of_file;
    std::function<void(Chunk&)> work;
  };
  /// All stages behind the intake, in their order. `prepare`: the first of them, of the thread at hand.
  std::array<Stage, 4> stages(std::function<void(Chunk&)> prepare);
  void look_ahead(Chunk& chunk);
  void emit(Chunk& chunk);
  void pass_on(Chunk& chunk);
  Result<PostReport> finish();
  void run_in_turn();
  void run_in_parallel();

  const PostJob& job_;
  const PostOptions& options_;
  Diagnostics& diagnostics_;
  std::size_t errors_before_;
  Pipeline pipeline_;
  ReadBack read_back_;
  FeedAhead feeds_;
  ChunkStore store_;
  Intake intake_;
  std::unique_ptr<cl::RecordSource> records_;
  cl::Record record_;
  std::array<cl::PlainCut, Intake::kMostCuts> cuts_;
  bool ended_ = false;
  bool choice_failed_ = false;
  struct Failures {
    std::optional<Error> emit, pass_on;
  } failures_;
};

}  // namespace trunnion::post
