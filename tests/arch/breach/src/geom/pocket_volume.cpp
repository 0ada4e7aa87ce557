#include "trunnion/geom/pocket.hpp"

namespace trunnion::geom {

double Pocket::volume() const {
  return x;
}

}  // namespace trunnion::geom
