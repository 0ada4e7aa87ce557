#pragma once
#include <memory>
#include <string>

#include "trunnion/cl/reader.hpp"
#include "trunnion/post/nc_origin.hpp"

namespace trunnion::post {

/// The text of a path that is not read yet: CL text, or an NC program.
struct PathText {
  std::unique_ptr<cl::TextSource> source;
  std::string file;             // for messages
  cl::ReaderOptions reading{};  // of an NC program the units and the cutter compensation
  /// What the NC program was made for; nothing: it is CL text. Must outlive the use of the text.
  const NcOrigin* from = nullptr;
};

/// The text of a program that is judged.
struct ProgramText {
  std::unique_ptr<cl::TextSource> source;
  std::string file;  // for messages
};

}  // namespace trunnion::post
