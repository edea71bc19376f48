#include "common/scene/pbrt/v3/dialect.h"

#include <map>
#include <set>

#include "common/scene/pbrt/syntax/tokenizer.h"

namespace lightmill {
namespace {

using Words = std::map<std::string_view, Dialect, std::less<>>;

/// Directives that one of them has.
const Words kDirectives = {
    {"SurfaceIntegrator", Dialect::kV3},
    {"VolumeIntegrator", Dialect::kV3},
    {"Renderer", Dialect::kV3},
    {"Volume", Dialect::kV3},
    {"SearchPath", Dialect::kV3},
    {"ColorSpace", Dialect::kV4},
    {"Option", Dialect::kV4},
    {"Attribute", Dialect::kV4},
};

const Words kMaterials = {
    {"matte", Dialect::kV3},          {"plastic", Dialect::kV3},
    {"metal", Dialect::kV3},          {"glass", Dialect::kV3},
    {"mirror", Dialect::kV3},         {"uber", Dialect::kV3},
    {"substrate", Dialect::kV3},      {"translucent", Dialect::kV3},
    {"disney", Dialect::kV3},         {"kdsubsurface", Dialect::kV3},
    {"fourier", Dialect::kV3},        {"shinymetal", Dialect::kV3},
    {"none", Dialect::kV3},           {"diffuse", Dialect::kV4},
    {"conductor", Dialect::kV4},      {"dielectric", Dialect::kV4},
    {"coateddiffuse", Dialect::kV4},  {"coatedconductor", Dialect::kV4},
    {"thindielectric", Dialect::kV4}, {"diffusetransmission", Dialect::kV4},
    {"interface", Dialect::kV4},
};

/// The type that follows a directive, or, of a named material, that its parameter "type" says.
const std::map<std::string_view, Words, std::less<>> kTypes = {
    {"Film",
     {{"image", Dialect::kV3}, {"rgb", Dialect::kV4}, {"gbuffer", Dialect::kV4}, {"spectral", Dialect::kV4}}},
    {"Camera", {{"environment", Dialect::kV3}, {"spherical", Dialect::kV4}}},
    {"Sampler",
     {{"lowdiscrepancy", Dialect::kV3},
      {"02sequence", Dialect::kV3},
      {"maxmindist", Dialect::kV3},
      {"random", Dialect::kV3},
      {"adaptive", Dialect::kV3},
      {"bestcandidate", Dialect::kV3},
      {"zsobol", Dialect::kV4},
      {"paddedsobol", Dialect::kV4},
      {"pmj02bn", Dialect::kV4},
      {"independent", Dialect::kV4}}},
    {"Integrator",
     {{"directlighting", Dialect::kV3},
      {"whitted", Dialect::kV3},
      {"simplepath", Dialect::kV4},
      {"simplevolpath", Dialect::kV4},
      {"lightpath", Dialect::kV4},
      {"randomwalk", Dialect::kV4}}},
    {"AreaLightSource", {{"area", Dialect::kV3}}},
    {"Texture", {{"color", Dialect::kV3}, {"spectrum", Dialect::kV4}}},
    {"Material", kMaterials},
    {"MakeNamedMaterial", kMaterials},
    {"Shape",
     {{"cone", Dialect::kV3},
      {"paraboloid", Dialect::kV3},
      {"hyperboloid", Dialect::kV3},
      {"heightfield", Dialect::kV3},
      {"nurbs", Dialect::kV3},
      {"bilinearmesh", Dialect::kV4}}},
};

/// Declarations, all of whose "type name" or whose type alone tells.
const Words kDeclarations = {
    {"color", Dialect::kV3},
    {"xyz", Dialect::kV3},
    {"float xwidth", Dialect::kV3},
    {"float ywidth", Dialect::kV3},
    {"string mapname", Dialect::kV3},
    {"integer nsamples", Dialect::kV3},
    {"rgb scale", Dialect::kV3},
    {"spectrum scale", Dialect::kV3},
    {"float xradius", Dialect::kV4},
    {"float yradius", Dialect::kV4},
    {"float illuminance", Dialect::kV4},
    {"rgb reflectance", Dialect::kV4},
    {"spectrum reflectance", Dialect::kV4},
    {"texture reflectance", Dialect::kV4},
};

std::optional<Dialect> found_in(const Words& words, std::string_view word) {
  const auto found = words.find(word);
  return found == words.end() ? std::nullopt : std::optional(found->second);
}

/// Whether the string of this number after its directive is the type, not a name.
bool says_type(std::string_view directive, int number, std::string_view declaration) {
  if (directive == "MakeNamedMaterial") return declaration == "string type";
  return number == (directive == "Texture" ? 2 : 1);
}

}  // namespace

const char* dialect_name(Dialect dialect) { return dialect == Dialect::kV3 ? "pbrt-v3" : "pbrt-v4"; }

std::optional<Dialect> dialect_of(std::string_view text,
                                  const std::function<void(const std::string& file)>& include) {
  const std::string name;
  ProblemList unheard(false);
  PbrtTokenizer tokens(PbrtTokenizer::Borrowed{text}, &name, &unheard);
  std::string_view directive, declaration;
  int strings = 0;                         // since the directive
  bool is_value = false, in_list = false;  // what comes after a declaration
  for (Token token = tokens.next(); token.kind != Token::Kind::kEnd; token = tokens.next()) {
    if (token.kind == Token::Kind::kWord) {
      const char first = token.text[0];
      if (!((first >= 'A' && first <= 'Z') || (first >= 'a' && first <= 'z'))) {  // a number
        is_value = false;
        continue;
      }
      directive = token.text;
      declaration = {};
      strings = 0;
      is_value = in_list = false;
      if (const auto found = found_in(kDirectives, directive)) return found;
    } else if (token.kind == Token::Kind::kOpen || token.kind == Token::Kind::kClose) {
      in_list = token.kind == Token::Kind::kOpen;
      is_value = false;
    } else if (token.kind == Token::Kind::kString) {
      if (directive == "Include" || directive == "Import") include(std::string(token.text));
      ++strings;
      const auto words = kTypes.find(directive);
      if (words != kTypes.end() && says_type(directive, strings, declaration)) {
        if (const auto found = found_in(words->second, token.text)) return found;
      }
      const size_t blank = token.text.find(' ');
      const bool declares = blank != std::string_view::npos && !is_value && !in_list;
      is_value = declares;
      if (!declares) continue;
      declaration = token.text;
      if (const auto found = found_in(kDeclarations, token.text)) return found;
      if (const auto found = found_in(kDeclarations, token.text.substr(0, blank))) return found;
    }
  }
  return std::nullopt;
}

}  // namespace lightmill
