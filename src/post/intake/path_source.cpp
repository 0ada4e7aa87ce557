#include "post/intake/path_source.hpp"

#include <utility>

#include "post/intake/nc_source.hpp"

namespace trunnion::post {

std::unique_ptr<cl::RecordSource> records_of(PathText text, const PathReading& with,
                                             Diagnostics& diagnostics) {
  if (text.from == nullptr)
    return std::make_unique<cl::Reader>(std::move(text.source), text.file, text.reading, diagnostics);
  const NcWalk::Keep keep{text.reading, with};
  return std::make_unique<NcSource>(std::move(text.source), text.file, *text.from, keep, diagnostics);
}

}  // namespace trunnion::post
