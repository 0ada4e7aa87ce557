#include "trunnion/path/held_run.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "path/choice/choice_account.hpp"
#include "path/choice/far_limits.hpp"
#include "path/choice/global_choice.hpp"
#include "path/choice/point_store.hpp"
#include "path/choice/pole_settler.hpp"

namespace trunnion::path {

namespace {

// LINTOL changes the tolerance while the run is read, and more digits the resolution.
bool differ(const ChoiceOptions& a, const ChoiceOptions& b) {
  return a.inverse.axis_resolution != b.inverse.axis_resolution ||
         a.axis_tolerance.rad() != b.axis_tolerance.rad() || a.tool_mm != b.tool_mm;
}

}  // namespace

class HeldRun::Work {
 public:
  Work(const Machine& machine, const JointVector& seed, const ChoiceOptions& options, std::string cl_file)
      : machine_(machine),
        free_(without_far_limits(machine)),
        seed_(seed),
        options_(options),
        cl_file_(std::move(cl_file)),
        choice_(std::make_unique<GlobalChoice>(free_ ? *free_ : machine_, options_)),
        kinematics_(machine_, options_.tool_mm),
        settler_(machine_, kinematics_) {
    choice_->start(seed_);
  }

  void add(std::span<const ChoicePoint> points) {
    store_.add(points);
    if (!lost_) advance(points);
  }
  std::size_t size() const { return store_.size(); }

  Result<void> finish(const ChoiceOptions& options) {
    if (differ(options, options_)) {
      options_ = options;
      choose_on(free_ ? *free_ : machine_);
    }
    settle();
    if (free_ && (lost_ || !stays_within())) {
      choose_on(machine_);
      settle();
    }
    if (lost_) return tl::unexpected(unreachable(machine_, *lost_, options_, cl_file_));
    return {};
  }

  // At the pole C stands where the path has led it, which only its way there tells; with axes at right angles
  // it stands still on that way.
  ChosenPoint last() {
    ChosenPoint out = choice_->end();
    if (!out.singular || kinematics_.rotary_count() < 2 ||
        std::abs(kinematics_.direction(0).dot(kinematics_.direction(1))) < kRightAngle)
      return out;
    const GlobalChoice::Place here = choice_->place();
    PoleSettler settler = settler_;
    ChoiceSummary summary;
    std::vector<ChoicePoint> points;
    std::vector<ChosenPoint> chosen;
    for (std::size_t from = here.next; from < store_.size(); from = choice_->place().next) {
      points.clear();
      store_.append(from, std::min(from + kAtATime, store_.size()), points);
      chosen.resize(points.size());
      choice_->replay(points, chosen);
      settler.settle(points, chosen, summary, [&] { return pole_ahead(choice_->place().next); });
    }
    choice_->go_to(here);
    return chosen.empty() ? out : chosen.back();
  }

  std::size_t take(std::span<ChosenPoint> chosen, std::vector<ChoicePoint>& points, ChoiceSummary& summary) {
    const std::size_t begin = choice_->place().next;
    const std::size_t end = std::min(begin + chosen.size(), store_.size());
    if (begin == end) return 0;
    const std::size_t first = points.size();
    store_.append(begin, end, points);
    const auto piece = chosen.first(end - begin);
    const auto of_piece = std::span<const ChoicePoint>(points).subspan(first);
    choice_->replay(of_piece, piece);
    settler_.settle(of_piece, piece, summary, [&] { return pole_ahead(end); });
    if (!account_) account_.emplace(machine_, seed_, summary.goes_on ? summary.last_branch : piece[0].branch);
    account_->add(piece, summary);
    store_.forget_before(end);
    return end - begin;
  }

 private:
  static constexpr std::size_t kAtATime = 1024;  // points of a run that is looked at again
  static constexpr double kRightAngle = 1e-12;   // cosine of the angle between the rotary axes

  void choose_on(const Machine& machine) {
    choice_ = std::make_unique<GlobalChoice>(machine, options_);
    choose_again(GlobalChoice::kFewPositions);
  }

  void settle() {
    for (std::size_t most = 0; !lost_ && (most = choice_->settle()) > 0;) choose_again(most);
  }

  // What was chosen without far limits is within them.
  bool stays_within() {
    const GlobalChoice::Place here = choice_->place();
    bool within = true;
    std::vector<ChosenPoint> chosen;
    for (std::size_t i = 0; i < store_.size() && within; i += kAtATime) {
      ahead_points_.clear();
      store_.append(i, std::min(i + kAtATime, store_.size()), ahead_points_);
      chosen.resize(ahead_points_.size());
      choice_->replay(ahead_points_, chosen);
      within = keeps_far_limits(machine_, chosen);
    }
    choice_->go_to(here);
    return within;
  }

  void advance(std::span<const ChoicePoint> points) {
    if (const ChoicePoint* lost = choice_->advance(points)) lost_ = *lost;
  }

  void choose_again(std::size_t most) {
    choice_->start(seed_, most);
    lost_.reset();
    for (std::size_t i = 0; i < store_.size() && !lost_; i += kAtATime) {
      ahead_points_.clear();
      store_.append(i, std::min(i + kAtATime, store_.size()), ahead_points_);
      advance(ahead_points_);
    }
  }

  // The stretch at the pole that goes on behind `begin`, the next point of the replay.
  PoleSettler::Ahead pole_ahead(std::size_t begin) {
    PoleSettler::Ahead out;
    const GlobalChoice::Place here = choice_->place();
    Vec3 tip_P = begin > 0 && begin < store_.size() ? store_.at(begin - 1).pose.tip_P : Vec3::Zero();
    while (!out.next && choice_->place().next < store_.size()) {
      const std::size_t from = choice_->place().next;
      ahead_points_.clear();
      store_.append(from, std::min(from + PoseSolver::kAhead, store_.size()), ahead_points_);
      ahead_.resize(ahead_points_.size());
      choice_->replay(ahead_points_, ahead_);
      for (std::size_t i = 0; i < ahead_.size() && !out.next; ++i) {
        if (PoleSettler::goes_on(ahead_points_[i], ahead_[i])) {
          out.way_mm += (ahead_points_[i].pose.tip_P - tip_P).norm();
          tip_P = ahead_points_[i].pose.tip_P;
          ++out.points;
        } else {
          out.next = ahead_[i];
          out.next_axis_P = ahead_points_[i].pose.axis_P;
          out.next_rapid = ahead_points_[i].rapid;
        }
      }
    }
    choice_->go_to(here);
    return out;
  }

  Machine machine_;
  std::optional<Machine> free_;  // the same without far limits: what is chosen on it is tried first
  JointVector seed_;
  ChoiceOptions options_;
  std::string cl_file_;
  std::unique_ptr<GlobalChoice> choice_;
  TableKinematics kinematics_;
  PoleSettler settler_;
  PointStore store_;
  std::optional<ChoicePoint> lost_;
  std::optional<ChoiceAccount> account_;
  std::vector<ChoicePoint> ahead_points_;
  std::vector<ChosenPoint> ahead_;
};

HeldRun::HeldRun(const Machine& machine, const JointVector& seed, const ChoiceOptions& options,
                 std::string cl_file)
    : work_(std::make_unique<Work>(machine, seed, options, std::move(cl_file))) {}

HeldRun::~HeldRun() = default;

void HeldRun::add(std::span<const ChoicePoint> points) {
  work_->add(points);
}

std::size_t HeldRun::size() const {
  return work_->size();
}

Result<void> HeldRun::finish(const ChoiceOptions& options) {
  return work_->finish(options);
}

ChosenPoint HeldRun::last() const {
  return work_->last();
}

std::size_t HeldRun::take(std::span<ChosenPoint> chosen, std::vector<ChoicePoint>& points,
                          ChoiceSummary& summary) {
  return work_->take(chosen, points, summary);
}

}  // namespace trunnion::path
