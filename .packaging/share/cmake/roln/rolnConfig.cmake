# roln::roln: headers only, C99 or C++11, sqrt from libm
get_filename_component(roln_INCLUDE_DIR "${CMAKE_CURRENT_LIST_DIR}/../../../include" ABSOLUTE)
if(NOT TARGET roln::roln)
    add_library(roln::roln INTERFACE IMPORTED)
    set_target_properties(roln::roln PROPERTIES
        INTERFACE_INCLUDE_DIRECTORIES "${roln_INCLUDE_DIR}"
        INTERFACE_COMPILE_FEATURES "c_std_99;cxx_std_11"
        INTERFACE_LINK_LIBRARIES "$<$<NOT:$<PLATFORM_ID:Windows>>:m>")
endif()
