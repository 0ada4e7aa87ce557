# The Python package `trunnion`: its compiled part is made of the code that the program's commands are made of, so that both read options, give
# messages and calculate alike. In the build folder it stands in python/: PYTHONPATH=build/python.
set(folder ${CMAKE_BINARY_DIR}/python/trunnion)
file(GLOB python_sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/src/app/python/*.cpp)
pybind11_add_module(trunnion_python MODULE NO_EXTRAS ${python_sources})
set_target_properties(trunnion_python PROPERTIES OUTPUT_NAME _trunnion LIBRARY_OUTPUT_DIRECTORY ${folder})
target_link_libraries(trunnion_python PRIVATE trunnion_commands)
target_compile_options(trunnion_python PRIVATE -Wall -Wextra -Wshadow $<$<BOOL:${TRUNNION_WERROR}>:-Werror>)
# What the static libraries bring stays inside: another library of the process may bring its own.
target_link_options(trunnion_python PRIVATE LINKER:--exclude-libs,ALL LINKER:--as-needed)
file(GLOB python_files CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/src/app/python/trunnion/*)
file(MAKE_DIRECTORY ${folder})
foreach(file ${python_files})
  get_filename_component(name ${file} NAME)
  if(NOT name STREQUAL "__pycache__")
    file(CREATE_LINK ${file} ${folder}/${name} SYMBOLIC)
  endif()
endforeach()
file(CREATE_LINK ${CMAKE_SOURCE_DIR}/postconfigs ${folder}/postconfigs SYMBOLIC)

set(TRUNNION_PYTHON_DIR lib/python3/dist-packages CACHE PATH "Folder of Python packages below the prefix")
install(TARGETS trunnion_python LIBRARY DESTINATION ${TRUNNION_PYTHON_DIR}/trunnion COMPONENT python)
install(DIRECTORY ${CMAKE_SOURCE_DIR}/src/app/python/trunnion DESTINATION ${TRUNNION_PYTHON_DIR} COMPONENT python
  PATTERN __pycache__ EXCLUDE)
