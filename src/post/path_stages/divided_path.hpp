#pragma once
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "trunnion/machine/kinematics.hpp"

#include "post/intake/queued_records.hpp"

namespace trunnion::post {

/// A path whose cuts are divided into equal parts: their points stand on the programmed segment, the tool
/// axis on its great circle, so that the path stays what it is. Parts are made as they are asked for.
///
/// Not divided: rapids; motions whose begin is no place of the path (the first one, the first behind a tool
/// change or a word that may turn the table); taps.
class DividedPath final : public QueuedRecords {
 public:
  /// How many times a cut is as long as a part may be; it goes into so many parts, rounded up but for a
  /// billionth: three times 0.1 are three parts. 1 and less, or no number, leave it whole.
  using Rule = std::function<double(const ToolPose& from, const ToolPose& to)>;

  DividedPath(std::unique_ptr<cl::RecordSource> path, Rule rule)
      : path_(std::move(path)), rule_(std::move(rule)) {}

  const std::optional<Error>& read_failure() const override { return path_->read_failure(); }
  const cl::Resolution& resolution() const override { return path_->resolution(); }

 private:
  static constexpr std::size_t kAtATime = 32;
  /// A motion on its way out, part by part.
  struct Division {
    cl::Record whole;
    ToolPose from;
    std::uint64_t count = 1, next = 1;
    bool is_done() const { return next > count; }
  };

  void refill(std::vector<cl::Record>& queue) override;
  bool next_record(cl::Record& record);
  Division division_of(cl::Record record);
  static void put_part(Division& division, std::vector<cl::Record>& queue);
  void put_shape(const cl::Record& begin, std::vector<cl::Record>& queue);

  std::unique_ptr<cl::RecordSource> path_;
  Rule rule_;
  std::optional<ToolPose> from_;  // where the tool stands on the path
  Division division_{{}, {}, 1, 2};
  std::size_t tap_left_ = 0;  // motions of a tap that are to come
  /// Cuts that were read at once.
  struct Cuts {
    std::array<cl::PlainCut, kAtATime> cuts;
    cl::Feed feed;
    std::size_t next = 0, count = 0;
  } ahead_;
};

}  // namespace trunnion::post
