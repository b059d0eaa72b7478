# Copyright 2026 The Overtake authors
# SPDX-License-Identifier: Apache-2.0
#
# cmake -D CONFIG=BUILD/CPackConfig.cmake -D OUT=FOLDER -P make_deb.cmake: packs what is built. cpack's own message about a
# missing program ("file utility is not available") does not name the package that has it.
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
