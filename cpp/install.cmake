# What `cmake --install` puts where, so that find_package(surefix) and pkg-config find it from any
# prefix, also after the prefix was moved.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

install(TARGETS surefix EXPORT surefix-targets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY cpp/include/surefix ${CMAKE_CURRENT_BINARY_DIR}/generated/surefix
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT surefix-targets NAMESPACE surefix::
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/surefix)

configure_package_config_file(cpp/surefix-config.cmake.in
  ${CMAKE_CURRENT_BINARY_DIR}/surefix-config.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/surefix)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/surefix-config-version.cmake
  COMPATIBILITY SameMinorVersion)
file(RELATIVE_PATH SUREFIX_PC_PREFIX
  /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(cpp/surefix.pc.in ${CMAKE_CURRENT_BINARY_DIR}/surefix.pc @ONLY)

install(FILES
  ${CMAKE_CURRENT_BINARY_DIR}/surefix-config.cmake
  ${CMAKE_CURRENT_BINARY_DIR}/surefix-config-version.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/surefix)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/surefix.pc
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
