# Language level, warnings and numerics shared by every target of ours.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()

# Who switches the compile cache off when a folder is configured (CCACHE_DISABLE, as ccache itself reads it) builds there
# as if it were not installed.
find_program(CCACHE_PROGRAM ccache)
set(compile_cache ON)
if(NOT CCACHE_PROGRAM OR NOT "$ENV{CCACHE_DISABLE}" STREQUAL "")
  set(compile_cache OFF)
endif()
option(DMSLAM_COMPILE_CACHE "Compile through ccache" ${compile_cache})
# Precompiled headers are cached only where the cache may take it that no macro that is defined before them, nor the time,
# changes what they say: ours are the first thing that a file reads.
if(DMSLAM_COMPILE_CACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros ${CCACHE_PROGRAM})
endif()

# With the tests 270 programs are linked, each in half a second by the usual linker and in a tenth by gold.
include(CheckLinkerFlag)
check_linker_flag(CXX -fuse-ld=gold DMSLAM_HAVE_GOLD)
option(DMSLAM_GOLD "Link with gold" ${DMSLAM_HAVE_GOLD})
if(DMSLAM_GOLD AND NOT DMSLAM_SANITIZE)
  add_link_options(-fuse-ld=gold)
endif()

set(DMSLAM_SANITIZE "" CACHE STRING "Sanitizers, as for -fsanitize= (address,undefined or thread)")

# The promise of identical bytes needs products and sums to be rounded one by one. Nobody replaces a function of ours
# when a program is loaded, and a compiler that knows may inline what is in the same file.
add_library(dmslam_options INTERFACE)
target_compile_options(dmslam_options INTERFACE
  $<BUILD_INTERFACE:-Wall> $<BUILD_INTERFACE:-Wextra> $<BUILD_INTERFACE:-Wconversion> $<BUILD_INTERFACE:-Wshadow>
  $<BUILD_INTERFACE:-Werror> $<BUILD_INTERFACE:-ffp-contract=off>
  $<BUILD_INTERFACE:-fno-semantic-interposition>)
# GCC looks for memory that it can give back each time it has asked for some more, and in Eigen's templates it finds a
# sixth: it begins with that at a gigabyte only.
target_compile_options(dmslam_options INTERFACE
  $<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=1048576>>)
target_compile_features(dmslam_options INTERFACE cxx_std_20)
if(DMSLAM_SANITIZE)
  target_compile_options(dmslam_options INTERFACE
    -fsanitize=${DMSLAM_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(dmslam_options INTERFACE -fsanitize=${DMSLAM_SANITIZE})
endif()
target_include_directories(dmslam_options INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>)
# Third-party headers are not held to our warnings.
find_package(Eigen3 REQUIRED NO_MODULE)
get_target_property(_eigen_include Eigen3::Eigen INTERFACE_INCLUDE_DIRECTORIES)
target_include_directories(dmslam_options SYSTEM INTERFACE $<BUILD_INTERFACE:${_eigen_include}>)
target_link_libraries(dmslam_options INTERFACE $<INSTALL_INTERFACE:Eigen3::Eigen>)
dmslam_export(dmslam_options options)
