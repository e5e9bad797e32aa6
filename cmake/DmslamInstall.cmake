# What `cmake --install` puts where, and the Debian packages that cpack makes of it: `dmslam` (programs, message
# definitions, cameras, vocabulary, units, man pages, documents) and `dmslam-dev` (headers, libraries, find_package).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(DMSLAM_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/dmslam)
set(DMSLAM_SHARE_DIR ${CMAKE_INSTALL_DATADIR}/dmslam)

# dmslam_export(<target> <name>): a library that find_package(dmslam) offers as dmslam::<name>.
function(dmslam_export target name)
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS ${target} EXPORT dmslamTargets ARCHIVE COMPONENT dev INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
endfunction()

# dmslam_install_headers(FILES ...): generated headers, found beside those of the rooms as "dmslam/<type>.hpp".
function(dmslam_install_headers)
  cmake_parse_arguments(HEADERS "" "" "FILES" ${ARGN})
  install(FILES ${HEADERS_FILES} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/dmslam COMPONENT dev)
endfunction()

# A man page per program, made of what it says with --help. Programs of another architecture are run by
# CMAKE_CROSSCOMPILING_EMULATOR; without one there are no pages.
function(_dmslam_man_page name command)
  set(page ${PROJECT_BINARY_DIR}/man/${name}.1.gz)
  add_custom_command(OUTPUT ${page}
    COMMAND ${PROJECT_SOURCE_DIR}/cmake/man_page.sh ${page} ${name} ${PROJECT_VERSION} ${command}
    DEPENDS ${PROJECT_SOURCE_DIR}/cmake/man_page.sh ${ARGN}
    COMMENT "man page ${name}" VERBATIM)
  set_property(GLOBAL APPEND PROPERTY DMSLAM_MAN_PAGES ${page})
endfunction()

function(_dmslam_install_programs)
  file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/man)
  foreach(name player frontend mapper loopcloser collector viewer inprocess synth eval map vocab settings report run static)
    if(TARGET dmslam-${name})
      install(TARGETS dmslam-${name} RUNTIME COMPONENT runtime)
      if(NOT CMAKE_CROSSCOMPILING OR CMAKE_CROSSCOMPILING_EMULATOR)
        _dmslam_man_page(dmslam-${name} "${CMAKE_CROSSCOMPILING_EMULATOR};$<TARGET_FILE:dmslam-${name}>" dmslam-${name})
      endif()
    endif()
  endforeach()
  # Scripts see from their own name whether they are installed.
  foreach(name demo convert-camera)
    string(REPLACE "-" "_" script ${name})
    set(script ${PROJECT_SOURCE_DIR}/scripts/${script}.sh)
    install(PROGRAMS ${script} RENAME dmslam-${name} DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT runtime)
    file(CREATE_LINK ${script} ${PROJECT_BINARY_DIR}/man/dmslam-${name} SYMBOLIC)
    _dmslam_man_page(dmslam-${name} ${PROJECT_BINARY_DIR}/man/dmslam-${name} ${script})
  endforeach()
  get_property(pages GLOBAL PROPERTY DMSLAM_MAN_PAGES)
  add_custom_target(man ALL DEPENDS ${pages})
  install(FILES ${pages} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT runtime)
endfunction()

function(_dmslam_install_data)
  install(DIRECTORY config/ DESTINATION ${DMSLAM_SHARE_DIR}/config COMPONENT runtime FILES_MATCHING PATTERN "*.yaml"
    PATTERN "*.nft" PATTERN systemd EXCLUDE)
  install(FILES config/systemd/system.env DESTINATION ${DMSLAM_SHARE_DIR} COMPONENT runtime)
  install(FILES data/vocabulary.dmv data/vocabulary.md DESTINATION ${DMSLAM_SHARE_DIR}/data COMPONENT runtime)
  install(DIRECTORY procs/viewer/web DESTINATION ${DMSLAM_SHARE_DIR}/procs/viewer COMPONENT runtime)
  install(DIRECTORY config/systemd/ DESTINATION lib/systemd/system COMPONENT runtime
    FILES_MATCHING PATTERN "*.service" PATTERN "*.target")
  install(DIRECTORY docs examples DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT runtime)
  install(FILES README.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT runtime)
  install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright COMPONENT runtime)
endfunction()

function(_dmslam_install_development)
  install(DIRECTORY src/dmslam DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev FILES_MATCHING PATTERN "*.h"
    PATTERN testing EXCLUDE)
  install(EXPORT dmslamTargets NAMESPACE dmslam:: DESTINATION ${DMSLAM_CMAKE_DIR} COMPONENT dev)
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/dmslamConfig.cmake.in ${PROJECT_BINARY_DIR}/dmslamConfig.cmake
    INSTALL_DESTINATION ${DMSLAM_CMAKE_DIR} PATH_VARS CMAKE_INSTALL_DATADIR)
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/dmslamConfigVersion.cmake COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/dmslamConfig.cmake ${PROJECT_BINARY_DIR}/dmslamConfigVersion.cmake
    cmake/DmslamThirdParty.cmake DESTINATION ${DMSLAM_CMAKE_DIR} COMPONENT dev)
endfunction()

# The settings of cpack: cpack -G DEB in a build folder of the preset `package`.
macro(_dmslam_package)
  set(CPACK_GENERATOR DEB)
  set(CPACK_PACKAGE_CONTACT "dmslam <dmslam@localhost>")
  set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "monocular SLAM in scenes where people walk, as processes on LCM")
  set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
  set(CPACK_PACKAGING_INSTALL_PREFIX ${CMAKE_INSTALL_PREFIX})
  set(CPACK_STRIP_FILES ON)
  set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
  set(CPACK_DEB_COMPONENT_INSTALL ON)
  set(CPACK_COMPONENTS_ALL runtime dev)
  set(CPACK_DEBIAN_PACKAGE_SECTION science)
  set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME dmslam)
  set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_RUNTIME_PACKAGE_DEPENDS "libjs-three, libjs-chart.js")
  set(CPACK_DEBIAN_RUNTIME_PACKAGE_RECOMMENDS "liblcm-bin")
  set(CPACK_DEBIAN_DEV_PACKAGE_NAME dmslam-dev)
  set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
  string(CONCAT CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "dmslam (= ${PROJECT_VERSION}), liblcm-dev, libeigen3-dev, "
    "libceres-dev, libyaml-cpp-dev, nlohmann-json3-dev, libspdlog-dev, zlib1g-dev, libsodium-dev, libturbojpeg0-dev, libopencv-core-dev, "
    "libopencv-imgproc-dev, libopencv-imgcodecs-dev, libopencv-videoio-dev")
  set(CPACK_COMPONENT_RUNTIME_DESCRIPTION "Programs, message definitions, cameras, vocabulary, units, man pages.")
  set(CPACK_COMPONENT_DEV_DESCRIPTION "Headers and static libraries of the rooms, message types, CMake configuration.")
  include(CPack)
endmacro()

# Called last, when all targets are known.
macro(dmslam_finish_install)
  _dmslam_install_programs()
  _dmslam_install_data()
  _dmslam_install_development()
  _dmslam_package()
endmacro()
