#include "common/scene/fold_constants.h"

#include <limits>
#include <optional>

namespace lightmill {
namespace {

/// What an input shows: one value, or texture `texture`.
struct Look {
  std::optional<Rgb> value;
  int texture = -1;
  bool operator==(const Look&) const = default;
};

/// What textures show.
class Looks {
 public:
  explicit Looks(const std::vector<TextureDescription>& textures) {
    for (size_t i = 0; i < textures.size(); ++i) {
      const auto shown = std::visit([&](const auto& kind) { return of(kind); }, textures[i].kind);
      known_.push_back(shown.value_or(Look{{}, static_cast<int>(i)}));
    }
  }
  const Look& of_texture(int texture) const { return known_[static_cast<size_t>(texture)]; }

 private:
  Look of(const SpectrumInput& in) const {
    return in.texture < 0 ? Look{in.value, -1} : of_texture(in.texture);
  }
  Look of(const FloatInput& in) const {
    return in.texture < 0 ? Look{Rgb{in.value, in.value, in.value}, -1} : of_texture(in.texture);
  }
  static std::optional<Look> if_same(const Look& a, const Look& b) {
    return a == b ? std::optional(a) : std::nullopt;
  }

  // Empty: what it is depends on the place, and it is no other texture. Values as TextureTable::evaluate has
  // them.
  template <class Varying>
  std::optional<Look> of(const Varying&) const {
    return {};
  }
  std::optional<Look> of(const ConstantTexture& t) const { return Look{t.value, -1}; }
  std::optional<Look> of(const ScaleTexture& t) const {
    const Look a = of(t.tex), s = of(t.scale);
    if (!a.value || !s.value) return {};
    const float k = s.value->r;
    return Look{Rgb{a.value->r * k, a.value->g * k, a.value->b * k}, -1};
  }
  std::optional<Look> of(const MixTexture& t) const {
    const Look a = of(t.tex1), b = of(t.tex2), amount = of(t.amount);
    if (a == b) return a;
    if (!amount.value) return {};
    const float w = amount.value->r;
    if (w == 0) return a;
    if (w == 1) return b;
    if (!a.value || !b.value) return {};
    const Rgb &x = *a.value, &y = *b.value;
    return Look{Rgb{x.r + (y.r - x.r) * w, x.g + (y.g - x.g) * w, x.b + (y.b - x.b) * w}, -1};
  }
  std::optional<Look> of(const CheckerboardTexture& t) const { return if_same(of(t.tex1), of(t.tex2)); }
  std::optional<Look> of(const DirectionMixTexture& t) const { return if_same(of(t.tex1), of(t.tex2)); }
  std::optional<Look> of(const DotsTexture& t) const { return if_same(of(t.inside), of(t.outside)); }
  std::optional<Look> of(const BilerpTexture& t) const {
    if (!(t.v00 == t.v01 && t.v00 == t.v10 && t.v00 == t.v11)) return {};
    return Look{t.v00, -1};
  }
  std::optional<Look> of(const ProductTexture& t) const {
    const Look a = of(t.a), b = of(t.b);
    if (!a.value || !b.value) return {};
    return Look{Rgb{a.value->r * b.value->r, a.value->g * b.value->g, a.value->b * b.value->b}, -1};
  }

  std::vector<Look> known_;
};

class Folder {
 public:
  explicit Folder(SceneDescription* scene) : scene_(*scene), looks_(scene->textures) {}

  void run() {
    for (MaterialDescription& m : scene_.materials) {
      std::visit([&](auto& kind) { inputs_of(kind); }, m.kind);
      fold(&m.opacity);
      fold(&m.bump_strength, kAny);
      if (m.displacement >= 0 && looks_.of_texture(m.displacement).value) m.displacement = -1;
    }
    find_shown();
    for (MaterialDescription& m : scene_.materials) {
      auto* mix = std::get_if<MixMaterial>(&m.kind);
      if (!mix) continue;
      for (int& part : mix->materials) show(&part);
    }
    shapes(&scene_.shapes);
    for (ObjectDescription& object : scene_.objects) shapes(&object.shapes);
  }

 private:
  static constexpr float kAny = std::numeric_limits<float>::max();

  static bool within(const Rgb& c, float most) {
    const auto ok = [&](float x) { return x >= 0 && x <= most; };
    return ok(c.r) && ok(c.g) && ok(c.b);
  }
  static void set(SpectrumInput* in, const Rgb& value) { *in = {value, -1}; }
  static void set(FloatInput* in, const Rgb& value) { *in = {value.r, -1}; }
  template <class Input>
  void fold(Input* in, float most = 1) const {
    if (in->texture < 0) return;
    const Look& look = looks_.of_texture(in->texture);
    if (!look.value) {
      in->texture = look.texture;
    } else if (within(*look.value, most)) {
      set(in, *look.value);
    }
  }
  void fold(Roughness* r) const { fold(&r->u), fold(&r->v); }

  void inputs_of(DiffuseMaterial& m) const { fold(&m.reflectance); }
  void inputs_of(DiffuseTransmissionMaterial& m) const { fold(&m.reflectance), fold(&m.transmittance); }
  void inputs_of(ConductorMaterial& m) const {
    fold(&m.eta, kAny), fold(&m.k, kAny);
    if (m.reflectance) fold(&*m.reflectance);
    fold(&m.roughness);
  }
  void inputs_of(DielectricMaterial& m) const { fold(&m.roughness); }
  void inputs_of(ThinDielectricMaterial&) const {}
  void inputs_of(CoatedDiffuseMaterial& m) const { fold(&m.reflectance), fold(&m.roughness); }
  void inputs_of(CoatedConductorMaterial& m) const { inputs_of(m.conductor), fold(&m.coat_roughness); }
  void inputs_of(HairMaterial& m) const {
    fold(&m.sigma_a, kAny);
    if (m.reflectance) fold(&*m.reflectance);
  }
  void inputs_of(MixMaterial& m) const { fold(&m.amount), fold(&m.metallic); }
  void inputs_of(PrincipledMaterial& m) const {
    fold(&m.base_color, kAny);
    for (FloatInput* in :
         {&m.metallic, &m.specular, &m.specular_tint, &m.roughness, &m.anisotropic, &m.sheen, &m.sheen_tint,
          &m.clearcoat, &m.clearcoat_roughness, &m.transmission, &m.transmission_roughness})
      fold(in);
    fold(&m.anisotropic_rotation, kAny), fold(&m.ior, kAny);
  }
  void inputs_of(ClosureMaterial& m) const {
    fold(&m.color, kAny), fold(&m.roughness);
    fold(&m.anisotropy), fold(&m.rotation, kAny), fold(&m.ior, kAny);
  }
  // glTF's textures are images.
  void inputs_of(MetallicRoughnessMaterial&) const {}
  void inputs_of(TransmissionMaterial&) const {}
  void inputs_of(MeasuredMaterial&) const {}
  void inputs_of(SubsurfaceMaterial& m) const {
    if (m.reflectance) fold(&*m.reflectance);
    fold(&m.roughness);
  }

  /// The part that a mix shows alone, else -1.
  int only_part(int material) const {
    const auto* mix = std::get_if<MixMaterial>(&scene_.materials[static_cast<size_t>(material)].kind);
    if (!mix) return -1;
    const auto& [first, second] = mix->materials;
    if (mix->rule != MixRule::kChance && mix->rule != MixRule::kMixShader) return -1;
    if (first == second) return first;
    if (mix->amount.texture >= 0) return -1;
    return mix->amount.value <= 0 ? first : mix->amount.value >= 1 ? second : -1;
  }
  /// Fills shown_. Who mixes itself stays, to be refused where scenes are built.
  void find_shown() {
    const size_t count = scene_.materials.size();
    shown_.assign(count, -1);
    std::vector<int> path;
    for (size_t start = 0; start < count; ++start) {
      int at = static_cast<int>(start);
      path.clear();
      for (int next; shown_[static_cast<size_t>(at)] < 0; at = next) {
        path.push_back(at);
        next = only_part(at);
        if (next < 0 || path.size() > count) break;
      }
      const int end = shown_[static_cast<size_t>(at)] < 0 ? at : shown_[static_cast<size_t>(at)];
      for (const int i : path) shown_[static_cast<size_t>(i)] = path.size() > count ? i : end;
    }
  }
  void show(int* material) const {
    if (*material >= 0) *material = shown_[static_cast<size_t>(*material)];
  }
  void shapes(std::vector<ShapeDescription>* shapes) const {
    for (ShapeDescription& s : *shapes) {
      show(&s.material);
      fold(&s.alpha);
    }
  }

  SceneDescription& scene_;
  const Looks looks_;
  std::vector<int> shown_;
};

}  // namespace

void fold_constants(SceneDescription* scene) { Folder(scene).run(); }

}  // namespace lightmill
