# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# find_package(overtake COMPONENTS static): overtake::overtake_static, which needs oneTBB's CMake package.
if("static" IN_LIST overtake_FIND_COMPONENTS)
  include(CMakeFindDependencyMacro)
  find_dependency(TBB)
  find_dependency(Threads)
  include(${CMAKE_CURRENT_LIST_DIR}/overtake-static.cmake)
  set(overtake_static_FOUND TRUE)
endif()
