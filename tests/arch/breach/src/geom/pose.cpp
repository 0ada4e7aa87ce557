#include "trunnion/geom/pose.hpp"

#include <spdlog/spdlog.h>

double radians(double deg) {
  return deg * 3.141592653589793 / 180.0;
}
double angle(int deg) {
  return deg * 3.141592653589793 / 180;
}
double inch(double mm) {
  return mm / 25.4;
}
bool counts_turns(const char* controller) {
  return controller[0] == "fanuc"[0];
}
// A bound, no factor: not a breach.
int most_teeth() {
  return 180;
}
