# Bundles the chart library that HTML reports embed (src/report/web), once, at configure time. Without npm, or when npm fails, the
# program is built all the same and its pages hold static drawings only: TRUNNION_CHARTS_FILE is then empty.
option(TRUNNION_CHARTS "Embed the interactive chart library into HTML reports (needs npm)" ON)

function(trunnion_bundle_charts result)
  set(web ${CMAKE_SOURCE_DIR}/src/report/web)
  set(work ${CMAKE_BINARY_DIR}/charts)
  set(empty ${work}/none.js)
  file(WRITE ${empty} "")
  set(${result} ${empty} PARENT_SCOPE)
  if(NOT TRUNNION_CHARTS)
    return()
  endif()
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${web}/package-lock.json ${web}/charts.js)
  file(SHA256 ${web}/package-lock.json lock)
  file(SHA256 ${web}/charts.js entry)
  string(SHA256 key "${lock}${entry}")
  string(SUBSTRING ${key} 0 16 key)
  # Kept in the user's cache: a second build folder, or one without a network, needs no npm.
  set(cache $ENV{XDG_CACHE_HOME})
  if(NOT cache)
    set(cache $ENV{HOME}/.cache)
  endif()
  set(bundle ${cache}/trunnion/charts-${key}.js)
  if(NOT EXISTS ${bundle})
    find_program(NPM npm)
    if(NOT NPM)
      message(STATUS "npm not found: HTML reports will hold static drawings only")
      return()
    endif()
    message(STATUS "bundling the chart library with npm")
    file(COPY ${web}/package.json ${web}/package-lock.json ${web}/charts.js DESTINATION ${work})
    execute_process(
      COMMAND ${NPM} ci --ignore-scripts --no-audit --no-fund --loglevel=error
      WORKING_DIRECTORY ${work} TIMEOUT 300 RESULT_VARIABLE failed OUTPUT_QUIET ERROR_VARIABLE why)
    if(failed EQUAL 0)
      execute_process(
        COMMAND ${work}/node_modules/.bin/esbuild charts.js --bundle --minify --format=iife --target=es2020 --loader:.css=empty
                --define:global=globalThis --legal-comments=eof --log-level=error --outfile=charts.part.js
        WORKING_DIRECTORY ${work} TIMEOUT 120 RESULT_VARIABLE failed OUTPUT_QUIET ERROR_VARIABLE why)
    endif()
    file(REMOVE_RECURSE ${work}/node_modules)
    if(NOT failed EQUAL 0)
      string(REGEX REPLACE "\n.*" "" why "${why}")
      message(STATUS "npm failed (${why}): HTML reports will hold static drawings only")
      return()
    endif()
    file(MAKE_DIRECTORY ${cache}/trunnion)
    file(COPY_FILE ${work}/charts.part.js ${bundle}.part)
    file(RENAME ${bundle}.part ${bundle})
  endif()
  set(${result} ${bundle} PARENT_SCOPE)
endfunction()

trunnion_bundle_charts(TRUNNION_CHARTS_FILE)
set(web ${CMAKE_SOURCE_DIR}/src/report/web)
file(GLOB web_modules ${web}/*.js)
set_source_files_properties(${CMAKE_SOURCE_DIR}/src/report/assets.cpp PROPERTIES
  COMPILE_DEFINITIONS "TRUNNION_WEB=\"${web}\";TRUNNION_CHARTS=\"${TRUNNION_CHARTS_FILE}\""
  OBJECT_DEPENDS "${web}/page.css;${web_modules};${TRUNNION_CHARTS_FILE}")
