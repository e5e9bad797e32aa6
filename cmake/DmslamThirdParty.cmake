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

# dmslam_lcm: the LCM library (liblcm-dev).
find_library(LCM_LIBRARY lcm REQUIRED)
find_path(LCM_INCLUDE_DIR lcm/lcm-cpp.hpp REQUIRED)
if(NOT TARGET dmslam_lcm)
  add_library(dmslam_lcm INTERFACE IMPORTED GLOBAL)
  target_include_directories(dmslam_lcm SYSTEM INTERFACE ${LCM_INCLUDE_DIR})
  target_link_libraries(dmslam_lcm INTERFACE ${LCM_LIBRARY})
endif()

# dmslam_turbojpeg (libturbojpeg0-dev).
find_library(TURBOJPEG_LIBRARY turbojpeg REQUIRED)
find_path(TURBOJPEG_INCLUDE_DIR turbojpeg.h REQUIRED)
if(NOT TARGET dmslam_turbojpeg)
  add_library(dmslam_turbojpeg INTERFACE IMPORTED GLOBAL)
  target_include_directories(dmslam_turbojpeg SYSTEM INTERFACE ${TURBOJPEG_INCLUDE_DIR})
  target_link_libraries(dmslam_turbojpeg INTERFACE ${TURBOJPEG_LIBRARY})
endif()

# dmslam_sodium (libsodium-dev).
find_library(SODIUM_LIBRARY sodium REQUIRED)
find_path(SODIUM_INCLUDE_DIR sodium.h REQUIRED)
if(NOT TARGET dmslam_sodium)
  add_library(dmslam_sodium INTERFACE IMPORTED GLOBAL)
  target_include_directories(dmslam_sodium SYSTEM INTERFACE ${SODIUM_INCLUDE_DIR})
  target_link_libraries(dmslam_sodium INTERFACE ${SODIUM_LIBRARY})
endif()
