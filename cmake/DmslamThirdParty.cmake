# Imported targets for libraries that ship no CMake configuration with the Debian packages we ask for. Read by our own
# build and, installed, by find_package(dmslam).

# opencv_<module> (core, imgproc, imgcodecs, ...) for the modules whose development packages are there. Debian ships
# OpenCV's CMake configuration with the metapackage libopencv-dev only, which brings every module; the single packages
# (libopencv-core-dev, ...) are all that is needed here.
find_path(DMSLAM_OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
foreach(module core imgproc imgcodecs features2d calib3d flann videoio highgui)
  find_library(DMSLAM_OPENCV_${module}_LIBRARY opencv_${module})
  mark_as_advanced(DMSLAM_OPENCV_${module}_LIBRARY)
  if(DMSLAM_OPENCV_${module}_LIBRARY AND NOT TARGET opencv_${module})
    add_library(opencv_${module} INTERFACE IMPORTED GLOBAL)
    target_include_directories(opencv_${module} SYSTEM INTERFACE ${DMSLAM_OPENCV_INCLUDE_DIR})
    target_link_libraries(opencv_${module} INTERFACE ${DMSLAM_OPENCV_${module}_LIBRARY})
  endif()
endforeach()

# dmslam_<name>: the library <NAME>_LIBRARY with the header <NAME>_INCLUDE_DIR; both can be given by hand.
function(dmslam_third_party name library header)
  string(TOUPPER ${name} prefix)
  find_library(${prefix}_LIBRARY ${library} REQUIRED)
  find_path(${prefix}_INCLUDE_DIR ${header} REQUIRED)
  if(NOT TARGET dmslam_${name})
    add_library(dmslam_${name} INTERFACE IMPORTED GLOBAL)
    target_include_directories(dmslam_${name} SYSTEM INTERFACE ${${prefix}_INCLUDE_DIR})
    target_link_libraries(dmslam_${name} INTERFACE ${${prefix}_LIBRARY})
  endif()
endfunction()
dmslam_third_party(lcm lcm lcm/lcm-cpp.hpp)            # liblcm-dev
dmslam_third_party(turbojpeg turbojpeg turbojpeg.h)    # libturbojpeg0-dev
dmslam_third_party(sodium sodium sodium.h)             # libsodium-dev
