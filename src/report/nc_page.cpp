#include "trunnion/report/nc_page.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/kinematics.hpp"

#include "report/axis_figures.hpp"
#include "report/nc_figures.hpp"
#include "report/svg.hpp"
#include "report/texts.hpp"

namespace trunnion::report {
namespace {

constexpr double kLeastDrawn_um = 0.01;  // of a logarithmic scale: what is below stands at its foot
constexpr const char* kPathFigure = "deviation";

// Micrometres below a millimetre, millimetres from there on.
std::string length_text(double mm) {
  return mm < 1.0 ? short_number(mm * kUmPerMm, 4) + " µm" : short_number(mm, 4) + " mm";
}

// Does the machine hit a limit, and if not, how much room is left?
Fact limits_fact(const post::VerifyReport& r) {
  const auto in_words = [](const std::string& axis, AxisKind kind, double value) {
    const bool rotary = kind == AxisKind::rotary;
    return axis + " " + short_number(value * (rotary ? kDegreePerRad : 1.0), 4) + (rotary ? "°" : " mm");
  };
  Fact out{"limits", "axis limits", "", {}};
  if (!r.limits_ok()) {
    const auto& first = r.beyond_limits.front();
    out.text = std::to_string(r.beyond_limits_count) + " blocks beyond; NC line " +
               std::to_string(first.nc_line) + ": " + in_words(first.axis, first.kind, first.by) + " too far";
    return out;
  }
  // Angles and lengths do not compare: the least of each.
  for (const AxisKind kind : {AxisKind::linear, AxisKind::rotary}) {
    const auto room = [](const post::AxisTravel& t) {
      return std::min(t.smallest - t.axis.min, t.axis.max - t.largest);
    };
    const post::AxisTravel* least = nullptr;
    for (const auto& t : r.travel) {
      if (t.axis.kind != kind || !t.axis.has_limits()) continue;
      if (least == nullptr || room(t) < room(*least)) least = &t;
    }
    if (least != nullptr)
      out.text +=
          (out.text.empty() ? "kept; least room " : ", ") + in_words(least->axis.name, kind, room(*least));
  }
  if (out.text.empty()) out.text = "the machine file gives none";
  return out;
}

// The two questions that follow the figure: where, and which block is it?
std::string worst_text(const post::VerifyReport& r) {
  if (r.worst.empty()) return "";
  const auto& w = r.worst.front();
  return " Worst at NC line " + std::to_string(w.nc_line) + " (CL line " + std::to_string(w.cl_line) +
         "): " + length_text(w.tip_mm) + ".";
}

std::string verdict_of(const post::VerifyReport& r) {
  const std::string figures =
      "tip stays within " + length_text(r.largest_tip_deviation_mm()) + " of its path (" +
      (r.certified ? "proved" : "sampled") + "; tolerance " + length_text(r.tolerance_mm) +
      "), the tool axis within " + short_number(r.max_axis_deviation.deg(), 3) + "° (tolerance " +
      short_number(r.axis_tolerance.deg(), 3) + "°) of its great circle and within " +
      short_number(r.max_axis_deviation_at_tip.deg(), 3) + "° of where the path has it at the tip's place. " +
      as_sentence(post::flute_text(r)) + worst_text(r);
  const std::string machine = r.on_truth ? " Evaluated on the machine with its errors." : "";
  if (r.passed()) return "Verified: the " + figures + machine;
  std::string why;
  if (!r.limits_ok()) why += " Axis limits: " + limits_fact(r).text + ".";
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
          limits_fact(r),
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

// Before compensation and after it, from one place: what the correction is worth.
std::string compensation_text(const Scene& scene) {
  const auto colouring = [&](std::string_view column) {
    return std::find_if(scene.colourings.begin(), scene.colourings.end(),
                        [&](const auto& c) { return c.column == column; });
  };
  const auto before = colouring("machine_um");
  if (before == scene.colourings.end()) return "";
  std::string out =
      " Without compensation the machine's errors put the tip off by up to " + um_text(before->largest);
  const auto column = std::find_if(scene.columns.begin(), scene.columns.end(),
                                   [](const auto& c) { return c.name == "machine_um"; });
  if (!scene.worst.empty() && column != scene.columns.end())
    out += ", by " + um_text(column->values[scene.worst.front()]) + " at the worst place";
  return out + ".";
}

Section path_section(const NcPageInput& input, const std::vector<ProgrammedSegment>& segments) {
  const post::VerifyReport& r = *input.verification;
  Scene scene = program_scene({*input.machine, r, segments, input.errors, input.nc_text, input.cl_text});
  put_meshes(scene, input.bodies);
  scene.title = "Part, machine and program";
  scene.caption =
      "The surface is interpolated between neighbouring passes; colour: deviation of the block that ends "
      "there. Drag or use the arrow keys to turn, + and - to zoom; space plays, comma and full stop step.";
  if (scene.columns.front().values.size() < r.blocks.size())
    scene.caption +=
        " Drawn: " + std::to_string(scene.columns.front().values.size()) + " of " +
        std::to_string(r.blocks.size()) +
        " blocks: every block near the worst places, elsewhere the smallest and the largest of each stretch.";
  scene.path_figure = kPathFigure;
  scene.still = path_plot(r, 0.0);
  // What compensation changes is what is asked of such a program first.
  for (std::size_t k = 0; k < scene.colourings.size(); ++k)
    if (r.on_truth && scene.colourings[k].column == "machine_um") scene.beside = k;
  if (scene.beside)
    scene.caption +=
        " The handle on the lower edge of the picture moves the border between after and before.";
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
  return {kPathFigure, "Deviation along the path",
          before ? "Largest distance of the tip from the programmed path, block by block; and the tip error "
                   "of the nominal machine between the same CL points without inserted points. Logarithmic "
                   "scale; values below 0.01 µm are drawn at 0.01."
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

// One part and one camera: the first program's blocks, coloured by what each program does there.
Scene compared_scene(const ComparePageInput& input) {
  const ComparedProgram& carrier = input.programs.front();
  const std::vector<ProgrammedSegment> none;
  ProgramSceneInput drawn{input.machine, carrier.verification, none, nullptr, input.nc_text, input.cl_text};
  for (std::size_t k = 1; k < input.programs.size(); ++k) {
    const ComparedProgram& p = input.programs[k];
    std::vector<double> um = laid_onto(carrier.verification, p.verification);
    for (double& v : um) v *= kUmPerMm;
    drawn.beside.push_back({"program_" + std::to_string(k + 1), "tip deviation, " + p.file, std::move(um)});
  }
  Scene scene = program_scene(drawn);
  scene.colourings.front().label = "tip deviation, " + carrier.file;
  // The other programs stand behind it, the first of them beside it.
  std::rotate(scene.colourings.begin() + 1,
              scene.colourings.end() - static_cast<std::ptrdiff_t>(drawn.beside.size()),
              scene.colourings.end());
  if (input.programs.size() > 1) scene.beside = 1;
  put_meshes(scene, input.bodies);
  scene.title = "The programs on the part";
  scene.caption = "Blocks and text are those of " + carrier.file +
                  "; each has the largest deviation of the other program on the same stretch of the path. "
                  "The handle on the lower edge of the picture moves the border between both colours.";
  scene.path_figure = kPathFigure;
  scene.still = path_plot(carrier.verification, 0.0);
  return scene;
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
  if (r.on_truth) page.verdict += compensation_text(std::get<Scene>(page.sections.back().items.front()));
  Section deviation{"Deviation", {deviation_figure(r, segments), axis_deviation_figure(r)}};
  if (!segments.empty()) {
    deviation.items.emplace_back(inserted_figure(r, segments));
    const auto worst = std::max_element(segments.begin(), segments.end(), [](const auto& a, const auto& b) {
      return a.straight_um < b.straight_um;
    });
    deviation.items.emplace_back(
        Figure{"harmonic", "The harmonic model on the worst segment",
               "The segment with the largest nonlinear error without inserted points (CL line " +
                   std::to_string(r.blocks[worst->to].cl_line) +
                   "): its true error vector, the prediction by a sine through the midpoint error, and the "
                   "error of each prediction.",
               model_against_truth(*input.machine, r, *worst)});
  }
  page.sections.push_back(std::move(deviation));
  page.sections.push_back(axes_section(*input.machine, r));
  return page;
}

Page compare_page(const ComparePageInput& input) {
  const auto& programs = input.programs;
  Page page;
  page.title = "Programs of " + input.cl_file + " on " + input.machine.name;
  page.result_json = input.result_json;
  page.made_by = input.made_by;
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
  if (programs.front().verification.blocks.empty()) return page;
  Section parts{"Part", {}};
  parts.items.emplace_back(compared_scene(input));
  page.sections.push_back(std::move(parts));
  return page;
}

}  // namespace trunnion::report
