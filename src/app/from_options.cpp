#include "app/from_options.hpp"

namespace trunnion::app {

void FromOptions::add_to(CLI::App& c, const std::string& input_is) {
  input = input_is;
  c.add_option("--from", controller,
               input +
                   " is an NC program, for this control: controller file, or the name of one in "
                   "postconfigs/controllers");
  c.add_option("--from-machine", machine,
               "the machine that it was made for (default: that of -m). Of a program under "
               "tool-centre-point control only the directions of the rotary axes count");
  c.add_option("--from-path", path,
               "what lies between the ends of its blocks: what a CL file has there, so that the way of its "
               "machine from point to point, with its nonlinear error, does not count (points); or that way "
               "itself, by points on it (motion)")
      ->check(CLI::IsMember({"points", "motion"}))
      ->capture_default_str();
}

Result<std::optional<MachineFiles>> FromOptions::load(const MachineOptions& target,
                                                      Diagnostics& diagnostics) const {
  if (!is_asked()) {
    if (machine.empty() && path == "points") return std::optional<MachineFiles>{};
    return fail(ErrorCode::wrong_use,
                "--from-machine and --from-path are about an NC program: --from CONTROLLER says that " +
                    input + " is one");
  }
  MachineOptions origin;
  origin.machine = machine.empty() ? target.machine : machine;
  origin.controller = controller;
  auto files = load_with_controller(origin, diagnostics);
  if (!files) return tl::unexpected(files.error());
  return std::optional<MachineFiles>(std::move(*files));
}

std::string FromOptions::line(const MachineFiles& files) const {
  return "path of an NC program for " + files.controller.name + ", machine " + files.machine.name +
         (path == "motion" ? ", as that machine moves" : ", its points");
}

}  // namespace trunnion::app
