#include "app/from_options.hpp"

#include "trunnion/base/number_text.hpp"

namespace trunnion::app {

void FromOptions::add_to(CLI::App& c, const std::string& input_is) {
  input = input_is;
  c.add_option("--from", controller,
               input +
                   " is an NC program, for this control: controller file, or the name of one in "
                   "postconfigs/controllers");
  c.add_option("--from-machine", machine,
               "the machine that it was made for (default: that of -m). For a program under "
               "tool-centre-point control only the directions of the rotary axes of this file are used");
  c.add_option(
       "--from-path", path,
       "path between the ends of its blocks: a straight line of the tip, as in a CL file, so that the "
       "nonlinear error of the old machine is dropped (points), or the path that the old machine really took "
       "(motion). Default: points, and a block whose real path is far from the straight line is refused. A "
       "rapid that leaves its straight line by more than 2 mm keeps the path of the old machine")
      ->check(CLI::IsMember({"points", "motion"}));
  c.add_option("--from-words", words,
               "what X Y Z are after a tool change without length compensation (G43, D): the tip, since the "
               "control adds the length by itself or the tool was touched off (tip), or the spindle's gauge "
               "point (spindle). Default: such a cut is refused")
      ->check(CLI::IsMember({"tip", "spindle"}));
}

Result<std::optional<MachineFiles>> FromOptions::load(const MachineOptions& target,
                                                      Diagnostics& diagnostics) const {
  if (!is_asked()) {
    if (machine.empty() && path.empty() && words.empty()) return std::optional<MachineFiles>{};
    return fail(
        ErrorCode::wrong_use,
        "--from-machine, --from-path and --from-words are about an NC program: --from CONTROLLER says that " +
            input + " is one");
  }
  MachineOptions origin;
  origin.machine = machine.empty() ? target.machine : machine;
  origin.controller = controller;
  auto files = load_with_controller(origin, diagnostics);
  if (!files) return tl::unexpected(files.error());
  // The same of the machine that is posted for is said there.
  constexpr double kFar_mm = 100.0;
  if (!machine.empty() && files->machine.work_offset_mm.isZero(0.0) &&
      files->machine.part_zero_mm.norm() > kFar_mm) {
    const Vec3& zero = files->machine.part_zero_mm;
    diagnostics.warning(
        files->machine.file, {},
        "X Y Z of the program count from machine zero, since [output] work_offset_mm does not say where its "
        "work offset stood; the part zero is at machine X" +
            shortest_text(zero.x()) + " Y" + shortest_text(zero.y()) + " Z" + shortest_text(zero.z()));
  }
  return std::optional<MachineFiles>(std::move(*files));
}

std::string FromOptions::line(const MachineFiles& files) const {
  return "path of an NC program for " + files.controller.name + ", machine " + files.machine.name +
         (path == "motion" ? ", as that machine moves" : ", its points");
}

}  // namespace trunnion::app
