#pragma once
#include <memory>
#include <muParserDLL.h>
#include <type_traits>

#include "trunnion/base/result.hpp"

namespace trunnion::effects {

/// muParser by its C interface, loaded when the first formula is read: hardly a program has one, and to load
/// it, with the library for threads that it brings, took a tenth of the time in which a short file is posted.
struct FormulaLibrary {
  decltype(&mupCreate) create = nullptr;
  decltype(&mupRelease) release = nullptr;
  decltype(&mupDefineVar) define_variable = nullptr;
  decltype(&mupSetExpr) set_text = nullptr;
  decltype(&mupEval) evaluate = nullptr;
  decltype(&mupError) failed = nullptr;
  decltype(&mupGetErrorMsg) message = nullptr;
  decltype(&mupGetErrorPos) position = nullptr;

  /// Fails (io_failed) where it is not installed: what the system says. Thread-safe.
  static Result<const FormulaLibrary*> load();
};

struct ReleaseParser {
  const FormulaLibrary* library = nullptr;
  void operator()(void* parser) const { library->release(parser); }
};
/// One expression.
using FormulaHandle = std::unique_ptr<std::remove_pointer_t<muParserHandle_t>, ReleaseParser>;

}  // namespace trunnion::effects
