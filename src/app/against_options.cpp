#include "app/against_options.hpp"

#include <utility>

namespace trunnion::app {

CLI::Option* AgainstOptions::add_to(CLI::App& c) {
  CLI::Option* out = c.add_option("--against", file, "CL file, or NC program with --from");
  from_.add_to(c, "--against");
  reading_.add_to(c);
  return out;
}

Result<void> AgainstOptions::load(const MachineOptions& judged, Diagnostics& diagnostics) {
  auto files = from_.load(judged, diagnostics);
  if (!files) return tl::unexpected(files.error());
  made_for_ = std::move(*files);
  if (made_for_) origin_ = from_.resolve(*made_for_);
  return {};
}

Result<post::PathText> AgainstOptions::open() const {
  auto source = cl::open_source(file);
  if (!source) return tl::unexpected(source.error());
  return post::PathText{std::move(*source), file, reading_.resolve(), made_for_ ? &origin_ : nullptr};
}

}  // namespace trunnion::app
