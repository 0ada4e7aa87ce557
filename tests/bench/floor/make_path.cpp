// Writes an APT/CL file with exactly N points for measuring speed; the same bytes every time.
//   make_path impeller N > file   7 blades, both sides, zig-zag; A from 20 to 80 degrees, C swings by 60
//   degrees
//                                 about each leading edge
//   make_path pole N > file       raster over a dome whose normals pass through A = 0
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180;

struct Pose {
  double x, y, z;
  double tilt, azimuth;  // of the tool axis, rad
};

class Writer {
 public:
  explicit Writer(long points) : left_(points) { std::setvbuf(stdout, nullptr, _IOFBF, 1 << 20); }

  bool done() const { return left_ <= 0; }
  void text(const char* line) {
    if (!done()) std::puts(line);
  }
  void point(const Pose& p) {
    if (done()) return;
    const double sine = std::sin(p.tilt);
    std::printf("GOTO/%10.4f,%10.4f,%10.4f,%10.6f,%10.6f,%10.6f\n", p.x, p.y, p.z, sine * std::cos(p.azimuth),
                sine * std::sin(p.azimuth), std::cos(p.tilt));
    --left_;
  }

 private:
  long left_;
};

// 0 before 0, 1 behind 1, with level ends between.
double ramp(double t) {
  if (t <= 0) return 0;
  if (t >= 1) return 1;
  return t * t * (3 - 2 * t);
}

// A place on a blade: `along` from the leading edge (0) to the trailing edge, `across` from the hub (0) to
// the shroud; `side` is -1 or 1.
Pose on_blade(int blade, int side, double along, double across) {
  const double quarter = along * kPi / 2;
  const double opened = 1 - std::cos(quarter);
  const double hub_r = 20 + 60 * opened;
  const double hub_z = -50 * std::sin(quarter);
  const double shroud_r = 45 + 35 * opened;
  const double shroud_z = 5 - 47 * std::sin(quarter);
  const double r = hub_r + (shroud_r - hub_r) * across;
  double theta = blade * 2 * kPi / 7 + 55 * kDegree * std::pow(along, 1.3) + 6 * kDegree * across;
  theta += side * 1.2 / r;  // half a blade's thickness
  const double edge = 1 - ramp(along / 0.08);
  const double tilt =
      50 - 27.5 * std::cos(kPi * along) * (0.9 + 0.1 * across) + 2.5 * std::sin(5 * kPi * along + blade);
  const double azimuth =
      theta + 18 * kDegree * std::sin(2 * kPi * along) + side * (12 * kDegree + 60 * kDegree * edge);
  return {r * std::cos(theta), r * std::sin(theta), hub_z + (shroud_z - hub_z) * across, tilt * kDegree,
          azimuth};
}

Pose above(Pose p, double height) {
  p.z += height;
  return p;
}

void write_side(Writer& out, int blade, int side, long passes) {
  constexpr int kPointsOfPass = 275;
  for (long pass = 0; pass < passes; ++pass) {
    const double across = static_cast<double>(pass) / static_cast<double>(passes - 1);
    int count = kPointsOfPass;
    if (pass == 0) {
      const Pose start = on_blade(blade, side, 0, across);
      out.text("RAPID");
      out.point(above(start, 60));
      out.text("FEDRAT/MMPM,800.0000");
      out.point(above(start, 5));
      out.text("FEDRAT/MMPM,2400.0000");
      count -= 3;  // the two above, and the last one twice
    }
    Pose last{};
    for (int i = 0; i < count; ++i) {
      const double share = static_cast<double>(i) / (count - 1);
      last = on_blade(blade, side, pass % 2 == 1 ? 1 - share : share, across);
      out.point(last);
    }
    if (pass > 0) continue;
    if (!out.done()) std::printf("$$ BLADE %d SIDE %d\n", blade + 1, side < 0 ? 1 : 2);
    out.point(last);
  }
}

void write_impeller(Writer& out, long points) {
  constexpr long kPointsOfPass = 275L * 14;
  long passes = (points + kPointsOfPass - 1) / kPointsOfPass;
  if (passes < 2) passes = 2;
  for (int blade = 0; blade < 7; ++blade) {
    for (const int side : {-1, 1}) write_side(out, blade, side, passes);
  }
  while (!out.done()) out.point(above(on_blade(6, 1, 0, 1), 60));
}

void write_pole(Writer& out, long points) {
  constexpr double kRadius = 300;
  constexpr double kHalfWidth = 40;
  long lines = static_cast<long>(std::ceil(std::sqrt(static_cast<double>(points))));
  if (lines < 3) lines = 3;
  if (lines % 2 == 0) ++lines;
  const auto step = static_cast<double>(lines - 1);
  out.text("FEDRAT/MMPM,2000.0000");
  for (long row = 0; row < lines; ++row) {
    const double y = kHalfWidth * (2.0 * static_cast<double>(row) / step - 1);
    for (long column = 0; column < lines; ++column) {
      const double t = 2.0 * static_cast<double>(column) / step - 1;
      const double x = kHalfWidth * (row % 2 == 1 ? -t : t);
      const double r = std::sqrt(x * x + y * y);
      out.point({x, y, std::sqrt(kRadius * kRadius - r * r) - kRadius, std::asin(r / kRadius),
                 r > 0 ? std::atan2(y, x) : 0});
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view kind = argc == 3 ? argv[1] : "";
  const long points = argc == 3 ? std::atol(argv[2]) : 0;
  if ((kind != "impeller" && kind != "pole") || points < 1) {
    std::fputs("usage: make_path impeller|pole N > FILE\n", stderr);
    return 2;
  }
  Writer out(points);
  std::printf("$$ %s for measuring, %ld points\nPARTNO/%s\n", kind == "pole" ? "dome" : "impeller", points,
              kind == "pole" ? "DOME" : "IMPELLER");
  std::puts(
      "UNITS/MM\nMULTAX/ON\nTLAXIS/0.,0.,1.\nCUTTER/6.000000,3.000000\nLOADTL/4,ADJUST,4\n"
      "SPINDL/RPM,12000.0000,CLW\nCOOLNT/ON\nRAPID");
  if (kind == "pole") {
    write_pole(out, points);
  } else {
    write_impeller(out, points);
  }
  std::puts("RAPID\nCOOLNT/OFF\nSPINDL/OFF\nFINI");
  return 0;
}
