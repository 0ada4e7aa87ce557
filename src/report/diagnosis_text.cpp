#include <array>
#include <charconv>
#include <cmath>

#include "trunnion/report/diagnosis_json.hpp"

#include "report/columns.hpp"
#include "report/texts.hpp"

namespace trunnion::report {
namespace {

using namespace diagnosis;

std::string number(double value) {
  std::array<char, 40> buffer;
  const auto r = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value == 0.0 ? 0.0 : value,
                               std::chars_format::general, 4);
  return {buffer.data(), r.ptr};
}
std::string number(const std::optional<double>& value) {
  return value ? number(*value) : "-";
}

// "1.2 um and 3.4 urad": what was measured.
std::string sizes(double um, double urad) {
  std::string out;
  if (std::isfinite(um)) out = number(um) + " um";
  if (std::isfinite(urad)) out += (out.empty() ? "" : " and ") + number(urad) + " urad";
  return out;
}
std::string sizes(const std::optional<double>& um, const std::optional<double>& urad) {
  return sizes(um.value_or(std::nan("")), urad.value_or(std::nan("")));
}

std::string chi2_text(double chi2, double dof) {
  std::string out = "chi-square " + number(chi2) + " for " + number(dof) + " degrees of freedom";
  if (dof > 0.0) out += " (residuals " + number(std::sqrt(chi2 / dof)) + " times the stated uncertainty)";
  return out;
}

// Held-out residual without and with an effect; of displacements where there are any.
std::string held_out_text(const diagnosis::RankedEffect& r) {
  if (r.heldout_before_um) return number(r.heldout_before_um) + " -> " + number(r.heldout_after_um);
  if (!r.heldout_before_urad) return "- -> -";
  return number(r.heldout_before_urad) + " -> " + number(r.heldout_after_urad) + " urad";
}

std::string padded(std::string text, std::size_t width) {
  return left(std::move(text), width) + " ";
}

}  // namespace

std::string diagnosis_text(const Diagnosis& d) {
  std::string out = "verdict     " + std::string(text_of(d.verdict));
  if (!d.effects.empty()) out += ": " + joined(d.effects, " + ");
  out += "   (confidence " + number(d.confidence) + ")\n";
  for (std::size_t k = 1; k < d.sets.size(); ++k) out += "or          " + joined(d.sets[k], " + ") + "\n";
  if (d.verdict == diagnosis::Verdict::ambiguous)
    for (const auto& b : d.bookkeeping) out += "or          the files: " + b.words + "\n";
  out += "residual    " + sizes(d.rms_um, d.rms_urad) + " RMS, noise " +
         sizes(d.noise_floor_um, d.noise_floor_urad) + ", " + chi2_text(d.chi2, d.dof) + "\n\n" +
         d.paragraph + "\n\n";
  out += padded("effect", 22) + padded("p", 11) + padded("chi2 drop", 10) + padded("dof", 5) +
         padded("held-out um", 18) + "detectable um\n";
  std::size_t shown = 0;
  for (const auto& r : d.ranking) {
    if (++shown > 12) break;
    out += padded(r.id, 22) + padded(number(r.p_value), 11) + padded(number(r.chi2_drop), 10) +
           padded(number(r.dof), 5) + padded(held_out_text(r), 18) +
           (r.excited ? number(r.detectable_um) : "not excited by these runs") + "\n";
  }
  for (const auto& n : d.null_directions) out += "null direction: " + n.words + "\n";
  return out;
}

std::string evaluation_text(const Evaluation& e) {
  constexpr std::size_t kWorst = 5;
  std::string out = e.verdict + "\n";
  if (!e.beyond.empty()) out += "The model was not measured where these readings lie: " + e.beyond + ".\n";
  for (const auto& [size, unit] : {std::pair{e.displacement, "um"}, std::pair{e.rotation, "urad"}})
    if (std::isfinite(size.rms))
      out += "RMS " + number(size.rms) + " " + unit + ", 95 % within " + number(size.p95) + " " + unit +
             ", largest " + number(size.largest) + " " + unit + "\n";
  out += chi2_text(e.chi2, e.dof) + ", p = " + number(e.p_value) + "\n";
  if (e.replicate_p)
    out += "repeats scatter by " + number(e.replicate_um) +
           " um; lack of fit against them: p = " + number(e.replicate_p) + "\n";
  for (const auto& r : e.runs)
    out += padded("run " + r.run_id, 28) + sizes(r.displacement.rms, r.rotation.rms) + " RMS, largest " +
           sizes(r.displacement.largest, r.rotation.largest) + ", " + std::to_string(r.readings) +
           " readings\n";
  for (std::size_t k = 0; k < e.worst.size() && k < kWorst; ++k) {
    const auto& w = e.worst[k];
    out += (k == 0 ? "worst readings: " : "                ") + w.file + ":" + std::to_string(w.row) +
           " (run " + w.run_id + ") " + number(w.residual) +
           (w.quantity == Quantity::displacement ? " um, " : " urad, ") + number(std::abs(w.normalised)) +
           " times its uncertainty\n";
  }
  out += "the residual depends on:";
  std::size_t shown = 0;
  for (const auto& d : e.by_covariate)
    if (d.p_value < 0.01 && ++shown <= 6)
      out += (shown == 1 ? " " : ", ") + d.covariate + " (p = " + number(d.p_value) + ")";
  return out + (shown == 0 ? " nothing that was tried\n" : "\n");
}

std::string error_text(const HistoryEntry& e) {
  std::string out = sizes(e.rms_um, e.rms_urad) + " RMS";
  if (e.heldout_um || e.heldout_urad) out += ", held out " + sizes(e.heldout_um, e.heldout_urad);
  return out + ", noise " + sizes(e.noise_floor_um, e.noise_floor_urad) + ", " + chi2_text(e.chi2, e.dof);
}

std::string fit_text(const Fit& f) {
  std::string out = "chi-square " + number(f.chi2) + " for " + number(f.dof) + " degrees of freedom" +
                    (f.converged ? "" : " (did not converge)") + "\n";
  if (f.sigma_factor > 1.0)
    out += "WARNING: the model does not explain these readings (chi-square per degree of freedom " +
           number(f.chi2 / f.dof) + "). The uncertainties below are " + number(f.sigma_factor) +
           " times those that follow from the stated ones, and hold only if the missing effects act like "
           "random noise: `model diagnose` searches for them.\n";
  for (const ModelEffect& effect : f.model.effects) {
    const auto& info = effect.effect->info();
    for (std::size_t k = 0; k < effect.parameters.size(); ++k) {
      const double unit = unit_factor(info.parameters[k].unit);
      const auto& p = effect.parameters[k];
      out += padded(effect.id(), 22) + padded(info.parameters[k].key(), 16) + number(p.value / unit) +
             (p.sigma   ? " +/- " + number(*p.sigma / unit)
              : p.fixed ? ""
                        : "   not determined by these data") +
             (p.fixed ? "   (held)" : "") + "\n";
    }
  }
  for (const auto& n : f.null_directions) out += "null direction: " + n.words + "\n";
  return out;
}

}  // namespace trunnion::report
