# cmake -DGIT=... -DSOURCE=... -DVERSION=0.1.0 -DFILE=build_version.cc -P write_build_version.cmake: writes FILE, with the
# version, the commit of SOURCE where that is the top of a repository, and "-changed" where what is built differs from it.
set(version ${VERSION})
if(GIT)
  set(git ${GIT} -c safe.directory=* -C ${SOURCE})
  execute_process(COMMAND ${git} rev-parse --show-prefix OUTPUT_VARIABLE below RESULT_VARIABLE no_repository
    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  execute_process(COMMAND ${git} rev-parse --short=10 HEAD OUTPUT_VARIABLE commit RESULT_VARIABLE no_commit
    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(no_repository EQUAL 0 AND no_commit EQUAL 0 AND below STREQUAL "")
    string(APPEND version "+${commit}")
    execute_process(COMMAND ${git} diff --quiet HEAD -- CMakeLists.txt cmake lcmtypes src procs tools
      RESULT_VARIABLE differs ERROR_QUIET)
    if(NOT differs EQUAL 0)
      string(APPEND version "-changed")
    endif()
  endif()
endif()
file(CONFIGURE OUTPUT ${FILE} @ONLY CONTENT [[
#include "dmslam/util/build_version.h"

namespace dmslam {

const char* BuildVersion() { return "@version@"; }

}  // namespace dmslam
]])
