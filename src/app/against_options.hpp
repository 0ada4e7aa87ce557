#pragma once
#include <memory>
#include <optional>
#include <string>

#include "trunnion/post/path_text.hpp"

#include "app/from_options.hpp"
#include "app/options.hpp"

namespace trunnion::app {

/// `--against`: the path that programs are judged against, a CL file or (`--from`) an NC program; and how it
/// is read.
class AgainstOptions {
 public:
  std::string file;

  /// Returns `--against`.
  CLI::Option* add_to(CLI::App& command);
  /// What an NC program was made for. Before anything is opened.
  Result<void> load(const MachineOptions& judged, Diagnostics& diagnostics);
  /// The text from its beginning; must not outlive the object.
  Result<post::PathText> open() const;

 private:
  FromOptions from_;
  ClCliOptions reading_;
  std::optional<MachineFiles> made_for_;
  post::NcOrigin origin_;
};

}  // namespace trunnion::app
