#pragma once
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <string_view>

#include "trunnion/base/number_text.hpp"
#include "trunnion/post/axes_of.hpp"
#include "trunnion/post/post.hpp"

#include "support/cl_text.hpp"
#include "support/controllers.hpp"
#include "support/machines.hpp"

namespace trunnion::test {

struct Posted {
  Result<post::PostReport> report;
  std::string nc;
  Diagnostics diagnostics;
};

/// CL text of tests that are about something else loads no tool: number 1 then, of the machine's length.
inline post::ToolOptions with_some_tool(post::ToolOptions tools, const std::string& cl,
                                        const Machine& machine) {
  if (tools.tool || tools.length_mm || cl.find("LOADTL") != std::string::npos) return tools;
  tools.tool = 1;
  tools.length_mm = machine.tool_length_mm;
  return tools;
}

/// CL text posted into memory.
inline Posted posted(const std::string& cl, const Machine& given, post::PostOptions options = {},
                     const std::string& control = "linuxcnc", const Model* model = nullptr,
                     const post::TemperatureHistory* temperatures = nullptr) {
  Machine machine = given;
  machine.switchable_kinematics = machine.switchable_kinematics || options.rtcp;
  options.tools = with_some_tool(options.tools, cl, machine);
  const nc::Controller c = post::with_axes_of(machine, shipped_controller(control));
  post::PostJob job;
  job.cl_file = "part.cls";
  job.machine = &machine;
  job.controller = &c;
  job.model = model;
  job.temperatures = temperatures;
  Posted out;
  out.report = post::post(
      std::make_unique<TextOf>(cl), job, options,
      [&](std::string_view text) {
        out.nc += text;
        return Result<void>{};
      },
      out.diagnostics);
  return out;
}

/// A program read back against its CL text.
inline Result<post::VerifyReport> verified(const std::string& nc_text, const std::string& cl,
                                           const Machine& given, double tolerance_mm,
                                           const std::string& control = "linuxcnc", bool collect = false,
                                           const ModelEvaluator* truth = nullptr) {
  Machine machine = given;
  machine.switchable_kinematics = machine.switchable_kinematics || nc_text.find("M428") != std::string::npos;
  const nc::Controller c = post::with_axes_of(machine, shipped_controller(control));
  post::VerifyOptions options;
  options.tolerance_mm = tolerance_mm;
  options.collect = collect;
  options.truth = truth;
  options.tools = with_some_tool({}, cl, machine);
  Diagnostics d;
  return post::verify({std::make_unique<TextOf>(cl), "part.cls"},
                      {std::make_unique<TextOf>(nc_text), "part.nc"}, {machine, c, options}, d);
}

/// One line of CL text.
inline std::string point_text(const Vec3& tip, const Vec3& axis) {
  std::string out = "GOTO/";
  for (Eigen::Index i = 0; i < 3; ++i) out += fixed_text(tip[i], 4) + ",";
  for (Eigen::Index i = 0; i < 3; ++i) out += fixed_text(axis[i], 9) + (i < 2 ? "," : "\n");
  return out;
}

/// The tool axis at `tilt` from Z, turned by `turn` about it; rad.
inline Vec3 tilted(double tilt, double turn) {
  return {std::sin(tilt) * std::cos(turn), std::sin(tilt) * std::sin(turn), std::cos(tilt)};
}

/// A model file with this text.
inline Model model_of(const std::string& text, const Machine& machine) {
  Diagnostics d;
  const auto model = parse_model(text, "m.toml", machine, {}, d);
  if (!model) throw std::runtime_error(model.error().text());
  return *model;
}

/// Errors of every kind that changes how a program is made: lost motion in every axis, table location,
/// straightness, wobble, pitch.
inline Model random_errors(const Machine& machine, std::mt19937_64& random) {
  const auto any = [&](double size) {
    return fixed_text(std::uniform_real_distribution<double>(-size, size)(random), 3);
  };
  const auto lost = [&](double most) {
    return fixed_text(std::uniform_real_distribution<double>(0.0, most)(random), 3);
  };
  std::string text = "[model]\nname = \"m\"\n";
  for (const Axis& axis : machine.axes) {
    const bool rotary = axis.kind == AxisKind::rotary;
    text += "[[effect]]\nid = \"backlash:" + axis.name + "\"\n[effect.parameters]\n" +
            (rotary ? "b_urad = " + lost(15.0) : "b_um = " + lost(8.0)) + "\n";
  }
  text += "[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = " + any(60.0) +
          "\nY0C_um = " + any(60.0) + "\nA0C_urad = " + any(80.0) +
          "\n[[effect]]\nid = \"component:EYX\"\n[effect.parameters]\nP2_um = " + any(8.0) +
          "\nP3_um = " + any(5.0) +
          "\n[[effect]]\nid = \"component:EAC\"\n[effect.parameters]\ncos1_urad = " + any(25.0) +
          "\nsin2_urad = " + any(15.0) +
          "\n[[effect]]\nid = \"periodic:Y\"\n[effect.parameters]\nsin_um = " + any(1.5) + "\np_mm = 10.0\n";
  return model_of(text, machine);
}

/// `nc` with one linear word of a feed block changed: of a point of the CL file or of one between.
inline std::string with_changed_word(const std::string& nc, std::mt19937_64& random, double by_mm) {
  std::string text = nc;
  const auto first = std::min(text.find("G93"), text.find("\nG1"));  // behind the comments of the head
  for (;;) {
    auto at = std::uniform_int_distribution<std::size_t>(first, text.size() - 40)(random);
    at = text.find_first_of("XYZ", at);
    if (at == std::string::npos) continue;
    const auto end = text.find_first_of(" \n", at);
    const auto number = parse_number(std::string_view(text).substr(at + 1, end - at - 1));
    const auto rapid = text.rfind("G0", at);
    if (!number || (rapid != std::string::npos && rapid > text.rfind("G1", at))) continue;
    return text.replace(at + 1, end - at - 1, fixed_text(number.value + by_mm, 4));
  }
}

/// A smooth five-axis path, tilt 10 to 60 deg, with a rapid link in the middle.
inline std::string sample_path(unsigned seed, int points = 60) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  const double a = u(random) * 6.0;
  const double b = u(random) * 6.0;
  std::string out =
      "PARTNO TEST\nMULTAX/ON\nLOADTL/3\nSPINDL/RPM,8000,CLW\nCOOLNT/ON\nFEDRAT/MMPM,1200\nRAPID\n";
  for (int i = 0; i < points; ++i) {
    const double t = static_cast<double>(i) / points;
    const double tilt = 0.6 + 0.4 * std::sin(5.0 * t + a);
    const double turn = 3.0 * t + b;
    if (i == points / 2) out += "RAPID\n";
    out += "GOTO/" + fixed_text(40.0 * std::cos(3.0 * t), 4) + "," + fixed_text(40.0 * std::sin(3.0 * t), 4) +
           "," + fixed_text(20.0 * t, 4) + "," + fixed_text(std::sin(tilt) * std::cos(turn), 7) + "," +
           fixed_text(std::sin(tilt) * std::sin(turn), 7) + "," + fixed_text(std::cos(tilt), 7) + "\n";
  }
  return out + "FINI\n";
}

}  // namespace trunnion::test
