// The table of pbrt-v4's directives, and one handler for each; those of transforms are in
// transform_directives.cc, those of objects and their instances in object_directives.cc.
#include <algorithm>
#include <utility>

#include "common/base/lower_case.h"
#include "common/scene/pbrt/parser.h"
#include "common/scene/pbrt/v3/materials.h"
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
      {"Renderer", &PbrtParser::on_left_out},
      {"Rotate", &PbrtParser::on_rotate},
      {"Sampler", &PbrtParser::on_sampler},
      {"Scale", &PbrtParser::on_scale},
      {"SearchPath", &PbrtParser::on_left_out},
      {"Shape", &PbrtParser::on_shape},
      {"SurfaceIntegrator", &PbrtParser::on_integrator},
      {"Texture", &PbrtParser::on_texture},
      {"Transform", &PbrtParser::on_transform},
      {"TransformBegin", &PbrtParser::on_transform_begin},
      {"TransformEnd", &PbrtParser::on_transform_end},
      {"TransformTimes", &PbrtParser::on_transform_times},
      {"Translate", &PbrtParser::on_translate},
      {"Volume", &PbrtParser::on_left_out},
      {"VolumeIntegrator", &PbrtParser::on_left_out},
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
  std::vector<Parameter> given = take_values("medium");
  if (std::string none; out_.dialect == Dialect::kV3)
    v3::upgrade(v3::Directive::kMedium, d.where.location(), &none, &given, problems_);
  ParameterList params("the medium " + in_quotes(*name), d.where.location(), std::move(given), problems_);
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
  auto typed = take_typed(d, v3::Directive::kCamera, "camera", "");
  if (!typed) return;
  auto& [type, params] = *typed;
  translate_camera(out_, type, params, state_.shape.ctm, &times_);
  CameraDescription& camera = out_.scene.camera;
  camera.medium = state_.shape.media.outside;
  Transform end = inverse(state_.ctm_end);
  coordinate_systems_["camera"] = {camera.camera_to_world, end};
  for (Transform* t : {&camera.camera_to_world, &end}) {
    for (auto& row : t->m) {
      if (out_.flips_x) row[0] = -row[0];
      if (out_.flips_y) row[1] = -row[1];
    }
  }
  camera.moves_to = moves_to(d, camera.camera_to_world, end);
  if (camera.moves_to >= 0 && !Motion(camera.camera_to_world, end).is_rigid()) {
    problems_->unsupported(d.where.location(), "a camera whose Scale changes: it stays as at its start time");
    camera.moves_to = -1;
  }
}

void PbrtParser::on_film(const Token& d) {
  if (!require_options(d)) return;
  auto typed = take_typed(d, v3::Directive::kFilm, "film", "");
  if (!typed) return;
  auto& [type, params] = *typed;
  double explicit_time = 0;
  translate_film(out_, type, params, &iso_ratio_, &explicit_time);
  if (explicit_time > 0) film_exposure_time_ = explicit_time;
}

void PbrtParser::on_pixel_filter(const Token& d) {
  if (!require_options(d)) return;
  auto typed = take_typed(d, v3::Directive::kPixelFilter, "pixel filter", "");
  if (!typed) return;
  auto& [type, params] = *typed;
  translate_filter(out_, type, params);
}

void PbrtParser::on_sampler(const Token& d) {
  if (!require_options(d)) return;
  auto typed = take_typed(d, v3::Directive::kSampler, "sampler", "");
  if (!typed) return;
  auto& [type, params] = *typed;
  translate_sampler(out_, type, params);
}

void PbrtParser::on_integrator(const Token& d) {
  if (!require_options(d)) return;
  auto typed = take_typed(d, v3::Directive::kIntegrator, "integrator", "");
  if (!typed) return;
  auto& [type, params] = *typed;
  translate_integrator(out_, type, params);
}

void PbrtParser::on_accelerator(const Token& d) {
  if (!require_options(d)) return;
  const auto type = take_string(d, "a type");
  if (!type) return;
  ParameterList params = take_parameters(d, owner_of("accelerator", *type), "");
  translate_accelerator(out_, *type, params);
}

void PbrtParser::on_left_out(const Token& d) {
  problems_->warning(d.where.location(), std::string(d.text) + " is pbrt-v2's and is left out");
  skip_to_directive();
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

int PbrtParser::add_material(const Token& d, const std::string& name, std::string type,
                             std::vector<Parameter> given) {
  if (out_.dialect == Dialect::kV3 || v3::is_material(type)) {
    if (out_.dialect == Dialect::kV4) {
      problems_->warning(d.where.location(), "material " + in_quotes(type) +
                                                 " is pbrt-v3's; it is read as by pbrt-v4's --upgrade");
    }
    v3::upgrade_material(d.where.location(), &type, &given, problems_);
  }
  ParameterList params(name.empty() ? owner_of("material", type) : "the material " + in_quotes(name),
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
  return index;
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
  std::vector<Parameter> given = take_values("texture");
  std::string upgraded = *type;
  if (out_.dialect == Dialect::kV3)
    v3::upgrade(v3::Directive::kTexture, d.where.location(), &upgraded, &given, problems_);
  ParameterList params(owner_of("texture", *type), d.where.location(), std::move(given), problems_);
  stays(d, "a texture's space");
  translate_texture(out_, *name, *value_type, *type, params, state_.shape.ctm);
}

void PbrtParser::on_light(const Token& d) {
  if (!require_world(d)) return;
  auto typed = take_typed(d, v3::Directive::kLight, "light", "light");
  if (!typed) return;
  auto& [type, params] = *typed;
  if (refuse_if_flat()) return;
  stays(d, "a light");
  const size_t before = out_.scene.lights.size();
  translate_light(out_, type, params, state_.shape.ctm);
  for (size_t i = before; i < out_.scene.lights.size(); ++i)
    out_.scene.lights[i].medium = state_.shape.media.outside;
}

void PbrtParser::on_area_light(const Token& d) {
  if (!require_world(d)) return;
  auto typed = take_typed(d, v3::Directive::kAreaLight, "area light", "light");
  if (!typed) return;
  auto& [type, params] = *typed;
  state_.shape.area_light = translate_area_light(out_, type, params);
}

void PbrtParser::on_shape(const Token& d) {
  if (!require_world(d)) return;
  auto typed = take_typed(d, v3::Directive::kShape, "shape", "shape");
  if (!typed) return;
  auto& [type, params] = *typed;
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
  translate_shape(out_, type, params, attributes);
}

}  // namespace lightmill
