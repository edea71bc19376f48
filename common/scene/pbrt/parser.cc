// Files, scopes and the pieces that directives are made of; the directives are in directives.cc.
#include "common/scene/pbrt/parser.h"

#include <algorithm>

#include "common/base/error.h"
#include "common/base/parse_number.h"
#include "common/scene/fold_constants.h"
#include "common/scene/materials/see_through.h"
#include "common/scene/motion.h"
#include "common/scene/pbrt/shapes/quadrics.h"
#include "common/scene/pbrt/v3/direct_lighting.h"
#include "common/scene/scene_files.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr size_t kMaxIncludeDepth = 32;
// Files may include one another so that the text grows exponentially; these bound it.
constexpr size_t kMaxFilesRead = 200000;
constexpr size_t kMaxTextBytes = size_t{1} << 31;

/// Whether there is a medium around the camera or on a side of a shape.
bool has_media(const SceneDescription& scene) {
  const auto beside = [](const ShapeDescription& s) { return s.media.inside >= 0 || s.media.outside >= 0; };
  return scene.camera.medium >= 0 || std::ranges::any_of(scene.shapes, beside) ||
         std::ranges::any_of(scene.objects, [&](const ObjectDescription& o) {
           return std::ranges::any_of(o.shapes, beside);
         });
}

}  // namespace

SceneDescription PbrtParser::parse(const std::string& name) {
  parse_file(name, {name, 1, 1});
  finish();
  return std::move(out_.scene);
}

void PbrtParser::parse_file(const std::string& reference, const SourceLocation& where, bool is_include) {
  const std::string path = out_.open_reference(reference, where, &open_files_);
  if (path.empty()) return;
  if (std::find(open_files_.begin(), open_files_.end(), path) != open_files_.end()) {
    problems_->error(where, "the file " + in_quotes(reference) + " includes itself");
    return;
  }
  if (open_files_.size() >= kMaxIncludeDepth || ++files_read_ > kMaxFilesRead) {
    problems_->error(where, open_files_.size() >= kMaxIncludeDepth
                                ? "files include one another more than 32 deep"
                                : "more than 200000 files are included");
    return;
  }
  std::string text;
  try {
    text = read_scene_file(path, kMaxTextBytes);
    if (text.size() > kMaxTextBytes - bytes_read_)
      fail_scene("makes the text of all included files longer than the limit of 2048 MiB");
  } catch (const Error& e) {
    problems_->error(where, "the file " + in_quotes(reference) + " " + e.what());
    return;
  }
  if (open_files_.empty()) choose_dialect(text);
  bytes_read_ += text.size();
  out_.expect_meshes(text);
  PbrtTokenizer tokenizer(std::move(text), &file_names_.emplace_back(reference), problems_);
  PbrtTokenizer* const outer = tokens_;
  if (is_include) tokenizer.parameters_follow_in(outer);
  tokens_ = &tokenizer;
  open_files_.push_back(path);
  parse_tokens();
  open_files_.pop_back();
  tokens_ = outer;
}

void PbrtParser::parse_tokens() {
  while (!problems_->full()) {
    const Token token = tokens_->next();
    if (token.kind == Token::Kind::kEnd) return;
    if (token.kind != Token::Kind::kWord) {
      problems_->error(token.where.location(), "a directive is expected, not " + in_quotes(token.text));
      skip_to_directive();
      continue;
    }
    const auto found = handlers().find(token.text);
    if (found == handlers().end()) {
      std::vector<std::string_view> names;
      for (const auto& [name, handler] : handlers()) names.push_back(name);
      const SourceLocation where = token.where.location();
      if (tokens_->peek().kind == Token::Kind::kEnd) {
        problems_->error(where, "unknown directive " + in_quotes(token.text) +
                                    nearest_hint(token.text, names, "the file ends here; is it cut off?"));
      } else {
        problems_->warning(where, "unknown directive " + in_quotes(token.text) +
                                      nearest_hint(token.text, names, "it is left out"));
      }
      skip_to_directive();
      continue;
    }
    const int errors = problems_->errors();
    (this->*found->second)(token);
    if (problems_->errors() > errors) skip_to_directive();
  }
}

void PbrtParser::skip_to_directive() {
  for (;;) {
    const Token& token = tokens_->peek();
    if (token.kind == Token::Kind::kEnd) return;
    if (token.kind == Token::Kind::kWord && handlers().contains(token.text)) return;
    tokens_->next();
  }
}

std::optional<std::string> PbrtParser::take_string(const Token& directive, const char* what) {
  const Token& token = tokens_->peek();
  if (token.kind == Token::Kind::kString) return std::string(tokens_->next().text);
  problems_->error(token.where.location(),
                   std::string(directive.text) + " needs " + what + " in quotes" +
                       (token.kind == Token::Kind::kEnd ? "; the file ends here" : ""));
  return std::nullopt;
}

bool PbrtParser::take_numbers(const Token& directive, double* numbers, size_t count) {
  const bool bracketed = tokens_->peek().kind == Token::Kind::kOpen;
  if (bracketed) tokens_->next();
  const auto fail = [&](const Token& token) {
    problems_->error(
        token.where.location(),
        std::string(directive.text) + " needs " + std::to_string(count) + " finite numbers" +
            (token.kind == Token::Kind::kEnd ? "; the file ends here" : ", not " + in_quotes(token.text)));
    return false;
  };
  for (size_t i = 0; i < count; ++i) {
    const Token& token = tokens_->peek();
    if (token.kind != Token::Kind::kWord || !parse_number(token.text, &numbers[i])) return fail(token);
    tokens_->next();
  }
  if (bracketed) {
    if (tokens_->peek().kind != Token::Kind::kClose) return fail(tokens_->peek());
    tokens_->next();
  }
  return true;
}

std::vector<Parameter> PbrtParser::take_values(const char* inherited_from) {
  std::vector<Parameter> parameters = parse_parameters(*tokens_, state_.color_space, problems_);
  if (const auto found = state_.inherited->find(inherited_from); found != state_.inherited->end()) {
    for (const Parameter& p : found->second) {
      const bool given = std::any_of(parameters.begin(), parameters.end(),
                                     [&](const Parameter& q) { return q.name == p.name; });
      if (!given) parameters.push_back(p);
    }
  }
  return parameters;
}

ParameterList PbrtParser::take_parameters(const Token& directive, const std::string& owner,
                                          const char* inherited_from) {
  return ParameterList(owner, directive.where.location(), take_values(inherited_from), problems_);
}

std::optional<PbrtParser::Typed> PbrtParser::take_typed(const Token& directive, v3::Directive kind,
                                                        const char* owner, const char* inherited_from) {
  const auto type = take_string(directive, "a type");
  if (!type) return std::nullopt;
  std::vector<Parameter> parameters = take_values(inherited_from);
  std::string upgraded = *type;
  const SourceLocation where = directive.where.location();
  if (out_.dialect == Dialect::kV3) v3::upgrade(kind, where, &upgraded, &parameters, problems_);
  if (kind == v3::Directive::kLight || kind == v3::Directive::kAreaLight) v3::upgrade_blackbody(&parameters);
  return Typed{std::move(upgraded), ParameterList(std::string(owner) + " " + in_quotes(*type), where,
                                                  std::move(parameters), problems_)};
}

void PbrtParser::choose_dialect(const std::string& text) {
  constexpr size_t kMostFiles = 64, kMostBytes = size_t{64} << 20;
  std::vector<std::string> included;
  const auto include = [&](const std::string& file) {
    if (included.size() < kMostFiles) included.push_back(file);
  };
  std::optional<Dialect> found = dialect_of(text, include);
  for (size_t i = 0; i < included.size() && !found; ++i) {
    const std::string path = out_.files.resolve(included[i]);
    try {
      if (!path.empty()) found = dialect_of(read_scene_file(path, kMostBytes), include);
    } catch (const Error&) {  // who includes it for good says what is wrong with it
    }
  }
  out_.dialect = found.value_or(Dialect::kV4);
  out_.scene.format = dialect_name(out_.dialect);
  if (out_.dialect == Dialect::kV3) {
    out_.scene.filter = {FilterKind::kBox, 0.5, 0.5};
    out_.scene.film.width = 640;
    out_.scene.film.height = 480;
    film_exposure_time_ = 1;
  }
}

void PbrtParser::finish() {
  if (file_names_.empty()) return;  // the scene file itself could not be read
  if (problems_->full()) return;
  for (const Scope& scope : scopes_) {
    if (!world_ended_ || scope.kind == Scope::Kind::kObject) {
      problems_->error(scope.where, "the scope that begins here is never closed; is the file cut off?");
    } else {
      misplaced(scope.where, "the scope that begins here is never closed");
    }
  }
  if (open_object_ &&
      std::ranges::none_of(scopes_, [](const Scope& s) { return s.kind == Scope::Kind::kObject; }))
    problems_->error({file_names_.front(), 1, 1},
                     "the object " + in_quotes(*open_object_) + " is never closed");
  const SourceLocation top{file_names_.front(), 1, 1};
  if (!in_world_) {
    problems_->error(top, "there is no WorldBegin: the scene has no content");
    return;
  }
  out_.report_undefined();
  SceneDescription& scene = out_.scene;
  // Of shapes without a surface only those are kept that media end at.
  const auto drop_invisible = [&](std::vector<ShapeDescription>* shapes) {
    const auto unseen = [&](const ShapeDescription& s) {
      return s.area_light < 0 && out_.invisible_materials.contains(s.material);
    };
    std::erase_if(*shapes, [&](const auto& s) { return unseen(s) && !s.media.transition(); });
    for (ShapeDescription& s : *shapes) s.boundary = unseen(s);
  };
  if (problems_->errors() == 0) {
    fold_constants(&scene);
    cut_out_transparent(&scene, problems_);
  }
  if (direct_lighting_ && problems_->errors() == 0) v3::choose_depth(*direct_lighting_, &scene, problems_);
  drop_invisible(&scene.shapes);
  for (ObjectDescription& object : scene.objects) drop_invisible(&object.shapes);
  tessellate_spheres(&scene, problems_);
  if (!scene.later.empty()) settle_motion(times_, &scene);
  settle_lights(times_, moving_lights_, &scene);
  scene.camera.lens.film_diagonal = out_.film_diagonal;
  scene.film.imaging_ratio =
      film_exposure_time_.value_or(times_.shutter_closes - times_.shutter_opens) * iso_ratio_;
  const bool emits =
      !scene.lights.empty() ||
      std::ranges::any_of(scene.shapes, [](const ShapeDescription& s) { return s.area_light >= 0; }) ||
      std::ranges::any_of(scene.media, [](const MediumDescription& m) { return !is_black(brightest(m)); });
  if (!emits && problems_->errors() == 0 && !out_.strict_lights) {
    problems_->warning(top,
                       "the scene has no light that is supported; an even white sky of radiance 1 is put in "
                       "(--strict-lights leaves it black)");
    scene.lights.push_back({InfiniteLight{{1, 1, 1}}, top});
  }
  if (out_.media_left_out && has_media(scene)) {
    problems_->warning(*out_.media_left_out,
                       "pbrt's integrator " + in_quotes(scene.sampling.integrator) +
                           " leaves the scene's media out; they are rendered here, as by "
                           "pbrt's volpath");
  }
  if (problems_->errors() == 0) out_.list_images();
}

}  // namespace lightmill
