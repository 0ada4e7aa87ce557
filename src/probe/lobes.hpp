#pragma once
#include <vector>

#include "trunnion/probe/reading.hpp"
#include "trunnion/probe/sphere.hpp"

namespace trunnion::probe {

/// By how much the centres are farther apart where they touch in the direction `n` (unit, in M, from the
/// ball's centre): sum of c cos(k a) + s sin(k a) about the spindle, times how far `n` leans from it. mm.
double lobes_mm(const std::vector<Lobes>& lobes, const Vec3& n);

/// What goes two, three or four times round the spindle in the residuals of touches about their spheres,
/// where the evidence for it is strong. Once round it shifts all centres alike, and is not seen. `sets_mm` as
/// for fit_common_radius.
std::vector<Lobes> find_lobes(const std::vector<std::vector<Vec3>>& sets_mm, const CommonSpheres& common);

/// The touches as a probe without these lobes would have them.
std::vector<std::vector<Vec3>> without_lobes(std::vector<std::vector<Vec3>> sets_mm,
                                             const CommonSpheres& common, const std::vector<Lobes>& lobes);

}  // namespace trunnion::probe
