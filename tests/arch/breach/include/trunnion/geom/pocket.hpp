#pragma once
#include <vector>

namespace trunnion::geom {

struct Pocket {
  double x, y, z;
  double length = 0.0;
  double width{0.0};
  std::vector<std::vector<double>> corners;
  int a = 0, b = 0, c = 0, d = 0;
  const double* e = nullptr;
  double f[3];
  bool g = false;
  bool h = false;
  static constexpr int kNot = 1;  // one for all
  double i = 0.0;
  double j = 0.0;

  double area() const;
  double volume() const;
  double mass() const;
  double edge() const { return length; }
};

double few(int a, std::vector<std::pair<int, int>> b, double c = f(1, 2, 3), int d = 4, int e = 5);

double width(int a, int b, int c, int d, int e, int f, int g);

double depth(int a, int b, int c, int d, int e, int f);

}  // namespace trunnion::geom
