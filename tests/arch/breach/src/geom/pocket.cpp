#include "trunnion/geom/pocket.hpp"

namespace trunnion::geom {

double Pocket::area() const {
  return x;
}

}  // namespace trunnion::geom
