#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/diagnosis/measurement.hpp"
#include "trunnion/machine/machine.hpp"

namespace trunnion::probe {

/// A number that was fitted. `sigma` is its standard uncertainty, with what errors of the machine that the
/// fit does not know may do to it (src/probe/README.md, "Uncertainty").
struct Estimate {
  std::string name;  // "A.point_y_mm", "C.direction_x", "ball.probe.z_mm"
  double was = 0.0;  // in the machine file; of a ball: where the readings assume it
  double value = 0.0;
  double sigma = 0.0;
  bool seen = true;  // else the poses do not tell it, and it stays as it was
};

/// The lines do not explain the readings: chi-square per degree of freedom above 1.25, by chance in less than
/// one of 10 000 calibrations.
struct Misfit {
  double factor = 1.0;        // scatter of the readings over their stated uncertainty; never below 1
  double sigma_factor = 1.0;  // by which each sigma is wider for it: above a factor of 3 it is no small error
  std::string worst_run;      // whose readings are off by most of their uncertainties
  double worst_rms_mm = 0.0;
};

struct Calibration {
  Machine machine;                  // with the lines of its rotary axes as found
  std::vector<Estimate> estimates;  // points and directions across each rotary axis, the ball of each run
  /// Squareness and scale of the linear axes, which the fit allows for and the machine file does not hold:
  /// C0Y, B0Z, A0Z (urad), scale of X, Y, Z (um over a metre).
  std::vector<Estimate> linear;
  std::vector<std::string> turned_round;  // rotary axes whose sense was the other one
  std::vector<std::string> not_seen;      // in words
  double rms_before_mm = 0.0, rms_after_mm = 0.0;
  double chi2 = 0.0;
  double freedom = 0.0;  // readings less what was fitted from them
  std::size_t readings = 0;
  /// Where there is one, each `sigma` is wider by its `sigma_factor`.
  std::optional<Misfit> misfit;
};

/// Fits the machine file itself: the lines of its rotary axes, their senses and the places of the balls,
/// exactly for errors of any size (Gauss-Newton on the forward model, no small twists). Uses the
/// displacements of `data`. Model: reading = n . (p_PT(q) of the real machine - ball's shift in P - p_PT(q)
/// of the file), the two p_PT with the tool vector of the reading. M is what the linear axes make it; the
/// part frame is that of the table with all rotary axes at zero, so that a wrong zero of a rotary axis is in
/// the lines and in the ball's place. Fails with wrong_input where there are too few readings or the fit does
/// not converge, with check_failed where it leaves more than 0.1 mm RMS.
Result<Calibration> calibrate(const Machine& machine, const diagnosis::Dataset& data);

/// The misfit in words, with its figures; of a calibration that has one.
std::string misfit_text(const Calibration& calibration);

/// The text of a machine file with `point_mm` and `direction` of the rotary axes of `machine`; all else as it
/// stands.
Result<std::string> machine_text_with_axes(std::string_view text, const std::string& file,
                                           const Machine& machine);

}  // namespace trunnion::probe
