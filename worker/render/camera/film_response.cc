#include "worker/render/camera/film_response.h"

namespace lightmill {

FilmResponse::FilmResponse(const FilmDescription& film) : most_(static_cast<float>(film.most)) {
  for (int i = 0; i < 9; ++i) {
    const double m = film.sensor[static_cast<size_t>(i)];
    m_[i] = static_cast<float>(m);
    mixes_ = mixes_ || m != (i % 4 == 0 ? 1 : 0);
    signed_ = signed_ || m < 0;
  }
}

}  // namespace lightmill
