#include "worker/render/bsdf/tables/film_table.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "worker/render/bsdf/tables/facet_quadrature.h"
#include "worker/render/bsdf/thin_film.h"

namespace lightmill {
namespace {

/// Facets' cosines at which F is taken; linear between them.
constexpr int kFacetNodes = 33;
using FacetRow = std::array<float, kFacetNodes>;

/// Shares of a lobe by the cosine at its facets: of k, and of g g k.
struct LobeShares {
  FacetRow once{}, compensated{};
};

LobeShares shares_of(int alpha, int node) {
  constexpr int kSide = 24;
  const float x = static_cast<float>(alpha) / (kMetallicAlphas - 1);
  const Ggx<float> ggx{std::max(x * x, kSmoothAlpha)};
  const float* table = metallic_table().data();
  const auto g = [&](float cosine) {
    return AlbedoLookup<float, kMetallicValues>(table, kMetallicAlphas, cosine, static_cast<float>(alpha))(0);
  };
  const float cosine = node_cosine(node), go = g(cosine);
  LobeShares shares;
  for_each_reflection(ggx, cosine, kSide, [&](float weight, float facet, const Vec3<float>& wi) {
    const float gain = go * g(wi.z);
    const float at = std::clamp(facet, 0.0f, 1.0f) * (kFacetNodes - 1);
    const int below = std::min(static_cast<int>(at), kFacetNodes - 2);
    const float t = at - static_cast<float>(below);
    for (const int k : {0, 1}) {
      const float part = weight * (k == 0 ? 1 - t : t);
      const auto to = static_cast<size_t>(below + k);
      shares.once[to] += part;
      shares.compensated[to] += part * gain;
    }
  });
  return shares;
}

/// Of all alphas and cosines; made once per process.
const std::vector<LobeShares>& all_shares() {
  static const std::vector<LobeShares> shares = [] {
    std::vector<LobeShares> all;
    for (int alpha = 0; alpha < kMetallicAlphas; ++alpha) {
      for (int node = 0; node < kCosineNodes; ++node) all.push_back(shares_of(alpha, node));
    }
    return all;
  }();
  return shares;
}

/// Appends E of the largest of `reflectances`, each over the facets' cosines.
void append_albedos(const std::vector<FacetRow>& reflectances, std::vector<float>* block) {
  for (const LobeShares& lobe : all_shares()) {
    float largest = 0;
    for (const FacetRow& f : reflectances) {
      float e = 0;
      for (size_t j = 0; j < kFacetNodes; ++j)
        e += f[j] * (lobe.once[j] + f[j] * (lobe.compensated[j] - lobe.once[j]));
      largest = std::max(largest, e);
    }
    block->push_back(std::min(largest, 1.0f));
  }
}

}  // namespace

std::vector<float> film_block(const FilmOnBase& film) {
  const float grows = film.thickness_to - film.thickness_from;
  const float steps = std::min(std::abs(grows) * film.ior / kFilmStep, static_cast<float>(kMostFilms - 2));
  const int films = 2 + static_cast<int>(steps);
  std::vector<float> block{film.ior, film.thickness_from, grows, static_cast<float>(films)};
  const auto cosine = [](size_t j) { return static_cast<float>(j) / (kFacetNodes - 1); };
  std::vector<FacetRow> rows(3 * film.bases.size());
  const auto fill = [&](auto&& reflectance) {
    for (size_t b = 0; b < film.bases.size(); ++b) {
      for (size_t j = 0; j < kFacetNodes; ++j) {
        const Vec3<float> f = reflectance(film.bases[b], cosine(j));
        rows[3 * b][j] = f.x, rows[3 * b + 1][j] = f.y, rows[3 * b + 2][j] = f.z;
      }
    }
    append_albedos(rows, &block);
  };
  fill([](const FilmOnBase::Base& b, float c) {
    const float s = schlick_weight(c);
    const auto of = [&](float f0) { return f0 + (b.f90 - f0) * s; };
    return Vec3<float>{of(b.f0[0]), of(b.f0[1]), of(b.f0[2])};
  });
  for (int i = 0; i < films; ++i) {
    const float t = static_cast<float>(i) / static_cast<float>(films - 1);
    fill([&](const FilmOnBase::Base& b, float c) {
      return ThinFilm<float>(c, film.ior, film.thickness_from + grows * t)
          .reflectance({b.f0[0], b.f0[1], b.f0[2]});
    });
  }
  for (int row = 0; row < (films + 1) * kMetallicAlphas; ++row)
    block.push_back(hemispherical_mean(block.data() + kFilmHead + row * kCosineNodes, 1));
  block.resize((block.size() + kFilmAlign - 1) / kFilmAlign * kFilmAlign);
  return block;
}

}  // namespace lightmill
