#include <OpenImageIO/imagecache.h>

#include <memory>

#include "common/image/openimageio/functions.h"

namespace lightmill {

struct ImageTiles {
  OIIO::ImageCache* cache = OIIO::ImageCache::create(false);
  ~ImageTiles() { OIIO::ImageCache::destroy(cache); }
};

namespace openimageio {
namespace {

/// Side of the tiles that images without tiles are cut into.
constexpr int kTileSide = 64;

OIIO::ImageCache::ImageHandle* image_of(void* handle) {
  return static_cast<OIIO::ImageCache::ImageHandle*>(handle);
}

}  // namespace

ImageTiles* make_tiles(uint64_t max_bytes) {
  auto tiles = std::make_unique<ImageTiles>();
  OIIO::ImageCache& cache = *tiles->cache;
  cache.attribute("max_memory_MB", static_cast<float>(max_bytes) / (1 << 20));
  cache.attribute("autotile", kTileSide);
  cache.attribute("autoscanline", 0);
  cache.attribute("unassociatedalpha", 1);  // colours not multiplied by alpha
  cache.attribute("failure_retries", 0);
  return tiles.release();
}

void free_tiles(ImageTiles* tiles) { delete tiles; }

void* open_tiled(ImageTiles& tiles, const std::string& path, int* x, int* y, std::string* why) {
  OIIO::ImageCache& cache = *tiles.cache;
  auto* const image = cache.get_image_handle(OIIO::ustring(path));
  OIIO::ImageSpec spec;
  if (!image || !cache.good(image) || !cache.get_imagespec(image, nullptr, spec)) {
    *why = cache.geterror();
    return nullptr;
  }
  *x = spec.x;
  *y = spec.y;
  return image;
}

std::string tiled_path(ImageTiles& tiles, void* handle) {
  return tiles.cache->filename_from_handle(image_of(handle)).string();
}

bool read_tiled(ImageTiles& tiles, void* handle, const TexelRegion& region, TexelType type, void* out,
                std::string* why) {
  if (tiles.cache->get_pixels(image_of(handle), nullptr, 0, 0, region.x0, region.x1, region.y0, region.y1, 0,
                              1, region.first, region.first + region.channels, type_of(type), out))
    return true;
  *why = tiles.cache->geterror();
  return false;
}

}  // namespace openimageio
}  // namespace lightmill
