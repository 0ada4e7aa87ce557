#include "diagnosis/fit/float_products.hpp"

#include <algorithm>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace trunnion::diagnosis {
namespace {

#if defined(__x86_64__)

constexpr Eigen::Index kProductChunk = 1024;  // readings: seven columns of them stay in the first-level cache
constexpr Eigen::Index kLanes = 8;            // floats of an AVX register
constexpr std::size_t kTileA = 4, kTileB = 3;  // 12 sums and 4 operands are the 16 registers

// c(i, k) += sum over n of a(n, i) b(n, k), for one tile; leading dimensions in floats.
template <std::size_t I, std::size_t K>
__attribute__((target("avx2,fma"))) void add_tile(const float* a, Eigen::Index a_stride, const float* b,
                                                  Eigen::Index b_stride, Eigen::Index n, double* c,
                                                  Eigen::Index c_stride) {
  const auto at = [](std::size_t k, Eigen::Index stride) { return static_cast<Eigen::Index>(k) * stride; };
  __m256 sum[I][K];
  for (auto& row : sum)
    for (auto& s : row) s = _mm256_setzero_ps();
  Eigen::Index r = 0;
  for (; r + kLanes <= n; r += kLanes) {
    __m256 right[K];
    for (std::size_t k = 0; k < K; ++k) right[k] = _mm256_loadu_ps(b + at(k, b_stride) + r);
    for (std::size_t i = 0; i < I; ++i) {
      const __m256 left = _mm256_loadu_ps(a + at(i, a_stride) + r);
      for (std::size_t k = 0; k < K; ++k) sum[i][k] = _mm256_fmadd_ps(left, right[k], sum[i][k]);
    }
  }
  for (std::size_t i = 0; i < I; ++i)
    for (std::size_t k = 0; k < K; ++k) {
      alignas(32) float lanes[kLanes];
      _mm256_store_ps(lanes, sum[i][k]);
      double total = 0.0;
      for (const float lane : lanes) total += static_cast<double>(lane);
      for (Eigen::Index t = r; t < n; ++t)
        total += static_cast<double>(a[at(i, a_stride) + t]) * static_cast<double>(b[at(k, b_stride) + t]);
      c[at(i, 1) + at(k, c_stride)] += total;
    }
}

template <std::size_t I>
void add_tiles(const float* a, Eigen::Index a_stride, const float* b, Eigen::Index b_stride, Eigen::Index n,
               Eigen::Index columns, double* c, Eigen::Index c_stride) {
  Eigen::Index k = 0;
  for (; k + Eigen::Index{kTileB} <= columns; k += Eigen::Index{kTileB})
    add_tile<I, kTileB>(a, a_stride, b + k * b_stride, b_stride, n, c + k * c_stride, c_stride);
  for (; k < columns; ++k)
    add_tile<I, 1>(a, a_stride, b + k * b_stride, b_stride, n, c + k * c_stride, c_stride);
}

Eigen::MatrixXf tiled(const Eigen::Ref<const Eigen::MatrixXf>& a,
                      const Eigen::Ref<const Eigen::MatrixXf>& b) {
  Eigen::MatrixXd c = Eigen::MatrixXd::Zero(a.cols(), b.cols());
  for (Eigen::Index r = 0; r < a.rows(); r += kProductChunk) {
    const Eigen::Index n = std::min(kProductChunk, a.rows() - r);
    Eigen::Index i = 0;
    for (; i + Eigen::Index{kTileA} <= a.cols(); i += Eigen::Index{kTileA})
      add_tiles<kTileA>(a.data() + r + i * a.outerStride(), a.outerStride(), b.data() + r, b.outerStride(), n,
                        b.cols(), c.data() + i, c.rows());
    for (; i < a.cols(); ++i)
      add_tiles<1>(a.data() + r + i * a.outerStride(), a.outerStride(), b.data() + r, b.outerStride(), n,
                   b.cols(), c.data() + i, c.rows());
  }
  return c.cast<float>();
}

bool has_fma() {
  static const bool out = __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
  return out;
}

#endif

}  // namespace

Eigen::MatrixXf inner_products(const Eigen::Ref<const Eigen::MatrixXf>& a,
                               const Eigen::Ref<const Eigen::MatrixXf>& b) {
#if defined(__x86_64__)
  if (has_fma()) return tiled(a, b);
#endif
  return a.transpose() * b;
}

}  // namespace trunnion::diagnosis
