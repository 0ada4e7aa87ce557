#pragma once
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"
#include "trunnion/machine/machine.hpp"

namespace trunnion {

/// Triangles of a body, three corners each, counter-clockwise from outside.
using Triangles = std::vector<std::array<float, 3>>;

/// The shape of a body of the machine, for pictures only: no check looks at it.
struct BodyMesh {
  std::string name;  // its file's
  bool on_part_side = false;
  std::size_t axes = 0;  // carried by so many axes of that side's chain, from the bed outwards
  Triangles corners;     // in M with all axes at zero, mm
};

/// Reads an STL file, binary or text, coordinates as they stand. Errors with the line of a text, the number
/// of the triangle of a binary file: cut short, no number, not finite, no triangle at all, more than two
/// million of them.
Result<Triangles> parse_stl(std::string_view bytes, const std::string& file);

/// The shapes of [[body]] in the machine's file, read anew: `of` is "bed", "spindle" or an axis, `file` an
/// STL file beside the machine file, `unit` that of its numbers, `offset_mm` is added. None where it has
/// none.
Result<std::vector<BodyMesh>> load_body_meshes(const Machine& machine, Diagnostics& diagnostics);

/// The same with fewer triangles, corners moved to a grid that is made coarser until `most` are left.
Triangles coarsened(const Triangles& corners, std::size_t most);

}  // namespace trunnion
