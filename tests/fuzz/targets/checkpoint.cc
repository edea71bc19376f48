// Snapshots of films and of the error curve's batches, as read after a restart: as they are, and (since a
// digest guards them) what is inside, sealed anew.
#include <cstring>

#include "common/base/error.h"
#include "common/error/batch_film.h"
#include "common/film/film.h"
#include "common/film/packing.h"

namespace {

template <class T>
void restore(const std::string& bytes) {
  try {
    T::restore(bytes);
  } catch (const lightmill::Error&) {
  }
}

/// Seals `raw` as a valid snapshot is.
std::string sealed_as(const std::string& valid, std::string_view raw) {
  uint32_t head[2];
  std::memcpy(head, valid.data(), sizeof head);
  return lightmill::seal(head[0], head[1], raw);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace lightmill;
  static const FilmGrid grid{.width = 32, .height = 32, .crop = {0, 0, 32, 32}};
  static const std::string film = Film(grid).snapshot(), batches = BatchFilm(grid).snapshot();
  if (size == 0) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0] % 4) {
    case 0:
      restore<Film>(bytes);
      break;
    case 1:
      restore<BatchFilm>(bytes);
      break;
    case 2:
      restore<Film>(sealed_as(film, bytes));
      break;
    default:
      restore<BatchFilm>(sealed_as(batches, bytes));
  }
  return 0;
}
