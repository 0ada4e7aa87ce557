#include <algorithm>
#include <cmath>

#include "diagnosis/verdict/unrecorded.hpp"

// A drift that settles, or of an axis or the part, or in some runs only: the library has a steady one of the
// tool in all runs. With an axis that goes one way in time it passes for an error of that axis.
namespace trunnion::diagnosis {
namespace {

constexpr std::size_t kFewestOfRun = 8;
constexpr double kSteady_s = 3600.0;  // columns of the size of those that settle
constexpr double kLargest_mm = 0.2;   // in an hour, or in the end: ten times what machines do

// In which runs.
struct Where {
  std::vector<std::size_t> runs;
  std::string words;
  std::optional<std::size_t> only_in;
};

bool moves_in(const Observations& o, std::size_t run, AxisId axis) {
  const auto& rows = o.runs()[run];
  return std::any_of(rows.begin(), rows.end(), [&](Eigen::Index i) {
    return std::abs(o.state(i).q[axis] - o.state(rows.front()).q[axis]) > 1e-6;
  });
}

// Every run, each by itself, those in which an axis moves; none twice.
std::vector<Where> where_it_may_act(const Observations& o) {
  std::vector<Where> out(1);
  for (std::size_t run = 0; run < o.runs().size(); ++run) out[0].runs.push_back(run);
  out[0].words = "in every run";
  const auto add = [&](Where one) {
    if (!one.runs.empty() &&
        std::none_of(out.begin(), out.end(), [&](const Where& known) { return known.runs == one.runs; }))
      out.push_back(std::move(one));
  };
  for (std::size_t run = 0; run < o.runs().size(); ++run)
    if (o.runs()[run].size() >= kFewestOfRun)
      add({{run}, "in run '" + o.data().context.runs[run].id + "' alone", run});
  for (AxisId axis = 0; axis < o.machine().axes.size(); ++axis) {
    Where some{{}, "in the runs in which " + o.machine().axes[axis].name + " moves", {}};
    for (std::size_t run = 0; run < o.runs().size(); ++run)
      if (moves_in(o, run, axis)) some.runs.push_back(run);
    add(std::move(some));
  }
  return out;
}

// Three translations of the link from the beginning of each of the runs on.
MatrixXd drifting(const Observations& o, std::size_t link, const std::vector<std::size_t>& runs,
                  double tau_s) {
  const MatrixXd& response = o.response(link);
  MatrixXd out = MatrixXd::Zero(o.size(), 3);
  for (const std::size_t run : runs) {
    const auto& rows = o.runs()[run];
    double start_s = INFINITY;
    for (const Eigen::Index i : rows) start_s = std::min(start_s, o.state(i).time_s);
    for (const Eigen::Index i : rows) {
      const double since_s = o.state(i).time_s - start_s;
      out.row(i) = response.row(i).head<3>() *
                   (std::isinf(tau_s) ? since_s / kSteady_s : -std::expm1(-since_s / tau_s));
    }
  }
  return out;
}

}  // namespace

std::vector<UnrecordedCondition> drifts(const Observations& o) {
  std::vector<UnrecordedCondition> out;
  const std::size_t spindle = o.link_count() - 2, part = o.link_count() - 1;
  for (const Where& where : where_it_may_act(o)) {
    const auto add = [&](std::size_t link, const std::string& of) {
      UnrecordedCondition one;
      one.what = "a drift of " + of + " " + where.words;
      one.remedy = where.only_in
                       ? "Let instrument and set-up of that run settle, and measure it once more, there "
                         "and back."
                       : "Let machine and instrument settle first, and measure the same poses in "
                         "another order.";
      one.only_in = where.only_in;
      one.goes_with_time = true;
      one.steady_is_known = link == spindle && where.runs.size() == o.runs().size();
      one.stands_for = may_come_of_order;
      one.columns = [&o, link, runs = where.runs](double tau_s) { return drifting(o, link, runs, tau_s); };
      one.largest = VectorXd::Constant(3, kLargest_mm);
      out.push_back(std::move(one));
    };
    add(spindle, "the tool");
    for (AxisId axis = 0; axis < o.machine().axes.size(); ++axis)
      if (o.machine().axes[axis].kind == AxisKind::rotary)
        add(axis, "the axis of " + o.machine().axes[axis].name);
    add(part, "the part");
  }
  return out;
}

}  // namespace trunnion::diagnosis
