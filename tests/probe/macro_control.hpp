#pragma once
// A control with G31, variables and alarms (custom macros, DPRNT) and a machine behind it: written apart from
// the program. It runs probing programs of Fanuc and Haas in absolute millimetres.
#include <algorithm>
#include <cctype>
#include <optional>

#include "probe/hidden_machine.hpp"

namespace trunnion::test {

/// What is not as the program expects it.
struct MacroTrouble {
  double skip_z_mm = 0.0;          // by which #5063 is above the tip: the length, where it holds that
  bool pressed = false;            // the probe is on from the start
  std::optional<Triple> obstacle;  // a ball as large as the other one, where nothing is expected
  std::optional<std::size_t> gone_at_touch{};  // from this touch on (counted from 0) the ball is not there
};

struct MacroRun {
  std::string log;
  std::string alarm;        // none: the program came to its end
  std::size_t records = 0;  // lines of the log
  /// How far a motion went on behind a place where the stylus met something, at most, mm.
  double pressed_mm = 0.0;
};

class MacroControl {
 public:
  MacroControl(const HiddenMachine& machine, const MacroTrouble& trouble)
      : machine_(machine), trouble_(trouble) {}

  MacroRun run(const std::string& program) {
    std::istringstream lines(program);
    std::string line;
    while (out_.alarm.empty() && std::getline(lines, line)) take(line);
    return out_;
  }

 private:
  void take(std::string line) {
    if (line.empty() || line[0] == '(' || line[0] == '%' || line[0] == 'O') return;
    if (line[0] == 'N') line.erase(0, line.find(' ') + 1);
    if (line.rfind("DPRNT[", 0) == 0) return print(line.substr(6, line.size() - 7));
    if (line.rfind("IF[", 0) == 0) {
      const auto then = line.rfind("]THEN");
      if (holds(line.substr(3, then - 3))) take(line.substr(then + 5));
      return;
    }
    if (line.rfind("#3000=", 0) == 0) {
      out_.alarm = line;
      return;
    }
    if (line[0] == '#') {
      const auto equals = line.find('=');
      variables_[std::stoi(line.substr(1, equals - 1))] = value(line.substr(equals + 1));
      return;
    }
    if (line.rfind("M78", 0) == 0 && skipped_) out_.alarm = line;
    if (line.rfind("M79", 0) == 0 && !skipped_) out_.alarm = line;
    if (line.rfind("G53", 0) == 0) {
      at_['Z'] = 1e4;
      touching_ = false;
      return;
    }
    move(line);
  }

  void move(const std::string& line) {
    std::map<char, double> to = at_;
    bool moves = false;
    bool skips = false;
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      skips = skips || word == "G31";
      if (at_.count(word[0]) == 0) continue;
      to[word[0]] = std::stod(word.substr(1));
      moves = true;
    }
    if (!moves) return;
    if (at_['A'] != to['A'] || at_['C'] != to['C']) {
      if (at_['Z'] < 1e3) throw std::runtime_error("a rotary axis turns beside the ball: " + line);
      at_ = to;
      return;
    }
    const Triple from{at_['X'], at_['Y'], at_['Z']};
    const Triple way = plus({to['X'], to['Y'], to['Z']}, from, -1.0);
    const double length = std::sqrt(times(way, way));
    const auto met = first_contact(from, way);
    double share = 1.0;
    skipped_ = false;
    if (skips && trouble_.pressed) {
      share = 0.0;
      skipped_ = true;
    } else if (skips && met) {
      share = *met;
      skipped_ = true;
    } else if (met) {
      out_.pressed_mm = std::max(out_.pressed_mm, (1.0 - *met) * length);
    }
    for (std::size_t i = 0; i < 3; ++i) at_["XYZ"[i]] = from[i] + share * way[i];
    touching_ = skipped_;
    if (!skips) return;
    variables_[5061] = at_['X'];
    variables_[5062] = at_['Y'];
    variables_[5063] = at_['Z'] + trouble_.skip_z_mm;
    if (skipped_) ++skips_;
  }

  // Where on the way, as a share of it, the stylus comes to a ball; not while it leaves the one that it
  // touches.
  std::optional<double> first_contact(const Triple& from, const Triple& way) const {
    std::optional<double> first;
    const bool gone = trouble_.gone_at_touch && out_.records >= *trouble_.gone_at_touch;
    const auto look = [&](const Triple& ball) {
      const Triple d = plus(from, ball, -1.0);
      const double a = times(way, way), b = times(d, way),
                   c = times(d, d) - machine_.reach_mm * machine_.reach_mm;
      const double root = b * b - a * c;
      if (a == 0.0 || root < 0.0 || (touching_ && b > 0.0)) return;
      const double at = (-b - std::sqrt(root)) / a;
      if (at < -1e-9 || at > 1.0) return;
      if (!first || at < *first) first = std::max(at, 0.0);
    };
    if (!gone) look(machine_.ball_at(at_.at('A'), at_.at('C')));
    if (trouble_.obstacle) look(*trouble_.obstacle);
    return first;
  }

  // X#5061[44]Y#5062[44]...
  void print(const std::string& what) {
    for (std::size_t i = 0; i < what.size();) {
      const auto number = what.find('[', i);
      std::array<char, 40> text{};
      std::snprintf(text.data(), text.size(), "%c%.4f", what[i],
                    variables_[std::stoi(what.substr(i + 2, number - i - 2))]);
      out_.log += text.data();
      i = what.find(']', number) + 1;
    }
    out_.log += "\n";
    ++out_.records;
  }

  bool holds(const std::string& condition) {
    for (const char* relation : {"LT", "GT"}) {
      const auto at = condition.find(relation);
      if (at == std::string::npos) continue;
      const double left = value(condition.substr(0, at)), right = value(condition.substr(at + 2));
      return relation[0] == 'L' ? left < right : left > right;
    }
    throw std::runtime_error("a condition: " + condition);
  }

  // Sums of numbers, variables, brackets and ABS.
  double value(const std::string& text) {
    text_ = text;
    at_char_ = 0;
    const double out = sum();
    if (at_char_ != text_.size()) throw std::runtime_error("an expression: " + text);
    return out;
  }
  double sum() {
    double out = term();
    while (at_char_ < text_.size() && (text_[at_char_] == '+' || text_[at_char_] == '-')) {
      const double sign = text_[at_char_++] == '+' ? 1.0 : -1.0;
      out += sign * term();
    }
    return out;
  }
  double term() {
    if (text_.compare(at_char_, 4, "ABS[") == 0) {
      at_char_ += 3;
      return std::abs(term());
    }
    if (text_.compare(at_char_, 1, "[") == 0) {
      ++at_char_;
      const double out = sum();
      if (text_.compare(at_char_++, 1, "]") != 0) throw std::runtime_error("a bracket: " + text_);
      return out;
    }
    const bool variable = text_.compare(at_char_, 1, "#") == 0;
    if (variable) ++at_char_;
    // Two signs in a row are an error there.
    std::size_t used = 0;
    const double number = std::stod(text_.substr(at_char_), &used);
    at_char_ += used;
    if (!variable) return number;
    const auto found = variables_.find(static_cast<int>(number));
    if (found == variables_.end()) throw std::runtime_error("a variable without a value: " + text_);
    return found->second;
  }

  HiddenMachine machine_;
  MacroTrouble trouble_;
  MacroRun out_;
  std::map<char, double> at_{{'X', 0}, {'Y', 0}, {'Z', 1e4}, {'A', 0}, {'C', 0}};
  std::map<int, double> variables_;
  std::string text_;
  std::size_t at_char_ = 0;
  bool skipped_ = false, touching_ = false;
  std::size_t skips_ = 0;
};

}  // namespace trunnion::test
