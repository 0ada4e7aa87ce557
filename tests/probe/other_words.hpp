#pragma once
// Probing programs of other controls in the words that run_probing follows, and their logs: written apart
// from the program's own readers and writers.
#include <map>
#include <sstream>
#include <string>

namespace trunnion::test {

// "C=DC(30)" becomes "C30"; a measuring block a touch, one that guards a plain motion.
inline std::string siemens_for_runner(const std::string& program) {
  std::string out;
  std::istringstream lines(program);
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line[0] == 'N') line.erase(0, line.find(' ') + 1);
    const bool moves = line.rfind("MEAS", 0) == 0 || line.rfind("SUPA", 0) == 0 || line.rfind("G0", 0) == 0 ||
                       line.rfind("G1 ", 0) == 0 || line.find_first_of("XYZ") == 0;
    if (!moves) continue;
    if (line.find("SUPA") != std::string::npos) {
      out += "G53\n";
      continue;
    }
    for (auto at = line.find("=DC("); at != std::string::npos; at = line.find("=DC(")) {
      line.erase(line.find(')', at), 1);
      line.erase(at, 4);
    }
    if (line.rfind("MEAS=1 G1", 0) == 0)
      line.replace(0, 9, "G38.2");
    else if (const auto at = line.find(" MEAS=1"); at != std::string::npos)
      line.erase(at);
    out += line + "\n";
  }
  return out;
}

// Klartext: positions as L, a touch as touch probe cycle 4 from where the stylus stands.
inline std::string klartext_for_runner(const std::string& program) {
  std::string out;
  std::map<char, double> at{{'X', 0}, {'Y', 0}, {'Z', 0}}, way = at;
  std::istringstream lines(program);
  for (std::string line; std::getline(lines, line);) {
    line.erase(0, line.find(' ') + 1);
    if (line.find("M91") != std::string::npos) {
      out += "G53\n";
      continue;
    }
    std::istringstream words(line);
    std::string first;
    words >> first;
    if (first == "L") {
      out += line.find("FMAX") != std::string::npos ? "G0" : "G1";
      for (std::string word; words >> word;) {
        if (word == "FMAX" || word == "R0") continue;
        if (at.count(word[0]) != 0) at[word[0]] = std::stod(word.substr(1));
        out += " " + word;
      }
      out += "\n";
    }
    if (line.rfind("TCH PROBE 4.2", 0) == 0) {
      for (std::string word; words >> word;) {
        if (word.size() > 2 && word[0] == 'I') way[word[1]] = std::stod(word.substr(2));
      }
    }
    if (line.rfind("TCH PROBE 4.3", 0) == 0) {
      out += "G38.2";
      for (const char axis : {'X', 'Y', 'Z'})
        out += std::string(" ") + axis + std::to_string(at[axis] + way[axis]);
      const auto feed = line.find(" F");
      out += line.substr(feed, line.find(' ', feed + 1) - feed) + "\n";
    }
  }
  return out;
}

// The first three numbers of each line of a log, as `format` (of printf) has them.
inline std::string log_as(const std::string& log, const char* format) {
  std::string out;
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line);) {
    double x = 0.0, y = 0.0, z = 0.0;
    std::istringstream(line) >> x >> y >> z;
    std::array<char, 120> text{};
    std::snprintf(text.data(), text.size(), format, x, y, z);
    out += text.data();
  }
  return out;
}

}  // namespace trunnion::test
