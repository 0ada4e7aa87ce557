#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"

#include "diagnosis/search/run_factors.hpp"
#include "diagnosis/verdict/bookkeeping.hpp"
#include "diagnosis/verdict/verdict_text.hpp"

namespace trunnion::diagnosis {
namespace {

std::string listed_files(const std::vector<std::string>& files) {
  std::string out;
  for (const std::string& file : files) {
    if (!out.empty()) out += ", ";
    out += file;
  }
  return out.empty() ? "the measurement file" : out;
}

// Without a run all files.
std::string listed_files(const Dataset& data, const std::optional<std::size_t>& run = {}) {
  return run ? files_of_run(data, *run) : listed_files(data.files);
}

std::string listed_files(const Dataset& data, const Convention& c) {
  return c.file ? data.files[*c.file] : listed_files(data, c.run);
}

std::string column(const Machine& machine, const std::string& axis) {
  const auto id = machine.axis(axis);
  const bool linear = id && machine.axes[*id].kind == AxisKind::linear;
  return axis + (linear ? "_mm" : "_deg");
}

std::string machine_file(const Machine& machine) {
  return machine.file.empty() ? "the machine file" : machine.file;
}

std::string signed_mm(const Vec3& v) {
  return "(" + fixed_text(v.x(), 3) + ", " + fixed_text(v.y(), 3) + ", " + fixed_text(v.z(), 3) + ") mm";
}

std::string joined_columns(const Machine& machine, const std::vector<std::string>& axes) {
  std::string out;
  for (const std::string& axis : axes) {
    if (!out.empty()) out += " and ";
    out += column(machine, axis);
  }
  return out;
}

bool is_factor(double factor, double known) {
  return std::abs(factor / known - 1.0) < 1e-6;
}

std::string unit_words(const Bookkeeping& b, const Machine& machine, const Dataset& data) {
  const double f = b.convention.factor;
  const double by = f >= 1.0 ? f : 1.0 / f;
  const std::string times =
      (by >= 100.0 ? fixed_text(by, 0) : short_number(by)) + " times too " + (f >= 1.0 ? "small" : "large");
  if (!b.axes.empty())
    return "The positions in " + joined_columns(machine, b.axes) +
           (b.run.empty() ? "" : " of run '" + b.run + "'") + " in " + listed_files(data, b.convention) +
           " are " + times + ": they are in another unit than the column says";
  const std::string what = b.quantity.empty() ? "All readings" : "All " + b.quantity + " readings";
  const std::string of = b.run.empty() ? "" : " of run '" + b.run + "'";
  if (b.convention.only_uncertainty)
    return "`u_random` and `u_common` of the " + (b.quantity.empty() ? "" : b.quantity + " ") + "readings" +
           of + " in " + listed_files(data, b.convention) + " are " + times +
           ": the readings are as large as those of the other runs, so only their uncertainties are in "
           "another unit";
  const std::string arcsec = is_factor(f, kUradPerArcsec)         ? " (arcsec where it says urad)"
                             : is_factor(f, 1.0 / kUradPerArcsec) ? " (urad where it says arcsec)"
                                                                  : "";
  return what + of + " in " + listed_files(data, b.convention) + " are " + times +
         (b.convention.with_uncertainty ? ", with their uncertainties" : " (`value`, against u_random)") +
         ": they are in another unit than `unit` says" + arcsec;
}

std::string sense_words(const Bookkeeping& b, const Dataset& data) {
  std::string what = b.quantity.empty() ? "All readings" : "All " + b.quantity + " readings";
  if (!b.run.empty()) what = "The readings of run '" + b.run + "'";
  return what + " in " + listed_files(data, b.convention) +
         " have the wrong sign: `value` is actual minus nominal, of the tool relative to the part, along n";
}

std::string offsets(const Bookkeeping& b) {
  std::string out;
  for (const auto& [column, by] : b.by_column)
    out += (out.empty() ? "" : ", ") + fixed_text(by, 3) + (column.ends_with("_deg") ? " deg" : " mm") +
           " to " + column;
  return out;
}

bool says_part(const Dataset& data, const Convention& c) {
  const auto first = std::find_if(data.readings.begin(), data.readings.end(),
                                  [&](const Reading& r) { return concerns(data, r, c); });
  return first != data.readings.end() && first->frame == SensitivityFrame::part;
}

std::string told(const Bookkeeping& b, const Machine& machine, const Dataset& data) {
  const Convention& c = b.convention;
  const std::string of_run = b.run.empty() ? "" : " of run '" + b.run + "'";
  switch (c.kind) {
    case ConventionKind::axis_sense:
      if (c.run)
        return "The positions in " + column(machine, b.axis) + of_run + " in " + listed_files(data, c.run) +
               " have the wrong sign";
      return "Axis " + b.axis + " goes the other way than these files say: turn round `direction` of axis " +
             b.axis + " in " + machine_file(machine) + ", or the sign of " + column(machine, b.axis) +
             " in " + listed_files(data) + ". Command a small positive step of " + b.axis +
             " and look which way it goes";
    case ConventionKind::reading_sense:
      return sense_words(b, data);
    case ConventionKind::swapped_columns:
      return (b.axes.empty()
                  ? "The columns " + b.components[0] + " and " + b.components[1]
                  : "The columns " + column(machine, b.axes[0]) + " and " + column(machine, b.axes[1])) +
             of_run + (b.run.empty() ? " of " : " in ") + listed_files(data, c.run) + " are exchanged";
    case ConventionKind::unit:
      return unit_words(b, machine, data);
    case ConventionKind::tool_length:
      return "The tool" + of_run + " is " + fixed_text(std::abs(c.by_mm.z()), 3) + " mm " +
             (c.by_mm.z() < 0.0 ? "longer" : "shorter") + " than given: put right tool_z_mm in " +
             listed_files(data, c.run) + ", or where that column is missing `length_mm` of [tool] in " +
             machine_file(machine) +
             (b.wandered_mm > 0.0 ? " (positions of Z that count from another zero by as much look the same)"
                                  : "");
    case ConventionKind::tool_offset:
      return "The measured point lies " + signed_mm(c.by_mm) +
             " from where tool_x_mm, tool_y_mm, tool_z_mm say, and the readings of " + listed_files(data) +
             " show it: put these columns right, or take the offset out of the readings";
    case ConventionKind::ball_offset:
      return "The part (or the ball) of run '" + b.run + "' stands " + signed_mm(c.by_mm) +
             " from where the files say, in the part's axes: put it right, or leave out `translation = "
             "\"fixed\"` in "
             "[setup] of the model file";
    case ConventionKind::time_shift:
      return "Temperatures and spindle speed in " + listed_files(data) + " come " +
             short_number(std::abs(c.clock.by_s)) + " s too " + (c.clock.by_s > 0.0 ? "late" : "early") +
             " in the file: two clocks, one of them is off";
    case ConventionKind::stacking_order:
      return b.axes[1] + " carries " + b.axes[0] + ", not " + b.axes[0] + " " + b.axes[1] +
             ": exchange the two in `part` of [chain] in " + machine_file(machine) +
             ". Turn each of them alone and look whether the other one's axis moves with it";
    case ConventionKind::component_sense:
      return "The column " + b.components.front() + of_run + (b.run.empty() ? " of " : " in ") +
             listed_files(data, c) +
             " has the wrong sign, or the readings along it have: `value` is actual minus nominal, of the "
             "tool "
             "relative to the part, along n";
    case ConventionKind::frame:
      return "The column frame" + of_run + " in " + listed_files(data, c) +
             " is wrong: the directions n are given in the axes of the " +
             (says_part(data, c) ? "machine, not of the part" : "part, not of the machine");
    case ConventionKind::motion_sense:
      return "The column dir_" + b.axis + of_run + " in " + listed_files(data, c.run) +
             " says one sense throughout, while " + b.axis +
             " goes both ways in the order of the times, and the readings go with the positions: write the "
             "sense of the last motion in it";
    case ConventionKind::position_offset:
      return "The positions in " + joined_columns(machine, b.axes) + of_run + " in " +
             listed_files(data, c.run) + " count from another zero than the machine file: add " + offsets(b) +
             " (a program zero, or the zero of another file?)";
    case ConventionKind::compensated:
      return (b.run.empty() ? "All runs of " + listed_files(data, c)
                            : "Run '" + b.run + "' in " + listed_files(data, c)) +
             " show" + (b.run.empty() ? "" : "s") +
             " nothing of what the model says, and the others do: measured while the control compensated "
             "these errors? Measure with compensation off, or leave " +
             (b.run.empty() ? "that file" : "that run") + " out here";
  }
  return "";
}

}  // namespace

std::string files_of_run(const Dataset& data, std::size_t run) {
  std::vector<std::string> of_run;
  for (std::size_t file = 0; file < data.files.size(); ++file)
    if (std::any_of(data.readings.begin(), data.readings.end(),
                    [&](const Reading& r) { return data.run_of(r) == run && data.rows[r.row].file == file; }))
      of_run.push_back(data.files[file]);
  return listed_files(of_run);
}

std::string words_of(const Bookkeeping& b, const Machine& machine, const Dataset& data) {
  if (b.wandered_mm > 0.0)
    return told(b, machine, data) + ". (As the files are the measured point wanders by " +
           fixed_text(b.wandered_mm, 1) +
           " mm on the part while the rotary axes turn; with that put right it stands still. Chi-square of "
           "the "
           "model as given: " +
           short_number(b.chi2_before) + " before, " + short_number(b.chi2_after) + " then, for " +
           short_number(b.dof) +
           " degrees of freedom; what is still missing in it shows once the files are right.)";
  const std::string out = told(b, machine, data) + ". With that put right chi-square ";
  // Readings in too large a unit are near to everything.
  const std::string from = b.chi2_after < b.chi2_before
                               ? "falls from " + short_number(b.chi2_before) + " to "
                               : "is no smaller (" + short_number(b.chi2_before) +
                                     "), but these readings scatter as their uncertainty says: it is ";
  return out + from + short_number(b.chi2_after) + " for " + short_number(b.dof) + " degrees of freedom" +
         (b.as_it_stands ? ", the model's values as they stand." : ".");
}

}  // namespace trunnion::diagnosis
