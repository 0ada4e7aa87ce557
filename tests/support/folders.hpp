#pragma once

#include <string>

namespace trunnion::test {

// Folder of the sources and of the build, absolute. Only one source knows them, so that a compiler cache
// serves every checkout.
const std::string& source_folder();
const std::string& binary_folder();

}  // namespace trunnion::test
