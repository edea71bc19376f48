#pragma once
// A thin film on glTF's metallic-roughness material (KHR_materials_iridescence), over its dielectric and its
// metal alike and below coat and sheen.
//
// Both reflectances become those of film and base (thin_film.h), by the film's weight, and are blended as
// ever. Their lobe is F (1 + F (g g - 1)) k with F at the facet: reciprocal, and white where F is 1. The base
// gets what the largest channel of the dielectric's lobe leaves, as metallic_roughness.h has it, its albedo E
// from film_table.h; so no channel of the whole reflects more than it receives.
//
// Parameters: 0-2 base colour, 3 square roots of the dielectric's f0, 4 block of film_table.h / kFilmAlign,
// 5 thickness t and the film's weight, 6 alpha and the sheen's roughness, 7 f90 and metalness, 8 and 9 as of
// sheen.h and metallic_roughness.h.
#include "worker/render/bsdf/packed_params.h"
#include "worker/render/bsdf/sheen.h"
#include "worker/render/bsdf/tables/film_table.h"
#include "worker/render/bsdf/thin_film.h"

namespace lightmill {

template <class F>
class Iridescence {
 public:
  /// `params` of the kind; `base` is where sheen.h unpacked its part of them to, and receives the reflectance
  /// of the base as metallic_roughness.h has it.
  Iridescence(const BsdfParams<F>& params, MaskOf<F> of_kind, BsdfParams<F>* base)
      : tables_(params.tables), color_(params.rgb(0)), f90_(base->p[7]), metal_(base->p[8]) {
    f0_ = unpacked_color(params.p[3], of_kind);
    block_ = to_int(select(of_kind, params.p[4], F{})) * kFilmAlign;
    const UnpackedPair<F> pair(params.p[5], of_kind);
    const F t = pair.first;
    weight_ = pair.second;
    ior_ = head(0);
    thickness_ = head(1) + head(2) * t;
    const F films = select(of_kind, head(3), splat<F>(2.0f));
    const F row = t * (films - 1.0f);
    const IntOf<F> below = to_int(min(row, films - 2.0f));
    between_ = row - to_float(below);
    film_row_ = below + 1;
    const F alpha = sqrt(clamp(base->p[6], 0.0f, 1.0f)) * static_cast<float>(kMetallicAlphas - 1);
    alpha_row_ = to_int(min(alpha, splat<F>(kMetallicAlphas - 2)));
    between_alphas_ = alpha - to_float(alpha_row_);
    means_ = block_ + kFilmHead + (to_int(films) + 1) * kFilmRow;
    const F mean = film_and_bare([&](IntOf<F> film) {
      const IntOf<F> at = means_ + film * kMetallicAlphas + alpha_row_;
      return gather(tables_, at) * (1.0f - between_alphas_) + gather(tables_ + 1, at) * between_alphas_;
    });
    const F scale = (1.0f - metal_) / max(1.0f - mean, splat<F>(1e-6f));
    base->p[0] = color_.x * scale;
    base->p[1] = color_.y * scale;
    base->p[2] = color_.z * scale;
  }

  /// E of the dielectric's part.
  F albedo(F cosine) const {
    const CosinePlace<F> place(cosine);
    return film_and_bare([&](IntOf<F> film) {
      const IntOf<F> at = block_ + kFilmHead + film * kFilmRow + alpha_row_ * kCosineNodes;
      const F low = place.in(tables_, at), high = place.in(tables_, at + kCosineNodes);
      return low + (high - low) * between_alphas_;
    });
  }
  /// Of the whole lobe, nearly: for choices.
  F lobe_albedo(F dielectric) const { return dielectric + (max_component(color_) - dielectric) * metal_; }

  /// F at a facet's cosine.
  Vec3<F> reflectance(F cosine) const {
    const ThinFilm<F> film(cosine, ior_, thickness_);
    const F s = schlick_weight(cosine);
    const auto bare = [&](F f0, F f90) { return f0 + (f90 - f0) * s; };
    const F one = splat<F>(1.0f);
    const Vec3<F> over_dielectric = film.reflectance(f0_), over_metal = film.reflectance(color_);
    const auto blend = [&](F f0, F filmed, F color, F metal_filmed) {
      const F d0 = bare(f0, f90_), m0 = bare(color, one);
      const F d = d0 + (filmed - d0) * weight_, m = m0 + (metal_filmed - m0) * weight_;
      return d + (m - d) * metal_;
    };
    return {blend(f0_.x, over_dielectric.x, color_.x, over_metal.x),
            blend(f0_.y, over_dielectric.y, color_.y, over_metal.y),
            blend(f0_.z, over_dielectric.z, color_.z, over_metal.z)};
  }

 private:
  F head(int k) const { return gather(tables_ + k, block_); }
  template <class At>
  F film_and_bare(At&& at) const {
    const F bare = at(IntOf<F>{}), thinner = at(film_row_), thicker = at(film_row_ + 1);
    const F film = thinner + (thicker - thinner) * between_;
    return bare + (film - bare) * weight_;
  }

  const float* tables_;
  Vec3<F> color_, f0_{};
  F f90_, metal_, ior_{}, thickness_{}, weight_{}, between_{}, between_alphas_{};
  IntOf<F> block_{}, film_row_{}, alpha_row_{}, means_{};
};

}  // namespace lightmill
