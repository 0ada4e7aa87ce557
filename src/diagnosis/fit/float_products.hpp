#pragma once
#include <Eigen/Core>

namespace trunnion::diagnosis {

/// a' b. The columns are long (readings) and few: where the processor has AVX2 and FMA this takes a quarter
/// of Eigen's time for the plain x86-64 that the program is compiled for. Sums of 1024 products are in float,
/// sums of those in double.
Eigen::MatrixXf inner_products(const Eigen::Ref<const Eigen::MatrixXf>& a,
                               const Eigen::Ref<const Eigen::MatrixXf>& b);

}  // namespace trunnion::diagnosis
