// Directives of the world's content: materials, textures, lights and shapes.
#include <algorithm>
#include <utility>

#include "common/scene/pbrt/parser.h"
#include "common/scene/pbrt/v3/materials.h"

namespace lightmill {

int PbrtParser::add_material(const Token& d, const std::string& name, std::string type,
                             std::vector<Parameter> given) {
  MaterialText text;
  if (out_.dialect == Dialect::kV3) text = {type, given};
  if (out_.dialect == Dialect::kV3 || v3::is_material(type)) {
    if (out_.dialect == Dialect::kV4) {
      problems_->warning(d.where.location(), "material " + in_quotes(type) +
                                                 " is pbrt-v3's; it is read as by pbrt-v4's --upgrade");
    }
    v3::upgrade_material(d.where.location(), &type, &given, problems_);
  }
  ParameterList params(name.empty() ? "material " + in_quotes(type) : "the material " + in_quotes(name),
                       d.where.location(), std::move(given), problems_);
  params.accept({"type"});
  const std::optional<FloatInput> opacity = v3::read_opacity(out_, params);
  MaterialDescription material = translate_material(out_, type, params);
  material.name = name;
  int index = -1;
  if (name.empty()) {
    index = out_.add_material(std::move(material));
  } else {
    out_.define_material(std::move(material));
    index = out_.material_named(name, d.where.location());
  }
  if (is_interface_material(type)) out_.invisible_materials.insert(index);
  if (opacity) out_.opacities[index] = *opacity;
  if (out_.dialect == Dialect::kV3) material_texts_[index] = std::move(text);
  return index;
}

int PbrtParser::material_of_shape(const Token& d, ParameterList& shape) {
  static const std::vector<std::string_view> names = {"Kd",
                                                      "Ks",
                                                      "Kr",
                                                      "Kt",
                                                      "sigma",
                                                      "roughness",
                                                      "uroughness",
                                                      "vroughness",
                                                      "eta",
                                                      "index",
                                                      "k",
                                                      "opacity",
                                                      "bumpmap",
                                                      "reflect",
                                                      "transmit",
                                                      "color",
                                                      "metallic",
                                                      "speculartint",
                                                      "sheen",
                                                      "sheentint",
                                                      "anisotropic",
                                                      "clearcoat",
                                                      "clearcoatgloss",
                                                      "spectrans",
                                                      "sigma_a",
                                                      "sigma_s",
                                                      "mfp",
                                                      "amount",
                                                      "remaproughness"};
  const int current = state_.shape.material;
  const auto text = material_texts_.find(current);
  if (text == material_texts_.end()) return current;
  const std::vector<Parameter> own = shape.take(names);
  if (own.empty()) return current;
  MaterialText merged = text->second;
  for (const Parameter& p : own) {
    std::erase_if(merged.parameters, [&](const Parameter& q) { return q.name == p.name; });
    merged.parameters.push_back(p);
  }
  return add_material(d, "", merged.type, std::move(merged.parameters));
}

void PbrtParser::on_material(const Token& d) {
  if (!require_world(d)) return;
  const auto type = take_string(d, "a type");
  if (!type) return;
  state_.shape.material = add_material(d, "", *type, take_values("material"));
}

void PbrtParser::on_make_named_material(const Token& d) {
  if (!require_world(d)) return;
  const auto name = take_string(d, "a name");
  if (!name) return;
  std::vector<Parameter> given = take_values("material");
  const auto found = std::ranges::find_if(given, [](const Parameter& p) { return p.name == "type"; });
  std::string type = "diffuse";
  if (found != given.end() && found->strings.size() == 1) {
    type = found->strings[0];
  } else {
    problems_->warning(d.where.location(),
                       "the material " + in_quotes(*name) + " needs a \"string type\"; \"diffuse\" is taken");
  }
  add_material(d, *name, type, std::move(given));
}

void PbrtParser::on_named_material(const Token& d) {
  if (!require_world(d)) return;
  const SourceLocation where = tokens_->peek().where.location();
  const auto name = take_string(d, "a name");
  if (!name) return;
  if (out_.dialect == Dialect::kV3 && !out_.material_defined(*name)) {
    problems_->warning(where, "there is no material named " + in_quotes(*name) +
                                  "; the one before it is kept, as by pbrt-v3");
    return;
  }
  state_.shape.material = out_.material_named(*name, where);
}

void PbrtParser::on_texture(const Token& d) {
  if (!require_world(d)) return;
  const auto name = take_string(d, "a name");
  if (!name) return;
  const auto value_type = take_string(d, "\"float\" or \"spectrum\"");
  if (!value_type) return;
  const auto type = take_string(d, "a type");
  if (!type) return;
  std::vector<Parameter> given = take_values("texture");
  std::string upgraded = *type;
  if (out_.dialect == Dialect::kV3)
    v3::upgrade(v3::Directive::kTexture, d.where.location(), &upgraded, &given, problems_);
  ParameterList params("texture " + in_quotes(*type), d.where.location(), std::move(given), problems_);
  stays(d, "a texture's space");
  translate_texture(out_, *name, *value_type, *type, params, state_.shape.ctm);
}

void PbrtParser::on_light(const Token& d) {
  if (!require_world(d)) return;
  auto typed = take_typed(d, v3::Directive::kLight, "light", "light");
  if (!typed) return;
  auto& [type, params] = *typed;
  if (refuse_if_flat()) return;
  const size_t before = out_.scene.lights.size();
  const RayKinds hidden = hidden_from(params);
  const std::string group = light_group_from(params);
  translate_light(out_, type, params, state_.shape.ctm);
  bool can_go = true;
  for (size_t i = before; i < out_.scene.lights.size(); ++i) {
    LightDescription& light = out_.scene.lights[i];
    light.medium = state_.shape.media.outside;
    light.hidden = hidden;
    light.light_group = group;
    const auto* distant = std::get_if<DistantLight>(&light.kind);
    const bool narrow = distant != nullptr && distant->half_angle_degrees == 0;
    can_go = narrow || std::holds_alternative<PointLight>(light.kind) ||
             std::holds_alternative<SpotLight>(light.kind) || std::holds_alternative<AreaLamp>(light.kind);
    can_go = can_go && can_move(state_.shape.ctm, state_.ctm_end);
    if (ctm_moves() && can_go) moving_lights_.push_back({i, state_.shape.ctm, state_.ctm_end});
  }
  if (!can_go) stays(d, "a light of this kind");
}

void PbrtParser::on_area_light(const Token& d) {
  if (!require_world(d)) return;
  auto typed = take_typed(d, v3::Directive::kAreaLight, "area light", "light");
  if (!typed) return;
  auto& [type, params] = *typed;
  std::string group = light_group_from(params);
  state_.shape.area_light = translate_area_light(out_, type, params);
  state_.shape.area_light->light_group = std::move(group);
}

void PbrtParser::on_shape(const Token& d) {
  if (!require_world(d)) return;
  auto typed = take_typed(d, v3::Directive::kShape, "shape", "shape");
  if (!typed) return;
  auto& [type, params] = *typed;
  if (refuse_if_flat()) return;
  ShapeAttributes attributes = state_.shape;
  attributes.material = material_of_shape(d, params);
  if (open_object_ && attributes.area_light != nullptr) {
    problems_->unsupported(d.where.location(), "area lights in objects: the shape does not emit");
    attributes.area_light = nullptr;
  }
  attributes.moves_to = moves_to(d, state_.shape.ctm, state_.ctm_end);
  translate_shape(out_, type, params, attributes);
}

}  // namespace lightmill
