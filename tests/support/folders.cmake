# The one source that knows where the checkout stands (tests, benchmarks, fuzz targets).
if(NOT TARGET trunnion_test_folders)
  add_library(trunnion_test_folders STATIC ${CMAKE_SOURCE_DIR}/tests/support/folders.cpp)
  target_include_directories(trunnion_test_folders PUBLIC ${CMAKE_SOURCE_DIR}/tests)
  target_compile_definitions(trunnion_test_folders PRIVATE
    TRUNNION_SOURCE_DIR="${CMAKE_SOURCE_DIR}" TRUNNION_BINARY_DIR="${CMAKE_BINARY_DIR}")
endif()
