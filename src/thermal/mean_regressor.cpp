#include <array>

#include "thermal/regressors.hpp"

namespace trunnion::thermal {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using Member = std::shared_ptr<const Regressor>;

constexpr std::array kMembers = {"ridge", "combined", "gp"};

// The mean of what its members say; all know the same features.
class Mean final : public Regressor {
 public:
  explicit Mean(std::vector<Member> members) : members_(std::move(members)) {}
  double level_mm(const VectorXd& x) const override {
    double sum = 0.0;
    for (const Member& m : members_) sum += m->level_mm(x);
    return sum / static_cast<double>(members_.size());
  }
  double change_mm(const VectorXd& from, const VectorXd& to) const override {
    double sum = 0.0;
    for (const Member& m : members_) sum += m->change_mm(from, to);
    return sum / static_cast<double>(members_.size());
  }
  config::Table table() const override {
    config::Table out;
    for (std::size_t i = 0; i < members_.size(); ++i)
      out.emplace_back(kMembers[i], config::Value{members_[i]->table(), {}});
    return out;
  }

 private:
  std::vector<Member> members_;  // one for each of kMembers
};

}  // namespace

Result<Member> fit_mean(const TrainingSet& training) {
  TrainingSet temperatures = training;
  temperatures.from = training.from.leftCols(training.temperatures);
  temperatures.to = training.to.leftCols(training.temperatures);
  auto ridge = fit_ridge(temperatures);
  if (!ridge) return ridge;
  VectorXd weights = VectorXd::Zero(training.to.cols());
  weights.head(training.temperatures) = *(*ridge)->weights_mm();
  auto combined = fit_ridge(training);
  if (!combined) return combined;
  auto gp = fit_gp(training);
  if (!gp) return gp;
  return std::make_shared<const Mean>(
      std::vector<Member>{linear_regressor(0.0, std::move(weights)), *combined, *gp});
}

Member read_mean(std::size_t features, config::Section& section) {
  std::vector<Member> members;
  for (const char* name : kMembers) {
    auto part = section.find_section(name);
    if (!part) {
      section.error(name, std::string("a mean needs [channel.parameters.") + name + "]");
      return nullptr;
    }
    members.push_back(std::string_view(name) == "gp" ? read_gp(features, *part)
                                                     : read_linear(features, *part));
    part->finish();
    if (!members.back()) return nullptr;
  }
  return std::make_shared<const Mean>(std::move(members));
}

}  // namespace trunnion::thermal
