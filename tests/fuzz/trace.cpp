// Traces: a file, or a control's list of values; then held against a staircase and taken as measurements.
#include "trunnion/trace/trace.hpp"

#include "trunnion/trace/compare.hpp"
#include "trunnion/trace/measurements.hpp"

#include "fuzz/fuzz.hpp"

using namespace trunnion;

namespace {

// Corners of the tip in P; the gauge length and P are those of the machine file, A and C stand at zero.
trace::Plan staircase() {
  trace::Plan plan;
  std::uint32_t line = 10;
  for (const Vec3& p : {Vec3(0, 0, 0), Vec3(30, 0, 0), Vec3(30, 20, 0), Vec3(60, 20, 0), Vec3(60, 45, 5)}) {
    trace::PlannedBlock block;
    block.length_mm = fuzz::machine().tool_length_mm;
    const Vec3 at = p + Vec3(0.0, 0.0, block.length_mm);
    for (std::size_t i = 0; i < 3; ++i) block.q[i] = at[static_cast<Eigen::Index>(i)];
    block.unknown = plan.blocks.empty();
    block.seconds = plan.blocks.empty() ? 0.0 : (p - plan.path.back().tip_P).norm() / 40.0;
    block.nc_line = block.cl_line = ++line;
    plan.blocks.push_back(block);
    plan.path.push_back({p, Vec3::UnitZ(), 20.0, line, false});
  }
  return plan;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const trace::Plan plan = staircase();
  fuzz::Bytes bytes(data, size);
  const auto form = bytes.choice(3);
  Diagnostics diagnostics;
  const std::string text = bytes.rest();
  const auto read_as = [&] {
    if (form == 0) return trace::parse_trace(text, "input", fuzz::machine(), diagnostics);
    if (form == 1)
      return trace::parse_list(text, "input", fuzz::machine(),
                               {{"sample", "-", "X_mm", "Y_mm", "Z_mm", "A_deg", "C_deg", "block"}, 0.001},
                               diagnostics);
    return trace::parse_shdr(text, "input", fuzz::machine(),
                             {{{"x", "X_mm"}, {"y", "Y_mm"}, {"z", "Z_mm"}, {"a", "A_deg"}, {"c", "C_deg"}}},
                             diagnostics);
  };
  const auto read = read_as();
  if (!read) return 0;
  for (std::size_t i = 0; i < read->samples.size(); ++i) {
    fuzz::hold(std::isfinite(read->samples[i].time_s), "a time is a number");
    fuzz::hold(i == 0 || read->samples[i].time_s > read->samples[i - 1].time_s, "times increase");
  }
  Diagnostics again;
  const auto back =
      trace::parse_trace(trace::trace_text(*read, fuzz::machine()), "again", fuzz::machine(), again);
  fuzz::hold(back && back->samples.size() == read->samples.size(), "what is written reads back");
  if (const auto report = trace::compare(*read, fuzz::machine(), plan))
    fuzz::hold(std::isfinite(report->max_tip_deviation_mm), "a deviation is a number");
  static_cast<void>(trace::measurements_of(*read, fuzz::machine(), plan));
  return 0;
}
