#pragma once
// A layer of sums in a film's snapshot: whether it is there, its bytes in use, their planes.
#include <vector>

#include "common/film/packing.h"
#include "common/film/unit_planes.h"

namespace lightmill {

inline void put_stored_layer(const std::vector<ExactRgb>& layer, ByteWriter* out) {
  const ByteRange range = used_bytes(std::span(layer));
  out->put<uint8_t>(!layer.empty());
  out->put<uint8_t>(range.low);
  out->put<uint8_t>(range.high);
  append_planes(std::span(layer), range, &out->bytes());
}

/// Inverse; `pixels`: of a layer that is there.
inline std::vector<ExactRgb> get_stored_layer(size_t pixels, ByteReader* in) {
  const bool present = in->get<uint8_t>() != 0;
  ByteRange range;
  range.low = in->get<uint8_t>();
  range.high = in->get<uint8_t>();
  if (!range.valid()) in->fail("unknown layout");
  if (!present) return {};
  const std::string_view planes = in->get_bytes(plane_bytes(pixels, range));
  std::vector<ExactRgb> layer(pixels);
  read_planes(planes, range, std::span(layer));
  return layer;
}

}  // namespace lightmill
