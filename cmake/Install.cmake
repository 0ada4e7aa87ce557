# cmake --install, and packages by CPack: `trunnion` (the program, its data and texts), `libtrunnion-dev` (headers, static libraries,
# find_package(trunnion), pkg-config) and `python3-trunnion` (TRUNNION_PYTHON). Nothing installed holds a path of the build: what belongs to
# the program is found from its place.
# Where Debian looks for libraries of one architecture, under /usr/local too.
if(NOT DEFINED CMAKE_INSTALL_LIBDIR AND CMAKE_LIBRARY_ARCHITECTURE AND EXISTS /etc/debian_version)
  set(CMAKE_INSTALL_LIBDIR lib/${CMAKE_LIBRARY_ARCHITECTURE} CACHE PATH "Folder of libraries below the prefix")
endif()
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME trunnion)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

if(TARGET trunnion_app)
  install(TARGETS trunnion_app RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  install(DIRECTORY postconfigs DESTINATION ${CMAKE_INSTALL_DATADIR}/trunnion)
  # Man pages and completion come from the program's own tables of commands and options.
  install(CODE "
    set(texts \"${CMAKE_BINARY_DIR}/generated/share\")
    file(REMOVE_RECURSE \"\${texts}\")
    execute_process(COMMAND \"${CMAKE_BINARY_DIR}/trunnion\" texts share \"\${texts}\" COMMAND_ERROR_IS_FATAL ANY)
    file(GLOB pages \"\${texts}/man/man*/*\")
    execute_process(COMMAND gzip -9n \${pages} COMMAND_ERROR_IS_FATAL ANY)")
  install(DIRECTORY ${CMAKE_BINARY_DIR}/generated/share/ DESTINATION ${CMAKE_INSTALL_DATADIR})
endif()

# The library: a static one for each layer, together trunnion::trunnion.
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/trunnion)
foreach(target ${TRUNNION_LAYER_TARGETS} trunnion)
  if(target MATCHES "^trunnion_(.*)")
    set_target_properties(${target} PROPERTIES EXPORT_NAME ${CMAKE_MATCH_1})
  endif()
  install(TARGETS ${target} EXPORT trunnion COMPONENT dev ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
    INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
endforeach()
# Inline functions of the headers give the same numbers as the library's own code (Layers.cmake).
target_compile_options(trunnion INTERFACE $<INSTALL_INTERFACE:-ffp-contract=off> $<INSTALL_INTERFACE:-Wno-psabi>)
install(EXPORT trunnion NAMESPACE trunnion:: FILE trunnion-targets.cmake DESTINATION ${package} COMPONENT dev)
install(DIRECTORY include/trunnion DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev)
configure_package_config_file(cmake/trunnion-config.cmake.in ${CMAKE_BINARY_DIR}/generated/trunnion-config.cmake INSTALL_DESTINATION ${package})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/generated/trunnion-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/generated/trunnion-config.cmake ${CMAKE_BINARY_DIR}/generated/trunnion-config-version.cmake
  DESTINATION ${package} COMPONENT dev)

# pkg-config: a layer stands before those that it knows.
set(layers ${TRUNNION_LAYER_TARGETS})
list(REVERSE layers)
list(TRANSFORM layers PREPEND -l)
list(JOIN layers " " TRUNNION_LAYER_LIBRARIES)
file(RELATIVE_PATH TRUNNION_PREFIX_OF_PC /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(cmake/trunnion.pc.in ${CMAKE_BINARY_DIR}/generated/trunnion.pc @ONLY)
install(FILES ${CMAKE_BINARY_DIR}/generated/trunnion.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)

set(CPACK_PACKAGE_NAME trunnion)
set(CPACK_PACKAGE_VENDOR "trunnion maintainers")
set(CPACK_PACKAGE_CONTACT "trunnion maintainers <maintainers@trunnion.example>")
set(CPACK_PACKAGE_CHECKSUM SHA256)
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL trunnion dev)
set(packages trunnion=trunnion libtrunnion-dev=dev)
if(TRUNNION_PYTHON)
  list(APPEND CPACK_COMPONENTS_ALL python)
  list(APPEND packages python3-trunnion=python)
endif()
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_TRUNNION_PACKAGE_NAME trunnion)
set(CPACK_DEBIAN_TRUNNION_PACKAGE_SECTION misc)
set(CPACK_DEBIAN_TRUNNION_PACKAGE_SHLIBDEPS ON)
# Loaded at run time: for effects that are formulas, for the broker of `thermal serve`.
set(CPACK_DEBIAN_TRUNNION_PACKAGE_RECOMMENDS "libmuparser2v5, libmosquitto1")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "five-axis post-processor for dual-turntable machines")
set(CPACK_COMPONENT_TRUNNION_DESCRIPTION "Turns a CAM system's cutter-location (CL) file into NC code, keeps the
 nonlinear error of the moving tool inside a proved tolerance, corrects the
 machine's geometric and thermal errors, and re-reads and checks every program
 before it releases it. Compares the model of a machine with measurements and
 names the missing physical effect, or the measurement that would tell.")
set(CPACK_DEBIAN_DEV_PACKAGE_NAME libtrunnion-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "libeigen3-dev, libexpected-dev, libtbb-dev, libcsv-dev, libsvm-dev, libxxhash-dev, zlib1g-dev")
set(CPACK_COMPONENT_DEV_DESCRIPTION "Headers and static libraries of trunnion: kinematics of machines whose two
 rotary axes carry the part, models of their errors, posting and verification
 of NC programs, diagnosis of measurements. Found by CMake and pkg-config.")
if(TRUNNION_PYTHON)
  math(EXPR next_minor "${Python_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-trunnion)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
  # Machines and controls are those of the program.
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "trunnion (= ${PROJECT_VERSION}), python3 (>= ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}),\
 python3 (<< ${Python_VERSION_MAJOR}.${next_minor}), python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "libmuparser2v5")
  # Compiled when it is installed, so that removing it leaves nothing behind.
  file(WRITE ${CMAKE_BINARY_DIR}/generated/python/postinst "#!/bin/sh\nset -e\nif [ \"$1\" = configure ]; then py3compile -p python3-trunnion; fi\n")
  file(WRITE ${CMAKE_BINARY_DIR}/generated/python/prerm "#!/bin/sh\nset -e\npy3clean -p python3-trunnion\n")
  file(CHMOD ${CMAKE_BINARY_DIR}/generated/python/postinst ${CMAKE_BINARY_DIR}/generated/python/prerm
    PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${CMAKE_BINARY_DIR}/generated/python/postinst ${CMAKE_BINARY_DIR}/generated/python/prerm)
  set(CPACK_COMPONENT_PYTHON_DESCRIPTION "Python module of trunnion, on numpy arrays: kinematics of machines whose two
 rotary axes carry the part, NC programs posted and verified, models of a
 machine's errors fitted to measurements. The same numbers as the program's.")
endif()
# What every Debian package brings. The changelog is the newest entry of CHANGELOG.md in Debian's form.
file(STRINGS CHANGELOG.md lines)
set(TRUNNION_CHANGES "")
set(entries 0)
foreach(line IN LISTS lines)
  if(line MATCHES "^## ")
    math(EXPR entries "${entries} + 1")
  elseif(entries EQUAL 1 AND line MATCHES "^- (.*)")
    string(APPEND TRUNNION_CHANGES "  * ${CMAKE_MATCH_1}\n")
  elseif(entries EQUAL 1 AND line MATCHES "^  (.*)")
    string(APPEND TRUNNION_CHANGES "    ${CMAKE_MATCH_1}\n")
  endif()
endforeach()
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS CHANGELOG.md)
string(TIMESTAMP TRUNNION_DATE "%a, %d %b %Y %H:%M:%S +0000" UTC)
foreach(of ${packages})
  string(REPLACE "=" ";" of ${of})
  list(GET of 0 name)
  list(GET of 1 component)
  set(doc ${CMAKE_BINARY_DIR}/generated/doc/${name})
  configure_file(cmake/copyright.in ${doc}/copyright @ONLY)
  file(CONFIGURE OUTPUT ${doc}/changelog @ONLY CONTENT
"trunnion (@PROJECT_VERSION@) unstable; urgency=medium

@TRUNNION_CHANGES@
 -- @CPACK_PACKAGE_CONTACT@  @TRUNNION_DATE@
")
  install(FILES ${doc}/copyright DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/${name} COMPONENT ${component})
  install(CODE "execute_process(COMMAND gzip -9nc \"${doc}/changelog\" OUTPUT_FILE \"${doc}/changelog.gz\" COMMAND_ERROR_IS_FATAL ANY)"
    COMPONENT ${component})
  install(FILES ${doc}/changelog.gz DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/${name} COMPONENT ${component})
endforeach()
include(CPack)
