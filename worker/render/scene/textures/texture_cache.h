#pragma once
// Images of which only the tiles in use are in memory, within a bound. A tile holds what the file holds. So a
// texel's bits depend neither on the bound nor on which tiles are there.
#include <cstdint>
#include <memory>
#include <string>

namespace lightmill {

class TextureCache {
 public:
  /// Where an image's data begin, and its name in the cache.
  struct File {
    void* handle = nullptr;
    int x = 0, y = 0;
  };

  /// Keeps up to `max_bytes` of tiles, but at least kLeastBytes.
  explicit TextureCache(uint64_t max_bytes);
  ~TextureCache();
  TextureCache(const TextureCache&) = delete;
  TextureCache& operator=(const TextureCache&) = delete;
  static constexpr uint64_t kLeastBytes = uint64_t{10} << 20;  // what OpenImageIO takes at least

  /// Throws Error(kBadScene) if the image can't be opened.
  File open(const std::string& path);
  /// Reads texels [x0, x1) x [y0, y1), which lie inside, of `channels` channels from `first_channel`, row by
  /// row. Thread-safe. Returns false if they can't be read: then they are 0, and throw_if_failed() says so.
  bool read(const File& file, int x0, int x1, int y0, int y1, int first_channel, int channels, uint8_t* out);
  bool read(const File& file, int x0, int x1, int y0, int y1, int first_channel, int channels, float* out);
  /// Throws Error(kBadScene) with the first failure of read().
  void throw_if_failed() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightmill
