#pragma once
// LinuxCNC's interpreter (rs274), run on a program: the calls that it makes.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <sys/wait.h>
#include <vector>

#include "trunnion/base/files.hpp"

namespace trunnion::test {

inline bool has_interpreter() {
  return std::system("command -v rs274 > /dev/null 2>&1") == 0;
}

/// A motion as the interpreter prints it: six coordinates of four decimals, as text.
struct Straight {
  bool feed = false;
  std::array<std::string, 6> xyzabc;
  double feed_rate = 0.0;               // in force
  std::array<double, 3> machine_xyz{};  // with the work offset and what is added to it
  std::array<std::string, 2> center{};  // X Y, of an arc
  int turns = 0;                        // of an arc: 1 counterclockwise, -1 clockwise; 0: straight
};

struct Interpreted {
  int exit_code = -1;
  std::string messages;
  std::vector<Straight> motions;
  std::vector<std::string> taps;  // pitch and end of each thread, as it prints them
  std::vector<std::string> made;  // files that the program itself has made
};

class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "trunnion_rs274_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path = name;
  }
  ~Folder() { std::filesystem::remove_all(path); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::filesystem::path path;
};

inline Interpreted parse(const std::string& calls) {
  Interpreted out;
  std::istringstream lines(calls);
  double feed_rate = 0.0;
  std::array<double, 3> work_offset{};
  std::array<double, 3> added{};
  const auto take_offset = [](const std::string& line, const char* call, std::array<double, 3>& offset) {
    const auto at = line.find(call);
    if (at == std::string::npos) return;
    std::string numbers = line.substr(at + std::string(call).size());
    std::replace(numbers.begin(), numbers.end(), ',', ' ');
    std::istringstream values(numbers);
    for (double& v : offset) values >> v;
  };
  for (std::string line; std::getline(lines, line);) {
    if (const auto at = line.find("SET_FEED_RATE("); at != std::string::npos) {
      feed_rate = std::stod(line.substr(at + 14));
    }
    for (const std::string call : {"START_SPEED_FEED_SYNC(", "RIGID_TAP("}) {
      const auto at = line.find(call);
      if (at != std::string::npos) out.taps.push_back(line.substr(at + call.size()));
    }
    take_offset(line, "SET_G5X_OFFSET(1,", work_offset);
    take_offset(line, "SET_G92_OFFSET(", added);
    if (const auto arc = line.find("ARC_FEED("); arc != std::string::npos) {
      // end X, end Y, center X, center Y, turns, end Z, A, B, C
      std::string numbers = line.substr(arc + 9);
      std::replace_if(
          numbers.begin(), numbers.end(), [](char c) { return c == ',' || c == ')'; }, ' ');
      std::istringstream values(numbers);
      Straight s;
      s.feed = true;
      s.feed_rate = feed_rate;
      values >> s.xyzabc[0] >> s.xyzabc[1] >> s.center[0] >> s.center[1] >> s.turns >> s.xyzabc[2] >>
          s.xyzabc[3] >> s.xyzabc[4] >> s.xyzabc[5];
      out.motions.push_back(s);
      continue;
    }
    const auto feed = line.find("STRAIGHT_FEED(");
    const auto rapid = line.find("STRAIGHT_TRAVERSE(");
    if (feed == std::string::npos && rapid == std::string::npos) continue;
    Straight s;
    s.feed = feed != std::string::npos;
    s.feed_rate = feed_rate;
    std::istringstream numbers(line.substr(line.find('(') + 1));
    for (auto& coordinate : s.xyzabc) {
      std::getline(numbers >> std::ws, coordinate, coordinate.data() == s.xyzabc[5].data() ? ')' : ',');
    }
    if (const auto end = s.xyzabc[5].find(')'); end != std::string::npos) s.xyzabc[5].resize(end);
    for (std::size_t i = 0; i < 3; ++i) s.machine_xyz[i] = std::stod(s.xyzabc[i]) + work_offset[i] + added[i];
    out.motions.push_back(s);
  }
  return out;
}

// `-n 2` stops at the first error (`-n 0` would exit 0 in spite of errors); a variable file that does not
// exist yet keeps offsets of earlier runs out.
inline Interpreted interpret(const std::string& program) {
  const Folder folder;
  std::ofstream(folder.path / "p.ngc") << program;
  std::ofstream tools(folder.path / "tool.tbl");
  // From 91 on nothing, as the register of a new tool that holds wear.
  for (int t = 1; t <= 99; ++t)
    tools << "T" << t << " P" << t << " Z" << t / 10.0 << (t > 90 ? " D0\n" : " D0.25\n");
  tools.close();
  // Its tool table is mapped from HOME: two interpreters at a time would cut off each other's file.
  const std::string command =
      "cd " + folder.path.string() +
      " && HOME=$PWD timeout 120 rs274 -g -n 2 -t tool.tbl -v new.var p.ngc out.txt > log.txt 2>&1";
  const int status = std::system(command.c_str());
  Interpreted out = parse(read_file((folder.path / "out.txt").string()).value_or(""));
  out.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  out.messages = read_file((folder.path / "log.txt").string()).value_or("");
  for (const auto& entry : std::filesystem::directory_iterator(folder.path)) {
    const std::string name = entry.path().filename().string();
    static const std::vector<std::string> kOurs = {"p.ngc",       "tool.tbl", ".tool.mmap", "new.var",
                                                   "new.var.bak", "out.txt",  "log.txt"};
    if (std::find(kOurs.begin(), kOurs.end(), name) == kOurs.end()) out.made.push_back(name);
  }
  return out;
}

}  // namespace trunnion::test
