# Run by cpack on the staged files: what Debian wants other than a prefix has it.
set(root ${CPACK_TEMPORARY_INSTALL_DIRECTORY})
set(share ${root}/usr/share)
set(doc ${share}/doc/lightmill)

# Configuration, as conffiles.
file(MAKE_DIRECTORY ${root}/etc)
file(RENAME ${share}/lightmill/config ${root}/etc/lightmill)

# compress(FILES...): without name and time, so that equal contents give equal packages.
function(compress)
  execute_process(COMMAND gzip -9n ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()
file(GLOB pages ${share}/man/man1/*.1)
compress(${pages})

# The licence's text is in every Debian system.
file(REMOVE ${doc}/LICENSE)
file(WRITE ${doc}/copyright "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: Lightmill

Files: *
Copyright: 2026 ${CPACK_PACKAGE_VENDOR}
License: Apache-2.0
 On Debian systems, the full text of the Apache License, version 2.0, is in
 /usr/share/common-licenses/Apache-2.0.
")
string(TIMESTAMP now "%a, %d %b %Y %H:%M:%S +0000" UTC)  # SOURCE_DATE_EPOCH, where it is set
file(WRITE ${doc}/changelog "lightmill (${CPACK_PACKAGE_VERSION}) bookworm; urgency=medium

  * What is new is in /usr/share/doc/lightmill/CHANGELOG.md.

 -- ${CPACK_PACKAGE_CONTACT}  ${now}
")
compress(${doc}/changelog)
