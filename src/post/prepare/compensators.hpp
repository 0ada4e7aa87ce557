#pragma once
#include <map>
#include <mutex>
#include <string>

#include "trunnion/path/compensation.hpp"

namespace trunnion::post {

/// The compensators of one program, one for each gauge length. Several threads may ask at the same time.
class Compensators {
 public:
  /// Must outlive the object.
  Compensators(const Machine& machine, const Model& model) : machine_(machine), model_(model) {}

  /// The reference stays valid as long as this object lives.
  const path::Compensator& of(double length_mm) {
    const std::lock_guard lock(mutex_);
    return of_length_.try_emplace(length_mm, machine_, model_, Vec3(0.0, 0.0, -length_mm)).first->second;
  }
  /// One that corrects the direction of the tool, too.
  const path::Compensator& turning(double length_mm) {
    const std::lock_guard lock(mutex_);
    path::CompensationOptions options;
    options.orientation = true;
    return turning_.try_emplace(length_mm, machine_, model_, Vec3(0.0, 0.0, -length_mm), options)
        .first->second;
  }

  /// Of the effects of the model, each alone and at rest, the one that moves the tip farthest at this state.
  struct LargestEffect {
    std::string id;
    double tip_mm = 0.0;
  };
  LargestEffect largest_effect(const MachineState& at, double length_mm) const;

 private:
  const Machine& machine_;
  const Model& model_;
  std::mutex mutex_;
  std::map<double, path::Compensator> of_length_, turning_;
};

}  // namespace trunnion::post
