#pragma once
#include <algorithm>
#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include "trunnion/nc/blocks.hpp"

#include "post/judging/deviation_meter.hpp"
#include "post/judging/path_follower.hpp"

// Private to the verifier.
namespace trunnion::post {

/// A tool of this gauge length comes into the spindle.
struct InSpindle {
  double length_mm = 0.0;
};
/// Words that are no motion, for the judge of the program.
struct Mark {
  nc::Block block;
  std::uint32_t nc_line = 0;
};
/// A motion with what the control adds to it at run time.
struct WithTerms {
  BlockEnd end;
  nc::VariableMotion terms;
};

/// What was read, and cannot be judged before more of the CL path is known.
class BlocksWaiting {
 public:
  // A block with terms of its own is large and rare: the others keep their size.
  using Step =
      std::variant<BlockEnd, std::unique_ptr<WithTerms>, nc::LatchValues, nc::RunTimeStep, nc::Comment,
                   nc::Dwell, nc::Spindle, InSpindle, nc::Retract, std::unique_ptr<Mark>>;

  template <class Block>
  void add(Block&& block) {
    steps_.emplace_back(std::forward<Block>(block));
  }
  bool is_empty() const { return next_ == steps_.size(); }
  /// Nothing of what was taken out is still held either.
  bool holds_none() const { return steps_.empty(); }
  const Step& next() const { return steps_[next_]; }
  const Step& take_next() { return steps_[next_++]; }
  /// Half at a time: what is left is moved, and in a program that had to wait for its end that may be all
  /// of it.
  void drop_taken() {
    if (is_empty()) {
      steps_.clear();
      next_ = 0;
    } else if (next_ > std::max(kLookAhead, steps_.size() / 2)) {
      steps_.erase(steps_.begin(), steps_.begin() + static_cast<std::ptrdiff_t>(next_));
      next_ = 0;
    }
  }

 private:
  std::vector<Step> steps_;
  std::size_t next_ = 0;
};

}  // namespace trunnion::post
