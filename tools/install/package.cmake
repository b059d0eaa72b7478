# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# cmake --build FOLDER --target deb: makes two Debian packages in FOLDER, one with all installed files, stripped, and
# one with the symbols. dpkg-shlibdeps finds the dependencies.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "The Overtake authors")
set(CPACK_PACKAGE_CONTACT "The Overtake authors <overtake@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "detects and tracks vehicles with LiDAR at racing speed")
set(CPACK_PACKAGE_DESCRIPTION "Scans of one to eight LiDAR sensors in; positions, headings,
speeds and predicted paths of the other cars out. Library with a C API (header, CMake and pkg-config packages,
examples), and the command line overtake for recordings.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)       # so that dpkg-shlibdeps of a package built on this one finds it
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY ">=")
set(CPACK_DEBIAN_DEBUGINFO_PACKAGE ON)
include(CPack)

add_custom_target(deb
  COMMAND ${CMAKE_COMMAND} -D CONFIG=${PROJECT_BINARY_DIR}/CPackConfig.cmake -D OUT=${PROJECT_BINARY_DIR}
          -P ${CMAKE_CURRENT_LIST_DIR}/make_deb.cmake
  DEPENDS product USES_TERMINAL VERBATIM COMMENT "Packing the library and the command line")
