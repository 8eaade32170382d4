# cmake -DSOURCES=FILE -DOUT=FILE -P PartFingerprint.cmake: a header with one hash of all sources that FILE lists.
# The cache of compiled parts is keyed by it: a program that compiles parts otherwise finds none of the old ones.
file(STRINGS ${SOURCES} files)
set(hashes)
foreach(file ${files})
  file(SHA256 ${file} hash)
  string(APPEND hashes ${hash})
endforeach()
string(SHA256 all "${hashes}")
file(WRITE ${OUT} "// Made by the build: a hash of the sources that compile a part.\n#pragma once\n"
                  "namespace tribin {\ninline constexpr char kPartFingerprint[] = \"${all}\";\n}  // namespace tribin\n")
