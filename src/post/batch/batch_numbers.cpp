#include <algorithm>
#include <filesystem>
#include <map>

#include "trunnion/post/batch.hpp"

namespace trunnion::post {

void warn_of_equal_numbers(const std::vector<BatchResult>& results, Diagnostics& diagnostics) {
  std::map<std::int64_t, std::vector<const BatchResult*>> of_number;
  for (const BatchResult& r : results)
    if (r.program_number > 0) of_number[r.program_number].push_back(&r);
  std::erase_if(of_number, [](const auto& entry) { return entry.second.size() < 2; });
  if (of_number.empty()) return;
  const auto& [number, programs] =
      *std::max_element(of_number.begin(), of_number.end(),
                        [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
  constexpr std::size_t kNamed = 3;
  std::string names;
  for (std::size_t i = 0; i < std::min(kNamed, programs.size()); ++i)
    names += (i == 0 ? "" : ", ") + std::filesystem::path(programs[i]->item.output).filename().string();
  if (programs.size() > kNamed) names += " and " + std::to_string(programs.size() - kNamed) + " more";
  std::string message =
      std::to_string(programs.size()) + " programs of this batch have number " + std::to_string(number) +
      " (" + names +
      "): a control that knows programs by their number keeps one of them. Digits in PARTNO or "
      "in the file's name make the number";
  if (of_number.size() > 1)
    message += "; so it is with " + std::to_string(of_number.size() - 1) +
               (of_number.size() == 2 ? " other number" : " other numbers");
  diagnostics.warning("", {}, message);
}

}  // namespace trunnion::post
