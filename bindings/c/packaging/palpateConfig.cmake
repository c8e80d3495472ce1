# palpate for CMake: find_package(palpate), then link with palpate::palpate (shared) or palpate::static.

get_filename_component(_palpate_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
set(_palpate_library "${_palpate_prefix}/lib/${CMAKE_SHARED_LIBRARY_PREFIX}palpate_c${CMAKE_SHARED_LIBRARY_SUFFIX}")

if(NOT TARGET palpate::palpate)
  add_library(palpate::palpate SHARED IMPORTED)
  set_target_properties(palpate::palpate PROPERTIES
    IMPORTED_LOCATION "${_palpate_library}"
    IMPORTED_NO_SONAME TRUE
    INTERFACE_INCLUDE_DIRECTORIES "${_palpate_prefix}/include")

  add_library(palpate::static STATIC IMPORTED)
  set_target_properties(palpate::static PROPERTIES
    IMPORTED_LOCATION "${_palpate_prefix}/lib/${CMAKE_STATIC_LIBRARY_PREFIX}palpate_c${CMAKE_STATIC_LIBRARY_SUFFIX}"
    INTERFACE_INCLUDE_DIRECTORIES "${_palpate_prefix}/include"
    INTERFACE_LINK_LIBRARIES "@STATIC_LIBRARIES@")
endif()

unset(_palpate_library)
unset(_palpate_prefix)
