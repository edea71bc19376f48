// Float textures that show what spectrum textures show: pbrt-v3 takes the one kind for the other.
#include <variant>

#include "common/scene/pbrt/scene.h"

namespace lightmill {
namespace {

Rgb grey_mean(const Rgb& c) {
  const float mean = (c.r + c.g + c.b) / 3;
  return {mean, mean, mean};
}

}  // namespace

int PbrtScene::float_copy(const std::string& spectrum_texture) {
  const auto found = named_textures_.find({true, spectrum_texture});
  return found == named_textures_.end() || !found->second.defined ? -1 : float_copy(found->second.index);
}

int PbrtScene::float_copy(int texture) {
  if (const auto known = float_copies_.find(texture); known != float_copies_.end()) return known->second;
  TextureDescription copy = scene.textures.at(static_cast<size_t>(texture));
  copy.is_spectrum = false;
  bool can_be = true;
  const auto make_grey = [&](SpectrumInput& input) {
    input.value = grey_mean(input.value);
    if (input.texture < 0) return;
    input.texture = float_copy(input.texture);
    can_be = can_be && input.texture >= 0;
  };
  if (auto* constant = std::get_if<ConstantTexture>(&copy.kind)) {
    constant->value = grey_mean(constant->value);
  } else if (auto* scaled = std::get_if<ScaleTexture>(&copy.kind)) {
    make_grey(scaled->tex);
  } else if (auto* mix = std::get_if<MixTexture>(&copy.kind)) {
    make_grey(mix->tex1);
    make_grey(mix->tex2);
  } else if (auto* board = std::get_if<CheckerboardTexture>(&copy.kind)) {
    make_grey(board->tex1);
    make_grey(board->tex2);
  } else if (auto* dots = std::get_if<DotsTexture>(&copy.kind)) {
    make_grey(dots->inside);
    make_grey(dots->outside);
  } else if (auto* directions = std::get_if<DirectionMixTexture>(&copy.kind)) {
    make_grey(directions->tex1);
    make_grey(directions->tex2);
  } else if (auto* corners = std::get_if<BilerpTexture>(&copy.kind)) {
    for (Rgb* c : {&corners->v00, &corners->v01, &corners->v10, &corners->v11}) *c = grey_mean(*c);
  } else {
    can_be = std::holds_alternative<ImageTexture>(copy.kind);
  }
  int index = -1;
  if (can_be) {
    index = static_cast<int>(scene.textures.size());
    scene.textures.push_back(std::move(copy));
  }
  float_copies_[texture] = index;
  return index;
}

std::optional<int> PbrtScene::texture_given(ParameterList& params, std::string_view name, const Parameter& p,
                                            bool is_spectrum) {
  if (p.strings.size() != 1) params.odd_value(name, "needs one texture name; the first is taken");
  const std::string& texture = p.strings[0];
  if (texture_defined(texture, is_spectrum)) return texture_named(texture, is_spectrum, p.where);
  if (!is_spectrum) {
    if (const int copy = float_copy(texture); copy >= 0) {
      params.odd_value(name, "names a spectrum texture where a float one belongs; its mean is taken");
      return copy;
    }
  }
  if (dialect == Dialect::kV4) return texture_named(texture, is_spectrum, p.where);  // it may come yet
  params.odd_value(name, "names the " + std::string(is_spectrum ? "spectrum" : "float") + " texture " +
                             in_quotes(texture) + ", which is not defined above; it is left out");
  return std::nullopt;
}

}  // namespace lightmill
