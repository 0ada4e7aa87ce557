#include "support/folders.hpp"

namespace trunnion::test {

const std::string& source_folder() {
  static const std::string folder = TRUNNION_SOURCE_DIR;
  return folder;
}

const std::string& binary_folder() {
  static const std::string folder = TRUNNION_BINARY_DIR;
  return folder;
}

}  // namespace trunnion::test
