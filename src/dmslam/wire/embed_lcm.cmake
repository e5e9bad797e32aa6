# cmake -DFILES="a.lcm;b.lcm" -DOUT=x.cc -P embed_lcm.cmake: the text of message definitions as a C++ constant.
set(code "// Made from lcmtypes/*.lcm when they change.\n#include \"dmslam/wire/schema.h\"\n\n")
string(APPEND code "namespace dmslam::wire {\n\nconst char* const kLcmText[] = {\n")
foreach(file ${FILES})
  file(READ ${file} text)
  string(APPEND code "R\"lcm(${text})lcm\",\n")
endforeach()
string(APPEND code "nullptr};\n\n}  // namespace dmslam::wire\n")
file(WRITE ${OUT} "${code}")
