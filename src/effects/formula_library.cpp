#include "effects/formula_library.hpp"

#include "trunnion/base/loaded_library.hpp"

namespace trunnion::effects {
namespace {

constexpr const char* kLibrary = "libmuparser.so.2";  // of which the interface is

struct Loaded {
  FormulaLibrary library;
  std::string error;

  Loaded() {
    LoadedLibrary file(kLibrary);
    file.find(library.create, "mupCreate");
    file.find(library.release, "mupRelease");
    file.find(library.define_variable, "mupDefineVar");
    file.find(library.set_text, "mupSetExpr");
    file.find(library.evaluate, "mupEval");
    file.find(library.failed, "mupError");
    file.find(library.message, "mupGetErrorMsg");
    file.find(library.position, "mupGetErrorPos");
    error = file.error();
  }
};

}  // namespace

Result<const FormulaLibrary*> FormulaLibrary::load() {
  static const Loaded loaded;
  if (!loaded.error.empty())
    return fail(ErrorCode::io_failed, "formulas need muParser, which cannot be loaded: " + loaded.error);
  return &loaded.library;
}

}  // namespace trunnion::effects
