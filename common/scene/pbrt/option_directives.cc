// Directives before WorldBegin: camera, film, sampling; WorldBegin and WorldEnd.
#include <utility>

#include "common/scene/pbrt/parser.h"
#include "common/scene/pbrt/v3/direct_lighting.h"
#include "common/scene/transform.h"

namespace lightmill {

void PbrtParser::on_camera(const Token& d) {
  if (!require_options(d)) return;
  auto typed = take_typed(d, v3::Directive::kCamera, "camera", "");
  if (!typed) return;
  auto& [type, params] = *typed;
  translate_camera(out_, type, params, state_.shape.ctm, &times_);
  CameraDescription& camera = out_.scene.camera;
  camera.medium = state_.shape.media.outside;
  if (std::exchange(state_.steps, nullptr))
    problems_->unsupported(d.where.location(), "a camera with TransformSteps: it goes straight to the last");
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
  const bool direct = v3::is_direct_lighting(std::string(tokens_->peek().text));
  auto typed = take_typed(d, v3::Directive::kIntegrator, "integrator", "");
  if (!typed) return;
  direct_lighting_.reset();
  if (direct && out_.dialect == Dialect::kV3) direct_lighting_ = d.where.location();
  auto& [type, params] = *typed;
  translate_integrator(out_, type, params);
}

void PbrtParser::on_accelerator(const Token& d) {
  if (!require_options(d)) return;
  const auto type = take_string(d, "a type");
  if (!type) return;
  ParameterList params = take_parameters(d, "accelerator " + in_quotes(*type), "");
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
  if (!require_world(d)) return;
  world_ended_ = true;
  if (out_.dialect != Dialect::kV3 || tokens_->peek().kind == Token::Kind::kEnd) return;
  problems_->warning(
      tokens_->peek().where.location(),
      "a further picture begins here, after WorldEnd; it is left out: one file is one picture");
  while (tokens_->next().kind != Token::Kind::kEnd) {
  }
}

}  // namespace lightmill
