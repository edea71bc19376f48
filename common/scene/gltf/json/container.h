#pragma once
// What surrounds glTF's JSON: the chunks of a .glb file, and URIs.
#include <optional>
#include <string>
#include <string_view>

namespace lightmill {

struct GltfContainer {
  std::string json;
  std::optional<std::string> binary;  // a .glb's second chunk
};

/// Takes the contents of a .gltf or .glb file apart (a .glb is known by its magic number). Throws
/// GltfProblem.
GltfContainer open_gltf_container(std::string contents);

/// Bytes of a data URI, or nothing if `uri` is none. Throws GltfProblem (without a pointer) if it is damaged.
std::optional<std::string> decode_data_uri(const std::string& uri);
/// A relative reference with its %XX taken back; throws GltfProblem (without a pointer) for other schemes.
std::string path_of_uri(const std::string& uri);

}  // namespace lightmill
