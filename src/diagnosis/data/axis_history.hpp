#pragma once
#include "diagnosis/fit/observations.hpp"

namespace trunnion::diagnosis {

/// What an axis did before each reading, within its run.
struct AxisHistory {
  VectorXd sense;                // +1, -1, 0: as stated, else from the positions of the rows before
  VectorXd since_turn_s;         // since it last turned round (or since the run began)
  VectorXd since_turn_distance;  // mm or rad
  VectorXd last_step;            // its last change of position, signed
};

/// One for each axis of the machine.
std::vector<AxisHistory> axis_histories(const Observations& observations);

}  // namespace trunnion::diagnosis
