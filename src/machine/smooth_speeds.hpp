#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "machine/smooth_path.hpp"

namespace trunnion {

/// The speed along a piece of a block: its square runs as begin2 + slope s + bend s^2 / 2, so that speed and
/// acceleration jump nowhere; beside a rest as s^(4/3) from it, at an even jerk.
struct SpeedPiece {
  enum class Kind : std::uint8_t { between, from_rest, to_rest };
  double length = 0.0;
  double begin2 = 0.0, end2 = 0.0;
  double slope = 0.0, bend = 0.0;
  Kind kind = Kind::between;
  bool ends_block = false;

  double most2() const;
  double seconds() const;
  double end_slope() const { return slope + bend * length; }
};

/// How the speed begins or ends along a row of pieces.
struct SpeedEnd {
  enum class Kind : std::uint8_t { rest, going };
  Kind kind = Kind::rest;
  double at2 = 0.0, slope = 0.0;  // where it is going: square of the speed, and its slope
};

/// How it goes on from where it is, as was found before: it may, and need not be faster.
struct KnownSpeeds {
  std::vector<SpeedPiece> pieces;
  /// Found by SteadyWay: whether what follows can be got into from just these is not known.
  bool are_steady = false;
};

/// Speeds along the pieces of a path that keep to the bounds of each (README, "Jerk").
class SmoothSpeeds {
 public:
  /// @param remembers_s  for so long it goes on from where it is going as it was planned before
  explicit SmoothSpeeds(double remembers_s) : remembers_s_(remembers_s) {}

  struct Ends {
    SpeedEnd begin, end;
  };
  /// False where it cannot get from its begin into these pieces, or from them to its end; a path from rest to
  /// rest can always be run.
  /// @param known  along the first of these pieces, where it is going
  /// @param out    the speeds are appended to it
  bool plan(const SmoothPath& path, const Ends& ends, const KnownSpeeds& known, std::vector<SpeedPiece>& out);

 private:
  /// Up to where the bounds of a piece hold.
  struct Trust {
    double speed2 = std::numeric_limits<double>::infinity();
    double slope = std::numeric_limits<double>::infinity();
    double more = 0.1;  // of the largest acceleration, beyond that
  };
  /// A control point of the square of the speed, a spline of second degree over the pieces: it stands in the
  /// middle of its piece, and the lines from one to the next touch the spline where pieces meet.
  struct Node {
    double at = 0.0;
    double most2 = 0.0;
    double reach2 = 0.0;  // that speed alone and acceleration would let it have
    // 2 jerk length: by so much over the speed the slope may change, upwards and downwards.
    double per_bend = 0.0, per_fall = 0.0;
    Trust trust{};
    // As it was found before; it may go on so here, and need not be faster.
    double known2 = 0.0, known_slope = 0.0;
    bool is_kept = false;
    double up2 = 0.0;    // from the begin on
    double down2 = 0.0;  // from the end on
    double value2 = 0.0;
    double speed = 0.0;   // in its piece, not less than it is
    double summed = 0.0;  // twice summed changes of the slope that are possible
  };
  /// Between a node and the next.
  struct Knot {
    double at = 0.0;
    double share = 0.0;  // of the way from the node to the next
    double most2 = 0.0;
    double steepest = 0.0;   // slope
    double from_rest = 0.0;  // slope that the jerk allows beside a rest
  };

  void lay(const SmoothPath& path);
  void bound(const SmoothPath& path);
  void remember(const SmoothPath& path, const KnownSpeeds& known);
  double improve(const SmoothPath& path);
  void trust(double wider);
  bool run(const SmoothPath& path);
  void sweep(bool forward, std::size_t from, double slope);
  double push(std::size_t i, double Node::*value);
  void round_tops();
  void put(const SmoothPath& path, std::vector<SpeedPiece>& out) const;

  double remembers_s_;
  std::vector<Node> nodes_;
  std::vector<Knot> knots_;
  std::vector<std::size_t> stack_;
  std::vector<double> found_;  // squares of speeds at the nodes
  std::size_t first_ = 0;      // node of the first piece
  Ends ends_;
};

}  // namespace trunnion
