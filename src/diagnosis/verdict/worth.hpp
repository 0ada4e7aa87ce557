#pragma once
#include "diagnosis/fit/observations.hpp"

namespace trunnion::diagnosis {

struct Worth {
  double gained = 0.0, count = 0.0;
  VectorXd coefficients;  // of those that were taken
};

/// Of columns that are orthogonal to a fit (which left `white`): what those explain that are worth their
/// price, the best first (orthogonal matching pursuit), and how many they are. `whole`: their lengths before
/// the fit was taken out; one of which hardly anything is left follows rounding. `largest`: of each of their
/// coefficients, beyond which they are no explanation; empty: any.
Worth worth(const MatrixXd& columns, const VectorXd& whole, const VectorXd& white, double price,
            const VectorXd& largest);

}  // namespace trunnion::diagnosis
