#pragma once
// What Cryptomatte calls the things that rays hit, and how the AOVs objectid and materialid number them.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/film/cryptomatte/matte_sums.h"
#include "common/scene/cryptomatte/part_names.h"
#include "common/scene/description.h"

namespace lightmill {

class MatteTable {
 public:
  MatteTable() : MatteTable(SceneDescription()) {}
  /// Names of materials come first: of those there are few, and no object makes one go without.
  explicit MatteTable(const SceneDescription& scene);

  /// Of the numbers in keys. Places among names (ThingIds) are in the order in which shapes have them: those
  /// of the world, then those of instances.
  const std::shared_ptr<const MatteList>& list() const { return list_; }
  /// How many names of the scene were too many.
  size_t left_out() const { return left_out_; }
  /// The names of a shape, of the instance that it is in and of its material (-1: none).
  MatteKey key(const PartNames& shape, const PartNames& instance, int material) const;

 private:
  uint32_t part(int name) const { return name < 0 ? unnamed_ : parts_[static_cast<size_t>(name)]; }
  std::vector<ThingIds> ids_of(const SceneDescription& scene, size_t names) const;

  std::shared_ptr<const MatteList> list_;
  std::vector<uint32_t> parts_, materials_;  // numbers of the scene's names, and of its materials'
  uint32_t unnamed_ = 0;
  size_t left_out_ = 0;
};

}  // namespace lightmill
