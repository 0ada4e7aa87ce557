#pragma once
#include <optional>

#include "trunnion/machine/motion_plan.hpp"
#include "trunnion/nc/controller.hpp"

namespace trunnion::post {

/// How this control runs a program on this machine; nothing where the machine file does not say of every axis
/// how fast it accelerates. `machine` must outlive the plan.
/// @param smoothing_mm  PostOptions::smoothing_mm
std::optional<MotionPlan> plan_of_control(const Machine& machine, const nc::Controller& controller,
                                          std::optional<double> smoothing_mm, PlanOf what);

}  // namespace trunnion::post
