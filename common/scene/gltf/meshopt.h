#pragma once
// Buffer views that meshoptimizer has packed: EXT_meshopt_compression, and KHR_meshopt_compression where it
// uses nothing newer (codec version 1 and the filter COLOR are refused by name).
#include <string>
#include <string_view>

#include "common/scene/gltf/json/json.h"

namespace lightmill {

/// Size in bytes of what `extension`, the extension object of a buffer view, unpacks to: count elements of
/// byteStride. Throws GltfProblem where the object itself is wrong.
size_t meshopt_unpacked_size(const GltfValue& extension);
/// Unpacks the bytes that `extension` describes. Throws GltfProblem if they are damaged.
std::string unpack_meshopt(const GltfValue& extension, std::string_view packed);

}  // namespace lightmill
