#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "trunnion/path/compensation.hpp"
#include "trunnion/path/place_of.hpp"
#include "trunnion/path/point.hpp"

namespace trunnion::path {

/// Share of the tolerance that a block may take on a machine with errors, where it is sampled or bounded from
/// norms.
inline constexpr double kBentWithErrors = 0.98;
/// Rounding of the words at both ends of a block, and what the errors make of it.
inline constexpr double kBothEnds = 2.0;

/// A run of points corrected two at a time, on a machine whose errors hang on the position alone: what
/// Compensator::corrected gives for each, put on the word grid. It tells the motions that need no second look
/// from the others: those that surely stay within the tolerance on the machine with errors. For machines that
/// TableKinematics evaluates side by side.
class CorrectionRun {
 public:
  /// `compensator` must outlive the object.
  CorrectionRun(const Compensator& compensator, const TableKinematics& kinematics, const Rounding& rounding);

  /// Corrects the points at the nominal positions `nominal`, rotary axes on the word grid, of which
  /// `pose_at(i)` is prescribed and `sines_at(i)` known.
  template <class PoseAt, class SinesAt>
  void correct(std::span<const JointVector> nominal, const PoseAt& pose_at, const SinesAt& sines_at,
               double tolerance_mm) {
    begin(nominal.size(), tolerance_mm);
    for (std::size_t i = 0; i < nominal.size(); i += 2) {
      const std::size_t j = i + 1 < nominal.size() ? i + 1 : i;
      const RotarySines a = sines_at(i);
      const RotarySines b = sines_at(j);
      add(i, j, {nominal[i], pose_at(i), a}, {nominal[j], pose_at(j), b});
    }
    decide();
  }
  std::span<const JointVector> joints() const { return joints_; }
  /// The motion from point i - 1 to point i keeps, both ends corrected here.
  const std::vector<std::uint8_t>& keeps() const { return keeps_; }
  /// Of the points that were corrected here, as Corrected::before_mm.
  double largest_error_mm() const { return largest_error_mm_; }
  /// Of the linear axes.
  double largest_correction_mm() const { return std::sqrt(largest_correction2_mm2_); }

 private:
  void begin(std::size_t count, double tolerance_mm);
  void add(std::size_t first, std::size_t second, const Compensator::NominalPlace& a,
           const Compensator::NominalPlace& b);
  void take(std::size_t i, const Compensator::NominalPlace& at, const Corrected& found);
  void bend(std::size_t first, std::size_t second, const std::array<Vec3, 2>& tips_P);
  void decide();

  const Compensator& compensator_;
  TableKinematics kinematics_;
  Rounding rounding_;
  double constants_mm_ = 0.0;    // of the chain, beside w
  double word_radius_mm_ = 0.0;  // by which rounding of the linear words moves the tip at most
  double limit_mm_ = 0.0;        // for bow and errors of a block
  PlaceOf<Lanes> last_;
  Vec3 aim_P_ = Vec3::Zero();  // Corrected::aim_P of the last point
  std::vector<JointVector> joints_;
  std::vector<std::uint8_t> known_, keeps_;
  std::vector<double> bow_mm_;  // of the nominal motions to the points
  double largest_error_mm_ = 0.0;
  double largest_correction2_mm2_ = 0.0;
};

}  // namespace trunnion::path
