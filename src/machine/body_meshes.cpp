#include "trunnion/machine/body_meshes.hpp"

#include <algorithm>
#include <filesystem>

#include "trunnion/base/files.hpp"
#include "trunnion/base/units.hpp"

#include "machine/body_keys.hpp"

namespace trunnion {
namespace {

constexpr double kMmPerMetre = 1e3;

// Behind how many axes of which chain the body stands.
void place(BodyMesh& body, const Machine& machine, const std::string& of) {
  if (of == kBed) return;
  if (of == kSpindle) {
    body.axes = machine.tool_chain.size();
    return;
  }
  const AxisId id = machine.axis(of).value_or(0);
  body.on_part_side = machine.axes[id].carries_part;
  const auto& chain = body.on_part_side ? machine.part_chain : machine.tool_chain;
  body.axes = static_cast<std::size_t>(std::find(chain.begin(), chain.end(), id) - chain.begin()) + 1;
}

}  // namespace

std::vector<BodyFile> read_bodies(config::Section& root, const Machine& machine) {
  std::vector<BodyFile> out;
  for (config::Section& s : root.sections("body")) {
    BodyFile body;
    body.of = s.text("of");
    if (body.of != kBed && body.of != kSpindle && !machine.axis(body.of))
      s.error("of", "'of' is \"bed\", \"spindle\" or an axis of this machine, not '" + body.of + "'");
    body.file = s.text("file");
    s.takes("unit", {"mm", "inch", "m"});
    const std::string unit = s.find_text("unit").value_or("mm");
    body.mm_per_unit = unit == "inch" ? kMmPerInch : unit == "m" ? kMmPerMetre : 1.0;
    if (unit != "mm" && unit != "inch" && unit != "m") s.error("unit", "'unit' is \"mm\", \"inch\" or \"m\"");
    body.offset_mm = s.find_vector("offset_mm").value_or(Vec3::Zero());
    s.finish();
    out.push_back(std::move(body));
  }
  return out;
}

Result<std::vector<BodyMesh>> load_body_meshes(const Machine& machine, Diagnostics& diagnostics) {
  if (machine.file.empty() || machine.file == "-") return std::vector<BodyMesh>{};  // it lies nowhere
  const auto text = read_file(machine.file);
  if (!text) return tl::unexpected(text.error());
  const auto value = config::parse_toml(*text, machine.file);
  if (!value) return tl::unexpected(value.error());
  config::Section root(*value, "file", machine.file, diagnostics);
  std::vector<BodyMesh> out;
  for (const BodyFile& body : read_bodies(root, machine)) {
    namespace fs = std::filesystem;
    const fs::path file = fs::path(body.file).is_absolute()
                              ? fs::path(body.file)
                              : fs::path(machine.file).parent_path() / body.file;
    const auto bytes = read_file(file.string());
    if (!bytes) return tl::unexpected(bytes.error());
    auto corners = parse_stl(*bytes, file.string());
    if (!corners) return tl::unexpected(corners.error());
    BodyMesh mesh{file.filename().string(), false, 0, std::move(*corners)};
    place(mesh, machine, body.of);
    for (auto& corner : mesh.corners)
      for (std::size_t k = 0; k < 3; ++k)
        corner[k] = static_cast<float>(body.mm_per_unit * static_cast<double>(corner[k]) +
                                       body.offset_mm[static_cast<Eigen::Index>(k)]);
    out.push_back(std::move(mesh));
  }
  return out;
}

}  // namespace trunnion
