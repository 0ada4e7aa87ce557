#include "probe/head_lines.hpp"

#include <array>
#include <cctype>
#include <sstream>

#include "trunnion/base/number_text.hpp"

namespace trunnion::probe {
namespace {

struct Length {
  const char* name;
  double Ball::*value;
};
constexpr std::array<Length, 5> kLengths = {{{"ball radius", &Ball::radius_mm},
                                             {"stylus radius", &Ball::stylus_radius_mm},
                                             {"stylus length", &Ball::stylus_length_mm},
                                             {"ball within", &Ball::within_mm},
                                             {"clearance", &Ball::clearance_mm}}};
constexpr const char* kPlace = "ball at";
constexpr const char* kStem = "stem to";
constexpr const char* kBody = "probe body";
constexpr int kDecimals = 4;

std::string lower(std::string text) {
  for (char& ch : text) ch = static_cast<char>(std::tolower(static_cast<unsigned char>(ch)));
  return text;
}

}  // namespace

std::vector<std::string> head_lines(const Ball& ball) {
  std::vector<std::string> out = {"touches of a ball on the table; lengths in mm"};
  std::string place = std::string(kPlace) + ":";
  for (int i = 0; i < 3; ++i) place += " " + fixed_text(ball.place_P[i], kDecimals);
  out.push_back(place + " in the part");
  for (const Length& length : kLengths)
    out.push_back(std::string(length.name) + ": " + fixed_text(ball.*(length.value), kDecimals));
  if (ball.stem) {
    std::string stem = std::string(kStem) + ":";
    for (int i = 0; i < 3; ++i) stem += " " + fixed_text(ball.stem->end_P[i], kDecimals);
    out.push_back(stem + " " + fixed_text(ball.stem->radius_mm, kDecimals) + " in the part, and its radius");
  }
  if (ball.body) {
    out.push_back(std::string(kBody) + ": " + fixed_text(ball.body->radius_mm, kDecimals) + " " +
                  fixed_text(ball.body->above_mm, kDecimals) +
                  " its radius, and how far over the stylus ball it begins");
  }
  return out;
}

bool HeadReader::take(const std::string& comment) {
  const std::string text = lower(comment);
  std::istringstream rest(text);
  std::string name;
  if (!std::getline(rest, name, ':') || rest.eof()) return false;
  std::array<double, 4> numbers{};
  std::size_t count = 0;
  for (std::string word; count < numbers.size() && rest >> word; ++count) {
    const auto number = parse_number(word);
    if (!number) break;
    numbers[count] = number.value;
  }
  if (name == kPlace && count == 3) {
    ball_.place_P = {numbers[0], numbers[1], numbers[2]};
    seen_ |= 1U;
    return true;
  }
  if (name == kStem && count == 4) {
    ball_.stem = Stem{{numbers[0], numbers[1], numbers[2]}, numbers[3]};
    return true;
  }
  if (name == kBody && count == 2) {
    ball_.body = ProbeBody{numbers[0], numbers[1]};
    return true;
  }
  for (std::size_t i = 0; i < kLengths.size(); ++i) {
    if (name != kLengths[i].name || count < 1) continue;
    ball_.*(kLengths[i].value) = numbers[0];
    seen_ |= 2U << i;
    return true;
  }
  return false;
}

std::optional<std::string> HeadReader::missing() const {
  if ((seen_ & 1U) == 0) return kPlace;
  for (std::size_t i = 0; i < kLengths.size(); ++i) {
    if ((seen_ & (2U << i)) == 0) return kLengths[i].name;
  }
  return std::nullopt;
}

}  // namespace trunnion::probe
