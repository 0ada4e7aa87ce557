#include "effects/formula_library.hpp"

#include <dlfcn.h>

namespace trunnion::effects {
namespace {

constexpr const char* kLibrary = "libmuparser.so.2";  // of which the interface is

struct Loaded {
  FormulaLibrary library;
  std::string error;

  Loaded() {
    void* const handle = ::dlopen(kLibrary, RTLD_NOW | RTLD_LOCAL);
    if (handle == nullptr) {
      take_error();
      return;
    }
    const auto find = [&](auto& function, const char* name) {
      void* const at = ::dlsym(handle, name);
      if (at == nullptr && error.empty()) take_error();
      function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(at);
    };
    find(library.create, "mupCreate");
    find(library.release, "mupRelease");
    find(library.define_variable, "mupDefineVar");
    find(library.set_text, "mupSetExpr");
    find(library.evaluate, "mupEval");
    find(library.failed, "mupError");
    find(library.message, "mupGetErrorMsg");
    find(library.position, "mupGetErrorPos");
  }
  void take_error() {
    const char* const said = ::dlerror();
    error = said != nullptr ? said : kLibrary;
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
