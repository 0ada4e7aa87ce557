#include "post/intake/nc_source.hpp"

#include <algorithm>
#include <utility>

namespace trunnion::post {
namespace {

constexpr std::size_t kPiece = 1 << 14;  // characters that are read at once

// Quanta of a billionth: those of other people's words, and of inches with five decimals.
nc::Controller for_reading(nc::Controller controller) {
  constexpr int kDecimals = 9;
  constexpr int kFeedDecimals = 6;
  controller.numbers.axes = nc::AxisFormat(kDecimals, kDecimals);
  controller.numbers.feed.per_minute_decimals = kFeedDecimals;
  controller.numbers.feed.inverse_time_decimals = kFeedDecimals;
  controller.silent.insert(controller.silent.end(), controller.input.lines.silent.begin(),
                           controller.input.lines.silent.end());
  return controller;
}

nc::ReaderOptions reading(const NcWalk::Keep& keep) {
  nc::ReaderOptions out;
  out.others = true;
  if (keep.reading.units) out.inches = keep.reading.units == cl::ReaderOptions::Units::inch;
  return out;
}

}  // namespace

NcSource::NcSource(std::unique_ptr<cl::TextSource> source, const std::string& file, const NcOrigin& origin,
                   const NcWalk::Keep& keep, Diagnostics& diagnostics)
    : source_(std::move(source)),
      file_(file),
      controller_(for_reading(*origin.controller)),
      origin_{origin.machine, &controller_, origin.path, origin.words},
      walk_(origin_, keep, file, diagnostics),
      reader_(
          controller_, file, diagnostics,
          [this](const nc::Block& block) {
            walk_.take(block, {reader_.line(), 1});
          },
          reading(keep)),
      diagnostics_(diagnostics),
      buffer_(kPiece, '\0') {}

void NcSource::refill(std::vector<cl::Record>& queue) {
  walk_.records().clear();
  while (!ended_ && walk_.records().empty()) {
    const auto size = source_->read(buffer_.data(), buffer_.size());
    if (!size) {
      failure_ = size.error();
      diagnostics_.error(file_, {}, size.error().message);
      ended_ = true;
    } else if (*size == 0) {
      static_cast<void>(reader_.finish());  // what it fails with is among the diagnostics
      if (!walk_.has_moved() && !diagnostics_.has_errors())
        diagnostics_.error(file_, {}, "the program has no motion to a place where all axes are known");
      ended_ = true;
    } else {
      reader_.feed({buffer_.data(), *size});
    }
  }
  queue.swap(walk_.records());
}

}  // namespace trunnion::post
