# All .cpp files of the named stages: src/<stage>/*.cpp, in a fixed order.
function(tribin_stage_sources OUT)
  set(sources)
  foreach(stage ${ARGN})
    file(GLOB files CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/${stage}/*.cpp)
    list(SORT files)
    list(APPEND sources ${files})
  endforeach()
  set(${OUT} ${sources} PARENT_SCOPE)
endfunction()

# Gives a target the header io/part_fingerprint.hpp, made again when a source of the named stages changes.
function(tribin_part_fingerprint TARGET)
  set(sources)
  foreach(stage ${ARGN})
    file(GLOB files CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/${stage}/*.[ch]pp
         ${PROJECT_SOURCE_DIR}/include/tribin/${stage}/*.hpp)
    list(SORT files)
    list(APPEND sources ${files})
  endforeach()
  set(list ${PROJECT_BINARY_DIR}/part_sources.txt)
  set(header ${PROJECT_BINARY_DIR}/generated/io/part_fingerprint.hpp)
  string(REPLACE ";" "\n" lines "${sources}")
  file(GENERATE OUTPUT ${list} CONTENT "${lines}\n")
  add_custom_command(OUTPUT ${header} DEPENDS ${sources} ${PROJECT_SOURCE_DIR}/cmake/PartFingerprint.cmake
    COMMAND ${CMAKE_COMMAND} -DSOURCES=${list} -DOUT=${header} -P ${PROJECT_SOURCE_DIR}/cmake/PartFingerprint.cmake
    COMMENT "Hashing the sources that compile a part")
  target_sources(${TARGET} PRIVATE ${header})
  set_source_files_properties(${PROJECT_SOURCE_DIR}/src/io/part_cache.cpp PROPERTIES
    INCLUDE_DIRECTORIES ${PROJECT_BINARY_DIR}/generated)
endfunction()
