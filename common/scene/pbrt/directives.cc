// The table of pbrt-v4's directives, and one handler for each; those of transforms are in
// transform_directives.cc, those of objects and their instances in object_directives.cc.
#include <algorithm>
#include <utility>

#include "common/base/lower_case.h"
#include "common/scene/pbrt/parser.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

std::string owner_of(const char* kind, const std::string& type) {
  return std::string(kind) + " " + in_quotes(type);
}

}  // namespace

const std::map<std::string_view, PbrtParser::Handler>& PbrtParser::handlers() {
  static const std::map<std::string_view, Handler> table = {
      {"Accelerator", &PbrtParser::on_accelerator},
      {"ActiveTransform", &PbrtParser::on_active_transform},
      {"AreaLightSource", &PbrtParser::on_area_light},
      {"Attribute", &PbrtParser::on_attribute},
      {"AttributeBegin", &PbrtParser::on_attribute_begin},
      {"AttributeEnd", &PbrtParser::on_attribute_end},
      {"Camera", &PbrtParser::on_camera},
      {"ColorSpace", &PbrtParser::on_color_space},
      {"ConcatTransform", &PbrtParser::on_concat_transform},
      {"CoordSysTransform", &PbrtParser::on_coord_sys_transform},
      {"CoordinateSystem", &PbrtParser::on_coordinate_system},
      {"Film", &PbrtParser::on_film},
      {"Identity", &PbrtParser::on_identity},
      {"Import", &PbrtParser::on_import},
      {"Include", &PbrtParser::on_include},
      {"Integrator", &PbrtParser::on_integrator},
      {"LightSource", &PbrtParser::on_light},
      {"LookAt", &PbrtParser::on_look_at},
      {"MakeNamedMaterial", &PbrtParser::on_make_named_material},
      {"MakeNamedMedium", &PbrtParser::on_make_named_medium},
      {"Material", &PbrtParser::on_material},
      {"MediumInterface", &PbrtParser::on_medium_interface},
      {"NamedMaterial", &PbrtParser::on_named_material},
      {"ObjectBegin", &PbrtParser::on_object_begin},
      {"ObjectEnd", &PbrtParser::on_object_end},
      {"ObjectInstance", &PbrtParser::on_object_instance},
      {"Option", &PbrtParser::on_option},
      {"PixelFilter", &PbrtParser::on_pixel_filter},
      {"ReverseOrientation", &PbrtParser::on_reverse_orientation},
      {"Rotate", &PbrtParser::on_rotate},
      {"Sampler", &PbrtParser::on_sampler},
      {"Scale", &PbrtParser::on_scale},
      {"Shape", &PbrtParser::on_shape},
      {"Texture", &PbrtParser::on_texture},
      {"Transform", &PbrtParser::on_transform},
      {"TransformBegin", &PbrtParser::on_transform_begin},
      {"TransformEnd", &PbrtParser::on_transform_end},
      {"TransformTimes", &PbrtParser::on_transform_times},
      {"Translate", &PbrtParser::on_translate},
      {"WorldBegin", &PbrtParser::on_world_begin},
      {"WorldEnd", &PbrtParser::on_world_end},
  };
  return table;
}

// --- scopes and attributes ------------------------------------------------------------------------

void PbrtParser::on_attribute_begin(const Token& d) {
  if (require_world(d)) push(Scope::Kind::kAttribute, d);
}
void PbrtParser::on_attribute_end(const Token& d) {
  if (require_world(d)) pop(Scope::Kind::kAttribute, d, "AttributeBegin");
}
void PbrtParser::on_transform_begin(const Token& d) { push(Scope::Kind::kTransform, d); }
void PbrtParser::on_transform_end(const Token& d) { pop(Scope::Kind::kTransform, d, "TransformBegin"); }

void PbrtParser::on_reverse_orientation(const Token& d) {
  if (require_world(d)) state_.shape.reverse_orientation = !state_.shape.reverse_orientation;
}

void PbrtParser::on_attribute(const Token& d) {
  const auto target = take_string(d, "what it is for");
  if (!target) return;
  static const std::vector<std::string_view> targets = {"shape", "light", "material", "medium", "texture"};
  if (std::find(targets.begin(), targets.end(), *target) == targets.end()) {
    problems_->error(d.where.location(),
                     "unknown target of Attribute " + in_quotes(*target) + nearest_hint(*target, targets));
    return;
  }
  auto inherited = std::make_shared<InheritedParameters>(*state_.inherited);
  auto& list = (*inherited)[*target];
  for (Parameter& p : parse_parameters(*tokens_, state_.color_space, problems_)) {
    p.inherited = true;
    std::erase_if(list, [&](const Parameter& old) { return old.name == p.name; });
    list.push_back(std::move(p));
  }
  state_.inherited = std::move(inherited);
}

void PbrtParser::on_color_space(const Token& d) {
  const auto name = take_string(d, "a name");
  if (!name) return;
  // As pbrt, which takes capitals, too.
  if (const auto space = color_space_named(lower_case(*name))) {
    state_.color_space = *space;
  } else {
    problems_->error(d.where.location(),
                     "unknown color space " + in_quotes(*name) + nearest_hint(*name, color_space_names()));
  }
}

void PbrtParser::on_medium_interface(const Token& d) {
  const SourceLocation where = tokens_->peek().where.location();
  const auto inside = take_string(d, "a medium's name");
  if (!inside) return;
  MediumInterface& media = state_.shape.media;
  media.inside = media.outside = out_.medium_named(*inside, where);
  if (tokens_->peek().kind != Token::Kind::kString) return;
  const SourceLocation second = tokens_->peek().where.location();
  if (const auto outside = take_string(d, "a medium's name"))
    media.outside = out_.medium_named(*outside, second);
}

void PbrtParser::on_make_named_medium(const Token& d) {
  const auto name = take_string(d, "a name");
  if (!name) return;
  ParameterList params = take_parameters(d, "the medium " + in_quotes(*name), "medium");
  MediumDescription medium = translate_medium(out_, *name, params);
  if (name->empty()) {
    problems_->error(d.where.location(), "a medium needs a name; \"\" is empty space");
    return;
  }
  out_.define_medium(std::move(medium));
}

// --- files ----------------------------------------------------------------------------------------

void PbrtParser::on_include(const Token& d) {
  const SourceLocation where = tokens_->peek().where.location();
  if (const auto file = take_string(d, "a file name")) parse_file(*file, where);
}

void PbrtParser::on_import(const Token& d) {
  if (!require_world(d)) return;
  const SourceLocation where = tokens_->peek().where.location();
  const auto file = take_string(d, "a file name");
  if (!file) return;
  // Unlike Include, what the file does to the graphics state ends with it.
  const size_t depth = scopes_.size();
  push(Scope::Kind::kImport, d);
  parse_file(*file, where);
  while (scopes_.size() > depth + 1) {
    problems_->error(scopes_.back().where,
                     "the scope that begins here is never closed in " + in_quotes(*file));
    scopes_.pop_back();
  }
  if (scopes_.size() == depth + 1) pop(Scope::Kind::kImport, d, "Import");
}

// --- options --------------------------------------------------------------------------------------

void PbrtParser::on_camera(const Token& d) {
  if (!require_options(d)) return;
  const auto type = take_string(d, "a type");
  if (!type) return;
  ParameterList params = take_parameters(d, owner_of("camera", *type), "");
  translate_camera(out_, *type, params, state_.shape.ctm, &times_);
  CameraDescription& camera = out_.scene.camera;
  camera.medium = state_.shape.media.outside;
  const Transform end = inverse(state_.ctm_end);
  camera.moves_to = moves_to(d, camera.camera_to_world, end);
  if (camera.moves_to >= 0 && !Motion(camera.camera_to_world, end).is_rigid()) {
    problems_->unsupported(d.where.location(), "a camera whose Scale changes: it stays as at its start time");
    camera.moves_to = -1;
  }
  coordinate_systems_["camera"] = {camera.camera_to_world, end};
}

void PbrtParser::on_film(const Token& d) {
  if (!require_options(d)) return;
  const auto type = take_string(d, "a type");
  if (!type) return;
  ParameterList params = take_parameters(d, owner_of("film", *type), "");
  double explicit_time = 0;
  translate_film(out_, *type, params, &iso_ratio_, &explicit_time);
  if (explicit_time > 0) film_exposure_time_ = explicit_time;
}

void PbrtParser::on_pixel_filter(const Token& d) {
  if (!require_options(d)) return;
  const auto type = take_string(d, "a type");
  if (!type) return;
  ParameterList params = take_parameters(d, owner_of("pixel filter", *type), "");
  translate_filter(out_, *type, params);
}

void PbrtParser::on_sampler(const Token& d) {
  if (!require_options(d)) return;
  const auto type = take_string(d, "a type");
  if (!type) return;
  ParameterList params = take_parameters(d, owner_of("sampler", *type), "");
  translate_sampler(out_, *type, params);
}

void PbrtParser::on_integrator(const Token& d) {
  if (!require_options(d)) return;
  const auto type = take_string(d, "a type");
  if (!type) return;
  ParameterList params = take_parameters(d, owner_of("integrator", *type), "");
  translate_integrator(out_, *type, params);
}

void PbrtParser::on_accelerator(const Token& d) {
  if (!require_options(d)) return;
  const auto type = take_string(d, "a type");
  if (!type) return;
  ParameterList params = take_parameters(d, owner_of("accelerator", *type), "");
  translate_accelerator(out_, *type, params);
}

void PbrtParser::on_option(const Token& d) {
  // pbrt-v4 writes `Option "seed" 3`; `Option "integer seed" 3` is understood, too.
  if (const Token& next = tokens_->peek();
      next.kind == Token::Kind::kString && next.text.find(' ') == std::string_view::npos) {
    ParameterList params("Option", d.where.location(), parse_untyped_parameter(*tokens_, problems_),
                         problems_);
    translate_option(out_, params);
    return;
  }
  ParameterList params = take_parameters(d, "Option", "");
  translate_option(out_, params);
}

void PbrtParser::on_world_begin(const Token& d) {
  if (in_world_) {
    problems_->error(d.where.location(), "WorldBegin is given twice");
    return;
  }
  for (const Scope& scope : scopes_) {
    problems_->error(scope.where, "the scope that begins here is not closed before WorldBegin");
  }
  scopes_.clear();
  in_world_ = true;
  state_.shape.ctm = state_.ctm_end = Transform{};
  state_.transforms_start = state_.transforms_end = true;
  coordinate_systems_["world"] = {};
}

void PbrtParser::on_world_end(const Token& d) {
  // pbrt-v3's last line; v4 allows and ignores it.
  require_world(d);
}

// --- content --------------------------------------------------------------------------------------

void PbrtParser::on_material(const Token& d) {
  if (!require_world(d)) return;
  const auto type = take_string(d, "a type");
  if (!type) return;
  ParameterList params = take_parameters(d, owner_of("material", *type), "material");
  state_.shape.material = out_.add_material(translate_material(out_, *type, params));
  if (is_interface_material(*type)) out_.invisible_materials.insert(state_.shape.material);
}

void PbrtParser::on_make_named_material(const Token& d) {
  if (!require_world(d)) return;
  const auto name = take_string(d, "a name");
  if (!name) return;
  ParameterList params = take_parameters(d, "the material " + in_quotes(*name), "material");
  const std::string type = params.text("type", "");
  if (type.empty()) {
    if (!params.has("type"))
      problems_->error(d.where.location(), "the material " + in_quotes(*name) + " needs a \"string type\"");
    return;
  }
  MaterialDescription material = translate_material(out_, type, params);
  material.name = *name;
  out_.define_material(std::move(material));
  if (is_interface_material(type))
    out_.invisible_materials.insert(out_.material_named(*name, d.where.location()));
}

void PbrtParser::on_named_material(const Token& d) {
  if (!require_world(d)) return;
  const SourceLocation where = tokens_->peek().where.location();
  if (const auto name = take_string(d, "a name")) state_.shape.material = out_.material_named(*name, where);
}

void PbrtParser::on_texture(const Token& d) {
  if (!require_world(d)) return;
  const auto name = take_string(d, "a name");
  if (!name) return;
  const auto value_type = take_string(d, "\"float\" or \"spectrum\"");
  if (!value_type) return;
  const auto type = take_string(d, "a type");
  if (!type) return;
  ParameterList params = take_parameters(d, owner_of("texture", *type), "texture");
  stays(d, "a texture's space");
  translate_texture(out_, *name, *value_type, *type, params, state_.shape.ctm);
}

void PbrtParser::on_light(const Token& d) {
  if (!require_world(d)) return;
  const auto type = take_string(d, "a type");
  if (!type) return;
  ParameterList params = take_parameters(d, owner_of("light", *type), "light");
  if (refuse_if_flat()) return;
  stays(d, "a light");
  const size_t before = out_.scene.lights.size();
  translate_light(out_, *type, params, state_.shape.ctm);
  for (size_t i = before; i < out_.scene.lights.size(); ++i)
    out_.scene.lights[i].medium = state_.shape.media.outside;
}

void PbrtParser::on_area_light(const Token& d) {
  if (!require_world(d)) return;
  const auto type = take_string(d, "a type");
  if (!type) return;
  ParameterList params = take_parameters(d, owner_of("area light", *type), "light");
  state_.shape.area_light = translate_area_light(out_, *type, params);
}

void PbrtParser::on_shape(const Token& d) {
  if (!require_world(d)) return;
  const auto type = take_string(d, "a type");
  if (!type) return;
  ParameterList params = take_parameters(d, owner_of("shape", *type), "shape");
  if (refuse_if_flat()) return;
  ShapeAttributes attributes = state_.shape;
  if (open_object_ && attributes.area_light != nullptr) {
    problems_->unsupported(d.where.location(), "area lights in objects: the shape does not emit");
    attributes.area_light = nullptr;
  }
  if (attributes.area_light != nullptr) {
    stays(d, "an area light");
  } else {
    attributes.moves_to = moves_to(d, state_.shape.ctm, state_.ctm_end);
  }
  translate_shape(out_, *type, params, attributes);
}

}  // namespace lightmill
