#include "common/scene/cryptomatte/part_names.h"

#include <iterator>

#include "common/scene/description.h"

namespace lightmill {
namespace {

/// In the order of MaterialKind: pbrt's names where it has some.
constexpr const char* kKindNames[] = {"diffuse",
                                      "conductor",
                                      "dielectric",
                                      "coateddiffuse",
                                      "thindielectric",
                                      "diffusetransmission",
                                      "coatedconductor",
                                      "mix",
                                      "metallic-roughness",
                                      "transmission",
                                      "hair",
                                      "measured",
                                      "subsurface",
                                      "principled",
                                      "closure"};
static_assert(std::size(kKindNames) == std::variant_size_v<MaterialKind>);

/// Empty if the place is not known.
std::string placed(const std::string& kind, const SourceLocation& where) {
  return where.file.empty() ? "" : kind + " " + where.file + ":" + std::to_string(where.line);
}

}  // namespace

int NameList::number(std::string_view name) {
  const auto [entry, is_new] = numbers_.try_emplace(std::string(name), static_cast<int>(names_.size()));
  if (is_new) names_.emplace_back(name);
  return entry->second;
}

void name_parts(SceneDescription* scene) {
  for (ShapeDescription& s : scene->shapes) {
    if (s.names.object < 0) s.names.object = scene->names.number(placed("shape", s.location));
    if (s.names.asset < 0) s.names.asset = scene->names.number(s.location.file);
  }
  for (ObjectDescription& object : scene->objects) {
    const int name = scene->names.number(object.name);
    for (ShapeDescription& s : object.shapes) {
      if (s.names.object < 0) s.names.object = name;
      if (s.names.asset < 0) s.names.asset = name;
    }
  }
}

std::string name_of_material(const MaterialDescription& material) {
  return material.name.empty() ? placed(kKindNames[material.kind.index()], material.location) : material.name;
}

}  // namespace lightmill
