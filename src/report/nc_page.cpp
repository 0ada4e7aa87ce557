#include "trunnion/report/nc_page.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/kinematics.hpp"

#include "report/axis_figures.hpp"
#include "report/nc_figures.hpp"
#include "report/svg.hpp"

namespace trunnion::report {
namespace {

constexpr double kLeastDrawn_um = 0.01;  // of a logarithmic scale: what is below stands at its foot
constexpr const char* kPathFigure = "deviation";

// Micrometres below a millimetre, millimetres from there on.
std::string length_text(double mm) {
  return mm < 1.0 ? short_number(mm * kUmPerMm, 4) + " µm" : short_number(mm, 4) + " mm";
}

std::string verdict_of(const post::VerifyReport& r) {
  const std::string figures = "tip stays within " + length_text(r.largest_tip_deviation_mm()) +
                              " of its path (" + (r.certified ? "proved" : "sampled") + "; tolerance " +
                              length_text(r.tolerance_mm) + "), the tool axis within " +
                              short_number(r.max_axis_deviation.deg(), 3) + "° (tolerance " +
                              short_number(r.axis_tolerance.deg(), 3) + "°) of its great circle and within " +
                              short_number(r.max_axis_deviation_at_tip.deg(), 3) +
                              "° of where the path has it at the tip's place. " + post::flute_text(r) + ".";
  const std::string machine = r.on_truth ? " Evaluated on the machine with its errors." : "";
  if (r.passed()) return "Verified: the " + figures + machine;
  std::string why;
  if (!r.limits_ok())
    why += " " + std::to_string(r.beyond_limits_count) + " blocks are beyond the limits of an axis.";
  if (r.points_missed > 0) why += " " + std::to_string(r.points_missed) + " CL points are not on the path.";
  for (const auto& unsafe : r.unsafe) {
    why += " NC line " + std::to_string(unsafe.nc_line) + ": " + unsafe.what + ".";
    break;
  }
  for (std::size_t i = 0; i < post::kChecks; ++i) {
    if (r.checks[i].places.empty()) continue;
    const post::CheckPlace& place = r.checks[i].places.front();
    why += std::string(" ") + post::name_of(static_cast<post::CheckOf>(i)) + ", NC line " +
           std::to_string(place.nc_line) + ": " + place.what + ".";
  }
  return (r.within_tolerance() ? "Not passed." : "Not within tolerance.") + why + " The " + figures + machine;
}

std::vector<Fact> facts_of(const post::VerifyReport& r) {
  const auto count = [](std::size_t n) { return static_cast<double>(n); };
  return {{"max_tip_deviation_mm", "largest tip deviation found", length_text(r.max_tip_deviation_mm),
           r.max_tip_deviation_mm},
          {"certified_tip_deviation_mm", r.certified ? "proved bound" : "sampled bound",
           length_text(r.certified_tip_deviation_mm), r.certified_tip_deviation_mm},
          {"tolerance_mm", "tolerance", length_text(r.tolerance_mm), r.tolerance_mm},
          {"max_axis_deviation_deg", "largest tool axis deviation",
           short_number(r.max_axis_deviation.deg(), 4) + "°", r.max_axis_deviation.deg()},
          {"max_axis_deviation_at_tip_deg", "tool axis off the path's at the tip's place, at most",
           short_number(r.max_axis_deviation_at_tip.deg(), 4) + "°", r.max_axis_deviation_at_tip.deg()},
          {"points_in", "CL points", std::to_string(r.points_in), count(r.points_in)},
          {"points_out", "NC motion blocks", std::to_string(r.points_out), count(r.points_out)},
          {"max_rapid_deviation_mm", "largest deviation of rapids", length_text(r.max_rapid_deviation_mm),
           r.max_rapid_deviation_mm}};
}

Table worst_table(const post::VerifyReport& r, const std::vector<std::size_t>& stops) {
  Table table;
  table.id = "worst";
  table.title = "Worst places";
  table.caption =
      "A click (or Enter) on the NC line shows the place on the part, in the program and in the plot. The "
      "deviation is the proved bound of the block where it was proved, else the largest that was found.";
  table.columns = {"NC line", "CL line", "tip deviation / µm", "tool axis / °", "X / mm", "Y / mm", "Z / mm"};
  table.numeric.assign(table.columns.size(), true);
  table.go_to = stops;
  for (const auto& w : r.worst) {
    table.rows.push_back({std::to_string(w.nc_line), std::to_string(w.cl_line),
                          fixed_text(w.tip_mm * kUmPerMm, 3), fixed_text(w.axis.deg(), 4),
                          fixed_text(w.tip_P.x(), 3), fixed_text(w.tip_P.y(), 3),
                          fixed_text(w.tip_P.z(), 3)});
  }
  return table;
}

Table checks_table(const post::VerifyReport& r) {
  Table table;
  table.id = "checks";
  table.title = "What was compared";
  table.caption =
      "The program, word for word as the control runs it, beside what its CL file and the job ask for.";
  table.columns = {"check", "result", "of", "places", "NC line", "first finding"};
  table.numeric = {false, false, false, true, true, false};
  for (std::size_t i = 0; i < post::kChecks; ++i) {
    const post::Check& check = r.checks[i];
    const bool found = !check.places.empty();
    table.rows.push_back({post::name_of(static_cast<post::CheckOf>(i)), post::name_of(check.state),
                          check.about, check.count > 0 ? std::to_string(check.count) : "",
                          found ? std::to_string(check.places.front().nc_line) : "",
                          found ? check.places.front().what : ""});
  }
  return table;
}

constexpr std::size_t kMostText = 12'000'000;  // bytes of a file that a page holds beside its blocks

// Colours that need what a report does not hold.
void add_colourings(const NcPageInput& input, Scene& scene) {
  const post::VerifyReport& r = *input.verification;
  const auto column = [&](std::string_view name) {
    return std::find_if(scene.columns.begin(), scene.columns.end(),
                        [&](const auto& c) { return c.name == name; });
  };
  if (r.tolerance_mm > 0.0) {
    BlockColumn share{"share", "%", 1e-3, column("tip_um")->values};
    for (double& v : share.values) v *= 100.0 / (r.tolerance_mm * kUmPerMm);
    double largest = 100.0;
    for (const double v : share.values) largest = std::max(largest, v);
    scene.columns.push_back(std::move(share));
    scene.colourings.push_back({"share", "share of the tolerance", "%", largest});
  }
  if (input.model == nullptr) return;
  // What the machine's errors would do to the tip at each block if nothing were compensated.
  const ModelEvaluator errors(*input.model);
  const Machine& machine = *input.machine;
  BlockColumn before{"machine_um", "µm", 1e-3, {}};
  double largest = 0.0;
  for (std::size_t i = 0; i < scene.columns.front().values.size(); ++i) {
    JointVector q;
    for (AxisId id = 0; id < machine.axes.size(); ++id)
      q[id] = column(machine.axes[id].name)->values[i] *
              (machine.axes[id].kind == AxisKind::rotary ? kRadPerDegree : 1.0);
    MachineState state;
    state.q = q;
    const Vec3 moved =
        forward(machine, q, machine.tool_vector(), errors.errors(state)).p - forward(machine, q).p;
    before.values.push_back(column("rapid")->values[i] > 0.0 ? 0.0 : moved.norm() * kUmPerMm);
    largest = std::max(largest, before.values.back());
  }
  scene.columns.push_back(std::move(before));
  scene.colourings.push_back({"machine_um", "machine error before compensation", "µm", largest});
}

Section path_section(const NcPageInput& input, const std::vector<ProgrammedSegment>& segments) {
  const post::VerifyReport& r = *input.verification;
  Scene scene = program_scene(*input.machine, r, segments);
  add_colourings(input, scene);
  scene.title = "Part, machine and program";
  scene.caption =
      "The surface is stretched between neighbouring rows of the cut; colours are those of the blocks that "
      "end "
      "there. Drag or use the arrow keys to turn, + and - to come nearer; space plays, comma and full stop "
      "step.";
  if (scene.columns.front().values.size() < r.blocks.size())
    scene.caption += " Drawn: " + std::to_string(scene.columns.front().values.size()) + " of " +
                     std::to_string(r.blocks.size()) +
                     " blocks; the smallest and the largest of every stretch are among them.";
  scene.path_figure = kPathFigure;
  scene.still = path_plot(r, 0.0);
  if (input.nc_text.size() <= kMostText) scene.texts.nc = input.nc_text;
  if (input.cl_text.size() <= kMostText / 4) scene.texts.cl = input.cl_text;
  if (input.nc_text.size() > kMostText) scene.caption += " The program's text is too long for this page.";
  const std::vector<std::size_t> stops = scene.worst;
  Section section{"Path", {}};
  section.items.emplace_back(std::move(scene));
  if (!r.worst.empty()) section.items.emplace_back(worst_table(r, stops));
  if (!r.checks[0].about.empty()) section.items.emplace_back(checks_table(r));
  return section;
}

Figure deviation_figure(const post::VerifyReport& r, const std::vector<ProgrammedSegment>& segments) {
  XyPlot plot{{"path length", "mm"},
              {"tip deviation", "µm"},
              {},
              {{"tolerance", r.tolerance_mm * kUmPerMm}},
              {},
              false};
  const bool before = !segments.empty();
  plot.y.logarithmic = before;  // hundreds of micrometres beside one
  if (before) {
    Series s;
    s.name = "one move from CL point to CL point";
    s.colour = 1;
    double last = 0.0;
    for (const auto& segment : segments) {
      const double from = r.blocks[segment.from].path_mm;
      if (!s.x.empty() && from > last) {
        s.x.push_back(last);
        s.y.push_back(kGap);
      }
      last = r.blocks[segment.to].path_mm;
      s.x.push_back((from + last) / 2);
      s.y.push_back(std::max(segment.straight_um, kLeastDrawn_um));
    }
    plot.series.push_back(std::move(s));
  }
  Series after = deviation_series(r, "this program");
  after.colour = 0;
  if (before) {
    for (double& v : after.y) v = std::isfinite(v) ? std::max(v, kLeastDrawn_um) : v;
  }
  plot.series.push_back(std::move(after));
  return {
      kPathFigure, "Deviation along the path",
      before ? "Largest distance of the tip from the programmed path, block by block; and how far the tip of "
               "the nominal machine would stray between the same CL points without inserted points. "
               "Logarithmic: what is below 0.01 µm stands at 0.01."
             : "Largest distance of the tip from the programmed path, block by block.",
      std::move(plot)};
}

Figure axis_deviation_figure(const post::VerifyReport& r) {
  XyPlot plot{{"path length", "mm"}, {"tool axis deviation", "°"}, {}, {}, {}, false};
  Series s;
  for (const auto& block : r.blocks) {
    s.x.push_back(block.path_mm);
    s.y.push_back(block.rapid ? kGap : static_cast<double>(block.axis_deviation_rad) * kDegreePerRad);
  }
  plot.series.push_back(std::move(s));
  return {"axis-deviation", "Tool axis along the path",
          "Angle between the tool axis and the great circle of its segment.", std::move(plot)};
}

Figure inserted_figure(const post::VerifyReport& r, const std::vector<ProgrammedSegment>& segments) {
  XyPlot plot{{"path length", "mm"}, {"inserted points", ""}, {}, {}, {}, false};
  Series s;
  s.mark = Mark::points;
  for (const auto& segment : segments) {
    s.x.push_back(r.blocks[segment.to].path_mm);
    s.y.push_back(static_cast<double>(segment.inserted));
  }
  plot.series.push_back(std::move(s));
  return {"inserted", "Inserted points", "NC blocks between two CL points, segment by segment.",
          std::move(plot)};
}

}  // namespace

Page nc_page(const NcPageInput& input) {
  const post::VerifyReport& r = *input.verification;
  Page page;
  page.title = input.nc_file + " against " + input.cl_file + " on " + input.machine->name;
  page.verdict = verdict_of(r);
  page.tone = r.passed() ? Tone::good : Tone::bad;
  page.facts = facts_of(r);
  page.facts.insert(page.facts.end(), input.more_facts.begin(), input.more_facts.end());
  page.result_json = input.result_json;
  page.made_by = input.made_by;
  if (r.blocks.empty()) return page;
  const auto segments = programmed_segments(*input.machine, r);
  page.sections.push_back(path_section(input, segments));
  Section deviation{"Deviation", {deviation_figure(r, segments), axis_deviation_figure(r)}};
  if (!segments.empty()) {
    deviation.items.emplace_back(inserted_figure(r, segments));
    const auto worst = std::max_element(segments.begin(), segments.end(), [](const auto& a, const auto& b) {
      return a.straight_um < b.straight_um;
    });
    deviation.items.emplace_back(Figure{"harmonic", "The harmonic model on the worst segment",
                                        "The segment that errs most when it is run in one move (CL line " +
                                            std::to_string(r.blocks[worst->to].cl_line) +
                                            "): its error vector, what a sine through the midpoint error "
                                            "predicts, and what each prediction leaves.",
                                        model_against_truth(*input.machine, r, *worst)});
  }
  page.sections.push_back(std::move(deviation));
  page.sections.push_back(axes_section(*input.machine, r));
  return page;
}

Page compare_page(const std::vector<ComparedProgram>& programs, const Machine& machine,
                  const std::string& cl_file, const std::string& result_json, const std::string& made_by) {
  Page page;
  page.title = "Programs of " + cl_file + " on " + machine.name;
  page.result_json = result_json;
  page.made_by = made_by;
  if (programs.empty()) return page;
  // One figure for a program, wherever it stands on the page: that of the table, a bound where it was proved.
  double largest = 0.0;
  double least = std::numeric_limits<double>::infinity();
  const auto* best = &programs.front();
  XyPlot plot{{"path length", "mm"}, {"tip deviation", "µm"}, {}, {}, {}, false};
  Table table{"figures",
              "Tip deviation, µm",
              "Over the feed blocks.",
              {"program", "mean", "rms", "95 %", "largest", "blocks"},
              {false, true, true, true, true, true},
              {},
              {}};
  for (const auto& p : programs) {
    const DeviationFigures f = deviation_figures(p.verification);
    largest = std::max(largest, f.max);
    if (f.max < least) best = &p;
    least = std::min(least, f.max);
    page.facts.push_back(
        {"max_tip_deviation_mm:" + p.file, p.file + ": largest tip deviation", length_text(f.max), f.max});
    plot.series.push_back(deviation_series(p.verification, p.file));
    const auto text = [](double mm) { return fixed_text(mm * kUmPerMm, 3); };
    table.rows.push_back({p.file, text(f.mean), text(f.rms), text(f.p95), text(f.max),
                          std::to_string(p.verification.feed_blocks)});
  }
  // Where one program hides the other a logarithmic scale shows both.
  constexpr double kHides = 10.0;
  if (largest > kHides * least) {
    plot.y.logarithmic = true;
    for (Series& series : plot.series) {
      for (double& v : series.y) v = std::isfinite(v) ? std::max(v, kLeastDrawn_um) : v;
    }
  }
  page.verdict =
      best->file + " stays nearest to the path: within " + length_text(least) +
      "; the largest deviation of all is " + length_text(largest) + "." +
      (best->verification.on_truth ? " Evaluated on the machine with its errors." : " Nominal machine.");
  page.sections.push_back(
      {"Deviation",
       {Figure{"deviation", "Deviation along the path",
               std::string("Largest distance of the tip from the programmed path, block by block.") +
                   (plot.y.logarithmic ? " Logarithmic: what is below 0.01 µm stands at 0.01." : ""),
               std::move(plot)},
        std::move(table)}});
  Section paths{"Paths, one colour scale", {}};
  for (std::size_t i = 0; i < programs.size(); ++i) {
    paths.items.emplace_back(Figure{"path-" + std::to_string(i + 1), programs[i].file,
                                    "Tool tip in the part frame, feed moves.",
                                    path_plot(programs[i].verification, largest * kUmPerMm)});
  }
  page.sections.push_back(std::move(paths));
  return page;
}

}  // namespace trunnion::report
