#include "app/file_keys.hpp"

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <utility>

#include "trunnion/base/files.hpp"
#include "trunnion/diagnosis/plan.hpp"
#include "trunnion/effects/model.hpp"
#include "trunnion/machine/machine.hpp"
#include "trunnion/machine/maker_machine.hpp"
#include "trunnion/nc/controller.hpp"
#include "trunnion/post/batch.hpp"
#include "trunnion/thermal/model.hpp"

#include "app/options.hpp"

namespace trunnion::app {
namespace {

namespace fs = std::filesystem;

// A folder for probes that goes with its object.
class ProbeFolder {
 public:
  ProbeFolder() {
    std::error_code ec;
    std::string name = (fs::temp_directory_path(ec) / "trunnion-XXXXXX").string();
    if (::mkdtemp(name.data()) != nullptr) folder_ = name;
  }
  ~ProbeFolder() {
    std::error_code ec;
    if (!folder_.empty()) fs::remove_all(folder_, ec);
  }
  ProbeFolder(const ProbeFolder&) = delete;
  ProbeFolder& operator=(const ProbeFolder&) = delete;

  Result<std::string> write(const std::string& name, const std::string& text) const {
    if (folder_.empty()) return fail(ErrorCode::io_failed, "no folder for temporary files");
    const std::string path = folder_ + "/" + name;
    if (auto written = write_file(path, text); !written) return tl::unexpected(written.error());
    return path;
  }

 private:
  std::string folder_;
};

std::string linear_axis(const std::string& name, const std::string& direction) {
  return "[[axis]]\nname = \"" + name + "\"\ntype = \"linear\"\ndirection = " + direction +
         "\nmin_mm = -500\nmax_mm = 500\n";
}
std::string rotary_axis(const std::string& name, const std::string& direction) {
  return "[[axis]]\nname = \"" + name + "\"\ntype = \"rotary\"\ndirection = " + direction +
         "\npoint_mm = [0, 0, 0]\nmin_deg = -90\nmax_deg = 90\n";
}
constexpr const char* kHead = "[machine]\nname = \"probe\"\n";
std::string linear_axes() {
  return linear_axis("X", "[1, 0, 0]") + linear_axis("Y", "[0, 1, 0]") + linear_axis("Z", "[0, 0, 1]");
}

// Machines of every axis that there can be.
std::vector<std::string> probe_machines() {
  const std::string a = rotary_axis("A", "[1, 0, 0]"), b = rotary_axis("B", "[0, 1, 0]"),
                    c = rotary_axis("C", "[0, 0, 1]");
  const std::string uvw =
      linear_axis("U", "[1, 0, 0]") + linear_axis("V", "[0, 1, 0]") + linear_axis("W", "[0, 0, 1]");
  const std::string tool = "[chain]\ntool = [\"X\", \"Y\", \"Z\"]\npart = ";
  return {kHead + linear_axes() + a + c + tool + "[\"A\", \"C\"]\n",
          kHead + linear_axes() + b + c + tool + "[\"B\", \"C\"]\n",
          kHead + uvw + "[chain]\ntool = [\"U\", \"V\", \"W\"]\npart = []\n"};
}

// A document, and which variant of which table it holds (none: it is of the whole file).
struct Probe {
  std::string text;
  std::string table;
  std::string key;
  std::string pattern;
};

std::vector<Probe> machine_probes() {
  const std::string tables =
      "[tool]\n[spindle]\n[part]\n[output]\n[retract]\n[table]\n[datum.probed_at]\n[thermal.axis_sensors]\nX "
      "= "
      "\"bed\"\n";
  std::vector<Probe> out;
  for (const std::string& machine : probe_machines()) out.push_back({machine + tables, {}, {}, {}});
  out.push_back({kHead + linear_axes(), "axis", "type", "^linear$"});
  out.push_back({kHead + rotary_axis("A", "[1, 0, 0]"), "axis", "type", "^rotary$"});
  return out;
}

std::vector<Probe> controller_probes() {
  return {
      {"[controller]\nname = \"probe\"\nbase = \"default\"\n[clamp.A]\n[axis_numbers]\nany = "
       "[\"\"]\n[retract]\nZ = "
       "\"\"\n[read.refused]\nG2 = "
       "\"\"\n",
       {},
       {},
       {}}};
}

constexpr const char* kProbeTable = "table.csv";

std::vector<Probe> model_probes() {
  const std::string tail = "[effect.parameters]\n{}\n[effect.sigma]\n{}\n[effect.evidence]\n";
  const auto effect = [&](const std::string& keys, const std::string& values) {
    std::string text = "[[effect]]\n" + keys + tail;
    for (auto at = text.find("{}"); at != std::string::npos; at = text.find("{}"))
      text.replace(at, 2, values);
    return text;
  };
  return {{"[model]\n[model.valid]\nX_mm = [0, 1]\n[setup]\n" + effect("id = \"location:C\"\n", "X0C_um = 1"),
           {},
           {},
           {}},
          {effect("id = \"user:probe\"\njoint = \"C\"\ncomponent = \"EZC\"\nexpression = \"k * "
                  "sin(C)\"\nrange = { k_um = [0, 2] }\n",
                  "k_um = 1"),
           "effect", "id", "^user:"},
          {effect("id = \"component:EXX\"\ntable = \"" + std::string(kProbeTable) + "\"\n", ""), "effect",
           "table", ""},
          {effect("id = \"location:C\"\n", "X0C_um = 1"), "effect", "id", ""}};
}

std::vector<Probe> plan_probes() {
  const std::string run =
      "[[run]]\nid = \"probe\"\nu_random = 1\nn = [1, 0, 0]\nat = {}\nspindle_rpm = 0\nT_bed_degC = []\n";
  return {{"[simulation]\n" + run + "poses = []\n" + run + "sweep = { axis = \"X\" }\n" + run +
               "sweep = { axis = \"C\" }\n" + run + "line = { from = {}, to = {} }\n" + run +
               "circle = { axes = [\"X\", \"Y\"] }\n" + run + "grid = {}\n",
           {},
           {},
           {}}};
}

std::vector<Probe> thermal_probes() {
  const std::string head = "[model]\nkind = \"thermal\"\nmeasure_every_min = 30\n";
  const std::string plain = "[[channel]]\nname = \"dx\"\nsigma_floor_um = 1\nmethod = \"";
  const std::string parts =
      "\"\nsensors = [\"bed\"]\ntemperature_lags_s = [0]\n[channel.range]\nscale = [1]\nspread = [1]\nfloor "
      "= 1\n"
      "largest = 1\ndirections = [[1]]\nseen = []\n[channel.parameters]\n";
  const std::string gp =
      "feature_scale = [1]\nrbf = 1\nlength = 1\nnoise = 1\nchanges_um = [1]\nfrom = [[0]]\nto = [[1]]\n";
  const std::string linear = "weights_um = [1]\n";
  const auto channel = [&](const char* method, const std::string& parameters) {
    return plain + method + parts + parameters;
  };
  std::vector<Probe> out;
  out.push_back({head + plain + "none\"\n", "channel", "method", R"(^(none|hold_last)(\+.*)?$)"});
  out.push_back({head + channel("svr", ""), "channel", "method", R"(^svr(_all)?(\+.*)?$)"});
  out.push_back({head + channel("gp", gp), "channel", "method", R"(^gp(\+.*)?$)"});
  out.push_back(
      {head + channel("mean", "[channel.parameters.ridge]\n" + linear + "[channel.parameters.combined]\n" +
                                  linear + "[channel.parameters.gp]\n" + gp),
       "channel", "method", R"(^mean(\+.*)?$)"});
  out.push_back({head + channel("ridge", linear), "channel", "method", ""});
  return out;
}

std::vector<Probe> batch_probes() {
  return {{"[[part]]\nfile = \"part.cls\"\n", {}, {}, {}}};
}

std::vector<Probe> maker_probes() {
  const std::string head = "name = \"probe\"\nrotary = \"AC\"\nsources = [\"\"]\n[[axis]]\nname = \"";
  return {{head + "X\"\n", "axis", "name", "^[XYZ]$"}, {head + "A\"\n", "axis", "name", "^[ABC]$"}};
}

// Reads one probe, `file`; what is wrong with it does not matter.
using Read = std::function<void(const std::string& file, Diagnostics& diagnostics)>;

struct FileKind {
  std::vector<Probe> probes;
  std::vector<Read> readers;  // each reads every probe
};

template <class Load>
std::vector<Read> for_each_machine(const Load& load) {
  std::vector<Read> out;
  for (const std::string& text : probe_machines()) {
    Diagnostics diagnostics;
    if (auto machine = parse_machine(text, "probe", diagnostics)) {
      out.emplace_back([machine = std::move(*machine), load](const std::string& file, Diagnostics& d) {
        load(file, machine, d);
      });
    }
  }
  return out;
}

FileKind file_kind(const std::string& kind) {
  if (kind == "machine")
    return {machine_probes(),
            {[](const std::string& file, Diagnostics& d) { static_cast<void>(load_machine(file, d)); }}};
  if (kind == "controller") {
    return {controller_probes(), {[](const std::string& file, Diagnostics& d) {
              static_cast<void>(nc::load_controller(file, d, postconfigs_folder() + "/controllers"));
            }}};
  }
  if (kind == "model") {
    auto readers = for_each_machine([](const std::string& file, const Machine& machine, Diagnostics& d) {
      static_cast<void>(load_model(file, machine, {}, d));
    });
    readers.resize(1);  // the keys of effects do not depend on the axes
    return {model_probes(), std::move(readers)};
  }
  if (kind == "plan") {
    return {plan_probes(),
            for_each_machine([](const std::string& file, const Machine& machine, Diagnostics& d) {
              static_cast<void>(diagnosis::load_plan(file, machine, d));
            })};
  }
  if (kind == "thermal") {
    return {thermal_probes(), {[](const std::string& file, Diagnostics& d) {
              static_cast<void>(thermal::load_model(file, d));
            }}};
  }
  if (kind == "maker") {
    return {maker_probes(), {[](const std::string& file, Diagnostics& d) {
              if (const auto text = read_file(file)) static_cast<void>(parse_maker_machine(*text, file, d));
            }}};
  }
  return {batch_probes(), {[](const std::string& file, Diagnostics& d) {
            static_cast<void>(post::batch_items({file}, "out", d));
          }}};
}

void merge(const config::FileRecord& from, config::FileRecord& into) {
  for (const auto& [path, table] : from) {
    config::TableRecord& out = into[path];
    out.seen += table.seen;
    out.patterns.insert(table.patterns.begin(), table.patterns.end());
    for (const auto& [key, record] : table.keys) {
      config::KeyRecord& k = out.keys[key];
      k.types.insert(record.types.begin(), record.types.end());
      k.required += record.required;
      if (!record.choices.empty()) k.choices = record.choices;
    }
  }
}

// Heads of the tables that a reader looks for at the top of a file, and that stand in no probe yet: a new one
// needs no mention here.
std::string unread_tables(const config::FileRecord& record, const std::string& probe) {
  std::string out;
  const auto root = record.find("");
  if (root == record.end()) return out;
  for (const auto& [key, value] : root->second.keys) {
    if (record.contains(key)) continue;
    for (const auto& [type, head] : {std::pair(config::KeyType::table, "\n[" + key + "]\n"),
                                     std::pair(config::KeyType::tables, "\n[[" + key + "]]\n")}) {
      if (value.types.contains(type) && probe.find(head) == std::string::npos) out += head;
    }
  }
  return out;
}

Result<config::FileRecord> record_of(const FileKind& kind, const std::string& text,
                                     const ProbeFolder& folder) {
  const auto file = folder.write("probe.toml", text);
  if (!file) return tl::unexpected(file.error());
  config::FileRecord out;
  for (const Read& read : kind.readers) {
    config::FileRecord once;
    {
      const config::KeyRecording recording(once);
      Diagnostics diagnostics;
      read(*file, diagnostics);
    }
    merge(once, out);
  }
  return out;
}

}  // namespace

const std::vector<std::string>& file_kinds() {
  static const std::vector<std::string> kinds = {"machine", "controller", "model", "plan",
                                                 "thermal", "batch",      "maker"};
  return kinds;
}

Result<FileKeys> keys_of_file(const std::string& kind) {
  const ProbeFolder folder;
  const auto table = folder.write(kProbeTable, "X_mm,EXX_um\n-500,0\n500,1\n");
  if (!table) return tl::unexpected(table.error());
  const FileKind of = file_kind(kind);
  FileKeys out;
  for (const Probe& probe : of.probes) {
    std::string text = probe.text;
    auto record = record_of(of, text, folder);
    while (record) {
      const std::string more = unread_tables(*record, text);
      if (more.empty()) break;
      text += more;
      record = record_of(of, text, folder);
    }
    if (!record) return tl::unexpected(record.error());
    merge(*record, out.record);
    if (!probe.table.empty())
      out.variants.push_back({probe.table, probe.key, probe.pattern, std::move(*record)});
  }
  return out;
}

}  // namespace trunnion::app
