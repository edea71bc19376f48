# cmake -DINPUT=FILE -DOUTPUT=FILE.cc -P embed.cmake: the bytes of a file as embedded_description().
file(READ ${INPUT} bytes HEX)
string(REGEX REPLACE "(................................)" "\\1\n" bytes "${bytes}")
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
file(WRITE ${OUTPUT} "#include \"coordinator/http_api/api_description.h\"

namespace lightmill {
namespace {

const unsigned char kDescription[] = {
${bytes}
};

}  // namespace

std::string_view embedded_description() {
  return {reinterpret_cast<const char*>(kDescription), sizeof kDescription};
}

}  // namespace lightmill
")
