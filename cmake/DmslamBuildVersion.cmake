# dmslam_build_version(<file.cc>): a source file that says which version of the project a build is of. It is looked at
# again when a source file changes or another commit is checked out, and left as it is where its text would be the same.
find_package(Git QUIET)

function(dmslam_build_version file)
  set(depends ${PROJECT_SOURCE_DIR}/cmake/write_build_version.cmake ${PROJECT_SOURCE_DIR}/CMakeLists.txt)
  if(GIT_FOUND)
    # The log of what was checked out. In a folder without a repository there is none, and no commit is named.
    execute_process(COMMAND ${GIT_EXECUTABLE} -c safe.directory=* rev-parse --path-format=absolute --git-path logs/HEAD
      WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE log OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    if(log AND EXISTS ${log})
      list(APPEND depends ${log})
    endif()
  endif()
  foreach(folder lcmtypes src procs tools)
    file(GLOB_RECURSE sources ${PROJECT_SOURCE_DIR}/${folder}/*.h ${PROJECT_SOURCE_DIR}/${folder}/*.cc
      ${PROJECT_SOURCE_DIR}/${folder}/*.lcm ${PROJECT_SOURCE_DIR}/${folder}/CMakeLists.txt)
    list(APPEND depends ${sources})
  endforeach()
  add_custom_command(OUTPUT ${file}
    COMMAND ${CMAKE_COMMAND} -DGIT=${GIT_EXECUTABLE} -DSOURCE=${PROJECT_SOURCE_DIR} -DVERSION=${PROJECT_VERSION}
      -DFILE=${file} -P ${PROJECT_SOURCE_DIR}/cmake/write_build_version.cmake
    DEPENDS ${depends} COMMENT "version of this build" VERBATIM)
endfunction()
