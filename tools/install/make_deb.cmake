# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# cmake -D CONFIG=BUILD/CPackConfig.cmake -D OUT=FOLDER -P make_deb.cmake: packs an existing build. Names the Debian
# package of a missing program; cpack's message ("file utility is not available") does not.
foreach(program file dpkg-shlibdeps)
  find_program(found_${program} ${program} PATHS ENV PATH NO_DEFAULT_PATH)
  if(NOT found_${program})
    list(APPEND missing ${program})
  endif()
endforeach()
if(missing)
  list(JOIN missing ", " missing)
  message(FATAL_ERROR "a Debian package needs ${missing}: run tools/setup --package")
endif()
execute_process(COMMAND ${CMAKE_CPACK_COMMAND} --config ${CONFIG} -G DEB -B ${OUT} COMMAND_ERROR_IS_FATAL ANY)
