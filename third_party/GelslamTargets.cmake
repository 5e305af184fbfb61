# gelslam_library(name SOURCES ... [PUBLIC deps] [PRIVATE deps] [COLD] [HEADERS ...] [INSTALLED]): one library of libs/, as
#   gelslam::name. COLD: gelslam_cold(). With HEADERS, names in include/gelslam/<name>, it is installed (docs/cpp.md) and
#   they are its public API; others are internal. INSTALLED: without any, for what needs it.
# gelslam_test(name SOURCES ... DEPS ... [INCLUDES folders] [PROGRAM] [LAUNCHER command] [COST seconds]): one GoogleTest
#   executable and one test of ctest. One process for all its cases: loading 250 shared libraries takes 0.3 s, longer than
#   most cases, and cases share what they simulate. PROGRAM: it runs the built program, GELSLAM_PROGRAM. COST: the longest
#   tests begin first.

function(gelslam_compile_options target)
  # -Wno-restrict: g++ 12 reports "const char* + std::string" falsely (GCC bug 105651).
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wconversion -Wno-restrict $<$<BOOL:${GELSLAM_WERROR}>:-Werror>)
endfunction()

# Sources are compiled eight at a time: the headers of Eigen and OpenCV cost more than our code.
function(gelslam_unity target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${GELSLAM_UNITY} UNITY_BUILD_BATCH_SIZE 8)
endfunction()

# Code between the loops over pixels, samples and vertices: -O1 compiles it in 0.7 of the time.
function(gelslam_cold target)
  # g++ 12 reports both falsely of strings that -O1 has inlined.
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1> -Wno-array-bounds -Wno-stringop-overflow)
endfunction()

function(gelslam_library name)
  cmake_parse_arguments(ARG "NO_UNITY;COLD;INSTALLED" "" "SOURCES;PUBLIC;PRIVATE;HEADERS" ${ARGN})
  add_library(gelslam_${name} STATIC ${ARG_SOURCES})
  add_library(gelslam::${name} ALIAS gelslam_${name})
  target_include_directories(gelslam_${name}
    PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
    PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
  # Position-independent: the libraries also end up in Python modules and in shared libraries of robots. Hidden, so that
  # calls within them cost what they cost in a program.
  set_target_properties(gelslam_${name} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  target_compile_features(gelslam_${name} PUBLIC cxx_std_20)
  target_link_libraries(gelslam_${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  gelslam_compile_options(gelslam_${name})
  if(ARG_COLD)
    gelslam_cold(gelslam_${name})
  endif()
  if(NOT ARG_NO_UNITY)
    gelslam_unity(gelslam_${name})
  endif()
  if(ARG_HEADERS OR ARG_INSTALLED)
    install(TARGETS gelslam_${name} EXPORT gelslam_targets
      ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
    list(TRANSFORM ARG_HEADERS PREPEND include/gelslam/${name}/)
    install(FILES ${ARG_HEADERS} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/gelslam/${name} COMPONENT development)
  endif()
endfunction()

# Headers of most tests, precompiled once: they cost more than the tests.
function(gelslam_test_options target)
  gelslam_compile_options(${target})
  gelslam_cold(${target})
  if(NOT TARGET gelslam_test_headers)
    file(WRITE ${CMAKE_BINARY_DIR}/test_headers.cpp "")
    add_library(gelslam_test_headers OBJECT ${CMAKE_BINARY_DIR}/test_headers.cpp)
    target_link_libraries(gelslam_test_headers PRIVATE gelslam::core opencv_core GTest::gtest GTest::gmock)
    gelslam_compile_options(gelslam_test_headers)
    target_compile_options(gelslam_test_headers PRIVATE $<$<CONFIG:Release>:-O1>)
    target_precompile_headers(gelslam_test_headers PRIVATE
      <gmock/gmock.h> <gtest/gtest.h> <Eigen/Geometry> <opencv2/core.hpp> <filesystem> <functional> <map> <vector>)
  endif()
  target_precompile_headers(${target} REUSE_FROM gelslam_test_headers)
endfunction()

function(gelslam_test name)
  cmake_parse_arguments(ARG "PROGRAM" "COST" "SOURCES;DEPS;INCLUDES;LAUNCHER" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_DEPS} GTest::gtest GTest::gmock GTest::gtest_main)
  target_include_directories(${name} PRIVATE ${ARG_INCLUDES})
  gelslam_test_options(${name})
  gelslam_unity(${name})
  # Where tests/support/data_folder.hpp looks when GELSLAM_DATA is not set.
  target_compile_definitions(${name} PRIVATE GELSLAM_DEFAULT_DATA="${PROJECT_SOURCE_DIR}/../shared/data")
  if(ARG_PROGRAM)
    target_compile_definitions(${name} PRIVATE GELSLAM_PROGRAM="$<TARGET_FILE:gelslam_app>")
    add_dependencies(${name} gelslam_app)
  endif()
  add_test(NAME ${name} COMMAND ${ARG_LAUNCHER} $<TARGET_FILE:${name}> --gtest_brief=1)
  set_tests_properties(${name} PROPERTIES TIMEOUT 600 COST "${ARG_COST}")
endfunction()
