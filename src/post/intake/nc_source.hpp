#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "trunnion/cl/reader.hpp"
#include "trunnion/nc/reader.hpp"
#include "trunnion/post/nc_origin.hpp"
#include "trunnion/post/post.hpp"

#include "post/intake/nc_walk.hpp"
#include "post/intake/queued_records.hpp"

namespace trunnion::post {

/// An NC program as a source of the records of a CL path, read piece by piece.
class NcSource final : public QueuedRecords {
 public:
  /// `origin`, the tools of `keep` and `diagnostics` must outlive the object.
  NcSource(std::unique_ptr<cl::TextSource> source, const std::string& file, const NcOrigin& origin,
           const NcWalk::Keep& keep, Diagnostics& diagnostics);

  const std::optional<Error>& read_failure() const override { return failure_; }
  /// Words are exact: the tool axis is what they say.
  const cl::Resolution& resolution() const override { return resolution_; }

 private:
  void refill(std::vector<cl::Record>& queue) override;

  std::unique_ptr<cl::TextSource> source_;
  std::string file_;
  nc::Controller controller_;  // with digits that hold those of other people's words, and inches
  NcOrigin origin_;            // with it
  NcWalk walk_;
  nc::Reader reader_;
  Diagnostics& diagnostics_;
  std::string buffer_;
  bool ended_ = false;
  std::optional<Error> failure_;
  cl::Resolution resolution_;
};

}  // namespace trunnion::post
