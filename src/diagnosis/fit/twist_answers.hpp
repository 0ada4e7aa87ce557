#pragma once
#include <cstddef>
#include <vector>

#include "diagnosis/fit/observations.hpp"

namespace trunnion::diagnosis {

/// A component of the twist of a joint (mm or rad along or about an axis of its frame).
struct TwistPlace {
  std::size_t link = 0;
  Eigen::Index component = 0;
};

/// What the readings answer to a unit twist, and all twists to which they answer so.
struct TwistAnswer {
  VectorXd values;  // mm or rad, one for each reading
  std::vector<TwistPlace> places;
};

/// The twists of all joints that these readings tell from one another; those that no reading answers to are
/// left out.
std::vector<TwistAnswer> twist_answers(const Observations& observations);

}  // namespace trunnion::diagnosis
