#include "client/terminal/tev_packets.h"

#include <cstring>

#include "common/film/packing.h"

namespace lightmill::client {
namespace {

enum PacketType : uint8_t { kCreateImage = 4, kUpdateImageV3 = 6 };

void put_text(const std::string& text, ByteWriter* w) {
  w->put_bytes(text.substr(0, text.find('\0')));
  w->put<uint8_t>(0);
}

ByteWriter begin(PacketType type, const std::string& name) {
  ByteWriter w;
  w.put<uint32_t>(0);  // the length, filled in at the end
  w.put<uint8_t>(type);
  w.put<uint8_t>(0);  // do not bring the window to the front
  put_text(name, &w);
  return w;
}

void put_channels(ByteWriter* w) {
  w->put<int32_t>(3);
  for (const char* channel : {"R", "G", "B"}) put_text(channel, w);
}

std::string finish(ByteWriter w) {
  const auto length = static_cast<uint32_t>(w.bytes().size());
  std::memcpy(w.bytes().data(), &length, sizeof length);
  return std::move(w.bytes());
}

}  // namespace

std::string tev_create_image(const std::string& name, int width, int height) {
  ByteWriter w = begin(kCreateImage, name);
  w.put<int32_t>(width);
  w.put<int32_t>(height);
  put_channels(&w);
  return finish(std::move(w));
}

std::string tev_update_rows(const std::string& name, const Image& image, int y0, int y1) {
  ByteWriter w = begin(kUpdateImageV3, name);
  put_channels(&w);
  for (const int v : {0, y0, image.width, y1 - y0}) w.put<int32_t>(v);
  for (const int64_t offset : {0, 1, 2}) w.put<int64_t>(offset);  // of a channel's first value, in floats
  for (int c = 0; c < 3; ++c) w.put<int64_t>(image.channels);     // from one value to the next
  const size_t row = static_cast<size_t>(image.width) * static_cast<size_t>(image.channels);
  w.put_bytes({reinterpret_cast<const char*>(&image.data[static_cast<size_t>(y0) * row]),
               static_cast<size_t>(y1 - y0) * row * sizeof(float)});
  return finish(std::move(w));
}

}  // namespace lightmill::client
