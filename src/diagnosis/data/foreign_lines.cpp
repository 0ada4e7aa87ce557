#include "diagnosis/data/foreign_lines.hpp"

#include <algorithm>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/printable.hpp"

namespace trunnion::diagnosis {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const auto from = text.find_first_not_of(kBlank);
  if (from == std::string_view::npos) return {};
  return text.substr(from, text.find_last_not_of(kBlank) - from + 1);
}

std::vector<ForeignLine> lines_of(std::string_view text) {
  std::vector<ForeignLine> out;
  std::uint32_t number = 0;
  while (!text.empty()) {
    const auto end = std::min(text.find('\n'), text.size());
    const std::string_view content = trimmed(text.substr(0, end));
    const std::size_t blanks = content.empty() ? 0 : static_cast<std::size_t>(content.data() - text.data());
    out.push_back({content, ++number, static_cast<std::uint32_t>(blanks + 1)});
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> out;
  for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
    const auto end = std::min(text.find_first_of(" \t"), text.size());
    out.push_back(text.substr(0, end));
    text.remove_prefix(end);
  }
  return out;
}

std::vector<double> numbers_of(const ForeignLine& line, const std::string& file, Diagnostics& diagnostics) {
  std::vector<double> out;
  for (const std::string_view word : words_of(line.text)) {
    const ParsedNumber number = parse_number(word);
    if (!number)
      diagnostics.error(
          file, {line.number, line.column + static_cast<std::uint32_t>(word.data() - line.text.data())},
          "'" + printable(std::string(word)) + "' is not a number");
    out.push_back(number.value);
  }
  return out;
}

DealtReadings::DealtReadings(const Machine& machine, std::size_t parts) : machine_(machine) {
  for (std::size_t k = 0; k < std::max<std::size_t>(parts, 1); ++k)
    context_.runs.push_back({"part_" + std::to_string(k + 1)});
}

void DealtReadings::at(const JointVector& q) {
  MachineState state;
  state.q = q;
  state.run = states_.size() % context_.runs.size();
  states_.push_back(state);
  rows_.push_back({.file = 0, .line = 0, .tool_mm = machine_.tool_vector()});
}

void DealtReadings::add(Quantity quantity, const Vec3& n, double value, double u_random) {
  Reading& r = readings_.emplace_back();
  r.row = rows_.size() - 1;
  r.quantity = quantity;
  r.n = n;
  r.value = value;
  r.u_random = u_random;
  r.u_common = 0.0;
}

std::string DealtReadings::text(const std::vector<std::string>& comments) {
  context_.runs.resize(std::min(context_.runs.size(), states_.size()));
  const Dataset data = make_dataset(context_, states_, rows_, readings_);
  return measurements_text(data, machine_, comments);
}

}  // namespace trunnion::diagnosis
