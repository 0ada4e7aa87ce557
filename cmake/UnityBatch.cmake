# Sources in one compilation, where TRUNNION_UNITY is on. Most of the time goes into headers and templates, once for each compilation: whole
# layers (0) take a quarter less processor time than 16 sources at a time. They keep few processors busy, since one layer is half of the code,
# and the largest takes 4.4 GB (g++ 12): only where there are few processors, with memory enough for each.
function(trunnion_unity_batch out)
  set(most_processors 4)
  set(mb_of_one 6000)
  cmake_host_system_information(RESULT processors QUERY NUMBER_OF_LOGICAL_CORES)
  cmake_host_system_information(RESULT memory_mb QUERY TOTAL_PHYSICAL_MEMORY)
  # What a container may have of it.
  foreach(limit /sys/fs/cgroup/memory.max /sys/fs/cgroup/memory/memory.limit_in_bytes)
    if(EXISTS ${limit})
      file(STRINGS ${limit} bytes LIMIT_COUNT 1)
      if(bytes MATCHES "^[0-9]+$")
        math(EXPR limit_mb "${bytes} / 1000000")
        if(limit_mb LESS memory_mb)
          set(memory_mb ${limit_mb})
        endif()
      endif()
    endif()
  endforeach()
  math(EXPR needed_mb "${processors} * ${mb_of_one}")
  set(${out} 16 PARENT_SCOPE)
  # Not where sanitizers make code several times as large.
  if(processors LESS_EQUAL most_processors AND memory_mb GREATER needed_mb AND NOT TRUNNION_SANITIZE)
    set(${out} 0 PARENT_SCOPE)
  endif()
endfunction()
