#include <algorithm>
#include <utility>

#include "post/verifier_state.hpp"

namespace trunnion::post {

bool VerifyReport::within_tolerance() const {
  // A hair for the rounding errors of the evaluation itself.
  constexpr double kRounding_mm = 1e-9;
  constexpr double kRounding_rad = 1e-12;
  return certified_tip_deviation_mm <= tolerance_mm + kRounding_mm &&
         max_point_deviation_mm <= tolerance_mm + kRounding_mm &&
         max_axis_deviation.rad() <= axis_tolerance.rad() + kRounding_rad &&
         max_pole_axis_deviation.rad() <= axis_tolerance.rad() + pole_tolerance.rad() + kRounding_rad &&
         (!rapid_tolerance_mm || max_rapid_deviation_mm <= *rapid_tolerance_mm + kRounding_mm);
}

Verifier::Verifier(const Machine& machine, const nc::Controller& controller, const Vec3& tool_mm,
                   const VerifyOptions& options, std::string nc_file, Diagnostics& diagnostics)
    : state_(
          std::make_unique<State>(machine, controller, tool_mm, options, std::move(nc_file), diagnostics)) {}
Verifier::~Verifier() = default;

void Verifier::expect(const cl::Motion& motion, SourceRef where) {
  State& s = *state_;
  ++s.report.points_in;
  s.points->add(motion, where.line, s.in_cone(motion.axis_P));
  if (s.follower != nullptr) ++s.follower->report.points_in;
}

void Verifier::text(std::string_view piece) {
  state_->points->settle();
  state_->reader.feed(piece);
}

void Verifier::share_with(Verifier& other) {
  state_->follower = other.state_.get();
  other.state_->follows = true;
  other.state_->leader = state_.get();
  other.state_->points = state_->points;
  // Nothing that only one of them knows of changes where its words lead.
  const auto only_words = [](const State& s) {
    return !s.offsets && s.options.run_time_temperatures == nullptr;
  };
  other.state_->same_words = only_words(*state_) && only_words(*other.state_);
}

Result<VerifyReport> Verifier::finish() {
  State& s = *state_;
  s.points->settle();
  if (!s.follows) {
    if (auto read = s.reader.finish(); !read) return tl::unexpected(read.error());
  }
  s.all_expected = true;
  s.work();
  s.settle_rapid_end();
  if (s.started && s.at.segment + 1 < s.targets().size()) {
    const Target& next = s.targets()[s.at.segment + 1];
    if (combined_distance(*s.previous, next.tip_P, next.axis_P) <= s.near_point_mm()) s.mark_programmed();
  }
  // CL points behind the last block were met if the tool stands there (a repeated point), else they are
  // missed.
  for (std::size_t i = s.started ? s.at.segment + 1 : 0; i < s.targets().size(); ++i) {
    const Target& target = s.targets()[i];
    const Angle allowed =
        s.options.axis_tolerance + (s.in_cone(target.axis_P) ? s.options.pole.tolerance : Angle{});
    const double d =
        s.started ? (s.previous->tip_P - target.tip_P).norm() : std::numeric_limits<double>::infinity();
    if (d <= s.options.tolerance_mm && angle_between(s.previous->axis_P, target.axis_P) <= allowed) {
      s.point_hit(d);
    } else {
      ++s.report.points_missed;
    }
  }
  s.report_travel();
  return std::move(s.report);
}

cl::ReaderOptions reading_within(cl::ReaderOptions reading, double tolerance_mm) {
  constexpr double kShare = 0.1;
  reading.arc_tolerance_mm = std::min(reading.arc_tolerance_mm, kShare * tolerance_mm);
  return reading;
}

Result<VerifyReport> verify(std::unique_ptr<cl::TextSource> cl, const std::string& cl_file,
                            std::unique_ptr<cl::TextSource> nc, const std::string& nc_file,
                            const Machine& machine, const nc::Controller& controller,
                            const cl::ReaderOptions& reading, const VerifyOptions& options,
                            Diagnostics& diagnostics) {
  Verifier verifier(machine, controller, machine.tool_vector(), options, nc_file, diagnostics);
  const std::size_t errors = diagnostics.error_count();
  cl::Reader reader(std::move(cl), cl_file, reading_within(reading, options.tolerance_mm), diagnostics);
  cl::Record record;
  while (reader.next(record)) {
    if (const auto* motion = std::get_if<cl::Motion>(&record.data)) verifier.expect(*motion, record.where);
  }
  if (diagnostics.error_count() > errors) return tl::unexpected(diagnostics.first_error());
  std::array<char, 1 << 16> buffer;
  for (;;) {
    const auto size = nc->read(buffer.data(), buffer.size());
    if (!size) return tl::unexpected(size.error());
    if (*size == 0) break;
    verifier.text({buffer.data(), *size});
  }
  return verifier.finish();
}

}  // namespace trunnion::post
