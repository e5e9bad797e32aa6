# lcm_generate(<target> <file.lcm>...): C++ types from .lcm files with lcm-gen, as a header-only SYSTEM target.
# Headers land in <binary dir>/lcm_generated/dmslam/ and are included as "dmslam/<type>.hpp".
find_program(LCM_GEN lcm-gen REQUIRED)

function(lcm_generate target)
  set(out ${PROJECT_BINARY_DIR}/lcm_generated)
  set(headers "")
  foreach(lcm_file ${ARGN})
    get_filename_component(base ${lcm_file} NAME_WE)
    string(REGEX REPLACE "^dmslam_" "" type ${base})
    set(header ${out}/dmslam/${type}.hpp)
    add_custom_command(
      OUTPUT ${header}
      COMMAND ${LCM_GEN} --cpp --cpp-hpath=${out} ${lcm_file}
      DEPENDS ${lcm_file}
      COMMENT "lcm-gen ${base}" VERBATIM)
    list(APPEND headers ${header})
  endforeach()
  add_custom_target(${target}_headers ALL DEPENDS ${headers})
  add_library(${target} INTERFACE)
  add_dependencies(${target} ${target}_headers)
  target_include_directories(${target} SYSTEM INTERFACE $<BUILD_INTERFACE:${out}>)
  target_link_libraries(${target} INTERFACE dmslam_lcm)
  dmslam_install_headers(FILES ${headers})
  dmslam_export(${target} lcmtypes)
endfunction()
