#include "worker/render/scene/cryptomatte/matte_table.h"

namespace lightmill {
namespace {

/// Numbers of the names of objects, or of those of materials.
class Places {
 public:
  explicit Places(size_t names) : ids_(names), is_known_(names), is_given_(names) {}
  /// Something of this name. `given`: its number, or -1. The first that is given counts.
  void note(uint32_t name, int given) {
    if (given >= 0 && !is_given_[name]) {
      ids_[name] = static_cast<uint32_t>(given);
    } else if (!is_known_[name] && !is_given_[name]) {
      ids_[name] = count_ + 1;
    }
    if (!is_known_[name]) ++count_;
    is_known_[name] = true;
    is_given_[name] = is_given_[name] || given >= 0;
  }
  uint32_t operator[](size_t name) const { return ids_[name]; }

 private:
  std::vector<uint32_t> ids_;
  std::vector<bool> is_known_, is_given_;
  uint32_t count_ = 0;  // of names that are known
};

}  // namespace

MatteTable::MatteTable(const SceneDescription& scene) {
  MatteNames names;
  unnamed_ = names.number("");
  for (const MaterialDescription& m : scene.materials)
    materials_.push_back(names.number(name_of_material(m)));
  for (const std::string& name : scene.names.names()) parts_.push_back(names.number(name));
  list_ = std::make_shared<const MatteList>(MatteList{names.names(), ids_of(scene, names.names().size())});
  left_out_ = names.left_out();
}

std::vector<ThingIds> MatteTable::ids_of(const SceneDescription& scene, size_t names) const {
  Places objects(names), materials(names);
  const auto note = [&](const PartNames& shape, const PartNames& instance, int material) {
    const MatteKey at = key(shape, instance, material);
    objects.note(name_of(at, kObjectMatte), named_by(instance, shape).object_id);
    materials.note(name_of(at, kMaterialMatte), shape.material_id);
  };
  for (const ShapeDescription& s : scene.shapes) note(s.names, {}, s.material);
  // All shapes of an object for its first instance with a name of its own, and the first without. For further
  // ones their names alone: there may be millions of both.
  std::vector<bool> named(scene.objects.size()), bare(scene.objects.size());
  for (const InstanceDescription& i : scene.instances) {
    const auto object = static_cast<size_t>(i.object);
    const std::vector<ShapeDescription>& shapes = scene.objects[object].shapes;
    std::vector<bool>& noted = i.names.object >= 0 ? named : bare;
    if (!noted[object]) {
      for (const ShapeDescription& s : shapes) note(s.names, i.names, s.material);
    } else if (!shapes.empty() && i.names.object >= 0) {
      note(shapes.front().names, i.names, shapes.front().material);
    }
    noted[object] = true;
  }
  std::vector<ThingIds> ids;
  ids.reserve(names);
  for (size_t i = 0; i < names; ++i) ids.push_back({objects[i], materials[i]});
  return ids;
}

MatteKey MatteTable::key(const PartNames& shape, const PartNames& instance, int material) const {
  const PartNames names = named_by(instance, shape);
  const uint32_t of_material = names.material >= 0 ? part(names.material)
                               : material >= 0     ? materials_[static_cast<size_t>(material)]
                                                   : unnamed_;
  return matte_key(part(names.object), of_material, part(names.asset));
}

}  // namespace lightmill
