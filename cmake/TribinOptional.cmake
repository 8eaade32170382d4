# Optional libraries, each switched on by its package being found. A missing one is named in the configure summary, and
# the commands that need it say which package to install.

# tribin::cad_exchange: STEP and IGES by Open CASCADE.
find_package(OpenCASCADE CONFIG QUIET)  # its version file accepts its own version only
if(OpenCASCADE_FOUND)
  tribin_stage_sources(TRIBIN_CAD_EXCHANGE_SOURCES cad_exchange)
  add_library(tribin_cad_exchange ${TRIBIN_CAD_EXCHANGE_SOURCES})
  add_library(tribin::cad_exchange ALIAS tribin_cad_exchange)
  set_target_properties(tribin_cad_exchange PROPERTIES EXPORT_NAME cad_exchange)
  target_link_libraries(tribin_cad_exchange PUBLIC tribin PRIVATE
    TKSTEP TKSTEPBase TKSTEPAttr TKSTEP209 TKIGES TKXSBase TKShHealing TKMesh TKTopAlgo TKGeomAlgo TKBRep TKGeomBase
    TKG3d TKG2d TKMath TKernel)
  # SYSTEM: warnings in Open CASCADE's headers are not ours.
  target_include_directories(tribin_cad_exchange SYSTEM PRIVATE ${OpenCASCADE_INCLUDE_DIR})
  target_include_directories(tribin_cad_exchange PRIVATE ${PROJECT_SOURCE_DIR}/src)
  target_compile_definitions(tribin_cad_exchange INTERFACE TRIBIN_WITH_CAD_EXCHANGE)
  message(STATUS "tribin: STEP and IGES: Open CASCADE ${OpenCASCADE_VERSION}")
else()
  message(STATUS "tribin: STEP and IGES: off (install libocct-data-exchange-dev)")
endif()

# tribin::calibration: boards in pictures by OpenCV.
find_package(OpenCV QUIET COMPONENTS core imgproc imgcodecs features2d calib3d OPTIONAL_COMPONENTS aruco)
if(OpenCV_FOUND)
  tribin_stage_sources(TRIBIN_CALIBRATION_SOURCES calibration)
  add_library(tribin_calibration ${TRIBIN_CALIBRATION_SOURCES})
  add_library(tribin::calibration ALIAS tribin_calibration)
  set_target_properties(tribin_calibration PROPERTIES EXPORT_NAME calibration)
  target_link_libraries(tribin_calibration PUBLIC tribin PRIVATE opencv_core opencv_imgproc opencv_imgcodecs
                                                                 opencv_features2d opencv_calib3d)
  target_include_directories(tribin_calibration PRIVATE ${PROJECT_SOURCE_DIR}/src)
  target_include_directories(tribin_calibration SYSTEM PRIVATE ${OpenCV_INCLUDE_DIRS})
  if(TARGET opencv_aruco)
    target_link_libraries(tribin_calibration PRIVATE opencv_aruco)
    target_compile_definitions(tribin_calibration PRIVATE TRIBIN_HAS_ARUCO)
  endif()
  target_compile_definitions(tribin_calibration INTERFACE TRIBIN_WITH_CALIBRATION)
  message(STATUS "tribin: calibration from pictures: OpenCV ${OpenCV_VERSION}")
else()
  message(STATUS "tribin: calibration from pictures: off (install libopencv-dev)")
endif()

# tribin::sim: the simulated camera by Embree, heaps of parts and convex hulls by Bullet.
find_package(embree 3 CONFIG QUIET)
find_package(Bullet CONFIG QUIET)
if(embree_FOUND AND BULLET_FOUND)
  tribin_stage_sources(TRIBIN_SIM_SOURCES sim)
  if(TRIBIN_SIM_SOURCES)
    add_library(tribin_sim ${TRIBIN_SIM_SOURCES})
    add_library(tribin::sim ALIAS tribin_sim)
    set_target_properties(tribin_sim PROPERTIES EXPORT_NAME sim)
    target_link_libraries(tribin_sim PUBLIC tribin PRIVATE embree BulletDynamics BulletCollision LinearMath nlohmann_json::nlohmann_json)
    target_include_directories(tribin_sim PRIVATE ${PROJECT_SOURCE_DIR}/src)
    target_include_directories(tribin_sim SYSTEM PRIVATE ${BULLET_ROOT_DIR}/${BULLET_INCLUDE_DIR})
    target_compile_definitions(tribin_sim INTERFACE TRIBIN_WITH_SIM PRIVATE TRIBIN_VERSION="${PROJECT_VERSION}")
    message(STATUS "tribin: simulation: Embree ${embree_VERSION}")
  endif()
else()
  message(STATUS "tribin: simulation: off (install libembree-dev libbullet-dev)")
endif()

# tribin::genicam: GigE Vision and USB3 Vision cameras by Aravis, which has no CMake config.
find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(ARAVIS QUIET IMPORTED_TARGET aravis-0.8)
endif()
if(ARAVIS_FOUND)
  tribin_stage_sources(TRIBIN_GENICAM_SOURCES genicam)
  add_library(tribin_genicam ${TRIBIN_GENICAM_SOURCES})
  add_library(tribin::genicam ALIAS tribin_genicam)
  set_target_properties(tribin_genicam PROPERTIES EXPORT_NAME genicam)
  target_link_libraries(tribin_genicam PUBLIC tribin PRIVATE PkgConfig::ARAVIS)
  target_include_directories(tribin_genicam PRIVATE ${PROJECT_SOURCE_DIR}/src)
  target_compile_definitions(tribin_genicam INTERFACE TRIBIN_WITH_GENICAM)
  message(STATUS "tribin: GenICam cameras: Aravis ${ARAVIS_VERSION}")
else()
  message(STATUS "tribin: GenICam cameras: off (install libaravis-dev)")
endif()
