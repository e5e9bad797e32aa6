# The files of a room are compiled as one: they read the same headers and need the same templates (Eigen's decompositions,
# JSON, message types), so that a full build takes half the time. Who works on the code switches it off
# (-DDMSLAM_TOGETHER=OFF, as the preset dev does): only what was changed is compiled, every file shows that it includes
# what it needs, and compile_commands.json, which clang-tidy and editors read, lists each file.
option(DMSLAM_TOGETHER "Compile the files of a room together" ON)
# The headers that nearly all rooms read (Eigen, the standard library) are then compiled once, which saves a second in
# every room, and GoogleTest's with them for the tests.
set(precompile OFF)
if(DMSLAM_TOGETHER AND CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  set(precompile ON)
endif()
option(DMSLAM_PRECOMPILE "Compile the headers of Eigen and of the standard library once" ${precompile})
# dmslam_precompile(<target> [headers...]): <target> has these headers beside those of all rooms. A file that reads them is
# optimized as they were, whatever its own options say (GCC 12). -fpch-preprocess: for the compile cache.
function(dmslam_precompile target)
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/precompiled.cc CONTENT "// It has headers only.\n")
  add_library(${target} STATIC ${PROJECT_BINARY_DIR}/precompiled.cc)
  target_link_libraries(${target} PRIVATE dmslam_options)
  target_compile_options(${target} PRIVATE -fpch-preprocess)
  target_precompile_headers(${target} PRIVATE ${ARGN} <Eigen/Cholesky> <Eigen/Geometry> <Eigen/LU> <algorithm> <array>
    <chrono> <deque> <fstream> <functional> <limits> <map> <memory> <numeric> <optional> <random> <set> <span> <sstream>
    <string> <thread> <unordered_map> <unordered_set> <variant> <vector>)
endfunction()
if(DMSLAM_PRECOMPILE)
  dmslam_precompile(dmslam_precompiled)
  dmslam_precompile(dmslam_precompiled_lightly)  # for dmslam_compile_lightly
  target_compile_options(dmslam_precompiled_lightly PRIVATE $<$<CONFIG:Release>:-O1>)
  if(DMSLAM_BUILD_TESTS)
    dmslam_precompile(dmslam_precompiled_for_tests <gtest/gtest.h>)
    target_link_libraries(dmslam_precompiled_for_tests PRIVATE GTest::gtest)
    target_compile_options(dmslam_precompiled_for_tests PRIVATE $<$<CONFIG:Release>:-O1>)
  endif()
endif()

# The files of <target> read the headers that were compiled once. CMake compiles a program's files with -fPIE; the compiler
# takes headers compiled with -fPIC only where it says -fPIC, too. It compares the options by itself, and CMake asks it to say so (-Winvalid-pch).
function(dmslam_use_precompiled target)
  if(NOT DMSLAM_PRECOMPILE)
    return()
  endif()
  get_target_property(type ${target} TYPE)
  if(type STREQUAL EXECUTABLE)
    target_compile_options(${target} PRIVATE -fPIC)
  endif()
  target_compile_options(${target} PRIVATE -fpch-preprocess)
  get_target_property(is_test ${target} DMSLAM_TEST)
  get_target_property(lightly ${target} DMSLAM_LIGHTLY)
  if(is_test)
    target_precompile_headers(${target} REUSE_FROM dmslam_precompiled_for_tests)
  elseif(lightly)
    target_precompile_headers(${target} REUSE_FROM dmslam_precompiled_lightly)
  else()
    target_precompile_headers(${target} REUSE_FROM dmslam_precompiled)
  endif()
endfunction()

# All programs of this project under <folder>.
function(dmslam_programs_use_precompiled folder)
  get_property(folders DIRECTORY ${folder} PROPERTY SUBDIRECTORIES)
  foreach(subfolder ${folders})
    dmslam_programs_use_precompiled(${subfolder})
  endforeach()
  get_property(targets DIRECTORY ${folder} PROPERTY BUILDSYSTEM_TARGETS)
  foreach(target ${targets})
    get_target_property(type ${target} TYPE)
    if(type STREQUAL EXECUTABLE)
      dmslam_use_precompiled(${target})
    endif()
  endforeach()
endfunction()

function(dmslam_compile_together target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${DMSLAM_TOGETHER} UNITY_BUILD_BATCH_SIZE 0)
  if(DMSLAM_TOGETHER)  # the warning takes a file for a header where another one includes it
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
  endif()
  get_target_property(type ${target} TYPE)
  if(type STREQUAL STATIC_LIBRARY)  # programs: dmslam_programs_use_precompiled
    dmslam_use_precompiled(${target})
  endif()
endfunction()

# What waits for people, disks and the bus is not optimized to the utmost: that takes a third of the time to compile.
# What computes (geometry, matching, optimization) is, in the rooms.
function(dmslam_compile_lightly)
  foreach(target ${ARGN})
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
    set_target_properties(${target} PROPERTIES DMSLAM_LIGHTLY ON)
    get_target_property(type ${target} TYPE)
    if(type STREQUAL STATIC_LIBRARY)  # programs: dmslam_programs_use_precompiled
      dmslam_use_precompiled(${target})
    endif()
  endforeach()
endfunction()

# dmslam_room(NAME <room> [APART] [SRCS ...] [DEPS ...] [TESTS ...] [TEST_DEPS ...] [BENCHES ...])
#
# One library per room: target dmslam_<room>, alias dmslam::<room>. Every file in TESTS becomes its own test
# program, every file in BENCHES its own benchmark program. APART: the files are never compiled together (see
# dmslam_compile_together): where they have little in common, or need the memory of several.
function(dmslam_room)
  cmake_parse_arguments(ROOM "APART" "NAME" "SRCS;DEPS;TESTS;TEST_DEPS;BENCHES" ${ARGN})
  set(target dmslam_${ROOM_NAME})
  if(ROOM_SRCS)
    add_library(${target} STATIC ${ROOM_SRCS})
    target_link_libraries(${target} PUBLIC dmslam_options ${ROOM_DEPS})
    if(ROOM_APART)
      dmslam_use_precompiled(${target})
    else()
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

# dmslam_test(<source> <libraries...>): one GoogleTest program, registered with ctest under its file name. What is worth
# optimizing is in the rooms.
function(dmslam_test test_source)
  get_filename_component(test_name ${test_source} NAME_WE)
  add_executable(${test_name} ${test_source})
  target_link_libraries(${test_name} PRIVATE ${ARGN} GTest::gtest_main)
  target_compile_options(${test_name} PRIVATE $<$<CONFIG:Release>:-O1>)
  set_target_properties(${test_name} PROPERTIES DMSLAM_TEST ON)
  add_test(NAME ${test_name} COMMAND ${test_name})
  set_tests_properties(${test_name} PROPERTIES TIMEOUT 600 SKIP_REGULAR_EXPRESSION "\\[  SKIPPED \\] [1-9]"
    ENVIRONMENT "DMSLAM_SOURCE_DIR=${PROJECT_SOURCE_DIR}")
endfunction()
