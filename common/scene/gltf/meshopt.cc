#include "common/scene/gltf/meshopt.h"

#include <meshoptimizer.h>

#include "common/scene/problem_list.h"

namespace lightmill {
namespace {

constexpr int64_t kMaxCount = int64_t{1} << 32;

struct Packing {
  std::string mode, filter;
  size_t count, stride;
};

/// The specification's rules, which the library relies upon.
Packing packing_of(const GltfValue& extension) {
  Packing p{extension.require("mode").text(), extension.text_or("filter", "NONE"),
            static_cast<size_t>(extension.require("count").integer(1, kMaxCount)),
            static_cast<size_t>(extension.require("byteStride").integer(1, 256))};
  const auto require_stride = [&](bool good, const char* what) {
    if (!good) extension.require("byteStride").fail("must be " + std::string(what));
  };
  if (p.mode == "ATTRIBUTES") {
    require_stride(p.stride % 4 == 0, "a multiple of 4");
  } else if (p.mode == "TRIANGLES" || p.mode == "INDICES") {
    require_stride(p.stride == 2 || p.stride == 4, "2 or 4");
    if (p.mode == "TRIANGLES" && p.count % 3 != 0)
      extension.require("count").fail("must be a multiple of 3 for triangles");
  } else {
    extension.require("mode").fail("must be ATTRIBUTES, TRIANGLES or INDICES, not " + in_quotes(p.mode));
  }
  if (p.filter == "NONE") return p;
  const auto filter = extension.require("filter");
  if (p.mode != "ATTRIBUTES") filter.fail("must be NONE for indices");
  if (p.filter == "OCTAHEDRAL") {
    require_stride(p.stride == 4 || p.stride == 8, "4 or 8 for octahedral vectors");
  } else if (p.filter == "QUATERNION") {
    require_stride(p.stride == 8, "8 for quaternions");
  } else if (p.filter != "EXPONENTIAL") {
    filter.fail("must be NONE, OCTAHEDRAL, QUATERNION or EXPONENTIAL, not " + in_quotes(p.filter));
  }
  return p;
}

}  // namespace

size_t meshopt_unpacked_size(const GltfValue& extension) {
  const Packing p = packing_of(extension);
  return p.count * p.stride;
}

std::string unpack_meshopt(const GltfValue& extension, std::string_view packed) {
  const Packing p = packing_of(extension);
  std::string out(p.count * p.stride, '\0');
  const auto* bytes = reinterpret_cast<const unsigned char*>(packed.data());
  constexpr unsigned char kNewerVertices = 0xa1;
  if (p.mode == "ATTRIBUTES" && bytes[0] == kNewerVertices)
    extension.fail("is packed by version 1 of the codec, which is not supported; export it by version 0");
  const int failed = p.mode == "ATTRIBUTES"
                         ? meshopt_decodeVertexBuffer(out.data(), p.count, p.stride, bytes, packed.size())
                     : p.mode == "TRIANGLES"
                         ? meshopt_decodeIndexBuffer(out.data(), p.count, p.stride, bytes, packed.size())
                         : meshopt_decodeIndexSequence(out.data(), p.count, p.stride, bytes, packed.size());
  if (failed != 0)
    extension.fail("its " + std::to_string(packed.size()) + " bytes can't be unpacked; the file is damaged");
  if (p.filter == "OCTAHEDRAL") meshopt_decodeFilterOct(out.data(), p.count, p.stride);
  if (p.filter == "QUATERNION") meshopt_decodeFilterQuat(out.data(), p.count, p.stride);
  if (p.filter == "EXPONENTIAL") meshopt_decodeFilterExp(out.data(), p.count, p.stride);
  return out;
}

}  // namespace lightmill
