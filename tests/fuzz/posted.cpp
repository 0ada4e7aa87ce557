// Valid CL text with other numbers, words and order, posted: what is written keeps to the CL points by a
// chain of the target's own, and verify passes it.
#include "trunnion/base/number_text.hpp"

#include "../post/own_chain.hpp"
#include "../post/posting.hpp"
#include "fuzz/fuzz.hpp"

using namespace trunnion;

namespace {

constexpr double kTolerance_mm = 0.01;

struct Path {
  std::string cl;
  std::vector<Vec3> tips;  // of the cut, in order
};

Vec3 direction(fuzz::Bytes& bytes) {
  return test::tilted(bytes.number(0.0, 0.9), bytes.number(-3.1, 3.1));
}

// One cut of up to 24 points between two rapids, with words of no consequence between them.
Path path_of(fuzz::Bytes& bytes) {
  Path out;
  out.cl = "PARTNO/FUZZ\nUNITS/MM\nLOADTL/1\nSPINDL/RPM,5000,CLW\nFEDRAT/MMPM,600\n";
  constexpr std::string_view kBetween[] = {"",
                                           "COOLNT/FLOOD\n",
                                           "COOLNT/OFF\n",
                                           "PPRINT A ( B ; C % D\n",
                                           "FEDRAT/MMPM,900\n",
                                           "$$ A REMARK\n",
                                           "LINTOL/0.02\n",
                                           "INSERT\n",

                                           "SPINDL/RPM,6000,CLW\n"};
  Vec3 tip(bytes.number(-40, 40), bytes.number(-40, 40), bytes.number(10, 40));
  Vec3 axis = direction(bytes);
  out.cl += "RAPID\n" + test::point_text(tip + 60.0 * axis, axis);
  const std::size_t count = 2 + bytes.choice(23);
  for (std::size_t i = 0; i < count; ++i) {
    out.cl += kBetween[bytes.choice(std::size(kBetween))];
    out.cl += test::point_text(tip, axis);
    out.tips.push_back(tip);
    tip += Vec3(bytes.number(-6, 6), bytes.number(-6, 6), bytes.number(-2, 2));
    const double turn = bytes.number(0.0, 0.12);
    axis = (axis + turn * direction(bytes)).normalized();
  }
  out.cl += "RAPID\n" + test::point_text(tip + 60.0 * axis, axis) + "FINI\n";
  return out;
}

double off_path(const Vec3& tip, const std::vector<Vec3>& path) {
  double out = 1e9;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Vec3 along = path[i + 1] - path[i];
    const double length2 = along.squaredNorm();
    const double share = length2 > 0.0 ? std::clamp((tip - path[i]).dot(along) / length2, 0.0, 1.0) : 0.0;
    out = std::min(out, (tip - path[i] - share * along).norm());
  }
  return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes(data, size);
  constexpr const char* kControls[] = {"linuxcnc", "fanuc_30i", "haas_ngc", "iso"};
  const std::string control = kControls[bytes.choice(std::size(kControls))];
  post::PostOptions options;
  options.tolerance_mm = kTolerance_mm;
  options.axis_tolerance = Angle::degrees(1.0);
  options.nonlinear.method = bytes.choice(2) == 0 ? path::Method::adaptive : path::Method::reinsert;
  const Path path = path_of(bytes);
  const test::Posted posted = test::posted(path.cl, fuzz::machine(), options, control);
  if (!posted.report || !posted.report->verification || !posted.report->verification->passed()) return 0;
  const test::Cut cut = test::cut_of(posted.nc);
  if (cut.ends.empty()) return 0;
  double worst = 0.0;
  std::vector<double> nearest(path.tips.size(), 1e9);
  for (const test::PlacedTool& tool : test::tool_of(cut)) {
    worst = std::max(worst, off_path(tool.tip, path.tips));
    for (std::size_t i = 0; i < nearest.size(); ++i)
      nearest[i] = std::min(nearest[i], (tool.tip - path.tips[i]).norm());
  }
  // The quantum of the words, and the bow of a 256th of a block.
  constexpr double kMore = 1.02;
  fuzz::hold(worst <= kMore * kTolerance_mm + 0.001,
             "passed, and off its path by " + shortest_text(worst) + "\n" + path.cl + posted.nc);
  for (const double d : nearest)
    fuzz::hold(d <= 0.5, "passed, and a point is missed by " + shortest_text(d) + "\n" + path.cl + posted.nc);
  return 0;
}
