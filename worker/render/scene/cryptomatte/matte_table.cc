#include "worker/render/scene/cryptomatte/matte_table.h"

namespace lightmill {

MatteTable::MatteTable(const SceneDescription& scene) {
  MatteNames names;
  unnamed_ = names.number("");
  for (const MaterialDescription& m : scene.materials)
    materials_.push_back(names.number(name_of_material(m)));
  for (const std::string& name : scene.names.names()) parts_.push_back(names.number(name));
  names_ = std::make_shared<const std::vector<std::string>>(names.names());
  left_out_ = names.left_out();
}

MatteKey MatteTable::key(const PartNames& shape, const PartNames& instance, int material) const {
  const PartNames names = named_by(instance, shape);
  const uint32_t of_material = names.material >= 0 ? part(names.material)
                               : material >= 0     ? materials_[static_cast<size_t>(material)]
                                                   : unnamed_;
  return matte_key(part(names.object), of_material, part(names.asset));
}

}  // namespace lightmill
