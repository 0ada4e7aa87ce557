// Models with formulas; what is accepted gives numbers, or says where it gives none.
#include "trunnion/effects/model.hpp"

#include "fuzz/fuzz.hpp"

using namespace trunnion;

namespace {

MachineState state_at(double share) {
  MachineState state;
  for (AxisId id = 0; id < fuzz::machine().axes.size(); ++id) {
    const Axis& axis = fuzz::machine().axes[id];
    state.q[id] = axis.has_limits() ? axis.min + share * (axis.max - axis.min) : 6.0 * share - 3.0;
    state.direction[id] = share < 0.5 ? -1 : 1;
    state.velocity[id] = 10.0 * share;
  }
  state.spindle_rpm = 9000.0 * share;
  state.time_s = 3600.0 * share;
  return state;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Diagnostics diagnostics;
  const auto model = parse_model({reinterpret_cast<const char*>(data), size}, "/nonexistent/input.toml",
                                 fuzz::machine(), {}, diagnostics);
  if (!model) {
    fuzz::hold(diagnostics.has_errors() || !model.error().message.empty(), "a refusal has a reason");
    return 0;
  }
  try {
    const ModelEvaluator evaluator(*model);
    for (const double share : {0.0, 0.3, 0.7, 1.0}) {
      const ChainErrors errors = evaluator.errors(state_at(share));
      for (const Twist& twist : errors.joint)
        fuzz::hold(twist.trans_mm.allFinite() && twist.rot_rad.allFinite(), "an error is a number");
      static_cast<void>(evaluator.bends(state_at(share), state_at(share + 0.01)));
    }
    static_cast<void>(evaluator.range(fuzz::machine().axes));
  } catch (const Failure&) {
  }
  // What is written reads back.
  Diagnostics again;
  fuzz::hold(
      parse_model(model_text(*model), "/nonexistent/input.toml", fuzz::machine(), {}, again).has_value(),
      "a model reads back");
  return 0;
}
