#include <array>
#include <cstdlib>
#include <map>
#include <sstream>

#include "trunnion/base/files.hpp"
#include "trunnion/diagnosis/diagnose.hpp"
#include "trunnion/diagnosis/import.hpp"

#include "diagnosis/campaigns.hpp"

// Published measurements of real machines; their truth is known to nobody.
namespace trunnion::diagnosis {
namespace {

const std::string kStage =
    "[machine]\nname = \"stage\"\n[tool]\nlength_mm = 100.0\n[part]\nzero_mm = [0, 0, 0]\n"
    "[[axis]]\nname = \"X\"\ntype = \"linear\"\ndirection = [1, 0, 0]\nmin_mm = -260\nmax_mm = 260\n"
    "[[axis]]\nname = \"Y\"\ntype = \"linear\"\ndirection = [0, 1, 0]\nmin_mm = -260\nmax_mm = 260\n"
    "[[axis]]\nname = \"Z\"\ntype = \"linear\"\ndirection = [0, 0, 1]\nmin_mm = 0\nmax_mm = 100\n"
    "[chain]\ntool = [\"X\", \"Y\", \"Z\"]\npart = []\n";

std::string reference(const std::string& path) {
  const char* folder = std::getenv("TRUNNION_REFERENCE_DATA");
  if (folder == nullptr) return {};
  const auto text = read_file(std::string(folder) + path);
  return text ? *text : std::string();
}

Machine machine_of(const std::string& toml) {
  Diagnostics diagnostics;
  auto machine = parse_machine(toml, "machine", diagnostics);
  if (!machine) throw std::runtime_error(machine.error().text());
  return *machine;
}

Diagnosis said_of(const Machine& machine, const std::string& csv, const std::string& model) {
  Diagnostics diagnostics;
  const std::vector<NamedText> files = {{"data.csv", csv}};
  const auto data = parse_measurements(files, machine, diagnostics);
  if (!data) throw std::runtime_error(data.error().text());
  return diagnose(machine, *data, test::model_for(machine, *data, model), {.plan = false});
}

// Sum of squares that the means over one coordinate explain: another way to ask which straightness is
// missing.
double explained_by(const std::vector<std::array<double, 4>>& rows, std::size_t coordinate,
                    std::size_t value) {
  std::map<double, std::pair<double, double>> cells;
  double mean = 0.0;
  for (const auto& r : rows) {
    auto& [sum, count] = cells[r[coordinate]];
    sum += r[value];
    count += 1.0;
    mean += r[value] / static_cast<double>(rows.size());
  }
  double out = 0.0;
  for (const auto& [at, cell] : cells) {
    const double d = cell.first / cell.second - mean;
    out += cell.second * d * d;
  }
  return out;
}

TEST(LongRealData, TheMissingStraightnessOfAStageIsNamed) {
  const std::string text = reference("/geometric/stage_642583/642583-1-1-2dcal_stitched.dat");
  if (text.empty()) GTEST_SKIP() << "TRUNNION_REFERENCE_DATA is not set";
  // Every third point: a sixth of the time.
  std::istringstream in(text);
  std::string line, some;
  std::vector<std::array<double, 4>> rows;
  for (std::size_t k = 0; std::getline(in, line); ++k) {
    if (k % 3 != 0) continue;
    some += line + "\n";
    std::array<double, 4> r{};
    char comma = 0;
    std::istringstream fields(line);
    fields >> r[0] >> comma >> r[1] >> comma >> r[2] >> comma >> r[3];
    rows.push_back(r);
  }
  Diagnostics diagnostics;
  const auto csv = import_map(some, "map", {}, diagnostics);
  ASSERT_TRUE(csv);
  const Diagnosis d =
      said_of(machine_of(kStage), *csv,
              "[model]\nname = \"positioning\"\n[[effect]]\nid = \"component:EXX\"\n[[effect]]\nid "
              "= \"component:EYY\"\n");
  EXPECT_TRUE(d.verdict == Verdict::named || d.verdict == Verdict::named_but_incomplete) << d.paragraph;
  ASSERT_FALSE(d.effects.empty());
  const double eyx = explained_by(rows, 0, 3), exy = explained_by(rows, 1, 2);
  EXPECT_EQ(d.effects.front(), eyx > exy ? "component:EYX" : "component:EXY") << d.paragraph;
  ASSERT_TRUE(d.ranking.front().heldout_before_um && d.ranking.front().heldout_after_um);
  EXPECT_LT(*d.ranking.front().heldout_after_um, 0.5 * *d.ranking.front().heldout_before_um);
}

// The same temperatures go with displacements that differ by tens of micrometres from day to day: no model of
// temperatures may be called complete.
TEST(LongRealData, TemperaturesAloneDoNotExplainTheLathe) {
  const std::string text = reference("/thermal/lathe_days/ace_days.csv");
  if (text.empty()) GTEST_SKIP() << "TRUNNION_REFERENCE_DATA is not set";
  Diagnostics diagnostics;
  LogImport options;
  options.channel = "dia_disp";
  options.every = 10;
  const auto csv = import_log(text, "days", options, diagnostics);
  ASSERT_TRUE(csv);
  const Machine lathe =
      machine_of(kStage + "[thermal]\nambient_sensor = \"ambient\"\naxis_sensors = { X = \"bed_ref\" }\n");
  const Diagnosis d = said_of(lathe, *csv, "[model]\nname = \"nothing\"\n");
  EXPECT_TRUE(d.verdict == Verdict::not_in_library || d.verdict == Verdict::named_but_incomplete)
      << d.paragraph;
  ASSERT_FALSE(d.depends_on.empty());
}

}  // namespace
}  // namespace trunnion::diagnosis
