# Run at install time, by install.cmake: files that are made from the programs, then laid out below the prefix.
# KILN_SOURCE, KILN_BUILD, KILN_VERSION; KILN_COMPONENT is kiln or worker.
cmake_policy(VERSION 3.22)
set(made ${KILN_BUILD}/made/${KILN_COMPONENT})
file(REMOVE_RECURSE ${made})
file(MAKE_DIRECTORY ${made}/man)

function(run output)
  execute_process(COMMAND ${ARGN} OUTPUT_VARIABLE said ERROR_VARIABLE errors RESULT_VARIABLE status)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${ARGN}: ${errors}")
  endif()
  set(${output} "${said}" PARENT_SCOPE)
endfunction()

if(KILN_COMPONENT STREQUAL "kiln")
  set(package kiln)
  set(programs ${KILN_BUILD}/bin/kiln ${KILN_BUILD}/bin/kiln-images.so)
  run(said ${KILN_BUILD}/bin/kiln manual-pages -o ${made}/man)
  foreach(shell bash zsh fish)
    run(script ${KILN_BUILD}/bin/kiln completion ${shell})
    file(WRITE ${made}/${shell} "${script}")
  endforeach()
  set(share ${CMAKE_INSTALL_PREFIX}/share)
  file(INSTALL DESTINATION ${share}/bash-completion/completions TYPE FILE RENAME kiln FILES ${made}/bash)
  file(INSTALL DESTINATION ${share}/zsh/vendor-completions TYPE FILE RENAME _kiln FILES ${made}/zsh)
  file(INSTALL DESTINATION ${share}/fish/vendor_completions.d TYPE FILE RENAME kiln.fish FILES ${made}/fish)
  # Of three.js what the viewer imports.
  set(viewer ${KILN_SOURCE}/docs/examples/three)
  if(EXISTS ${viewer}/node_modules/three)
    run(files python3 ${KILN_SOURCE}/cmake/imported_modules.py ${viewer} viewer.js)
    string(REGEX MATCHALL "[^\n]+" files "${files}")
    foreach(file ${files} node_modules/three/LICENSE node_modules/three/package.json)
      get_filename_component(folder ${file} DIRECTORY)
      file(INSTALL DESTINATION ${share}/kiln/examples/three/${folder} TYPE FILE FILES ${viewer}/${file})
    endforeach()
  endif()
else()
  set(package kiln-worker)
  set(programs ${KILN_BUILD}/bin/kiln-worker)
  run(help ${KILN_BUILD}/bin/kiln-worker --help)
  string(REPLACE "\\" "\\e" help "${help}")
  string(REPLACE "-" "\\-" help "${help}")
  string(REPLACE "\n." "\n\\&." help "${help}")
  file(WRITE ${made}/man/kiln-worker.1 ".TH kiln\\-worker 1 \"\" \"Kiln ${KILN_VERSION}\" \"Kiln\"
.SH NAME
kiln\\-worker \\- bakes units of a lightmap for a Kiln coordinator
.SH DESCRIPTION
.nf
${help}.fi
.SH SEE ALSO
.BR kiln (1)
")
endif()

file(GLOB pages ${made}/man/*.1)
foreach(page ${pages})
  execute_process(COMMAND gzip -9nf ${page} RESULT_VARIABLE status)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "gzip ${page}: status ${status}")
  endif()
endforeach()
file(GLOB pages ${made}/man/*.1.gz)
file(INSTALL DESTINATION ${CMAKE_INSTALL_PREFIX}/share/man/man1 TYPE FILE FILES ${pages})

# Units name the programs where they are installed.
if(KILN_COMPONENT STREQUAL "kiln")
  set(unit kiln-serve.service)
else()
  set(unit kiln-worker@.service)
endif()
file(READ ${KILN_SOURCE}/configs/systemd/${unit} content)
string(REPLACE "/usr/local/" "${CMAKE_INSTALL_PREFIX}/" content "${content}")
string(REPLACE "Copy to /etc/systemd/system, then:" "To start it:" content "${content}")
string(REPLACE "Copy to /etc/systemd/system:" "To start them:" content "${content}")
file(WRITE ${made}/${unit} "${content}")
file(INSTALL DESTINATION ${CMAKE_INSTALL_PREFIX}/lib/systemd/system TYPE FILE FILES ${made}/${unit})

run(said python3 ${KILN_SOURCE}/cmake/inventory.py --package ${package} --version ${KILN_VERSION}
  --programs ${programs} --source ${KILN_SOURCE} --output ${made})
file(INSTALL DESTINATION ${CMAKE_INSTALL_PREFIX}/share/doc/${package} TYPE FILE
  FILES ${made}/copyright ${made}/sbom.spdx.json)
