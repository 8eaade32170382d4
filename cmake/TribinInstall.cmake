# Install, package config with components, and .deb files.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)
set(TRIBIN_CONFIG_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/tribin)

install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/tribin DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev
        FILES_MATCHING PATTERN "*.hpp")
install(TARGETS tribin EXPORT tribinTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
install(EXPORT tribinTargets NAMESPACE tribin:: DESTINATION ${TRIBIN_CONFIG_DIR} COMPONENT dev)
set(TRIBIN_COMPONENTS)
foreach(component cad_exchange calibration sim genicam)
  if(TARGET tribin_${component})
    install(TARGETS tribin_${component} EXPORT tribin_${component}Targets
            ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev
            LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
    install(EXPORT tribin_${component}Targets NAMESPACE tribin:: DESTINATION ${TRIBIN_CONFIG_DIR} COMPONENT dev)
    list(APPEND TRIBIN_COMPONENTS ${component})
  endif()
endforeach()
install(TARGETS tribin_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT cli)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/schema/ DESTINATION ${CMAKE_INSTALL_DATADIR}/tribin/schema COMPONENT cli
        FILES_MATCHING PATTERN "*.json")
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/tribin COMPONENT cli)

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/tribinConfig.cmake.in ${PROJECT_BINARY_DIR}/tribinConfig.cmake
                              INSTALL_DESTINATION ${TRIBIN_CONFIG_DIR})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/tribinConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/tribinConfig.cmake ${PROJECT_BINARY_DIR}/tribinConfigVersion.cmake
        DESTINATION ${TRIBIN_CONFIG_DIR} COMPONENT dev)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME tribin)
set(CPACK_PACKAGE_CONTACT "tribin developers <tribin@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Finds CAD parts in 3-D scans: class and 6-DOF pose")
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL cli dev)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_CLI_PACKAGE_NAME tribin)
set(CPACK_DEBIAN_CLI_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_DEV_PACKAGE_NAME libtribin-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "libeigen3-dev, libtbb-dev, libpng-dev, libtiff-dev, nlohmann-json3-dev, libtomlplusplus-dev, libmeshoptimizer-dev")
include(CPack)
