// CL text of any dialect, all ways of reading it.
#include "fuzz/cl_text.hpp"

using namespace trunnion;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::read_cl(fuzz::Bytes(data, size), cl::ReaderOptions::Dialect::apt);
  return 0;
}
