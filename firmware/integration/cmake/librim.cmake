# SPDX-License-Identifier: MIT
# librim.cmake: what a CMake build of somebody else needs to compile librim in place.
#   RIM_DIR         this source tree
#   RIM_SOURCES     the library's sources and rim_watch.c, absolute
#   RIM_INCLUDES    rim/*.h and rim_watch.h
#   RIM_PRIVATE     the folder of the library's private headers: for RIM_SOURCES alone
#   RIM_OPTIONS     without these the digest is not that of the other targets (lib/README.md)
get_filename_component(RIM_DIR "${CMAKE_CURRENT_LIST_DIR}/../../.." REALPATH)
# A build folder that is older than a new source configures itself again.
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${RIM_DIR}/lib/sources.txt")
file(STRINGS "${RIM_DIR}/lib/sources.txt" RIM_SOURCES REGEX "^[^#]")
list(TRANSFORM RIM_SOURCES PREPEND "${RIM_DIR}/")
list(APPEND RIM_SOURCES "${RIM_DIR}/firmware/integration/watch/rim_watch.c")
set(RIM_INCLUDES "${RIM_DIR}/lib/include" "${RIM_DIR}/firmware/integration/watch")
set(RIM_PRIVATE "${RIM_DIR}/lib/src")
set(RIM_OPTIONS -std=c11 -ffp-contract=off -fno-math-errno)
if(CMAKE_C_COMPILER_ID STREQUAL "GNU")
  list(APPEND RIM_OPTIONS -fno-tree-slp-vectorize)
endif()
