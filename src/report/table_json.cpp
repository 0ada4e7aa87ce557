#include "trunnion/report/table_json.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"

#include "report/columns.hpp"
#include "report/json_text.hpp"

namespace trunnion::report {
namespace {

using namespace diagnosis;
using nlohmann::ordered_json;

constexpr double kUmPerTableMm = 1.0 / kMmPerUm;
constexpr double kPercent = 100.0;

std::string um_column(double mm, std::size_t width = 8) {
  return right(fixed_text(mm * kUmPerTableMm, 2), width);
}
std::string percent(double ratio) {
  return right(fixed_text(ratio * kPercent, 1), 6) + " %";
}

}  // namespace

std::string tables_json(const std::string& format, const std::vector<ErrorTable>& tables) {
  ordered_json rows = ordered_json::array();
  for (const ErrorTable& table : tables) {
    std::string arguments;
    for (const std::string& a : table.arguments) arguments += (arguments.empty() ? "" : " ") + a;
    std::string components;
    for (const auto& c : table.components) components += (components.empty() ? "" : " ") + c.name;
    std::size_t points = 1;
    for (const auto& nodes : table.nodes) points *= nodes.size();
    ordered_json values = ordered_json::array();
    for (const auto& c : table.components) {
      // EXX is a translation, EAX a rotation.
      const bool angle = c.name.size() > 1 && c.name[1] <= 'C';
      const auto [low, high] = std::minmax_element(c.values.begin(), c.values.end());
      if (low == c.values.end()) continue;
      const double factor = 1.0 / (angle ? kRadPerUrad : kMmPerUm);
      values.push_back({{"component", c.name},
                        {"unit", angle ? "urad" : "um"},
                        {"points", c.values.size()},
                        {"smallest", *low * factor},
                        {"largest", *high * factor}});
    }
    rows.push_back(
        {{"arguments", arguments}, {"components", components}, {"points", points}, {"values", values}});
  }
  const ordered_json out = {{"format", format}, {"tables", rows}};
  return json_text(out);
}

std::string table_choice_json(const TableChoice& choice, const std::optional<Gate>& gate) {
  ordered_json out;
  out["chosen"] = choice.rows[choice.best].candidate.name;
  out["held_out_by"] = choice.held_out_by;
  out["models"] = ordered_json::array();
  for (const auto& row : choice.rows)
    out["models"].push_back({{"name", row.candidate.name},
                             {"heldout_rms_before_um", row.score.rms_before * kUmPerTableMm},
                             {"heldout_rms_after_um", row.score.rms_after * kUmPerTableMm},
                             {"heldout_max_before_um", row.score.max_before * kUmPerTableMm},
                             {"heldout_max_after_um", row.score.max_after * kUmPerTableMm},
                             {"reduction", row.score.reduction()}});
  if (gate) {
    out["gate"] = {{"passed", gate->passed()}, {"lines", ordered_json::array()}};
    for (const LineCheck& line : gate->lines)
      out["gate"]["lines"].push_back({{"name", line.name},
                                      {"before_um", line.before * kUmPerTableMm},
                                      {"after_um", line.after * kUmPerTableMm}});
  }
  return json_text(out);
}

std::string table_choice_text(const TableChoice& choice, const std::optional<Gate>& gate) {
  std::string out = "held out: " + choice.held_out_by + "\n" + left("model", 24) +
                    "  rms before   rms after   max after (um)   removed\n";
  for (std::size_t i = 0; i < choice.rows.size(); ++i) {
    const auto& row = choice.rows[i];
    out += left(row.candidate.name, 24) + "    " + um_column(row.score.rms_before) + "    " +
           um_column(row.score.rms_after) + "    " + um_column(row.score.max_after) + "         " +
           percent(row.score.reduction()) + (i == choice.best ? "  chosen" : "") + "\n";
  }
  if (gate)
    out +=
        "independent lines with the chosen model: " + std::string(gate->passed() ? "passed\n" : "REFUSED\n") +
        gate->text();
  return out;
}

std::string cross_talk_json(const CrossTalkStudy& study) {
  ordered_json out;
  out["position_x_um"] = study.position_x * kUmPerTableMm;
  out["position_y_um"] = study.position_y * kUmPerTableMm;
  out["floor_rms_um"] = study.floor * kUmPerTableMm;
  const StudiedModel& best = study.models[study.best];
  out["best"] = {{"name", best.name}, {"nodes", best.nodes}, {"reduction", best.reduction()}};
  out["models"] = ordered_json::array();
  for (const StudiedModel& model : study.models) {
    ordered_json one = {{"name", model.name},
                        {"nodes", model.nodes},
                        {"heldout_rms_before_um", model.held_out_before * kUmPerTableMm},
                        {"heldout_rms_after_um", model.held_out_rms * kUmPerTableMm},
                        {"random_rms_before_um", model.random_before * kUmPerTableMm},
                        {"random_rms_after_um", model.random_after * kUmPerTableMm},
                        {"random_rms_after_measured_um", model.random_after_measured * kUmPerTableMm},
                        {"reduction", model.reduction()},
                        {"evaluation_us", model.evaluation_s * 1e6},
                        {"diagonals", ordered_json::array()}};
    for (const DiagonalResult& line : model.diagonals)
      one["diagonals"].push_back({{"name", line.name},
                                  {"before_um", line.before * kUmPerTableMm},
                                  {"predicted_um", line.predicted * kUmPerTableMm},
                                  {"measured_um", line.measured * kUmPerTableMm},
                                  {"predicted_reduction", 1.0 - line.predicted / line.before},
                                  {"measured_reduction", 1.0 - line.measured / line.before}});
    out["models"].push_back(std::move(one));
  }
  return json_text(out);
}

std::string cross_talk_text(const CrossTalkStudy& study) {
  std::string out = "positioning, peak to valley: X " + fixed_text(study.position_x * kUmPerTableMm, 1) +
                    " um, Y " + fixed_text(study.position_y * kUmPerTableMm, 1) +
                    " um; noise of a mean of the runs " + fixed_text(study.floor * kUmPerTableMm, 2) +
                    " um rms\n";
  const std::size_t main_nodes = study.models.front().nodes;
  out += "\ndiagonals (" + std::to_string(main_nodes) + " x " + std::to_string(main_nodes) +
         " nodes), peak to valley in um, and how much of it is removed: predicted / measured on a "
         "fresh run\n" +
         left("", 30);
  for (const DiagonalResult& line : study.models.front().diagonals)
    out += right(line.name.starts_with("T") ? line.name.substr(0, 2) : line.name.substr(5), 18);
  out += "\n" + left("before", 30);
  for (const DiagonalResult& line : study.models.front().diagonals)
    out += right(fixed_text(line.before * kUmPerTableMm, 1), 18);
  for (const StudiedModel& model : study.models) {
    if (model.nodes != main_nodes) continue;
    out += "\n" + left(model.name, 30);
    for (const DiagonalResult& line : model.diagonals)
      out += right(fixed_text(kPercent * (1.0 - line.predicted / line.before), 0) + " / " +
                       fixed_text(kPercent * (1.0 - line.measured / line.before), 0) + " %",
                   18);
  }
  out +=
      "\n\nrandom points, rms of the error vector (um); held-out rms of one component; time for one "
      "position\n";
  for (const StudiedModel& model : study.models)
    out += right(std::to_string(model.nodes), 3) + "  " + left(model.name, 30) +
           um_column(model.random_before) + " ->" + um_column(model.random_after, 7) +
           percent(model.reduction()) + "   held-out" + um_column(model.held_out_rms) + "   " +
           right(fixed_text(model.evaluation_s * 1e6, 1), 6) + " us" +
           (&model == &study.models[study.best] ? "  best by held-out data" : "") + "\n";
  const StudiedModel& best = study.models[study.best];
  out += "\nbest: " + best.name + ", " + std::to_string(best.nodes) + " x " + std::to_string(best.nodes) +
         ": " + fixed_text(kPercent * best.reduction(), 1) + " % of the repeatable error removed; " +
         fixed_text(best.random_after * kUmPerTableMm, 2) + " um left, " +
         fixed_text(best.random_after_measured * kUmPerTableMm, 2) +
         " um with the noise of a mean, whose own is " + fixed_text(study.floor * kUmPerTableMm, 2) + " um\n";
  return out;
}

}  // namespace trunnion::report
