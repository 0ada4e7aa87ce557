// Cross-talk of two linear axes through the structural loop: one twist component as products P_i(x) P_k(y),
// i, k = 1, 2, without the pure terms (those are component errors). Variants: the component and the axis that
// carries it, in one symbol (EZX: along Z, carried by X). For translations the carrying axis cannot be told,
// and the first of the pair stands for both.
#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class Crosstalk final : public LibraryEffect {
 public:
  Crosstalk(EffectInfo info, AxisId carrier, std::array<AxisId, 2> pair, const Machine& machine, char letter)
      : LibraryEffect(std::move(info), joint_link(carrier)),
        pair_(pair),
        axes_{machine.axes[pair[0]], machine.axes[pair[1]]},
        unit_(unit_twist(letter)) {}

  DependsOn depends_on() const override { return DependsOn::position; }
  void columns(const MachineState& state, std::span<const double>, std::span<const double>,
               std::span<Twist> out) const override {
    const double s = normalised_position(axes_[0], state.q[pair_[0]]);
    const double t = normalised_position(axes_[1], state.q[pair_[1]]);
    std::size_t k = 0;
    for (const int i : {1, 2}) {
      for (const int j : {1, 2}) out[k++] = unit_ * (legendre(i, s) * legendre(j, t));
    }
  }
  std::optional<TwistBend> bend(const MachineState& from, const MachineState& to,
                                std::span<const double> p) const override {
    const Range s(axes_[0], from.q[pair_[0]], to.q[pair_[0]]);
    const Range t(axes_[1], from.q[pair_[1]], to.q[pair_[1]]);
    double second = 0.0;
    std::size_t k = 0;
    for (const int i : {1, 2}) {
      for (const int j : {1, 2}) {
        second += std::abs(p[k++]) *
                  (s.second(i) * t.value(j) + 2.0 * s.slope(i) * t.slope(j) + s.value(i) * t.second(j));
      }
    }
    return bend_along(unit_, second / 8.0);
  }

 private:
  // Bounds on P_1 and P_2 of one axis and their derivatives over a motion.
  struct Range {
    Range(const Axis& axis, double from, double to)
        : largest(
              std::max(std::abs(normalised_position(axis, from)), std::abs(normalised_position(axis, to)))),
          way(std::abs(normalised_position(axis, to) - normalised_position(axis, from))) {}
    double value(int n) const { return n == 1 ? largest : std::max(0.5, legendre(2, largest)); }
    double slope(int n) const { return n == 1 ? way : 3.0 * largest * way; }
    double second(int n) const { return n == 1 ? 0.0 : 3.0 * way * way; }
    double largest, way;
  };

  std::array<AxisId, 2> pair_;
  std::array<Axis, 2> axes_;
  Twist unit_;
};

EffectInfo describe_crosstalk(const std::string& first, const std::string& second, char letter,
                              const std::string& carrier) {
  EffectInfo info;
  info.id = "crosstalk:" + first + second;
  info.what = "An error that depends on " + first + " and " + second +
              " together, more than the sum of one table for each";
  info.cause = "stacked axes that bend each other: a saddle that tilts as the table's weight moves over it";
  info.remedy = "enter a two-dimensional error table; stiffen or counterbalance the lower axis";
  info.variant = {{"component", std::string("E") + letter + carrier}};
  for (const char* name : {"P11", "P12", "P21", "P22"}) {
    info.parameters.push_back(linear(name, unit_of_letter(letter), is_rotation(letter) ? 15.0 : 4.0));
  }
  return info;
}

}  // namespace

void make_crosstalk(const LibraryBuilder& builder) {
  const Machine& machine = builder.machine();
  for (const auto& [first, second] : {std::pair{"X", "Y"}, std::pair{"X", "Z"}, std::pair{"Y", "Z"}}) {
    const auto a = machine.axis(first);
    const auto b = machine.axis(second);
    if (!a || !b || machine.axes[*a].kind != AxisKind::linear || machine.axes[*b].kind != AxisKind::linear)
      continue;
    std::vector<std::shared_ptr<const Effect>> variants;
    for (const char letter : std::string_view("XYZABC")) {
      for (const AxisId carrier : {*a, *b}) {
        if (carrier == *b && !is_rotation(letter) && !builder.equivalents()) continue;
        variants.push_back(
            std::make_shared<Crosstalk>(describe_crosstalk(first, second, letter, machine.axes[carrier].name),
                                        carrier, std::array{*a, *b}, machine, letter));
      }
    }
    builder.add(std::move(variants));
  }
}

}  // namespace trunnion::effects
