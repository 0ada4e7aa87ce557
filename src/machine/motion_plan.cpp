#include "trunnion/machine/motion_plan.hpp"

#include <algorithm>

#include "machine/look_ahead.hpp"
#include "machine/smooth_ahead.hpp"

namespace trunnion {

class MotionPlan::Kind {
 public:
  Kind() = default;
  Kind(const Kind&) = delete;
  Kind& operator=(const Kind&) = delete;
  virtual ~Kind() = default;

  virtual void add(const Block& block) = 0;
  virtual void stop() = 0;
  virtual void rest() = 0;
  virtual void lose() = 0;
  virtual std::size_t waiting() const = 0;
  virtual void settle(std::size_t count, std::vector<BlockRun>& out) = 0;
};

/// A control that stops at block ends, or looks one block ahead.
class MotionPlan::OneAhead : public Kind {
 public:
  OneAhead(const Machine& machine, std::optional<double> blend_mm, PlanOf what)
      : time_(machine, blend_mm, what) {}

  void add(const Block& block) override {
    if (block.apart != is_apart_) time_.rest(runs_);
    is_apart_ = block.apart;
    time_.go(block.from, block.to, block.seconds, runs_);
    ++waiting_;
  }
  void stop() override { time_.stop(runs_); }
  void rest() override { time_.rest(runs_); }
  void lose() override { time_.lose(runs_); }
  std::size_t waiting() const override { return waiting_; }
  void settle(std::size_t count, std::vector<BlockRun>& out) override {
    if (runs_.size() < count) time_.stop(runs_);
    const auto end = runs_.begin() + static_cast<std::ptrdiff_t>(count);
    out.insert(out.end(), runs_.begin(), end);
    runs_.erase(runs_.begin(), end);
    waiting_ -= count;
  }

 private:
  MotionTime time_;
  bool is_apart_ = false;  // the last one
  std::vector<BlockRun> runs_;
  std::size_t waiting_ = 0;
};

/// A control that slows down in time; `Path` finds its speeds.
template <class Path>
class MotionPlan::ManyAhead : public Kind {
 public:
  explicit ManyAhead(Path path) : path_(std::move(path)) {}

  void add(const Block& block) override {
    if (block.apart) path_.stop();
    path_.add(block.from, block.to, block.seconds);
    if (block.apart) path_.stop();
  }
  void stop() override { path_.stop(); }
  void rest() override { path_.stop(); }
  void lose() override { path_.lose(); }
  std::size_t waiting() const override { return path_.waiting(); }
  void settle(std::size_t count, std::vector<BlockRun>& out) override { path_.settle(count, out); }

 private:
  Path path_;
};

bool MotionPlan::knows_jerk(const Machine& machine) {
  return std::all_of(machine.axes.begin(), machine.axes.end(),
                     [](const Axis& axis) { return axis.jerk.has_value(); });
}

MotionPlan::MotionPlan(const Machine& machine, const BlockEnds& ends, const JointVector& digits,
                       PlanOf what) {
  if (ends.stops)
    kind_ = std::make_unique<OneAhead>(machine, std::nullopt, what);
  else if (ends.looks_ahead && knows_jerk(machine))
    kind_ = std::make_unique<ManyAhead<SmoothAhead>>(SmoothAhead(machine, ends.blend_mm, digits, what));
  else if (ends.looks_ahead)
    kind_ = std::make_unique<ManyAhead<LookAhead>>(LookAhead(machine, ends.blend_mm, digits, what));
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

void MotionPlan::rest() {
  kind_->rest();
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
