# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# cmake --build FOLDER --target deb: makes Debian packages in FOLDER: overtake with all installed files, stripped;
# python3-overtake, where the Python package is built for Debian's Python; and one with the symbols of each.
# dpkg-shlibdeps finds the dependencies.
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
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL Unspecified)              # what install() puts into no component
set(CPACK_DEBIAN_UNSPECIFIED_PACKAGE_NAME overtake)
set(CPACK_COMPONENT_UNSPECIFIED_DESCRIPTION "${CPACK_PACKAGE_DESCRIPTION}")
if(TARGET overtake_python AND OVT_TOOLS AND Python_EXECUTABLE STREQUAL /usr/bin/python3)
  list(APPEND CPACK_COMPONENTS_ALL python)
  list(APPEND product overtake_python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-overtake)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  math(EXPR next_minor "${Python_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= 3.${Python_VERSION_MINOR}), python3 (<< 3.${next_minor}), \
python3-numpy, overtake (= ${PROJECT_VERSION})")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-pandas, python3-matplotlib")
  set(CPACK_DEBIAN_PYTHON_DESCRIPTION "The Python package overtake: detector, recordings as NumPy arrays,
race simulator.")
  # Not of a plain cmake --install, whose tree may be moved and is for no certain Python.
  set(python_dir lib/python3/dist-packages/overtake)
  install(TARGETS overtake_python COMPONENT python EXCLUDE_FROM_ALL LIBRARY DESTINATION ${python_dir})
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/tools/python/overtake/ COMPONENT python EXCLUDE_FROM_ALL
          DESTINATION ${python_dir} FILES_MATCHING PATTERN *.py PATTERN *.pyi PATTERN py.typed
          PATTERN __pycache__ EXCLUDE)
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE COMPONENT python EXCLUDE_FROM_ALL
          DESTINATION share/doc/python3-overtake RENAME copyright)
endif()
include(CPack)

add_custom_target(deb
  COMMAND ${CMAKE_COMMAND} -D CONFIG=${PROJECT_BINARY_DIR}/CPackConfig.cmake -D OUT=${PROJECT_BINARY_DIR}
          -P ${CMAKE_CURRENT_LIST_DIR}/make_deb.cmake
  DEPENDS ${product} USES_TERMINAL VERBATIM COMMENT "Packing the library and the command line")
