#include "diagnosis/data/zeroed_groups.hpp"

#include <algorithm>
#include <map>

namespace trunnion::diagnosis {
namespace {

constexpr std::size_t kFewestOfGroup = 5;  // a few readings may begin with 0 by chance
constexpr std::size_t kFewestZeroed = 2;

struct ZeroedGroup {
  std::size_t run = 0, count = 0;
  double first_s = 0.0, first = 0.0;
  bool goes_on = false;  // a reading that is not 0
};

}  // namespace

void mark_zeroed(Dataset& data) {
  for (const Quantity quantity : {Quantity::displacement, Quantity::rotation}) {
    std::vector<ZeroedGroup> groups(data.group_count);
    for (const Reading& r : data.readings) {
      if (r.u_common || r.quantity != quantity) continue;
      const MachineState state = data.track.state(r.row);
      ZeroedGroup& group = groups[r.group];
      if (group.count++ == 0 || state.time_s < group.first_s) {
        group.first_s = state.time_s;
        group.first = r.value;
      }
      group.run = state.run;
      group.goes_on = group.goes_on || r.value != 0.0;
    }
    std::map<std::size_t, bool> run_begins_so;
    for (const ZeroedGroup& group : groups) {
      if (group.count < kFewestOfGroup) continue;
      const auto [it, fresh] = run_begins_so.emplace(group.run, true);
      it->second = it->second && group.first == 0.0 && group.goes_on;
    }
    const auto is_zeroed = [&](const ZeroedGroup& group) {
      const auto run = run_begins_so.find(group.run);
      return group.count >= kFewestOfGroup && run != run_begins_so.end() && run->second;
    };
    if (static_cast<std::size_t>(std::count_if(groups.begin(), groups.end(), is_zeroed)) < kFewestZeroed)
      continue;
    for (Reading& r : data.readings)
      if (!r.u_common && r.quantity == quantity) r.zeroed = is_zeroed(groups[r.group]);
  }
}

}  // namespace trunnion::diagnosis
