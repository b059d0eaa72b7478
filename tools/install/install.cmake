# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# cmake --install: headers, libovertake.so, CMake and pkg-config packages, the command line, rigs and examples. The tree
# may be moved afterwards: every path in it is relative. Components, which become Debian packages (package.cmake):
#   library      libovertake.so.0
#   development  headers, libraries to link, CMake and pkg-config packages, documents of the library, examples
#   tools        the command line with its manual, completions and rigs; documents of the tools and of the formats
#   tree         what only a whole tree has
include(CMakePackageConfigHelpers)
set(cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/overtake)
set(doc_dir ${CMAKE_INSTALL_DATADIR}/doc/overtake)

install(FILES ${PROJECT_SOURCE_DIR}/pipeline/overtake.h ${PROJECT_SOURCE_DIR}/pipeline/overtake.hpp
        ${PROJECT_SOURCE_DIR}/core/columns.def DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/overtake
        COMPONENT development)
install(TARGETS overtake_shared EXPORT overtake-shared
        LIBRARY COMPONENT library NAMELINK_COMPONENT development)
install(EXPORT overtake-shared NAMESPACE overtake:: DESTINATION ${cmake_dir} COMPONENT development)
set(product overtake_shared)
set(OVT_PC_STATIC "")
if(OVT_STATIC)
  list(APPEND product overtake_static)
  install(TARGETS overtake_static EXPORT overtake-static ARCHIVE COMPONENT development)
  install(EXPORT overtake-static NAMESPACE overtake:: DESTINATION ${cmake_dir} COMPONENT development)
  install(FILES ${CMAKE_CURRENT_LIST_DIR}/overtake-static-config.cmake DESTINATION ${cmake_dir} COMPONENT development)
  set(OVT_PC_STATIC "Libs.private: -ltbb -lstdc++ -lm -lpthread\n")
endif()

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/overtake-config.cmake.in
                              ${PROJECT_BINARY_DIR}/overtake-config.cmake
                              INSTALL_DESTINATION ${cmake_dir} NO_SET_AND_CHECK_MACRO)
# The same rule as the library's check of a caller's header: equal major versions.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/overtake-config-version.cmake COMPATIBILITY SameMajorVersion)
install(FILES ${PROJECT_BINARY_DIR}/overtake-config.cmake ${PROJECT_BINARY_DIR}/overtake-config-version.cmake
        DESTINATION ${cmake_dir} COMPONENT development)

file(RELATIVE_PATH OVT_PREFIX_FROM_PC /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
string(REGEX REPLACE "/$" "" OVT_PREFIX_FROM_PC ${OVT_PREFIX_FROM_PC})
configure_file(${CMAKE_CURRENT_LIST_DIR}/overtake.pc.in ${PROJECT_BINARY_DIR}/overtake.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/overtake.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)

# tools/examples/live needs the source tree.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/tools/examples DESTINATION ${doc_dir} COMPONENT development
        PATTERN live EXCLUDE)
install(FILES ${PROJECT_SOURCE_DIR}/CHANGELOG.md DESTINATION ${doc_dir} COMPONENT development)
# Installs the documents that README.md links to, in the layout of the source tree. Links to sources become plain text.
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/README.md)
file(READ ${PROJECT_SOURCE_DIR}/README.md readme)
string(REPLACE "](tools/examples/" "](examples/" readme "${readme}")
foreach(source core tests/abi)
  string(REPLACE "[${source}](${source})" "${source}" readme "${readme}")
endforeach()
file(WRITE ${PROJECT_BINARY_DIR}/installed/README.md "${readme}")
install(FILES ${PROJECT_BINARY_DIR}/installed/README.md DESTINATION ${doc_dir} COMPONENT development)
# Installs the method's pictures, but not the sources that it links to.
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/kernels/README.md)
file(READ ${PROJECT_SOURCE_DIR}/kernels/README.md method)
string(REGEX REPLACE "\\[([^]]*)\\]\\([^)]*\\.(h|cpp)\\)" "\\1" method "${method}")
file(WRITE ${PROJECT_BINARY_DIR}/installed/kernels/README.md "${method}")
install(FILES ${PROJECT_BINARY_DIR}/installed/kernels/README.md DESTINATION ${doc_dir}/kernels COMPONENT development)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/kernels/pictures DESTINATION ${doc_dir}/kernels COMPONENT development)
foreach(file pipeline/README.md tests/README.md bench/README.md bench/flame.svg)
  cmake_path(GET file PARENT_PATH folder)
  install(FILES ${PROJECT_SOURCE_DIR}/${file} DESTINATION ${doc_dir}/${folder} COMPONENT development)
endforeach()
foreach(file tools/README.md tools/python/README.md tools/io/README.md tools/io/formats.def tools/sim/README.md
             tools/evaluation/README.md tools/evaluation/BEST.md tools/evaluation/FINDINGS.md tools/evaluation/SCALE.md
             tools/evaluation/sweep.schema.yaml tools/view/README.md tools/view/web/README.md
             tools/serve/README.md tools/ros2/README.md
             tools/frame.png)
  cmake_path(GET file PARENT_PATH folder)
  install(FILES ${PROJECT_SOURCE_DIR}/${file} DESTINATION ${doc_dir}/${folder} COMPONENT tools)
endforeach()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/tools/view/pictures DESTINATION ${doc_dir}/tools/view COMPONENT tools)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/tools/evaluation/pictures DESTINATION ${doc_dir}/tools/evaluation COMPONENT tools)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/bench/results DESTINATION ${doc_dir}/bench COMPONENT development)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${doc_dir} RENAME copyright COMPONENT tree)
if(OVT_TOOLS)
  list(APPEND product overtake)
  list(APPEND product overtake_manual)
  install(TARGETS overtake COMPONENT tools)
  get_property(manual_pages GLOBAL PROPERTY OVT_MANUAL_PAGES)
  install(FILES ${manual_pages} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT tools)
  install(FILES ${PROJECT_BINARY_DIR}/manual/overtake.bash RENAME overtake
          DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT tools)
  foreach(place site-functions vendor-completions)      # of zsh; Debian searches the second one below /usr
    install(FILES ${PROJECT_BINARY_DIR}/manual/_overtake DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/${place} COMPONENT tools)
  endforeach()
  # Sweeps, and packages for a colcon workspace.
  install(FILES ${PROJECT_SOURCE_DIR}/tools/evaluation/Snakefile ${PROJECT_SOURCE_DIR}/tools/evaluation/sweep.py
                ${PROJECT_SOURCE_DIR}/tools/evaluation/once.py
          ${PROJECT_SOURCE_DIR}/tools/evaluation/sweep.schema.yaml
          DESTINATION ${CMAKE_INSTALL_DATADIR}/overtake/evaluation COMPONENT tools)
  install(PROGRAMS ${PROJECT_SOURCE_DIR}/tools/evaluation/sweep DESTINATION ${CMAKE_INSTALL_DATADIR}/overtake/evaluation COMPONENT tools)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/tools/evaluation/profiles
          DESTINATION ${CMAKE_INSTALL_DATADIR}/overtake/evaluation COMPONENT tools USE_SOURCE_PERMISSIONS)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/tools/ros2/overtake_msgs ${PROJECT_SOURCE_DIR}/tools/ros2/overtake_ros2
          DESTINATION ${CMAKE_INSTALL_DATADIR}/overtake/ros2 COMPONENT tools)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/tools/rigs DESTINATION ${CMAKE_INSTALL_DATADIR}/overtake COMPONENT tools
          FILES_MATCHING PATTERN *.toml)
endif()
add_custom_target(product DEPENDS ${product})      # what is installed, without tests and benches
