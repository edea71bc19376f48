// The table of the directives, and the handlers of those of scopes, attributes and files. The others are in
// option_directives.cc, transform_directives.cc, content_directives.cc and object_directives.cc.
#include <algorithm>
#include <utility>

#include "common/base/lower_case.h"
#include "common/scene/pbrt/parser.h"

namespace lightmill {

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
      {"TransformSteps", &PbrtParser::on_transform_steps},
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
  MediumDescription medium = translate_medium(out_, *name, params, state_.shape.ctm);
  if (medium.grid && refuse_if_flat()) return;
  if (const int end = medium.grid ? moves_to(d, state_.shape.ctm, state_.ctm_end) : -1; end >= 0) {
    auto moving = std::make_shared<MediumGrid>(*medium.grid);
    moving->moves_to = end;
    medium.grid = std::move(moving);
  }
  if (name->empty()) {
    problems_->error(d.where.location(), "a medium needs a name; \"\" is empty space");
    return;
  }
  out_.define_medium(std::move(medium));
}

// --- files ----------------------------------------------------------------------------------------

void PbrtParser::on_include(const Token& d) {
  const SourceLocation where = tokens_->peek().where.location();
  if (const auto file = take_string(d, "a file name")) parse_file(*file, where, true);
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

}  // namespace lightmill
