// Lines of the live loop: JSON and XML, in any order.
#include "trunnion/report/thermal_service.hpp"

#include "fuzz/thermal_model.hpp"

using namespace trunnion;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  report::ThermalService service(fuzz::thermal_model(), {});
  std::string text(reinterpret_cast<const char*>(data), size);
  double now_s = 0.0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string answer = service.handle(text.substr(begin, end - begin), now_s += 1.0);
    fuzz::hold(!answer.empty() && answer.find('\n') == std::string::npos, "an answer is one line");
    fuzz::hold(answer.find("null") == std::string::npos || answer.find("error") != std::string::npos,
               "a correction is a number");
    begin = end + 1;
  }
  return 0;
}
