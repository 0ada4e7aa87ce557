# One target per layer; its link list is what it may know. tests/arch checks the #include lines against the same lists.
set(TRUNNION_LAYER_TARGETS "" CACHE INTERNAL "")

add_library(trunnion_warnings INTERFACE)
target_compile_options(trunnion_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wnon-virtual-dtor -Wold-style-cast
  -Woverloaded-virtual -Wduplicated-cond -Wlogical-op
  # gcc 12 sees overlaps and overflows in string concatenation that are not there (PR105651).
  -Wno-restrict $<$<BOOL:${TRUNNION_PCH}>:-Wno-stringop-overflow> $<$<BOOL:${TRUNNION_PCH}>:-Wno-array-bounds>
  $<$<BOOL:${TRUNNION_WERROR}>:-Werror>)

# The same bytes out on every machine: no fused multiply-add unless it is written. Nobody asks errno or the floating-point flags what a
# root was; with that said four roots are one instruction. Vectors of four doubles are handed to nobody (base/lanes.hpp).
add_compile_options(-ffp-contract=off -fno-math-errno -fno-trapping-math -Wno-psabi)
# TRUNNION_WIDE_MOVES: gcc copies vectors of four in one move each. By itself it copies them in halves, and to load what was stored in halves
# costs some fifteen cycles: posting takes 2 to 5 % longer so. clang moves them whole and does not know the words; a compile database that
# clang-tidy reads is made without them.
option(TRUNNION_WIDE_MOVES "copy vectors of four doubles in one move (gcc)" ON)
include(CheckCXXCompilerFlag)
check_cxx_compiler_flag("-mmove-max=256 -mstore-max=256" TRUNNION_KNOWS_WIDE_MOVES)
if(TRUNNION_WIDE_MOVES AND TRUNNION_KNOWS_WIDE_MOVES)
  add_compile_options(-mmove-max=256 -mstore-max=256)
endif()
# No path of the build in what is built: messages of defects name files of the source tree.
add_compile_options(-fmacro-prefix-map=${CMAKE_SOURCE_DIR}/=)
# A program that reads other people's files: overflows of buffers end it, its addresses are not known beforehand, and nobody writes over its
# tables of addresses. Posting takes 3 % more instructions so, a file of one point 3.4 %, of which 0.6 % are the addresses'. (What the
# sanitizers check they check themselves.)
add_compile_options(-fPIC -fvisibility=hidden -fvisibility-inlines-hidden -fno-semantic-interposition)
if(NOT TRUNNION_SANITIZE AND NOT TRUNNION_FUZZ)
  add_compile_options($<$<NOT:$<CONFIG:Debug>>:-D_FORTIFY_SOURCE=2> -fstack-protector-strong)
  add_link_options(LINKER:-z,relro)
endif()
if(TRUNNION_SANITIZE)
  # Instrumented code makes gcc see uninitialised values that are not there (its manual says so): the release build keeps that warning.
  # Null and objects that are too small are AddressSanitizer's to find, and the one cast to another type is the socket address: these three
  # checks stand at every access and take a third of the time to compile.
  add_compile_options(-fsanitize=address,undefined -fno-sanitize=null,object-size,alignment -fno-sanitize-recover=all
    -fno-omit-frame-pointer -Wno-maybe-uninitialized)
  add_link_options(-fsanitize=address,undefined)
endif()

# TRUNNION_FUZZ: clang's coverage for libFuzzer in every library, and the sanitizers with it (tests/fuzz).
if(TRUNNION_FUZZ)
  add_compile_options(-fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=address,undefined)
endif()

# TRUNNION_PCH: the standard library, Eigen and GoogleTest are parsed once, not 300 times. For whole builds (tests/run-all, samples/run-demo);
# a build without it, and clang-tidy, show that each file includes what it uses.
set(TRUNNION_PCH_HEADERS <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <map> <memory> <optional> <span>
  <sstream> <string> <string_view> <utility> <vector> <tl/expected.hpp> <Eigen/Dense>)
# trunnion_precompile(TARGET OWNER HEADERS...): TARGET takes the headers that OWNER compiled, or is OWNER itself.
function(trunnion_precompile target owner)
  if(NOT TRUNNION_PCH)
    return()
  elseif(target STREQUAL owner)
    target_precompile_headers(${target} PRIVATE ${ARGN})
  else()
    target_precompile_headers(${target} REUSE_FROM ${owner})
  endif()
endfunction()

# TRUNNION_UNITY: sources of a target are compiled several at a time; names in unnamed namespaces are therefore unique within a layer.
function(trunnion_unite target)
  if(NOT TRUNNION_UNITY)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${TRUNNION_UNITY_BATCH})
endfunction()

# Layers that make texts and pages of what others have calculated: nothing in them is hot, and a third of their compilation goes into
# optimising templates of JSON and texts.
set(TRUNNION_TEXT_LAYERS probe report)

function(trunnion_add_layer name)
  set(knows ${ARGN})
  set_property(GLOBAL PROPERTY TRUNNION_KNOWS_${name} "${knows}")
  set_property(GLOBAL APPEND PROPERTY TRUNNION_LAYERS ${name})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/src/${name}/*.cpp)
  set(target trunnion_${name})
  if(sources)
    add_library(${target} STATIC ${sources})
    set(scope PUBLIC)
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:trunnion_warnings>)
    trunnion_unite(${target})
    # Private headers: "effects/library.hpp" is src/effects/library.hpp.
    target_include_directories(${target} PRIVATE ${CMAKE_SOURCE_DIR}/src)
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_include_directories(${target} ${scope} $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}/include>)
  target_include_directories(${target} SYSTEM ${scope} $<BUILD_INTERFACE:${EXPECTED_INCLUDE}>)
  foreach(other ${knows})
    target_link_libraries(${target} ${scope} trunnion_${other})
  endforeach()
  if(NOT name STREQUAL "base")
    target_link_libraries(${target} ${scope} Eigen3::Eigen)
    if(sources AND name IN_LIST TRUNNION_TEXT_LAYERS)
      # A precompiled header brings its own -O3 with it.
      target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
    elseif(sources)
      trunnion_precompile(${target} trunnion_geom ${TRUNNION_PCH_HEADERS})
    endif()
  endif()
  if(sources)
    if(name STREQUAL "config")
      target_include_directories(${target} SYSTEM PRIVATE ${TOMLPP_INCLUDE} ${CSV_INCLUDE})
      target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:${CSV_LIBRARY}> $<INSTALL_INTERFACE:csv>)
    elseif(name STREQUAL "effects")
      target_include_directories(${target} SYSTEM PRIVATE ${MUPARSER_INCLUDE})
      target_link_libraries(${target} PRIVATE ${CMAKE_DL_LIBS})
    elseif(name STREQUAL "thermal")
      target_include_directories(${target} SYSTEM PRIVATE ${SVM_INCLUDE} ${BOOST_MATH_INCLUDE} ${MOSQUITTO_INCLUDE})
      target_link_libraries(${target} PRIVATE ${CMAKE_DL_LIBS})
      target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:$<IF:$<STREQUAL:$<TARGET_PROPERTY:TYPE>,MODULE_LIBRARY>,svm,${SVM_LIBRARY}>> $<INSTALL_INTERFACE:svm>)
    elseif(name STREQUAL "diagnosis")
      target_include_directories(${target} SYSTEM PRIVATE ${BOOST_MATH_INCLUDE})
      target_link_libraries(${target} PRIVATE TBB::tbb)
    elseif(name STREQUAL "post")
      target_include_directories(${target} SYSTEM PRIVATE ${XXHASH_INCLUDE} ${BOOST_MATH_INCLUDE})
      target_link_libraries(${target} PRIVATE TBB::tbb $<BUILD_INTERFACE:${XXHASH_LIBRARY}> $<INSTALL_INTERFACE:xxhash>)
    elseif(name STREQUAL "report")
      target_include_directories(${target} SYSTEM PRIVATE ${BOOST_MATH_INCLUDE})
      target_include_directories(${target} SYSTEM PRIVATE ${ZLIB_INCLUDE})
      target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:${ZLIB_LIBRARY}> $<INSTALL_INTERFACE:z>)
      target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:nlohmann_json::nlohmann_json>)
    endif()
  endif()
  set(TRUNNION_LAYER_TARGETS ${TRUNNION_LAYER_TARGETS} ${target} CACHE INTERNAL "")
endfunction()
