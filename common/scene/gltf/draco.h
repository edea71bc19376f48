#pragma once
// KHR_draco_mesh_compression: primitives that Draco has packed.
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/gltf/json/json.h"

namespace lightmill {

/// What a primitive's accessors would hold.
struct DracoMesh {
  struct Attribute {
    std::shared_ptr<const std::string> bytes;  // elements one after the other
    int component_type, components;            // glTF's numbers
    bool normalized = false;
  };
  size_t vertices = 0;
  std::vector<std::array<uint32_t, 3>> triangles;  // of vertices that exist
  std::map<std::string, Attribute> attributes;     // by their names in the extension
};

/// Decodes the bytes of `extension`, a primitive's extension object. `charge` is asked before memory is taken
/// for that many numbers, and may throw. Throws GltfProblem if the bytes are damaged.
DracoMesh unpack_draco(const GltfValue& extension, std::string_view packed,
                       const std::function<void(size_t)>& charge);

}  // namespace lightmill
