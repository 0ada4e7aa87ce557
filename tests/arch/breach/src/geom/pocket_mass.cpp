#include "trunnion/geom/pocket.hpp"

namespace trunnion::geom {

double Pocket::mass() const {
  return x;
}

}  // namespace trunnion::geom
