# Rooms whose files need the same templates (Eigen's decompositions, JSON, message types) are compiled as one file: a full
# build takes about half the time. Who works in such a room switches it off (-DDMSLAM_TOGETHER=OFF, as the preset dev
# does), to compile only what was changed; tools that read compile_commands.json want it off, too.
option(DMSLAM_TOGETHER "Compile the files of some rooms together" ON)
function(dmslam_compile_together target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${DMSLAM_TOGETHER} UNITY_BUILD_BATCH_SIZE 0)
endfunction()

# dmslam_room(NAME <room> [TOGETHER] [SRCS ...] [DEPS ...] [TESTS ...] [TEST_DEPS ...] [BENCHES ...])
#
# One library per room: target dmslam_<room>, alias dmslam::<room>. Every file in TESTS becomes its own test
# program, every file in BENCHES its own benchmark program. TOGETHER: see dmslam_compile_together.
function(dmslam_room)
  cmake_parse_arguments(ROOM "TOGETHER" "NAME" "SRCS;DEPS;TESTS;TEST_DEPS;BENCHES" ${ARGN})
  set(target dmslam_${ROOM_NAME})
  if(ROOM_SRCS)
    add_library(${target} STATIC ${ROOM_SRCS})
    target_link_libraries(${target} PUBLIC dmslam_options ${ROOM_DEPS})
    if(ROOM_TOGETHER)
      dmslam_compile_together(${target})
    endif()
  else()
    add_library(${target} INTERFACE)
    target_link_libraries(${target} INTERFACE dmslam_options ${ROOM_DEPS})
  endif()
  add_library(dmslam::${ROOM_NAME} ALIAS ${target})
  dmslam_export(${target} ${ROOM_NAME})
  if(DMSLAM_BUILD_TESTS)
    foreach(test_source ${ROOM_TESTS})
      dmslam_test(${test_source} ${target} ${ROOM_TEST_DEPS})
    endforeach()
  endif()
  if(DMSLAM_BUILD_BENCH)
    foreach(bench_source ${ROOM_BENCHES})
      get_filename_component(bench_name ${bench_source} NAME_WE)
      add_executable(${bench_name} ${bench_source})
      target_link_libraries(${bench_name} PRIVATE ${target} ${ROOM_TEST_DEPS} benchmark::benchmark)
    endforeach()
  endif()
endfunction()

# dmslam_test(<source> <libraries...>): one GoogleTest program, registered with ctest under its file name.
function(dmslam_test test_source)
  get_filename_component(test_name ${test_source} NAME_WE)
  add_executable(${test_name} ${test_source})
  target_link_libraries(${test_name} PRIVATE ${ARGN} GTest::gtest_main)
  add_test(NAME ${test_name} COMMAND ${test_name})
  set_tests_properties(${test_name} PROPERTIES TIMEOUT 600 SKIP_REGULAR_EXPRESSION "\\[  SKIPPED \\] [1-9]"
    ENVIRONMENT "DMSLAM_SOURCE_DIR=${PROJECT_SOURCE_DIR}")
endfunction()
