#include "worker/render/scene/textures/texture_cache.h"

#include <algorithm>
#include <atomic>
#include <mutex>

#include "common/base/error.h"
#include "common/image/image_library.h"

namespace lightmill {

struct TextureCache::Impl {
  const ImageLibrary& library = image_library();
  ImageTiles* const tiles;
  std::atomic<bool> failed{false};
  mutable std::mutex mutex;
  std::string failure;  // the first

  explicit Impl(uint64_t max_bytes) : tiles(library.make_tiles(std::max(max_bytes, kLeastBytes))) {}
  ~Impl() { library.free_tiles(tiles); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  template <class Value>
  bool read(const File& file, int x0, int x1, int y0, int y1, int first, int channels, TexelType type,
            Value* out) {
    const TexelRegion region{file.x + x0, file.x + x1, file.y + y0, file.y + y1, first, channels};
    std::string why;
    if (library.read_tiled(*tiles, file.handle, region, type, out, &why)) return true;
    std::fill_n(out,
                static_cast<size_t>(x1 - x0) * static_cast<size_t>(y1 - y0) * static_cast<size_t>(channels),
                Value{0});
    const std::lock_guard lock(mutex);
    if (!failed.exchange(true))
      failure = library.tiled_path(*tiles, file.handle) + ": texture can't be read: " + why;
    return false;
  }
};

TextureCache::TextureCache(uint64_t max_bytes) : impl_(std::make_unique<Impl>(max_bytes)) {}

TextureCache::~TextureCache() = default;

TextureCache::File TextureCache::open(const std::string& path) {
  File file;
  std::string why;
  file.handle = impl_->library.open_tiled(*impl_->tiles, path, &file.x, &file.y, &why);
  if (!file.handle) throw Error(ErrorKind::kBadScene, path + ": texture can't be read: " + why);
  return file;
}

bool TextureCache::read(const File& file, int x0, int x1, int y0, int y1, int first_channel, int channels,
                        uint8_t* out) {
  return impl_->read(file, x0, x1, y0, y1, first_channel, channels, TexelType::kBytes, out);
}
bool TextureCache::read(const File& file, int x0, int x1, int y0, int y1, int first_channel, int channels,
                        float* out) {
  return impl_->read(file, x0, x1, y0, y1, first_channel, channels, TexelType::kFloats, out);
}

void TextureCache::throw_if_failed() const {
  if (!impl_->failed.load(std::memory_order_relaxed)) return;
  const std::lock_guard lock(impl_->mutex);
  throw Error(ErrorKind::kBadScene, impl_->failure);
}

}  // namespace lightmill
