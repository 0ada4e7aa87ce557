#pragma once
#include <string>

#include "trunnion/effects/effect.hpp"
#include "trunnion/effects/table.hpp"

namespace trunnion::effects {

/// A `component:` effect whose error a table gives, as the model file writes it.
struct TableSpec {
  std::string component;  // "EXX": joint and direction; also the column of the table
  std::string file;       // as written in the model file
  InterpolationOptions interpolation;
  bool interpolation_given = false;  // else linear or bilinear, by the table's arguments
  bool refuse_outside = false;       // outside = "error"
};

/// An error table as an effect: no parameters, its twist is the fixed part.
class TableEffect final : public Effect {
 public:
  static Result<std::shared_ptr<const TableEffect>> make(const TableSpec& spec, const ErrorTable& table,
                                                         const Machine& machine);

  const EffectInfo& info() const override { return info_; }
  Link link() const override { return link_; }
  DependsOn depends_on() const override { return DependsOn::position; }
  void columns(const MachineState&, std::span<const double>, std::span<const double>,
               std::span<Twist>) const override {}
  Twist fixed_part(const MachineState& state, std::span<const double> lagged,
                   std::span<const double> shape) const override;
  std::optional<TwistBend> bend(const MachineState& from, const MachineState& to,
                                std::span<const double> parameters) const override;
  std::optional<TwistRange> range(std::span<const double> parameters,
                                  std::span<const Axis> axes) const override;
  RangeCheck check_range(const MachineState& state) const override;
  std::optional<StraightCourse> straight_course() const override;
  std::vector<std::pair<std::string, std::string>> file_keys() const override;

  const TableSpec& spec() const { return spec_; }
  /// The same effect, its table written under another path.
  std::shared_ptr<const TableEffect> with_file(const std::string& file) const;
  /// Slope of the least-squares line through the nodes over the joint's own axis (mm/mm, rad/mm, ...);
  /// nothing for other arguments.
  std::optional<double> line_slope() const { return slope_; }
  /// Mean of the nodes, mm or rad.
  double mean() const { return mean_; }

 private:
  TableEffect() = default;
  struct Argument {
    AxisId axis = 0;
    std::string name;
    bool rotary = false;
    double min = 0.0, max = 0.0;
    /// Where the table is read for a position: rotary positions in the turn of the table.
    double in_table(double q) const;
    /// Fractions of a motion from q0 to q1 at which a rotary position comes to an end of the table.
    void add_seams(double q0, double q1, std::vector<double>& out) const;
  };
  EffectInfo info_;
  Link link_;
  Twist unit_;
  TableSpec spec_;
  std::vector<Argument> arguments_;
  std::shared_ptr<const Interpolant> function_;
  std::optional<double> slope_;
  double mean_ = 0.0;
};

}  // namespace trunnion::effects
