#pragma once
#include <algorithm>
#include <array>
#include <deque>
#include <memory>
#include <span>
#include <vector>

#include "trunnion/base/large_pages.hpp"
#include "trunnion/path/solution_choice.hpp"

namespace trunnion::path {

/// Points of a run that are held, 56 bytes each and a bit, until they are forgotten from the first one on.
/// They are as many as the CL file has, and memory that is touched for the first time costs more than all
/// that is done with it here: so it comes in large pages.
class PointStore {
 public:
  void add(std::span<const ChoicePoint> points) {
    while (!points.empty()) {
      const std::size_t begin = size_ % kOfPage;
      if (begin == 0) add_page();
      const std::size_t count = std::min(points.size(), kOfPage - begin);
      pages_.back()->put(begin, points.first(count));
      size_ += count;
      points = points.subspan(count);
    }
  }
  std::size_t size() const { return size_; }
  ChoicePoint at(std::size_t index) const { return pages_[index / kOfPage - gone_]->at(index % kOfPage); }
  void append(std::size_t begin, std::size_t end, std::vector<ChoicePoint>& out) const {
    while (begin < end) {
      const Page& page = *pages_[begin / kOfPage - gone_];
      const std::size_t first = begin % kOfPage;
      const std::size_t last = std::min(first + (end - begin), kOfPage);
      for (std::size_t i = first; i < last; ++i) out.push_back(page.at(i));
      begin += last - first;
    }
  }
  /// Points before this one are not asked for any more.
  void forget_before(std::size_t index) {
    for (; gone_ < index / kOfPage; ++gone_) pages_.pop_front();
  }

 private:
  // Without the seven bytes beside `rapid`, and nothing of it before there is a point.
  struct Packed {
    std::array<double, 6> pose;
    std::uint32_t line, column;
  };
  static constexpr std::size_t kBits = 64;
  static constexpr std::size_t kOfPage =
      kLargePage / (kBits * sizeof(Packed) + sizeof(std::uint64_t)) * kBits;

  struct alignas(kLargePage) Page {
    std::array<Packed, kOfPage> point;
    std::array<std::uint64_t, kOfPage / kBits> rapid;

    void put(std::size_t begin, std::span<const ChoicePoint> points) {
      for (std::size_t k = 0; k < points.size(); ++k) {
        const ChoicePoint& p = points[k];
        const Vec3& tip = p.pose.tip_P;
        const Vec3& axis = p.pose.axis_P;
        const std::size_t i = begin + k;
        point[i] = {{tip.x(), tip.y(), tip.z(), axis.x(), axis.y(), axis.z()}, p.where.line, p.where.column};
        if (i % kBits == 0) rapid[i / kBits] = 0;
        rapid[i / kBits] |= std::uint64_t{p.rapid} << (i % kBits);
      }
    }
    ChoicePoint at(std::size_t i) const {
      const auto& [x, y, z, u, v, w] = point[i].pose;
      return {{{x, y, z}, {u, v, w}},
              {point[i].line, point[i].column},
              (rapid[i / kBits] >> (i % kBits) & 1) != 0};
    }
  };
  static_assert(sizeof(Page) == kLargePage);

  // A run that ends in the first page takes no more of it than it fills.
  void add_page() {
    pages_.push_back(std::make_unique_for_overwrite<Page>());
    if (pages_.size() + gone_ > 1) ask_for_large_pages(pages_.back().get(), sizeof(Page));
  }

  std::deque<std::unique_ptr<Page>> pages_;
  std::size_t gone_ = 0;  // pages
  std::size_t size_ = 0;
};

}  // namespace trunnion::path
