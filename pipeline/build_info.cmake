# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# Writes build_info.cpp to OUT if its content changes: git commit and compiler. With uncommitted changes it appends the
# start of their hash.
set(root ${CMAKE_CURRENT_LIST_DIR}/..)
if(NOT COMMIT)
  execute_process(COMMAND git -C ${root} describe --always --dirty --abbrev=12
                  OUTPUT_VARIABLE COMMIT OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(COMMIT MATCHES "-dirty$")
  execute_process(COMMAND git -C ${root} diff HEAD OUTPUT_VARIABLE changes ERROR_QUIET)
  string(SHA1 hash "${changes}")
  string(SUBSTRING ${hash} 0 8 hash)
  string(APPEND COMMIT "-${hash}")
endif()
if(NOT COMMIT)
  set(COMMIT "unknown")
endif()
configure_file(${CMAKE_CURRENT_LIST_DIR}/build_info.cpp.in ${OUT} @ONLY)
