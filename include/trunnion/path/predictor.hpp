#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "trunnion/path/certificate.hpp"

namespace trunnion::path {

/// How the error of a segment is predicted from few evaluations.
struct Predictor {
  enum class Kind : std::uint8_t {
    harmonic,  // sines 1..order through `order` interior samples; order 1 is paper 001, Eq. 3.3
    parabola,  // 4 k (1 - k) e_mid
    skew,      // parabola and the odd cubic from the end slopes
    quartic,   // midpoint error and both end slopes
    exact      // the curve itself
  };
  Kind kind = Kind::harmonic;
  int order = 1;  // of the harmonic
  bool operator==(const Predictor&) const = default;
  /// What it predicts is largest in the middle, where it is the curve itself.
  bool middle_is_largest() const { return kind == Kind::parabola || (kind == Kind::harmonic && order == 1); }
};
inline constexpr int kMaxHarmonicOrder = 9;
/// Names of the command line: harmonic, harmonic1 ... harmonic9, parabola, skew, quartic, exact.
std::optional<Predictor> predictor_from_text(std::string_view text);
std::string predictor_text(const Predictor& predictor);

/// Error vector e(k) = p(k) - [p0 + k (p1 - p0)] of a piece over k in [0, 1], in P (mm), as a predictor sees
/// it.
class ErrorModel {
 public:
  ErrorModel(const TableKinematics& kinematics, const Station& a, const Station& b,
             const Predictor& predictor);

  /// Predicted error vector, mm, in the axes of P (Eq. 3.2 without its cosines, which the ends at zero
  /// exclude).
  Vec3 at(double k) const;
  /// e(1/2) of the curve.
  const Vec3& midpoint() const { return midpoint_; }
  /// Predicted largest distance from the segment, mm.
  double largest_distance() const;

 private:
  Vec3 exact(double k) const;

  const TableKinematics* kinematics_;
  const Station* a_;
  const Station* b_;
  Predictor predictor_;
  Vec3 midpoint_ = Vec3::Zero();
  Vec3 odd_ = Vec3::Zero();                    // half the sum of the end slopes
  Vec3 even_ = Vec3::Zero();                   // half their difference
  std::array<Vec3, kMaxHarmonicOrder> sines_;  // amplitudes
};

}  // namespace trunnion::path
