#include "trunnion/machine/motion_plan.hpp"

#include "trunnion/machine/motion_time.hpp"

#include "machine/look_ahead.hpp"

namespace trunnion {

class MotionPlan::Kind {
 public:
  Kind() = default;
  Kind(const Kind&) = delete;
  Kind& operator=(const Kind&) = delete;
  virtual ~Kind() = default;

  virtual void add(const Block& block) = 0;
  virtual void stop() = 0;
  virtual void lose() = 0;
  virtual std::size_t waiting() const = 0;
  virtual void settle(std::size_t count, std::vector<BlockRun>& out) = 0;
};

/// A control that stops at block ends, or looks one block ahead.
class MotionPlan::OneAhead : public Kind {
 public:
  OneAhead(const Machine& machine, std::optional<double> blend_mm, PlanOf what)
      : time_(machine, blend_mm), what_(what) {}

  void add(const Block& block) override {
    const double least_s = time_.least_seconds(block.from, block.to);
    runs_.push_back({block.seconds < least_s ? block.seconds / least_s : 1.0,
                     what_ == PlanOf::paces ? 0.0 : time_.go(block.from, block.to, block.seconds)});
  }
  void stop() override {
    if (what_ == PlanOf::paces) return;
    const double more_s = time_.stop();
    if (!runs_.empty()) runs_.back().seconds += more_s;
  }
  void lose() override { stop(); }
  std::size_t waiting() const override { return runs_.size(); }
  void settle(std::size_t count, std::vector<BlockRun>& out) override {
    const auto end = runs_.begin() + static_cast<std::ptrdiff_t>(count);
    out.insert(out.end(), runs_.begin(), end);
    runs_.erase(runs_.begin(), end);
  }

 private:
  MotionTime time_;
  PlanOf what_;
  std::vector<BlockRun> runs_;
};

/// A control that slows down in time.
class MotionPlan::ManyAhead : public Kind {
 public:
  ManyAhead(const Machine& machine, std::optional<double> blend_mm, const JointVector& digits, PlanOf what)
      : path_(machine, blend_mm, digits), what_(what) {}

  void add(const Block& block) override {
    if (block.apart) path_.stop();
    path_.add(block.from, block.to, block.seconds);
    if (block.apart) path_.stop();
  }
  void stop() override { path_.stop(); }
  void lose() override { path_.lose(); }
  std::size_t waiting() const override { return path_.waiting(); }
  void settle(std::size_t count, std::vector<BlockRun>& out) override {
    profiles_.clear();
    path_.settle(count, profiles_);
    for (const SpeedProfile& profile : profiles_)
      out.push_back({profile.pace(), what_ == PlanOf::paces ? 0.0 : profile.seconds()});
  }

 private:
  LookAhead path_;
  PlanOf what_;
  std::vector<SpeedProfile> profiles_;
};

MotionPlan::MotionPlan(const Machine& machine, const BlockEnds& ends, const JointVector& digits,
                       PlanOf what) {
  if (ends.stops)
    kind_ = std::make_unique<OneAhead>(machine, std::nullopt, what);
  else if (ends.looks_ahead)
    kind_ = std::make_unique<ManyAhead>(machine, ends.blend_mm, digits, what);
  else
    kind_ = std::make_unique<OneAhead>(machine, ends.blend_mm.value_or(0.0), what);
}
MotionPlan::MotionPlan(MotionPlan&&) noexcept = default;
MotionPlan& MotionPlan::operator=(MotionPlan&&) noexcept = default;
MotionPlan::~MotionPlan() = default;

void MotionPlan::add(const Block& block) {
  kind_->add(block);
}

void MotionPlan::stop() {
  kind_->stop();
}

void MotionPlan::lose() {
  kind_->lose();
}

std::size_t MotionPlan::waiting() const {
  return kind_->waiting();
}

void MotionPlan::settle(std::size_t count, std::vector<BlockRun>& out) {
  kind_->settle(count, out);
}

}  // namespace trunnion
