#include <array>
#include <charconv>

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

std::string padded(std::string text, std::size_t width) {
  return left(std::move(text), width) + " ";
}

}  // namespace

std::string diagnosis_text(const Diagnosis& d) {
  std::string out = "verdict     " + std::string(text_of(d.verdict));
  if (!d.effects.empty()) out += ": " + joined(d.effects, " + ");
  out += "   (confidence " + number(d.confidence) + ")\n";
  for (std::size_t k = 1; k < d.sets.size(); ++k) out += "or          " + joined(d.sets[k], " + ") + "\n";
  out += "residual    " + number(d.rms_um) + " um RMS, noise " + number(d.noise_floor_um) +
         " um, chi-square " + number(d.chi2) + " for " + number(d.dof) + "\n\n" + d.paragraph + "\n\n";
  out += padded("effect", 22) + padded("p", 11) + padded("chi2 drop", 10) + padded("dof", 5) +
         padded("held-out um", 18) + "detectable um\n";
  std::size_t shown = 0;
  for (const auto& r : d.ranking) {
    if (++shown > 12) break;
    out += padded(r.id, 22) + padded(number(r.p_value), 11) + padded(number(r.chi2_drop), 10) +
           padded(number(r.dof), 5) +
           padded(number(r.heldout_before_um) + " -> " + number(r.heldout_after_um), 18) +
           (r.excited ? number(r.detectable_um) : "not excited by these runs") + "\n";
  }
  for (const auto& n : d.null_directions) out += "null direction: " + n.words + "\n";
  return out;
}

std::string evaluation_text(const Evaluation& e) {
  std::string out = e.verdict + "\nRMS " + number(e.rms_um) + " um, 95 % within " + number(e.p95_um) +
                    " um, largest " + number(e.max_um) + " um; chi-square " + number(e.chi2) + " for " +
                    number(e.dof) + " degrees of freedom (p = " + number(e.p_value) + ")\n";
  if (e.replicate_p)
    out += "repeats scatter by " + number(e.replicate_um) +
           " um; lack of fit against them: p = " + number(e.replicate_p) + "\n";
  for (const auto& r : e.runs)
    out += padded("run " + r.run_id, 28) + number(r.rms_um) + " um RMS, largest " + number(r.max_um) +
           " um, " + std::to_string(r.readings) + " readings\n";
  out += "the residual depends on:";
  std::size_t shown = 0;
  for (const auto& d : e.by_covariate)
    if (d.p_value < 0.01 && ++shown <= 6)
      out += (shown == 1 ? " " : ", ") + d.covariate + " (p = " + number(d.p_value) + ")";
  return out + (shown == 0 ? " nothing that was tried\n" : "\n");
}

std::string fit_text(const Fit& f) {
  std::string out = "chi-square " + number(f.chi2) + " for " + number(f.dof) + " degrees of freedom" +
                    (f.converged ? "" : " (did not converge)") + "\n";
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
