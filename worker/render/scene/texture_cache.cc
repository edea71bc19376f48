#include "worker/render/scene/texture_cache.h"

#include <OpenImageIO/imagecache.h>

#include <algorithm>
#include <atomic>
#include <mutex>

#include "common/error.h"

namespace lightmill {
namespace {

/// Side of the tiles that images without tiles are cut into.
constexpr int kTileSide = 64;

}  // namespace

struct TextureCache::Impl {
  OIIO::ImageCache* cache = OIIO::ImageCache::create(false);
  std::atomic<bool> failed{false};
  mutable std::mutex mutex;
  std::string failure;  // the first

  ~Impl() { OIIO::ImageCache::destroy(cache); }

  template <class Value>
  bool read(const File& file, int x0, int x1, int y0, int y1, int first, int channels, OIIO::TypeDesc type,
            Value* out) {
    auto* const handle = static_cast<OIIO::ImageCache::ImageHandle*>(file.handle);
    if (cache->get_pixels(handle, nullptr, 0, 0, file.x + x0, file.x + x1, file.y + y0, file.y + y1, 0, 1,
                          first, first + channels, type, out))
      return true;
    std::fill_n(out,
                static_cast<size_t>(x1 - x0) * static_cast<size_t>(y1 - y0) * static_cast<size_t>(channels),
                Value{0});
    const std::string why = cache->geterror();
    const std::lock_guard lock(mutex);
    if (!failed.exchange(true))
      failure = cache->filename_from_handle(handle).string() + ": texture can't be read: " + why;
    return false;
  }
};

TextureCache::TextureCache(uint64_t max_bytes) : impl_(std::make_unique<Impl>()) {
  OIIO::ImageCache& cache = *impl_->cache;
  cache.attribute("max_memory_MB", static_cast<float>(std::max(max_bytes, kLeastBytes)) / (1 << 20));
  cache.attribute("autotile", kTileSide);
  cache.attribute("autoscanline", 0);
  cache.attribute("unassociatedalpha", 1);  // colours not multiplied by alpha
  cache.attribute("failure_retries", 0);
}

TextureCache::~TextureCache() = default;

TextureCache::File TextureCache::open(const std::string& path) {
  File file;
  auto* const handle = impl_->cache->get_image_handle(OIIO::ustring(path));
  OIIO::ImageSpec spec;
  if (!handle || !impl_->cache->good(handle) || !impl_->cache->get_imagespec(handle, nullptr, spec))
    throw Error(ErrorKind::kBadScene, path + ": texture can't be read: " + impl_->cache->geterror());
  return {handle, spec.x, spec.y};
}

bool TextureCache::read(const File& file, int x0, int x1, int y0, int y1, int first_channel, int channels,
                        uint8_t* out) {
  return impl_->read(file, x0, x1, y0, y1, first_channel, channels, OIIO::TypeDesc::UINT8, out);
}
bool TextureCache::read(const File& file, int x0, int x1, int y0, int y1, int first_channel, int channels,
                        float* out) {
  return impl_->read(file, x0, x1, y0, y1, first_channel, channels, OIIO::TypeDesc::FLOAT, out);
}

void TextureCache::throw_if_failed() const {
  if (!impl_->failed.load(std::memory_order_relaxed)) return;
  const std::lock_guard lock(impl_->mutex);
  throw Error(ErrorKind::kBadScene, impl_->failure);
}

}  // namespace lightmill
