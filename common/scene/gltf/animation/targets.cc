#include "common/scene/gltf/animation/targets.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

namespace lightmill {
namespace {

using nlohmann::json;
using Kind = GltfTarget::Kind;

/// A number or list of numbers that may be animated: `place` is what its pointer ends with, after the thing
/// of `owner` (whose number stands between them).
struct Property {
  std::string_view owner, place;
  size_t components = 0;  // 0: a number, else a list of so many
  bool within_one = false;
  Kind kind = Kind::kNumbers;
};

constexpr std::string_view kMaterial = "materials", kLight = "extensions/KHR_lights_punctual/lights";
constexpr std::array<Property, 47> kProperties = {{
    {"nodes", "translation", 3},
    {"nodes", "rotation", 4, false, Kind::kRotation},
    {"nodes", "scale", 3},
    {"nodes", "extensions/KHR_node_visibility/visible", 0, false, Kind::kFlag},
    {"cameras", "perspective/yfov"},
    {"cameras", "perspective/aspectRatio"},
    {"cameras", "perspective/znear"},
    {"cameras", "perspective/zfar"},
    {"cameras", "orthographic/xmag"},
    {"cameras", "orthographic/ymag"},
    {"cameras", "orthographic/znear"},
    {"cameras", "orthographic/zfar"},
    {kLight, "color", 3},
    {kLight, "intensity"},
    {kLight, "range"},
    {kLight, "spot/innerConeAngle"},
    {kLight, "spot/outerConeAngle"},
    {kMaterial, "pbrMetallicRoughness/baseColorFactor", 4, true},
    {kMaterial, "pbrMetallicRoughness/metallicFactor", 0, true},
    {kMaterial, "pbrMetallicRoughness/roughnessFactor", 0, true},
    {kMaterial, "emissiveFactor", 3},
    {kMaterial, "alphaCutoff"},
    {kMaterial, "normalTexture/scale"},
    {kMaterial, "occlusionTexture/strength"},
    {kMaterial, "extensions/KHR_materials_emissive_strength/emissiveStrength"},
    {kMaterial, "extensions/KHR_materials_ior/ior"},
    {kMaterial, "extensions/KHR_materials_dispersion/dispersion"},
    {kMaterial, "extensions/KHR_materials_specular/specularFactor", 0, true},
    {kMaterial, "extensions/KHR_materials_specular/specularColorFactor", 3},
    {kMaterial, "extensions/KHR_materials_clearcoat/clearcoatFactor", 0, true},
    {kMaterial, "extensions/KHR_materials_clearcoat/clearcoatRoughnessFactor", 0, true},
    {kMaterial, "extensions/KHR_materials_clearcoat/clearcoatNormalTexture/scale"},
    {kMaterial, "extensions/KHR_materials_transmission/transmissionFactor", 0, true},
    {kMaterial, "extensions/KHR_materials_volume/thicknessFactor"},
    {kMaterial, "extensions/KHR_materials_volume/attenuationDistance"},
    {kMaterial, "extensions/KHR_materials_volume/attenuationColor", 3, true},
    {kMaterial, "extensions/KHR_materials_sheen/sheenColorFactor", 3, true},
    {kMaterial, "extensions/KHR_materials_sheen/sheenRoughnessFactor", 0, true},
    {kMaterial, "extensions/KHR_materials_iridescence/iridescenceFactor", 0, true},
    {kMaterial, "extensions/KHR_materials_iridescence/iridescenceIor"},
    {kMaterial, "extensions/KHR_materials_iridescence/iridescenceThicknessMinimum"},
    {kMaterial, "extensions/KHR_materials_iridescence/iridescenceThicknessMaximum"},
    {kMaterial, "extensions/KHR_materials_anisotropy/anisotropyStrength", 0, true},
    {kMaterial, "extensions/KHR_materials_anisotropy/anisotropyRotation"},
    {kMaterial, "extensions/KHR_materials_diffuse_transmission/diffuseTransmissionFactor", 0, true},
    {kMaterial, "extensions/KHR_materials_diffuse_transmission/diffuseTransmissionColorFactor", 3, true},
    {kMaterial, "extensions/KHR_materials_pbrSpecularGlossiness/diffuseFactor", 4, true},
}};
/// Of any texture of a material.
constexpr std::array<Property, 3> kTextureProperties = {{
    {kMaterial, "extensions/KHR_texture_transform/offset", 2},
    {kMaterial, "extensions/KHR_texture_transform/rotation"},
    {kMaterial, "extensions/KHR_texture_transform/scale", 2},
}};

std::vector<std::string> tokens_of(const std::string& pointer) {
  std::vector<std::string> out;
  for (size_t at = 0; at < pointer.size();) {
    const size_t end = std::min(pointer.find('/', at + 1), pointer.size());
    std::string token = pointer.substr(at + 1, end - at - 1);
    // RFC 6901: "~1" is a slash and "~0" a tilde.
    for (const auto& [code, character] : {std::pair{"~1", "/"}, std::pair{"~0", "~"}}) {
      for (size_t i = token.find(code); i != std::string::npos; i = token.find(code, i + 1))
        token.replace(i, 2, character);
    }
    out.push_back(std::move(token));
    at = end;
  }
  return out;
}

std::optional<size_t> index_of(const std::string& token) {
  size_t i = 0;
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), i);
  if (error != std::errc() || end != token.data() + token.size()) return std::nullopt;
  return i;
}

/// Objects that may be made where they are missing: without members they say nothing.
bool may_be_missing(const std::string& token) {
  return token == "pbrMetallicRoughness" || token == "extensions" || token == "KHR_texture_transform" ||
         token == "KHR_node_visibility" || token == "spot";
}

/// A member or element; null if there is none.
json* member_of(json* owner, const std::string& token) {
  if (owner->is_object()) {
    const auto found = owner->find(token);
    return found == owner->end() ? nullptr : &*found;
  }
  const auto i = index_of(token);
  return owner->is_array() && i && *i < owner->size() ? &(*owner)[*i] : nullptr;
}

/// One of the weights of a mesh or node.
bool is_one_weight(const std::vector<std::string>& path) {
  return path.size() == 4 && path[2] == "weights" && (path[0] == "nodes" || path[0] == "meshes");
}

bool is_there(const json& document, const std::vector<std::string>& path) {
  if (is_one_weight(path)) return is_there(document, {path[0], path[1], path[2]});
  const json* at = &document;
  for (size_t i = 0; i + 1 < path.size(); ++i) {
    const json* next = member_of(const_cast<json*>(at), path[i]);
    if (next == nullptr) return at->is_object() && may_be_missing(path[i]);
    at = next;
  }
  return true;
}

/// `tokens` joined by slashes.
std::string joined(std::span<const std::string> tokens) {
  std::string out;
  for (const std::string& token : tokens) out += (out.empty() ? "" : "/") + token;
  return out;
}

bool describe(GltfTarget* target) {
  const std::span<const std::string> path = target->path;
  if (path.size() < 3) return false;
  const size_t after = path[0] == "extensions" && path.size() > 4 ? 4 : 2;  // lights are in an extension
  if (!index_of(path[after - 1])) return false;
  const std::string owner = joined(path.first(after - 1)), place = joined(path.subspan(after));
  const auto use = [&](const Property& p) {
    target->kind = p.kind;
    target->is_list = p.components > 0;
    target->components = std::max<size_t>(p.components, 1);
    target->within_one = p.within_one;
    return true;
  };
  if ((owner == "nodes" || owner == "meshes") && path[2] == "weights") {
    target->is_list = path.size() == 3;
    target->components = target->is_list ? 0 : 1;
    constexpr size_t kMostTargets = 1 << 16;
    return path.size() == 3 || (path.size() == 4 && index_of(path[3]) && *index_of(path[3]) < kMostTargets);
  }
  for (const Property& p : kProperties) {
    if (p.owner == owner && p.place == place) return use(p);
  }
  for (const Property& p : kTextureProperties) {
    if (p.owner == owner && place.ends_with(p.place) && place.find("Texture/") != std::string::npos)
      return use(p);
  }
  return false;
}

/// Makes sure that there is a list with the weight that `path` means: a node without one has its mesh's.
void make_room(const std::vector<std::string>& path, json* document) {
  json* owner = member_of(member_of(document, path[0]), path[1]);
  json* weights = member_of(owner, "weights");
  if (weights == nullptr || !weights->is_array()) {
    json begin = json::array();
    if (path[0] == "nodes" && owner->contains("mesh") && (*owner)["mesh"].is_number_unsigned()) {
      json* meshes = member_of(document, "meshes");
      json* mesh = meshes ? member_of(meshes, (*owner)["mesh"].dump()) : nullptr;
      if (mesh && mesh->is_object() && mesh->contains("weights") && (*mesh)["weights"].is_array())
        begin = (*mesh)["weights"];
    }
    weights = &((*owner)["weights"] = std::move(begin));
  }
  while (weights->size() <= *index_of(path[3])) weights->push_back(0.0);
}

}  // namespace

std::string GltfTarget::pointer() const { return path.empty() ? "" : "/" + joined(path); }

int GltfTarget::node() const {
  if (path.size() != 3 || path[0] != "nodes") return -1;
  const auto i = index_of(path[1]);
  return i ? static_cast<int>(*i) : -1;
}

std::optional<GltfTarget> gltf_target(const json& document, const std::string& pointer, std::string* why) {
  GltfTarget target;
  target.path = tokens_of(pointer);
  if (!pointer.starts_with("/") || !describe(&target)) {
    *why = "is nothing that animations can change here";
    return std::nullopt;
  }
  if (!is_there(document, target.path)) {
    *why = "leads to nothing in the file";
    return std::nullopt;
  }
  return target;
}

void set_target(const GltfTarget& target, std::span<const double> value, json* document) {
  if (is_one_weight(target.path)) make_room(target.path, document);
  json* at = document;
  for (size_t i = 0; i + 1 < target.path.size(); ++i) {
    json* next = member_of(at, target.path[i]);
    if (next == nullptr) next = &(*at)[target.path[i]];
    if (next->is_null()) *next = json::object();
    at = next;
  }
  const auto clamped = [&](double x) { return target.within_one ? std::clamp(x, 0.0, 1.0) : x; };
  json result;
  if (target.is_list) {
    result = json::array();
    for (const double x : value) result.push_back(clamped(x));
  } else if (target.kind == Kind::kFlag) {
    result = value[0] != 0;
  } else {
    result = clamped(value[0]);
  }
  if (json* there = member_of(at, target.path.back())) {
    *there = std::move(result);
  } else if (at->is_object()) {
    (*at)[target.path.back()] = std::move(result);
  }
}

void take_matrix_apart(json* node) {
  if (!node->is_object() || !node->contains("matrix")) return;
  const json matrix = (*node)["matrix"];
  node->erase("matrix");
  if (!matrix.is_array() || matrix.size() != 16 ||
      !std::all_of(matrix.begin(), matrix.end(), [](const json& x) { return x.is_number(); }))
    return;
  double column[3][3], scale[3];
  for (size_t j = 0; j < 3; ++j) {
    for (size_t i = 0; i < 3; ++i) column[j][i] = matrix[4 * j + i].get<double>();
    scale[j] = std::hypot(column[j][0], column[j][1], column[j][2]);
  }
  const auto& c = column;
  const double det = c[0][0] * (c[1][1] * c[2][2] - c[1][2] * c[2][1]) -
                     c[1][0] * (c[0][1] * c[2][2] - c[0][2] * c[2][1]) +
                     c[2][0] * (c[0][1] * c[1][2] - c[0][2] * c[1][1]);
  if (det < 0) scale[0] = -scale[0];
  double m[3][3];  // m[i][j]: row i, column j of the rotation
  for (size_t j = 0; j < 3; ++j) {
    for (size_t i = 0; i < 3; ++i) m[i][j] = scale[j] != 0 ? column[j][i] / scale[j] : i == j ? 1.0 : 0.0;
  }
  // By the component that is surely large (Shepperd 1978).
  const double trace = m[0][0] + m[1][1] + m[2][2];
  std::array<double, 4> q{m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1], 1 + trace};
  if (trace <= 0) {
    const double d[3] = {m[0][0], m[1][1], m[2][2]};
    const auto i = static_cast<size_t>(std::max_element(d, d + 3) - d);
    const size_t j = (i + 1) % 3, k = (i + 2) % 3;
    q[i] = 1 + d[i] - d[j] - d[k];
    q[j] = m[i][j] + m[j][i];
    q[k] = m[i][k] + m[k][i];
    q[3] = m[k][j] - m[j][k];
  }
  const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (double& x : q) x = n > 0 ? x / n : 0;
  if (!(n > 0)) q[3] = 1;
  (*node)["translation"] = {matrix[12], matrix[13], matrix[14]};
  (*node)["rotation"] = q;
  (*node)["scale"] = {scale[0], scale[1], scale[2]};
}

}  // namespace lightmill
