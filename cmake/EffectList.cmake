# Writes effect_list.cpp, which calls make_<file name>() of every file in src/effects/library, in sorted order. Adding the file is all
# that a new effect needs. (No static registration: a linker drops it from a static library, and its order is undefined.)
file(GLOB effect_files CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/src/effects/library/*.cpp)
list(SORT effect_files)
set(declarations "")
set(calls "")
foreach(file ${effect_files})
  get_filename_component(name ${file} NAME_WE)
  string(APPEND declarations "void make_${name}(const LibraryBuilder& builder);\n")
  string(APPEND calls "  make_${name}(builder);\n")
endforeach()
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/generated/effect_list.cpp @ONLY CONTENT
"#include \"effects/library_support.hpp\"

namespace trunnion::effects {

@declarations@
void make_all(const LibraryBuilder& builder) {
@calls@}

}  // namespace trunnion::effects
")
target_sources(trunnion_effects PRIVATE ${CMAKE_BINARY_DIR}/generated/effect_list.cpp)
