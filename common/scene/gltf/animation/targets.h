#pragma once
// What animations may move: places in the document, as JSON pointers (KHR_animation_pointer), of which a
// node's translation, rotation, scale and weights are the core specification's.
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lightmill {

struct GltfTarget {
  enum class Kind { kNumbers, kRotation, kFlag };

  std::vector<std::string> path;  // "nodes", "3", "translation"
  Kind kind = Kind::kNumbers;
  size_t components = 1;  // of a list (0: as many as the sampler has), or 1 of a number of its own
  bool is_list = false;
  bool within_one = false;  // all are in [0, 1], which splines may leave

  std::string pointer() const;  // "/nodes/3/translation"
  /// The node whose `translation`, `rotation`, `scale` or `weights` this is, or -1.
  int node() const;
};

/// Of a JSON pointer; nothing if there is no such place in `document`, or none that animations may move
/// here: then `*why` says so.
std::optional<GltfTarget> gltf_target(const nlohmann::json& document, const std::string& pointer,
                                      std::string* why);
/// Puts a value there.
void set_target(const GltfTarget& target, std::span<const double> value, nlohmann::json* document);

/// Gives a node whose transform is a matrix the translation, rotation and scale that make it up, as far as
/// such do.
void take_matrix_apart(nlohmann::json* node);

}  // namespace lightmill
