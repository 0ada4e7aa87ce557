#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/nc/controller.hpp"

#include "nc/reading/lexer.hpp"

namespace trunnion::nc {

/// `meaning` is what a value of such a cycle may mean: a number that it must have (0 may be left out, and one
/// with ? behind it), "any", or what of the hole it is, Z in the coordinates of the program: "surface",
/// "above" (from it to where the feed begins), "bottom" or "depth" (from the surface, below 0) or "below"
/// (the same without its sign), "back" or "rise" (from the surface to where the tool returns), "step",
/// "first_bottom", "feed", "feed_out", "seconds", "lead" (below 0 for a left-hand thread), "rpm".
bool is_meaning_in_cycle(std::string_view meaning);

/// Drilling cycles as others write them: with a safety distance above the surface of the part, called again
/// at every place (M99, MCALL). Lines come out as [cycles] of the controller file has them, each call a cycle
/// of its own.
class HoleCalls {
 public:
  /// `controller` must outlive the object.
  explicit HoleCalls(const Controller& controller);

  /// False: the line, number `number`, is none of these, and stands as it is. Called with each of them: the
  /// lines it stands for.
  using Sink = std::function<void(std::string_view text)>;
  bool take(std::string_view text, std::uint32_t number, const Sink& sink);

  /// Lines of cycles that were said and never called.
  std::vector<std::uint32_t> never_called() const;

  std::string error;             // of what was taken last; empty: none
  std::uint32_t error_line = 0;  // where the cycle that is wrong begins

 private:
  struct Values;
  using Cycle = Controller::Input::Flow::Holes::Cycle;

  bool may_hold(std::string_view text) const;
  bool fail(const std::string& message);
  /// The values in a line, `behind` the cycle's first words.
  bool take_values(std::string_view behind);
  void define();
  /// What the cycle stands for; nothing, with `error`: it is another one, or wrong.
  std::optional<Template> lines_of(const Cycle& cycle);
  /// False, with `error`: the values are not those of this cycle.
  bool take_meanings(const Cycle& cycle, Values& out);
  bool call(std::string_view line, const Sink& sink);
  bool call_everywhere(std::string_view line, const Sink& sink);
  bool call_behind(std::string_view line, const Sink& sink);
  bool sets_parameter(std::string_view text) const;
  std::string_view plain(std::string_view text) const;

  const Controller& c_;
  const Controller::Input::Flow::Holes& holes_;
  std::string name_;                     // of the cycle that is being defined, or was last
  std::vector<std::string> given_;       // its values: "Q200=2", or an argument each
  bool begun_ = false;                   // its lines may go on
  bool goes_on_ = false;                 // with the next line, as the last one says
  bool everywhere_ = false;              // at each place from here on
  Template called_;                      // lines of the cycle that calls mean
  std::map<std::uint32_t, bool> calls_;  // of cycles that are called apart, by their line
};

}  // namespace trunnion::nc
