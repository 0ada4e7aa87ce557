// Squareness errors (ISO 230-1): C0Y, Y turned about +Z, EXY = -C0Y y; B0Z, Z turned about +Y, EXZ = +B0Z z;
// A0Z, Z turned about +X, EYZ = -A0Z z; y, z the joint's own coordinate.
#include <algorithm>
#include <cmath>
#include <limits>

#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class Squareness final : public StraightEffect {
 public:
  Squareness(EffectInfo info, Link link, const Vec3& per_mm)
      : StraightEffect(std::move(info), link), per_mm_(per_mm) {}

  DependsOn depends_on() const override { return DependsOn::position; }
  void columns(const MachineState& state, std::span<const double>, std::span<const double>,
               std::span<Twist> out) const override {
    out[0] = {per_mm_ * state.q[link().axis], Vec3::Zero()};
  }
  std::optional<TwistRange> range(std::span<const double> p, std::span<const Axis> axes) const override {
    const Axis& axis = axes[link().axis];
    TwistRange out;
    out.per_unit[link().axis] = {std::abs(p[0]) * per_mm_.norm(), 0.0};
    const double farthest = std::max(std::abs(axis.min), std::abs(axis.max));
    out.largest = {out.per_unit[link().axis].trans_mm * farthest, 0.0};
    return p[0] == 0.0 || farthest < std::numeric_limits<double>::infinity() ? std::optional(out)
                                                                             : std::nullopt;
  }

 private:
  Vec3 per_mm_;
};

struct Kind {
  const char* symbol;
  const char* axis;
  const char* to;
  Vec3 per_mm;
};

}  // namespace

void make_squareness(const LibraryBuilder& builder) {
  const Kind kinds[] = {
      {"C0Y", "Y", "X", -Vec3::UnitX()}, {"B0Z", "Z", "X", Vec3::UnitX()}, {"A0Z", "Z", "Y", -Vec3::UnitY()}};
  for (const Kind& kind : kinds) {
    const auto id = builder.machine().axis(kind.axis);
    if (!id || !builder.machine().axis(kind.to) || builder.machine().axes[*id].kind != AxisKind::linear)
      continue;
    EffectInfo info;
    info.id = std::string("squareness:") + kind.symbol;
    info.what =
        std::string("The motions of ") + kind.to + " and " + kind.axis + " are not square to each other";
    info.cause = "guideways that were assembled, or have settled, out of square; a machine that is not level";
    info.remedy = "level the machine, re-align the column or saddle, or enter the squareness in the control";
    info.parameters = {linear(kind.symbol, Unit::urad, 30.0)};
    builder.add(std::make_shared<Squareness>(std::move(info), joint_link(*id), kind.per_mm));
  }
}

}  // namespace trunnion::effects
