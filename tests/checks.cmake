# Tests that are programs of their own: the layer list, the layout, the command line, the pages' code, a foreign consumer.
find_program(TRIBIN_PYTHON NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH)  # the one that Debian's python3-* belong to
find_program(TRIBIN_CLANG_FORMAT NAMES clang-format clang-format-14)

function(tribin_check name)
  add_test(NAME ${name} COMMAND ${ARGN} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  set_tests_properties(${name} PROPERTIES LABELS quick SKIP_RETURN_CODE 77
    ENVIRONMENT "XDG_CACHE_HOME=${PROJECT_BINARY_DIR}/cache")  # the user's own cache is left alone
endfunction()

if(TRIBIN_PYTHON)
  tribin_check(check_layers ${TRIBIN_PYTHON} tools/check_layers)
  tribin_check(cli ${TRIBIN_PYTHON} tests/cli/cli_test.py $<TARGET_FILE:tribin_cli> ${PROJECT_BINARY_DIR}/cli_test)
  tribin_check(cli_calibrate ${TRIBIN_PYTHON} tests/cli/calibrate_boards_test.py $<TARGET_FILE:tribin_cli> ${PROJECT_BINARY_DIR}/calibrate_test)
  tribin_check(cli_bop ${TRIBIN_PYTHON} tests/cli/bop_test.py $<TARGET_FILE:tribin_cli> ${PROJECT_BINARY_DIR}/bop_test)
  tribin_check(cli_pick ${TRIBIN_PYTHON} tests/cli/pick_test.py $<TARGET_FILE:tribin_cli> ${PROJECT_BINARY_DIR}/pick_test)
  tribin_check(slurm ${TRIBIN_PYTHON} tests/cli/slurm_test.py $<TARGET_FILE:tribin_cli> ${PROJECT_BINARY_DIR}/slurm_test)
  tribin_check(docs ${TRIBIN_PYTHON} tests/docs/code_blocks_test.py $<TARGET_FILE:tribin_cli> ${PROJECT_BINARY_DIR}/docs_test)
endif()
tribin_check(clang_format tools/check_format "${TRIBIN_CLANG_FORMAT}")
tribin_check(consumer tests/consumer/run ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR})

# The loops that are built for several levels of vectors, built for one each: objects of a program go before those of
# the library. The levels must give the same bytes.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64" AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  set(vectorised)
  foreach(source ${TRIBIN_SOURCES})
    cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY ${PROJECT_SOURCE_DIR})
    file(STRINGS ${source} found REGEX "^TRIBIN_VECTOR_LEVELS" LIMIT_COUNT 1)
    if(found)
      list(APPEND vectorised ${source})
    endif()
  endforeach()
  set(levels)
  foreach(level sse2 avx2 avx512f)
    add_executable(at_${level} simd/at_level.cpp ${vectorised})
    target_link_libraries(at_${level} PRIVATE tribin::tribin GTest::gtest)
    target_include_directories(at_${level} PRIVATE ${PROJECT_SOURCE_DIR}/src ${CMAKE_CURRENT_SOURCE_DIR})
    target_compile_definitions(at_${level} PRIVATE TRIBIN_ONE_LEVEL="${level}" TRIBIN_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
    list(APPEND levels $<TARGET_FILE:at_${level}>)
  endforeach()
  tribin_check(simd_levels tests/simd/compare ${levels})
endif()
