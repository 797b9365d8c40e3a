# Semantic versions: 1.4 serves who asks for 1 or 1.2; while the first number is 0 the second stands in its place, so that 0.2.1
# serves who asks for 0.2, but neither 0.1 nor 0. Of a range the lower end is asked for, and the upper end is a bound. A version
# before its release, such as 1.4.0-dev, is 1.4.0 here, for CMake compares numbers.
set(PACKAGE_VERSION @NUMBERS@)
set(PACKAGE_VERSION_EXACT FALSE)
set(PACKAGE_VERSION_COMPATIBLE FALSE)
if(PACKAGE_FIND_VERSION STREQUAL "")
    return()
endif()
string(REGEX MATCH "^([0-9]+)[.]([0-9]+)" series "${PACKAGE_VERSION}")
if(PACKAGE_FIND_VERSION_MAJOR EQUAL CMAKE_MATCH_1 AND NOT PACKAGE_VERSION VERSION_LESS PACKAGE_FIND_VERSION)
    if(CMAKE_MATCH_1 GREATER 0 OR (PACKAGE_FIND_VERSION_COUNT GREATER 1 AND PACKAGE_FIND_VERSION_MINOR EQUAL CMAKE_MATCH_2))
        set(PACKAGE_VERSION_COMPATIBLE TRUE)
    endif()
endif()
if(PACKAGE_FIND_VERSION_RANGE)
    if(PACKAGE_VERSION VERSION_GREATER PACKAGE_FIND_VERSION_MAX OR
            (PACKAGE_FIND_VERSION_RANGE_MAX STREQUAL "EXCLUDE" AND PACKAGE_VERSION VERSION_EQUAL PACKAGE_FIND_VERSION_MAX))
        set(PACKAGE_VERSION_COMPATIBLE FALSE)
    endif()
elseif(PACKAGE_VERSION VERSION_EQUAL PACKAGE_FIND_VERSION)
    set(PACKAGE_VERSION_EXACT TRUE)
endif()
