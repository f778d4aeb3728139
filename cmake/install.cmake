# What `cmake --install` and the Debian packages lay out. Two packages, so that a machine of workers takes no more
# than it needs: kiln-worker, and kiln, which also bakes by itself and therefore needs the first.
#   ./kiln package     builds both, and says where they are
include(GNUInstallDirs)
set(KILN_SHARE ${CMAKE_INSTALL_DATADIR}/kiln)

install(TARGETS kiln RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT kiln)
install(TARGETS kiln-images LIBRARY DESTINATION lib/kiln COMPONENT kiln)
install(TARGETS kiln-worker RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT worker)

# What kiln view serves; install_made.cmake adds what it takes of three.js, where npm has installed that.
install(DIRECTORY docs/examples/three DESTINATION ${KILN_SHARE}/examples COMPONENT kiln
  PATTERN node_modules EXCLUDE)
install(DIRECTORY docs/shaders docs/schema DESTINATION ${KILN_SHARE} COMPONENT kiln)
install(DIRECTORY configs/ DESTINATION ${KILN_SHARE}/configs COMPONENT kiln PATTERN systemd EXCLUDE)
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT kiln
  FILES_MATCHING PATTERN "*.md" REGEX "/images/.*" REGEX "/docs/(examples|schema|shaders)$" EXCLUDE)
install(FILES README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT kiln)

# Made from the programs themselves: man pages, completion, lists of what is inside.
foreach(component kiln worker)
  install(CODE "
    set(KILN_SOURCE \"${CMAKE_SOURCE_DIR}\")
    set(KILN_BUILD \"${CMAKE_BINARY_DIR}\")
    set(KILN_COMPONENT ${component})
    set(KILN_VERSION ${PROJECT_VERSION})
    include(\"${CMAKE_SOURCE_DIR}/cmake/install_made.cmake\")" COMPONENT ${component})
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME kiln)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "The Kiln authors <kiln@example.invalid>")
set(CPACK_PACKAGE_DIRECTORY ${CMAKE_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL kiln worker)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_SOURCE_DIR}/cmake/package_times.cmake)
set(CPACK_DEBIAN_KILN_PACKAGE_NAME kiln)
set(CPACK_DEBIAN_KILN_PACKAGE_DEPENDS "kiln-worker (= ${PROJECT_VERSION})")
set(CPACK_COMPONENT_KILN_DESCRIPTION "lightmap bake farm for glTF scenes
Bakes lightmaps of glTF scenes on one machine, or as the coordinator of a farm
of workers, with a stated error, and writes textures that engines load.")
set(CPACK_DEBIAN_WORKER_PACKAGE_NAME kiln-worker)
set(CPACK_COMPONENT_WORKER_DESCRIPTION "worker of a Kiln lightmap bake farm
Traces the light of scenes that a Kiln coordinator sends. It needs no files
of its own and keeps none but a cache.")
include(CPack)
