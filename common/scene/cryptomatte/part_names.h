#pragma once
// Names that Cryptomatte calls shapes and instances by. Most come again and again, so things have their
// numbers in a list of the scene.
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace lightmill {

/// Numbers in SceneDescription::names; -1: nothing was said. `material`: where a file has another name for
/// the shape's material than its author. `object_id`, `material_id`: what the AOVs objectid and materialid
/// say of things of these names, in [0, kMaxGivenId].
struct PartNames {
  int object = -1, asset = -1, material = -1;
  int object_id = -1, material_id = -1;
  bool operator==(const PartNames&) const = default;
};
/// Floats hold all whole numbers up to here.
inline constexpr int kMaxGivenId = (1 << 24) - 1;
/// What an instance says goes before what its object's shapes say.
inline PartNames named_by(const PartNames& instance, const PartNames& shape) {
  return {instance.object >= 0 ? instance.object : shape.object,
          instance.asset >= 0 ? instance.asset : shape.asset, shape.material,
          instance.object_id >= 0 ? instance.object_id : shape.object_id, shape.material_id};
}

/// Texts, numbered from 0 in the order in which they come.
class NameList {
 public:
  int number(std::string_view name);
  const std::vector<std::string>& names() const { return names_; }

 private:
  std::vector<std::string> names_;
  std::unordered_map<std::string, int> numbers_;
};

struct MaterialDescription;
struct SceneDescription;

/// Names what a reader has left without: shapes of objects by the object, other shapes by their place in the
/// file, "shape scene.pbrt:12"; their assets are the object and the file.
void name_parts(SceneDescription* scene);
/// A material's name; one that has none goes by its kind and place, "conductor scene.pbrt:12".
std::string name_of_material(const MaterialDescription& material);

}  // namespace lightmill
