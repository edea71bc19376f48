#include "common/scene/parts_in_use.h"

#include <algorithm>

namespace lightmill {
namespace {

/// Marks by following references. Textures are made of earlier ones only; mixes may form a cycle, which the
/// scene builder refuses, so a material is followed once.
class Marker {
 public:
  explicit Marker(const SceneDescription& scene) : in_(scene) {
    used_.materials.resize(scene.materials.size());
    used_.textures.resize(scene.textures.size());
  }

  void shape(const ShapeDescription& s) {
    if (s.material >= 0 && !s.boundary) material(s.material);
    texture(s.alpha.texture);
    texture(s.displacement.texture);
    if (s.area_light >= 0) texture(in_.area_lights[static_cast<size_t>(s.area_light)].texture);
  }
  PartsInUse take() { return std::move(used_); }

 private:
  void material(int index) {
    if (index < 0 || used_.materials[static_cast<size_t>(index)]) return;
    used_.materials[static_cast<size_t>(index)] = true;
    const MaterialDescription& m = in_.materials[static_cast<size_t>(index)];
    texture(m.normal_map);
    texture(m.displacement);
    texture(m.bump_strength.texture);
    texture(m.shading_normal);
    texture(m.tangent);
    texture(m.opacity.texture);
    std::visit([&](const auto& kind) { inputs_of(kind); }, m.kind);
  }
  void texture(int index) {
    if (index < 0 || used_.textures[static_cast<size_t>(index)]) return;
    used_.textures[static_cast<size_t>(index)] = true;
    std::visit([&](const auto& kind) { inputs_of(kind); }, in_.textures[static_cast<size_t>(index)].kind);
  }
  template <class... Inputs>
  void read(const Inputs&... inputs) {
    (texture(inputs.texture), ...);
  }
  void read_roughness(const Roughness& r) { read(r.u, r.v); }

  void inputs_of(const DiffuseMaterial& m) { read(m.reflectance); }
  void inputs_of(const DiffuseTransmissionMaterial& m) { read(m.reflectance, m.transmittance); }
  void inputs_of(const ConductorMaterial& m) {
    read(m.eta, m.k);
    if (m.reflectance) read(*m.reflectance);
    read_roughness(m.roughness);
  }
  void inputs_of(const DielectricMaterial& m) { read_roughness(m.roughness); }
  void inputs_of(const ThinDielectricMaterial&) {}
  void inputs_of(const CoatedDiffuseMaterial& m) {
    read(m.reflectance);
    read_roughness(m.roughness);
  }
  void inputs_of(const CoatedConductorMaterial& m) {
    inputs_of(m.conductor);
    read_roughness(m.coat_roughness);
  }
  void inputs_of(const HairMaterial& m) {
    read(m.sigma_a);
    if (m.reflectance) read(*m.reflectance);
  }
  void inputs_of(const MixMaterial& m) {
    read(m.amount, m.metallic);
    for (const int part : m.materials) material(part);
  }
  void inputs_of(const MetallicRoughnessMaterial& m) {
    read(m.base_color, m.metallic, m.roughness, m.specular, m.specular_color, m.clearcoat,
         m.clearcoat_roughness, m.sheen_color, m.sheen_roughness, m.iridescence, m.iridescence_thickness,
         FloatInput{0, m.anisotropy_texture}, m.translucence, m.translucent_color);
  }
  void inputs_of(const TransmissionMaterial& m) { read(m.color, m.roughness); }
  void inputs_of(const MeasuredMaterial&) {}
  void inputs_of(const SubsurfaceMaterial& m) {
    if (m.reflectance) read(*m.reflectance);
    read_roughness(m.roughness);
  }

  void inputs_of(const PrincipledMaterial& m) {
    read(m.base_color, m.metallic, m.specular, m.specular_tint, m.roughness, m.anisotropic,
         m.anisotropic_rotation, m.sheen, m.sheen_tint, m.clearcoat, m.clearcoat_roughness, m.ior,
         m.transmission, m.transmission_roughness);
  }
  void inputs_of(const ClosureMaterial& m) { read(m.color, m.roughness, m.anisotropy, m.rotation, m.ior); }

  void inputs_of(const ImageTexture&) {}
  void inputs_of(const ConstantTexture&) {}
  void inputs_of(const BilerpTexture&) {}
  void inputs_of(const NoiseTexture&) {}
  void inputs_of(const VertexColorTexture&) {}
  void inputs_of(const ScaleTexture& t) { read(t.tex, t.scale); }
  void inputs_of(const MixTexture& t) { read(t.tex1, t.tex2, t.amount); }
  void inputs_of(const CheckerboardTexture& t) { read(t.tex1, t.tex2); }
  void inputs_of(const DirectionMixTexture& t) { read(t.tex1, t.tex2); }
  void inputs_of(const DotsTexture& t) { read(t.inside, t.outside); }
  void inputs_of(const ProductTexture& t) { read(t.a, t.b); }
  void inputs_of(const StepTexture& t) { read(t.value); }
  void inputs_of(const GraphTexture& t) {
    for (const int image : t.images) texture(image);
  }

  const SceneDescription& in_;
  PartsInUse used_;
};

}  // namespace

PartsInUse parts_in_use(const SceneDescription& scene) {
  Marker marker(scene);
  for (const ShapeDescription& s : scene.shapes) marker.shape(s);
  std::vector<bool> instanced(scene.objects.size());
  for (const InstanceDescription& i : scene.instances) instanced[static_cast<size_t>(i.object)] = true;
  for (size_t i = 0; i < instanced.size(); ++i) {
    if (!instanced[i]) continue;
    for (const ShapeDescription& s : scene.objects[i].shapes) marker.shape(s);
  }
  return marker.take();
}

}  // namespace lightmill
