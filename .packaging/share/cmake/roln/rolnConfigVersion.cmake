# Semantic versions: 1.4 serves who asks for 1 or 1.2; while the first number is 0 the second stands in its place, so that 0.2.1
# serves who asks for 0.2, but neither 0.1 nor 0.
set(PACKAGE_VERSION @VERSION@)
string(REGEX MATCH "^(0[.])?[0-9]+" series "${PACKAGE_VERSION}")
string(FIND "${PACKAGE_FIND_VERSION}" "${series}" at)
if(at EQUAL 0 AND NOT PACKAGE_VERSION VERSION_LESS PACKAGE_FIND_VERSION)
    set(PACKAGE_VERSION_COMPATIBLE TRUE)
endif()
if(PACKAGE_VERSION VERSION_EQUAL PACKAGE_FIND_VERSION)
    set(PACKAGE_VERSION_EXACT TRUE)
endif()
