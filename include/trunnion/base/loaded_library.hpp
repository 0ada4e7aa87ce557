#pragma once
#include <dlfcn.h>
#include <string>
#include <type_traits>

namespace trunnion {

/// A shared library with a C interface that is loaded when somebody needs it, and stays.
class LoadedLibrary {
 public:
  /// `name`: its file, of which the interface is ("libmuparser.so.2").
  explicit LoadedLibrary(const char* name) : name_(name), handle_(::dlopen(name, RTLD_NOW | RTLD_LOCAL)) {
    if (handle_ == nullptr) take_error();
  }
  /// Sets `function` to the function of that name; null where there is none.
  template <class Function>
  void find(Function& function, const char* symbol) {
    void* const at = handle_ != nullptr ? ::dlsym(handle_, symbol) : nullptr;
    if (at == nullptr && error_.empty()) take_error();
    function = reinterpret_cast<std::remove_reference_t<Function>>(at);
  }
  /// What the system says of the first thing that failed; empty where nothing did.
  const std::string& error() const { return error_; }

 private:
  void take_error() {
    const char* const said = ::dlerror();
    error_ = said != nullptr ? said : name_;
  }

  const char* name_;
  void* handle_;
  std::string error_;
};

}  // namespace trunnion
