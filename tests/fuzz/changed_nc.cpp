// A valid program with changed words: what verify still passes cuts within the tolerance by a chain of the
// target's own.
#include "trunnion/base/number_text.hpp"

#include "../post/own_chain.hpp"
#include "../post/posting.hpp"
#include "fuzz/fuzz.hpp"

using namespace trunnion;

namespace {

constexpr double kTolerance_mm = 0.01;
// Controls whose C runs on: where it turns the shorter way, a whole turn more in a word changes nothing, and
// the chain knows no such axis.
constexpr const char* kControls[] = {"linuxcnc", "fanuc_30i", "haas_ngc", "iso"};

// A short path of far points, and one of many near points, which is written and judged in runs of blocks.
struct Part {
  int count;
  double step;
};
constexpr Part kParts[] = {{12, 1.0}, {160, 0.07}};

std::vector<Vec3> tips(const Part& part) {
  std::vector<Vec3> out;
  for (int i = 0; i < part.count; ++i) {
    const double t = part.step * i;
    out.emplace_back(-15.0 + 3.0 * t, 0.2 * t * t - 8.0, 20.0 + std::sin(0.7 * t));
  }
  return out;
}

std::string cl_text(const Part& part) {
  const auto axis = [&](int i) { return test::tilted(0.25 + 0.02 * part.step * i, 0.1 * part.step * i); };
  const auto path = tips(part);
  std::string out = "PARTNO/FUZZ\nUNITS/MM\nLOADTL/1\nSPINDL/RPM,5000,CLW\nFEDRAT/MMPM,600\nRAPID\n";
  out += test::point_text(path.front() + 60.0 * axis(0), axis(0));
  for (int i = 0; i < part.count; ++i) out += test::point_text(path[static_cast<std::size_t>(i)], axis(i));
  const int last = part.count - 1;
  return out + "RAPID\n" + test::point_text(path.back() + 60.0 * axis(last), axis(last)) + "FINI\n";
}

const std::string& program(std::size_t part, std::size_t control) {
  static const std::vector<std::string> all = [] {
    std::vector<std::string> out;
    for (const Part& each : kParts) {
      for (const char* name : kControls) {
        post::PostOptions options;
        options.tolerance_mm = kTolerance_mm;
        options.axis_tolerance = Angle::degrees(1.0);
        const test::Posted posted = test::posted(cl_text(each), fuzz::machine(), options, name);
        if (!posted.report || !posted.report->verification->passed())
          fuzz::broken(std::string("no program for ") + name);
        out.push_back(posted.nc);
      }
    }
    return out;
  }();
  return all[part * std::size(kControls) + control];
}

// Where numbers stand: behind a letter, each with its sign and point.
std::vector<std::pair<std::size_t, std::size_t>> numbers_of(const std::string& nc) {
  std::vector<std::pair<std::size_t, std::size_t>> out;
  for (std::size_t i = 1; i < nc.size(); ++i) {
    const bool begins = std::string_view("-+.0123456789").find(nc[i]) != std::string_view::npos &&
                        (std::isalpha(static_cast<unsigned char>(nc[i - 1])) != 0 || nc[i - 1] == '=');
    if (!begins) continue;
    const std::size_t end = std::min(nc.find_first_not_of("-+.0123456789", i), nc.size());
    out.emplace_back(i, end - i);
    i = end;
  }
  return out;
}

void change_word(std::string& nc, fuzz::Bytes& bytes) {
  const auto places = numbers_of(nc);
  const std::size_t which = (std::size_t{bytes.byte()} * 256 + bytes.byte()) % places.size();
  const auto [at, length] = places[which];
  std::string_view old = std::string_view(nc).substr(at, length);
  const bool plus = old.starts_with('+');
  const ParsedNumber number = parse_number(plus ? old.substr(1) : old);
  if (!number) return;
  const auto point = old.find('.');
  const int decimals = point == std::string_view::npos ? 0 : static_cast<int>(old.size() - point - 1);
  constexpr double kSteps[] = {0.005, 0.01,  0.02, 0.03, 0.05, 0.1,   1.0,   10.0,
                               -0.01, -0.03, -0.1, -1.0, 90.0, 360.0, -360.0};
  const double value = number.value + kSteps[bytes.choice(std::size(kSteps))];
  std::string text = fixed_text(value, decimals);
  if (plus && value >= 0.0) text.insert(0, "+");
  nc.replace(at, length, text);
}

std::vector<std::string> lines_of(const std::string& nc) {
  std::vector<std::string> out;
  for (std::size_t begin = 0; begin < nc.size();) {
    const std::size_t end = std::min(nc.find('\n', begin), nc.size() - 1);
    out.push_back(nc.substr(begin, end + 1 - begin));
    begin = end + 1;
  }
  return out;
}

void change_lines(std::string& nc, fuzz::Bytes& bytes) {
  std::vector<std::string> lines = lines_of(nc);
  const auto line_number = [&] {
    const std::size_t high = bytes.byte();
    return (high * 256 + bytes.byte()) % lines.size();
  };
  const std::size_t from = line_number();
  const std::size_t to = line_number();
  const std::size_t how = bytes.choice(4);
  if (how == 0) lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(from));
  if (how == 1) std::swap(lines[from], lines[to]);
  if (how == 2) lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(to), std::string(lines[from]));
  if (how == 3) {
    std::string& line = lines[from];
    if (const auto g = line.find("G1 "); g != std::string::npos) line.replace(g, 3, "G0 ");
  }
  nc.clear();
  for (const std::string& line : lines) nc += line;
}

double off_path(const Vec3& tip, const std::vector<Vec3>& path) {
  double out = 1e9;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Vec3 along = path[i + 1] - path[i];
    const double share = std::clamp((tip - path[i]).dot(along) / along.squaredNorm(), 0.0, 1.0);
    out = std::min(out, (tip - path[i] - share * along).norm());
  }
  return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string texts[] = {cl_text(kParts[0]), cl_text(kParts[1])};
  static const std::vector<Vec3> paths[] = {tips(kParts[0]), tips(kParts[1])};
  fuzz::Bytes bytes(data, size);
  const std::size_t control = bytes.choice(std::size(kControls));
  // The long part takes ten times the time.
  const std::size_t part = bytes.choice(4) == 0 ? 1 : 0;
  std::string nc = program(part, control);
  const std::size_t changes = 1 + bytes.choice(3);
  for (std::size_t i = 0; i < changes; ++i) {
    if (bytes.choice(4) == 0)
      change_lines(nc, bytes);
    else
      change_word(nc, bytes);
  }
  const auto report = test::verified(nc, texts[part], fuzz::machine(), kTolerance_mm, kControls[control]);
  if (!report || !report->passed()) return 0;
  const test::Cut cut = test::cut_of(nc);
  if (cut.ends.empty()) fuzz::broken("passed, and it cuts nothing\n" + nc);
  double worst = 0.0;
  for (const test::PlacedTool& tool : test::tool_of(cut))
    worst = std::max(worst, off_path(tool.tip, paths[part]));
  constexpr double kMore = 1.02;
  fuzz::hold(worst <= kMore * kTolerance_mm + 0.001,
             "passed, and off its path by " + shortest_text(worst) + "\n" + nc);
  return 0;
}
