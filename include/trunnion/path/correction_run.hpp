#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "trunnion/path/compensation.hpp"
#include "trunnion/path/point.hpp"

namespace trunnion::path {

/// Share of the tolerance that a block may take on a machine with errors, where it is sampled or bounded from
/// norms.
inline constexpr double kBentWithErrors = 0.98;
/// Rounding of the words at both ends of a block, and what the errors make of it.
inline constexpr double kBothEnds = 2.0;

/// A run of points corrected a few at a time, on a machine whose errors hang on the position alone: what
/// Compensator::corrected gives for each, put on the word grid. It tells the motions that need no second look
/// from the others: those that surely stay within the tolerance on the machine with errors. For machines that
/// TableKinematics evaluates side by side.
class CorrectionRun {
 public:
  /// `compensator` must outlive the object.
  CorrectionRun(const Compensator& compensator, const TableKinematics& kinematics, const Rounding& rounding);
  ~CorrectionRun();
  CorrectionRun(CorrectionRun&&) noexcept;

  /// A point and its nominal position.
  struct NominalPlace {
    const JointVector* q;  // rotary axes on the word grid
    const Vec3* tip_P;     // prescribed, and beside it for inserted points
    const Vec3* axis_P;
    const RotarySines* sines;  // of q
    /// By which the nominal motion to it, from the place before, leaves its segment at most, mm; of the whole
    /// tool where the flute counts. Where it is not known that is the motion's own chord, and its bow is
    /// asked.
    double off_mm = kUnknown;
    /// By how much the tool, up to its flute length, is off the place of the path here, mm; asked where
    /// `off_mm` is not known.
    double beside_mm = 0.0;
    static constexpr double kUnknown = -1.0;
  };
  /// Where the flute counts, the rotary axes correct the direction of the tool, too: one step, on the word
  /// grid, and what it leaves is in the bounds. `flute_mm` 0: the tip alone.
  void correct(std::span<const NominalPlace> places, double tolerance_mm, double flute_mm);
  /// By how much a motion of the nominal machine may leave its segment where it is to be among `keeps`, mm.
  double limit_mm(double tolerance_mm) const {
    return kBentWithErrors * tolerance_mm - kBothEnds * word_radius_mm_;
  }
  /// On the word grid; the nominal ones where `known` is 0: those go another way.
  std::span<const JointVector> joints() const { return {joints_.data(), keeps_.size()}; }
  std::span<const std::uint8_t> known() const { return {known_.data(), keeps_.size()}; }
  /// The motion from point i - 1 to point i keeps to its segment, both ends corrected here.
  std::span<const std::uint8_t> keeps() const { return keeps_; }
  /// Of the points that were corrected here, as Corrected::before_mm.
  double largest_error_mm() const { return std::sqrt(largest_error2_mm2_); }
  /// Of the linear axes, where the rotary ones stand.
  double largest_correction_mm() const { return std::sqrt(largest_correction2_mm2_); }

 private:
  using Few = std::array<NominalPlace, 4>;    // two pairs
  using Firsts = std::array<std::size_t, 2>;  // of their points
  template <class T>
  struct Of;
  template <class T>
  struct Wanted;
  struct Work;
  // How far a stretch of motions goes: of each axis the least and the largest position, and the longest way.
  struct Box {
    JointVector low, high, way;
  };
  void begin(std::size_t count, double tolerance_mm, double flute_mm);
  void add(const Firsts& first, const Few& few);
  template <class T>
  void add_few(const std::size_t* first, const NominalPlace* few, Of<T>& of);
  template <class T>
  lanes::Mask<T> turn(const NominalPlace* few, const Wanted<T>& wanted, JointsOf<T>& q,
                      TableKinematics::SinesOf<T>& sines, Of<T>& of) const;
  template <class T>
  void store(const std::size_t* first, const JointsOf<T>& q, const T& arm2);
  template <class T>
  const ChainErrorsOf<T>& ask_each(const NominalPlace* few, const JointsOf<T>& q, Of<T>& of,
                                   lanes::Mask<T>& known) const;
  template <class T>
  void correct_pair(std::size_t pair, const std::size_t* first, const NominalPlace* few, bool turned,
                    Of<T>& of);
  void put(std::size_t i, const JointVector& q);
  void bound(std::span<const NominalPlace> places);
  double carried_mm(std::span<const NominalPlace> places, std::size_t i) const;
  double turned_mm(std::span<const NominalPlace> places, std::size_t i) const;
  template <class T>
  void bend();
  template <class T>
  void measure(std::size_t begin, std::size_t end, Box& out) const;
  void decide(std::size_t begin, std::size_t end, const Box& box);

  const Compensator& compensator_;
  TableKinematics kinematics_;
  Rounding rounding_;
  bool side_by_side_;            // else one by one
  bool looks_up_;                // the errors are those of tables, side by side
  lanes::Way way_;               // two pairs at a time
  double word_radius_mm_ = 0.0;  // by which rounding of the linear words moves the tip at most
  double limit_mm_ = 0.0;        // for bow and errors of a block
  std::unique_ptr<Work> work_;
  std::vector<JointVector> joints_;
  std::vector<std::uint8_t> known_, keeps_;
  // Of the points, with room for those that are not there.
  std::array<std::vector<double>, kMaxAxes> columns_;  // joints_ by axis
  std::vector<double> arm2_inner_mm2_;                 // PlaceOf::arm2_inner
  std::vector<double> bow_mm_;                         // of the motions to the points, without errors
  double largest_error2_mm2_ = 0.0;
  double largest_correction2_mm2_ = 0.0;
};

}  // namespace trunnion::path
