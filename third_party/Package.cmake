# What `cmake --install` puts where. Components: runtime (the program), development (the C++ library), python.

if(GELSLAM_BUILD_PROGRAM)
  install(TARGETS gelslam_app RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT runtime)
endif()

include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/gelslam)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/gelslamConfig.cmake.in ${CMAKE_BINARY_DIR}/gelslamConfig.cmake
  INSTALL_DESTINATION ${package_dir} PATH_VARS CMAKE_INSTALL_INCLUDEDIR)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/gelslamConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/gelslamConfig.cmake ${CMAKE_BINARY_DIR}/gelslamConfigVersion.cmake
  DESTINATION ${package_dir} COMPONENT development)
install(EXPORT gelslam_targets NAMESPACE gelslam:: FILE gelslam_targets.cmake
  DESTINATION ${package_dir} COMPONENT development)
