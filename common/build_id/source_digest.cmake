# cmake -DROOT=... -DLIST=... -DOUTPUT=... -P source_digest.cmake: a header with one digest over the names and
# contents of the listed files. The header changes only if the digest does.
file(READ ${LIST} sources)
set(text "")
foreach(source ${sources})
  file(SHA256 ${ROOT}/${source} digest)
  string(APPEND text "${source} ${digest}\n")
endforeach()
string(SHA256 digest "${text}")
string(SUBSTRING ${digest} 0 12 digest)
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT "#define LIGHTMILL_SOURCE_DIGEST \"@digest@\"\n" @ONLY)
