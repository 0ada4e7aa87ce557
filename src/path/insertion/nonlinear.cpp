#include "trunnion/path/nonlinear.hpp"

#include <array>

#include "path/insertion/run_refiner.hpp"

namespace trunnion::path {

std::optional<Method> method_from_text(std::string_view text) {
  if (text == "none") return Method::none;
  if (text == "reinsert") return Method::reinsert;
  if (text == "subtract") return Method::subtract;
  if (text == "adaptive") return Method::adaptive;
  return std::nullopt;
}

struct Refiner::Work {
  Work(const Machine& machine, const Vec3& tool_mm, const Rounding& rounding, const NonlinearOptions& options)
      : run(machine, tool_mm, rounding, options), segment(run.segment()) {}

  RunRefiner run;
  SegmentRefiner& segment;
  // The end of a segment is the start of the next: its station is kept.
  std::array<Station, 2> stations;
  std::size_t end = 0;
  bool known = false;

  SegmentEnds ends(const Ends& of) {
    const auto put = [&](Station& s, const Point& at, const TableKinematics::Sines* sines) {
      if (sines != nullptr)
        put_station(segment.kinematics(), at.q, *sines, s);
      else
        put_station(segment.kinematics(), at.q, s);
    };
    const std::size_t start = end;
    if (!known || !(stations[start].q == of.a.q)) put(stations[start], of.a, of.sines_a);
    end = 1 - start;
    put(stations[end], of.b, of.sines_b);
    known = true;
    return {&of.a, &of.b, &stations[start], &stations[end], false};
  }
};

Refiner::Refiner(const Machine& machine, const Vec3& tool_mm, const Rounding& rounding,
                 const NonlinearOptions& options)
    : work_(std::make_unique<Work>(machine, tool_mm, rounding, options)) {}
Refiner::~Refiner() = default;
Refiner::Refiner(Refiner&&) noexcept = default;
Refiner& Refiner::operator=(Refiner&&) noexcept = default;

SegmentReport Refiner::refine(const Point& a, const Point& b, const Tolerance& tolerance,
                              std::vector<Point>& out) {
  return work_->segment.refine(work_->ends({a, b}), tolerance, out);
}

SegmentReport Refiner::decide(const Ends& ends, const Tolerance& tolerance, double known_mm,
                              std::vector<Point>& out) {
  return work_->segment.decide(work_->ends(ends), tolerance, known_mm, out);
}

bool Refiner::bounds_decide() const {
  return work_->segment.predictor_is_below_truth();
}
SegmentReport Refiner::kept() const {
  return work_->segment.kept();
}

SegmentReport Refiner::measure(const Point& a, const Point& b, const Tolerance& tolerance) {
  return work_->segment.measure(work_->ends({a, b}), tolerance);
}

void Refiner::refine_run(std::span<const Point> run, const Tolerance& tolerance, std::vector<Point>& out,
                         std::vector<SegmentReport>& reports) {
  work_->run.refine(run, tolerance, out, reports);
}

}  // namespace trunnion::path
