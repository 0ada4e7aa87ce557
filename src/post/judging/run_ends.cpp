#include "post/judging/run_ends.hpp"

#include <algorithm>
#include <array>
#include <span>

namespace trunnion::post {

void RunEnds::evaluate(const nc::MotionRun& run, const JointVector& from, const WordsInForce& words,
                       const ControlTimes& times, const TravelSeen& travel) {
  const lanes::Way way = lanes::way();
  const AxisWordsOf& axis_words = words.axis_words();
  stations.resize(run.count + 1);
  for (AxisId id = 0; id < kMaxAxes; ++id) stations.of_axis(id)[0] = from[id];
  lanes::at_a_time(way, [&]<class T>() { put_words<T>(run, from, words); });
  within_limits = true;
  for (AxisId id = 0; id < axis_words.count; ++id)
    within_limits = within_limits && travel.holds(id, smallest_q[id], largest_q[id]);
  stations.evaluate();
  std::array<const double*, kMaxAxes> q{};
  for (AxisId id = 0; id < kMaxAxes; ++id) q[id] = stations.of_axis(id).data();
  seconds.resize(run.count + lanes::kCount<Quads>);
  slowest_s.resize(run.count + lanes::kCount<Quads>);
  way_mm.resize(run.count + lanes::kCount<Quads>);
  times.of_blocks({q, run.feed_mode, std::span(run.feed).first(run.count)}, seconds, slowest_s);
  lanes::at_a_time(way, [&]<class T>() {
    find_ways<T>(run.count);
    find_speed<T>(run.count);
  });
  within_limits = within_limits && speed_ratio <= 1.0 + kSpeedRounding;
}

template <class T>
void RunEnds::put_words(const nc::MotionRun& run, const JointVector& from, const WordsInForce& words) {
  const AxisWordsOf& axis_words = words.axis_words();
  constexpr std::size_t kTogether = lanes::kCount<T>;
  for (AxisId id = 0; id < axis_words.count; ++id) {
    const WordOfAxis& word = axis_words.of[id];
    const std::int32_t* const quanta = run.quanta[word.letter].data();
    double* const q = stations.of_axis(id).data() + 1;
    T smallest = lanes::splat<T>(from[id]);
    T largest = smallest;
    const double offset = words.offset[id];
    const auto put = [&](std::size_t i, const T& whole) {
      const T place = whole / word.scale * word.factor - offset;
      lanes::store(q + i, place);
      largest = lanes::larger(largest, place);
      smallest = lanes::select(smallest < place, smallest, place);
    };
    std::size_t i = 0;
    for (; i + kTogether <= run.count; i += kTogether) put(i, lanes::load_whole<T>(quanta + i));
    if (i < run.count)
      put(i, lanes::collect<T>(
                 [&](std::size_t k) { return static_cast<double>(quanta[std::min(i + k, run.count - 1)]); }));
    smallest_q[id] = largest_q[id] = smallest[0];
    for (int k = 0; k < static_cast<int>(kTogether); ++k) {
      smallest_q[id] = std::min(smallest_q[id], smallest[k]);
      largest_q[id] = std::max(largest_q[id], largest[k]);
    }
  }
}

template <class T>
void RunEnds::find_ways(std::size_t count) {
  for (std::size_t i = 0; i < count; i += lanes::kCount<T>) {
    T way2{};
    for (const auto& tip : stations.poses().tip_P) {
      const T d = lanes::load<T>(&tip[i + 1]) - lanes::load<T>(&tip[i]);
      way2 += d * d;
    }
    lanes::store(&way_mm[i], lanes::sqrt(way2));
  }
}

template <class T>
void RunEnds::find_speed(std::size_t count) {
  T largest{};
  for (std::size_t i = 0; i < count; i += lanes::kCount<T>) {
    const T block_s = lanes::load<T>(&seconds[i]);
    // What takes no time has no speed.
    const T ratio =
        lanes::load<T>(&slowest_s[i]) / lanes::select(block_s > 0.0, block_s, lanes::splat<T>(1.0));
    largest = lanes::larger<T>(largest, lanes::select(block_s > 0.0, ratio, T{}));
  }
  speed_ratio = 0.0;
  for (int k = 0; k < static_cast<int>(lanes::kCount<T>); ++k)
    speed_ratio = std::max(speed_ratio, largest[k]);
}

}  // namespace trunnion::post
