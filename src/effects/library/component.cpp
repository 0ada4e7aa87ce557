// Component error EXX ... ECC (ISO 230-1 for linear, ISO 230-7 for rotary axes): one of the six errors of an
// axis' carried body as a smooth function of the axis' own position:
//   linear axis: sum c_i P_i(x), i = 1..4, Legendre polynomials on [min, max] of the machine file
//   rotary axis: cos x, sin x, cos 2x, sin 2x
#include <cmath>

#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

class Component final : public LibraryEffect {
 public:
  Component(EffectInfo info, Link link, const Axis& axis, char letter)
      : LibraryEffect(std::move(info), link), axis_(axis), unit_(unit_twist(letter)) {}

  DependsOn depends_on() const override { return DependsOn::position; }
  void columns(const MachineState& state, std::span<const double>, std::span<const double>,
               std::span<Twist> out) const override {
    const double x = state.q[link().axis];
    if (axis_.kind == AxisKind::rotary) {
      out[0] = unit_ * std::cos(x);
      out[1] = unit_ * std::sin(x);
      out[2] = unit_ * std::cos(2.0 * x);
      out[3] = unit_ * std::sin(2.0 * x);
      return;
    }
    const double t = normalised_position(axis_, x);
    for (int n = 1; n <= 4; ++n) out[static_cast<std::size_t>(n - 1)] = unit_ * legendre(n, t);
  }
  std::optional<TwistBend> bend(const MachineState& from, const MachineState& to,
                                std::span<const double> p) const override {
    const double x0 = from.q[link().axis];
    const double x1 = to.q[link().axis];
    if (axis_.kind == AxisKind::rotary) {
      return bend_along(unit_, harmonic_bend(std::hypot(p[0], p[1]), x1 - x0) +
                                   harmonic_bend(std::hypot(p[2], p[3]), 2.0 * (x1 - x0)));
    }
    const double t0 = normalised_position(axis_, x0);
    const double t1 = normalised_position(axis_, x1);
    double second = 0.0;
    for (int n = 1; n <= 4; ++n) {
      second += std::abs(p[static_cast<std::size_t>(n - 1)]) * largest_legendre_second(n, t0, t1);
    }
    return bend_along(unit_, second * (t1 - t0) * (t1 - t0) / 8.0);
  }
  // On [-1, 1]: |P_n| <= 1, |P_n'| <= n (n + 1) / 2.
  std::optional<TwistRange> range(std::span<const double> p, std::span<const Axis>) const override {
    double largest = 0.0;
    double slope = 0.0;
    for (int n = 1; n <= 4; ++n) {
      const double size = std::abs(p[static_cast<std::size_t>(n - 1)]);
      largest += size;
      slope += size * (axis_.kind == AxisKind::rotary ? (n > 2 ? 2.0 : 1.0) : 0.5 * n * (n + 1));
    }
    if (axis_.kind == AxisKind::linear) slope *= 2.0 / (axis_.max - axis_.min);
    TwistRange out;
    out.largest = bend_along(unit_, largest);
    out.per_unit[link().axis] = bend_along(unit_, slope);
    return out;
  }

 private:
  Axis axis_;
  Twist unit_;
};

struct Words {
  std::string what, cause, remedy;
};

Words words_linear(const std::string& axis, char letter) {
  const std::string l(1, letter);
  if (!is_rotation(letter) && l == axis) {
    return {
        "Positioning error of " + axis + " along its own motion, as a smooth function of its position",
        "a scale or screw whose pitch is not what the control believes, or grew; an Abbe offset to the scale",
        "measure " + axis + " with a laser by ISO 230-2 and enter a pitch compensation table"};
  }
  if (!is_rotation(letter)) {
    return {"Straightness error of " + axis + " in the direction of " + l,
            "guideways that are bent or wear, a bed out of level",
            "re-level or scrape the guide, or enter a straightness table"};
  }
  const bool own = letter - 'A' == axis.front() - 'X';
  return {std::string(own ? "Roll" : "Tilt (pitch or yaw)") + " of the body on " + axis + " about " +
              std::string(1, static_cast<char>('X' + (letter - 'A'))) + " while it moves",
          "guideways that are not straight or not parallel, uneven preload of the carriages",
          "measure with an angle interferometer or level; re-align the guide, or enter an angular table"};
}

Words words_rotary(const std::string& axis, char letter) {
  const bool along = letter - (is_rotation(letter) ? 'A' : 'X') == axis.front() - 'A';
  const std::string what = !is_rotation(letter)
                               ? (along ? "Axial error motion of " : "Radial error motion of ")
                               : (along ? "Angular positioning error of " : "Tilt error motion of ");
  const std::string about = is_rotation(letter)
                                ? "about " + std::string(1, static_cast<char>('X' + (letter - 'A')))
                                : "along " + std::string(1, letter);
  return {what + axis + " (" + about + ") once and twice a turn",
          along && is_rotation(letter)
              ? "an encoder that is mounted eccentrically, a worm wheel that runs out"
              : "bearings that run out, a table face or centre that is not on the axis",
          along && is_rotation(letter)
              ? "re-centre the encoder, or enter an angle table"
              : "check the bearing's preload and run-out; enter an error table over the angle"};
}

std::vector<std::string> contained(const std::string& symbol) {
  if (symbol == "EXY") return {"squareness:C0Y"};
  if (symbol == "EXZ") return {"squareness:B0Z"};
  if (symbol == "EYZ") return {"squareness:A0Z"};
  return {};
}

EffectInfo describe_component(const Axis& axis, char letter) {
  const bool rotary = axis.kind == AxisKind::rotary;
  const std::string symbol = std::string("E") + letter + axis.name;
  const Words words = rotary ? words_rotary(axis.name, letter) : words_linear(axis.name, letter);
  EffectInfo info;
  info.id = "component:" + symbol;
  info.what = words.what;
  info.cause = words.cause;
  info.remedy = words.remedy;
  info.contains = contained(symbol);
  const double usual = is_rotation(letter) ? 20.0 : 5.0;
  for (const char* name :
       rotary ? std::array{"cos1", "sin1", "cos2", "sin2"} : std::array{"P1", "P2", "P3", "P4"}) {
    info.parameters.push_back(linear(name, unit_of_letter(letter), usual));
  }
  return info;
}

}  // namespace

void make_component(const LibraryBuilder& builder) {
  for (AxisId id = 0; id < builder.machine().axes.size(); ++id) {
    const Axis& axis = builder.machine().axes[id];
    for (const char letter : std::string_view("XYZABC")) {
      builder.add(
          std::make_shared<Component>(describe_component(axis, letter), joint_link(id), axis, letter));
    }
  }
}

}  // namespace trunnion::effects
