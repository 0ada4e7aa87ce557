#pragma once
#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "trunnion/cl/reader.hpp"

namespace trunnion::cl::test {

/// What a text reads as: all records, and all findings without the file name.
struct Reading {
  std::vector<Record> records;
  std::vector<std::string> findings;
  Resolution resolution;

  std::vector<Motion> motions() const {
    std::vector<Motion> all;
    for (const Record& record : records) {
      if (const auto* motion = std::get_if<Motion>(&record.data)) all.push_back(*motion);
    }
    return all;
  }
  std::vector<Arc> arcs() const {  // with ReaderOptions::mark_shapes
    std::vector<Arc> found;
    for (const ShapeBegin& shape : all<ShapeBegin>())
      if (const auto* arc = std::get_if<Arc>(&shape.shape->what)) found.push_back(*arc);
    return found;
  }
  template <class Data>
  std::vector<Data> all() const {
    std::vector<Data> found;
    for (const Record& record : records) {
      if (const auto* data = std::get_if<Data>(&record.data)) found.push_back(*data);
    }
    return found;
  }
};

/// For texts without UNITS.
inline ReaderOptions in_mm() {
  ReaderOptions options;
  options.units = ReaderOptions::Units::mm;
  return options;
}

inline Reading read(std::string_view text, const ReaderOptions& options = in_mm()) {
  Diagnostics diagnostics;
  Reader reader(text, "f", options, diagnostics);
  Reading reading;
  Record record;
  while (reader.next(record)) reading.records.push_back(record);
  reading.resolution = reader.resolution();
  for (const Finding& finding : diagnostics.findings())
    reading.findings.push_back(finding.text().substr(2));  // without "f:"
  return reading;
}

/// The same, plain motions as many at once as there are, at most `most`; in `in_runs` how many those are.
inline Reading read_in_runs(std::string_view text, std::size_t most, std::size_t& in_runs,
                            const ReaderOptions& options = in_mm()) {
  Diagnostics diagnostics;
  Reader reader(text, "f", options, diagnostics);
  Reading reading;
  Record record;
  std::vector<PlainCut> cuts(most);
  in_runs = 0;
  for (;;) {
    Feed feed;
    const std::size_t count = reader.next_cuts(cuts, feed);
    in_runs += count;
    for (std::size_t i = 0; i < count; ++i)
      reading.records.push_back({cuts[i].where, Motion{cuts[i].tip_P, cuts[i].axis_P, feed}});
    if (count == 0 && !reader.next(record)) break;
    if (count == 0) reading.records.push_back(record);
  }
  reading.resolution = reader.resolution();
  for (const Finding& finding : diagnostics.findings()) reading.findings.push_back(finding.text().substr(2));
  return reading;
}

inline std::string joined(const std::vector<std::string>& findings) {
  std::string all;
  for (const std::string& finding : findings) all += finding + "\n";
  return all;
}

}  // namespace trunnion::cl::test
