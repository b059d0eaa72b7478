# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# cmake --build FOLDER --target deb: makes Debian packages in FOLDER, stripped, and one with the symbols of each:
#   libovertake0       the library, for programs that were built on it
#   libovertake-dev    to build such programs: headers, CMake and pkg-config packages, documents, examples
#   overtake           the command line (simulate, run, evaluate, view, ...), rigs, documents of the tools and formats
#   python3-overtake   the Python package, where it is built for Debian's Python
# dpkg-shlibdeps finds the dependencies.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "The Overtake authors")
set(CPACK_PACKAGE_CONTACT "The Overtake authors <overtake@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "detects and tracks vehicles with LiDAR at racing speed")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_DEBUGINFO_PACKAGE ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)

set(CPACK_COMPONENTS_ALL library development)
set(soname_version ${PROJECT_VERSION_MAJOR})
# A package of this version and one of a version that had all its files may not be installed together.
set(older "overtake (<< ${PROJECT_VERSION})")

set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libovertake${soname_version})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_REPLACES ${older})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_BREAKS ${older})
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)       # so that dpkg-shlibdeps of a package built on this one finds it
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY ">=")
set(CPACK_DEBIAN_LIBRARY_DESCRIPTION "library
Scans of one to eight LiDAR sensors in; positions, headings, speeds and predicted
paths of the other cars out. The shared library with its C API.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libovertake-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libovertake${soname_version} (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS overtake)
if(OVT_STATIC)
  string(APPEND CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS ", libtbb-dev")      # programs with the static library
endif()
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_REPLACES ${older})
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_BREAKS ${older})
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "development files
Headers for C and C++20, CMake and pkg-config packages, documents and examples of
the library that detects and tracks vehicles with LiDAR.")

if(OVT_TOOLS)
  list(APPEND CPACK_COMPONENTS_ALL tools)
  set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME overtake)
  set(CPACK_DEBIAN_TOOLS_PACKAGE_SECTION utils)
  set(CPACK_DEBIAN_TOOLS_PACKAGE_SUGGESTS "snakemake, libovertake-dev")
  set(CPACK_DEBIAN_TOOLS_DESCRIPTION "command line
Replays recordings (rosbag2, MCAP, PCD, KITTI and others), simulates races, evaluates
detections and tracks, and shows them in a browser. With rigs of sensors and the
documents of the formats.")
endif()
# Debian wants the licence at this place, once per package; a plain cmake --install has it once.
foreach(component IN LISTS CPACK_COMPONENTS_ALL)
  string(TOUPPER ${component} upper)
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE COMPONENT ${component} EXCLUDE_FROM_ALL
          DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${CPACK_DEBIAN_${upper}_PACKAGE_NAME} RENAME copyright)
endforeach()
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
  DEPENDS ${product} USES_TERMINAL VERBATIM COMMENT "Packing the library, its development files and the command line")
