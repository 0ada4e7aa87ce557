#include <filesystem>
#include <functional>
#include <memory>
#include <set>

#include "trunnion/base/files.hpp"
#include "trunnion/effects/library.hpp"

#include "app/command_tree.hpp"
#include "app/completion.hpp"
#include "app/file_texts.hpp"
#include "app/man_pages.hpp"
#include "app/options.hpp"

namespace trunnion::app {
namespace {

namespace fs = std::filesystem;

ExitCode write_below(const fs::path& folder, const std::string& name, const std::string& text) {
  std::error_code ec;
  fs::create_directories((folder / name).parent_path(), ec);
  return write_output((folder / name).string(), text);
}

// What `cmake --install` puts below share/.
ExitCode write_share(const CLI::App& root, const std::string& folder) {
  std::map<std::string, std::string> files = {
      {"bash-completion/completions/trunnion", bash_completion(root)},
      {"zsh/vendor-completions/_trunnion", zsh_completion(root)},
      {"fish/vendor_completions.d/trunnion.fish", fish_completion(root)},
  };
  for (auto& [name, text] : command_pages(root)) files.emplace("man/man1/" + name, text);
  for (const std::string& kind : file_kinds()) {
    auto schema = file_schema(kind);
    if (!schema) return print_error(schema.error());
    files.emplace("trunnion/schemas/" + kind + ".json", std::move(*schema));
    auto page = file_page(kind);
    if (!page) return print_error(page.error());
    files.emplace("man/man5/trunnion-" + kind + ".5", std::move(*page));
  }
  for (const char* kind : {"measurements", "tools", "trace", "temperatures", "offsets"}) {
    auto page = column_page(kind);
    if (!page) return print_error(page.error());
    files.emplace("man/man5/trunnion-" + std::string(kind) + ".5", std::move(*page));
  }
  for (const auto& [name, text] : files) {
    if (const ExitCode code = write_below(folder, name, text); code != kDone) return code;
  }
  return kDone;
}

ExitCode write_effects() {
  Diagnostics diagnostics;
  const auto names = shipped_names("machines");
  std::set<std::string> ids;
  for (const std::string& name : names) {
    const auto machine = load_machine_or_named(name, diagnostics);
    if (!machine) return print_failure(diagnostics, machine.error());
    for (const EffectFamily& family : effect_library(*machine, {})) ids.insert(family.id());
  }
  std::string text;
  for (const std::string& id : ids) text += id + "\n";
  return write_output("-", text);
}

ExitCode write_names(const std::string& kind) {
  if (kind == "effects") return write_effects();
  std::string text;
  for (const std::string& name : shipped_names(kind)) text += name + "\n";
  return write_output("-", text);
}

ExitCode write_text(const Result<std::string>& text) {
  return text ? write_output("-", *text) : print_error(text.error());
}

}  // namespace

void add_texts_command(CLI::App& root, int& exit) {
  CLI::App* c =
      root.add_subcommand("texts", "man pages, completion for shells, schemas: for packages and shells");
  c->group("");
  c->require_subcommand(1);
  auto argument = std::make_shared<std::string>();
  const auto add = [&](const char* name, const char* what, const char* takes,
                       const std::vector<std::string>& choices,
                       const std::function<ExitCode(const std::string&)>& work) {
    CLI::App* sub = c->add_subcommand(name, what);
    auto* option = sub->add_option(takes, *argument)->required();
    if (!choices.empty()) option->check(CLI::IsMember(choices));
    sub->callback([argument, work, &exit] { exit = work(*argument); });
  };
  add("share", "all of them, as they stand below share/", "folder", {},
      [&root](const std::string& folder) { return write_share(root, folder); });
  add("completion", "of one shell", "shell", {"bash", "zsh", "fish"}, [&root](const std::string& shell) {
    return write_output("-", shell == "bash"  ? bash_completion(root)
                             : shell == "zsh" ? zsh_completion(root)
                                              : fish_completion(root));
  });
  add("schema", "JSON Schema of one kind of TOML file", "kind", file_kinds(),
      [](const std::string& kind) { return write_text(file_schema(kind)); });
  add("unexplained", "keys that are read and not explained, or explained and not read", "kind", file_kinds(),
      [](const std::string& kind) { return write_text(unexplained_keys(kind)); });
  add("names", "what ships, a line each", "kind", {"machines", "controllers", "effects", "makers"},
      write_names);
}

}  // namespace trunnion::app
