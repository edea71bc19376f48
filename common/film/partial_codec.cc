// The encoding of a partial.
//
//   magic, schema                                         8 bytes
//   content head: grid, tile, quantum, counts, layout     fixed size, part of the content digest
//     and, if anything was dropped, its count by kind     40 bytes more
//   cpu_seconds, payload size                             16 bytes
//   amounts of what was dropped, by kind, if anything was 40 bytes
//   content digest: SHA-256(content head, payload)        64 hex digits
//   head digest: SHA-256 of all of the above              64 hex digits
//   zstd frame of the payload: camera planes, sparse pixels, splat planes (unit_planes.h), counts for
//   Cryptomatte (cryptomatte/matte_codec.cc), AOVs (aov_codec.cc)
//
// The layout (byte ranges, sparse or dense) is a function of the content and decoding refuses any other, so
// the digest names the content, not one of its spellings. Where nothing was dropped the bytes are those of
// versions that did not tell the kinds apart, and theirs are read where something was.
#include <memory>
#include <utility>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/film/crop_walk.h"
#include "common/film/packing.h"
#include "common/film/partial.h"
#include "common/film/partial_check.h"
#include "common/film/partial_decoder.h"
#include "common/film/unit_planes.h"

namespace lightmill {

namespace {

constexpr uint32_t kPartialMagic = 0x74706d4c;  // "Lmpt"
constexpr const char* kPartial = "partial";
constexpr int kZstdLevel = 1;
constexpr size_t kSha256Bytes = 64;
constexpr int kHasCamera = 1, kHasAovs = 2, kHasDropped = 4, kHasMattes = 8;  // what is there

enum class SplatForm : uint8_t { kNone = 0, kSparse = 1, kDense = 2 };

struct Layout {
  bool has_camera = false;
  bool has_aovs = false;
  bool has_dropped = false;
  bool has_mattes = false;
  ByteRange camera_range, splat_range;
  SplatForm splat_form = SplatForm::kNone;
  uint64_t splat_count = 0;
  bool operator==(const Layout&) const = default;
};

size_t varint_bytes(uint64_t value) {
  size_t bytes = 1;
  while (value >>= 7) ++bytes;
  return bytes;
}

/// `units`: those of the layers' sums, or'd together.
Layout layout_of(const Partial& p, const LayerUnits& units) {
  Layout layout;
  layout.has_camera = !p.camera.empty();
  layout.has_aovs = p.aovs.spec.set != 0;
  layout.has_dropped = p.dropped.any();
  layout.has_mattes = !p.mattes.cells.empty();
  layout.camera_range = used_bytes(units.camera);
  layout.splat_range = used_bytes(units.splats);
  layout.splat_count = p.splats.size();
  if (p.splats.empty()) return layout;
  const size_t dense = plane_bytes(static_cast<size_t>(p.grid.crop.area()), layout.splat_range);
  size_t sparse = plane_bytes(p.splats.size(), layout.splat_range);
  layout.splat_form = SplatForm::kDense;
  if (sparse + p.splats.size() >= dense) return layout;  // gaps take a byte each at least
  int64_t last = -1;
  for (const Partial::SplatSum& splat : p.splats) {
    sparse += varint_bytes(static_cast<uint64_t>(splat.pixel - last - 1));
    last = splat.pixel;
  }
  if (sparse < dense) layout.splat_form = SplatForm::kSparse;
  return layout;
}

std::string content_head(const Partial& p, const Layout& layout) {
  ByteWriter w;
  const FilmGrid& g = p.grid;
  const CellRect& c = p.tile.cells;
  for (const int v : {g.width, g.height, g.crop.x0, g.crop.y0, g.crop.x1, g.crop.y1, c.x0, c.y0, c.x1, c.y1,
                      p.quantum_exponent}) {
    w.put<int32_t>(v);
  }
  w.put<int64_t>(p.tile.sample_begin);
  w.put<int64_t>(p.tile.sample_end);
  const RenderCounters& n = p.counters;
  for (const uint64_t v :
       {p.light_paths, n.camera_paths, n.light_paths, n.closest_hit_rays, n.shadow_rays,
        n.zero_connections_skipped, n.rouletted_connections, n.nonfinite, layout.splat_count}) {
    w.put<uint64_t>(v);
  }
  w.put<uint8_t>(
      static_cast<uint8_t>((layout.has_camera ? kHasCamera : 0) | (layout.has_aovs ? kHasAovs : 0) |
                           (layout.has_dropped ? kHasDropped : 0) | (layout.has_mattes ? kHasMattes : 0)));
  w.put<uint8_t>(static_cast<uint8_t>(layout.splat_form));
  for (const ByteRange& range : {layout.camera_range, layout.splat_range}) {
    w.put<uint8_t>(range.low);
    w.put<uint8_t>(range.high);
  }
  if (layout.has_dropped) {
    for (const Dropped::Kind& kind : p.dropped.kinds) w.put<uint64_t>(kind.count);
  }
  return std::move(w.bytes());
}

Layout read_content_head(ByteReader* in, Partial* p) {
  FilmGrid& g = p->grid;
  CellRect& c = p->tile.cells;
  for (int* v : {&g.width, &g.height, &g.crop.x0, &g.crop.y0, &g.crop.x1, &g.crop.y1, &c.x0, &c.y0, &c.x1,
                 &c.y1, &p->quantum_exponent}) {
    *v = in->get<int32_t>();
  }
  p->tile.sample_begin = in->get<int64_t>();
  p->tile.sample_end = in->get<int64_t>();
  RenderCounters& n = p->counters;
  Layout layout;
  for (uint64_t* v :
       {&p->light_paths, &n.camera_paths, &n.light_paths, &n.closest_hit_rays, &n.shadow_rays,
        &n.zero_connections_skipped, &n.rouletted_connections, &n.nonfinite, &layout.splat_count}) {
    *v = in->get<uint64_t>();
  }
  const auto present = in->get<uint8_t>();
  const auto form = in->get<uint8_t>();
  if (present > (kHasCamera | kHasAovs | kHasDropped | kHasMattes) || form > 2) in->fail("unknown layout");
  layout.has_camera = present & kHasCamera;
  layout.has_aovs = present & kHasAovs;
  layout.has_dropped = present & kHasDropped;
  layout.has_mattes = present & kHasMattes;
  layout.splat_form = static_cast<SplatForm>(form);
  for (ByteRange* range : {&layout.camera_range, &layout.splat_range}) {
    range->low = in->get<uint8_t>();
    range->high = in->get<uint8_t>();
    if (!range->valid()) in->fail("unknown layout");
  }
  if (layout.has_dropped) {
    for (Dropped::Kind& kind : p->dropped.kinds) kind.count = in->get<uint64_t>();
    if (!p->dropped.any()) in->fail("unknown layout");
  }
  return layout;
}

/// Gaps between the splats' pixels.
std::string gaps(const Partial& p) {
  ByteWriter w;
  int64_t last = -1;
  for (const Partial::SplatSum& splat : p.splats) {
    w.put_varint(static_cast<uint64_t>(splat.pixel - last - 1));
    last = splat.pixel;
  }
  return std::move(w.bytes());
}

/// The payload, piece by piece: a layer as a whole would be as large as the partial once more.
class Payload {
 public:
  Payload(const Partial& p, const Layout& layout) : p_(p), layout_(layout) {
    if (layout.splat_form == SplatForm::kSparse) gaps_ = gaps(p);
    ByteWriter mattes;
    if (layout.has_mattes) encode_mattes(p.mattes, &mattes);
    mattes_ = std::move(mattes.bytes());
    if (layout.has_aovs) aovs_ = encode_aovs(p.aovs);
  }
  size_t size() const {
    const size_t splats =
        layout_.splat_form == SplatForm::kDense ? static_cast<size_t>(p_.grid.crop.area()) : p_.splats.size();
    return plane_bytes(p_.camera.size(), layout_.camera_range) + gaps_.size() +
           plane_bytes(splats, layout_.splat_range) + mattes_.size() + aovs_.size();
  }
  void for_pieces(const TakeBytes& take) const {
    for_planes(std::span(p_.camera), layout_.camera_range, take);
    if (layout_.splat_form == SplatForm::kSparse) {
      take(gaps_);
      for_planes(std::span(p_.splats), layout_.splat_range, take);
    } else if (layout_.splat_form == SplatForm::kDense) {
      const auto place = [crop_index = CropWalk(p_.grid)](const Partial::SplatSum& splat) mutable {
        return static_cast<size_t>(crop_index(splat.pixel));
      };
      for_planes(std::span(p_.splats), layout_.splat_range, static_cast<size_t>(p_.grid.crop.area()), place,
                 take);
    }
    take(mattes_);
    take(aovs_);
  }

 private:
  const Partial& p_;
  const Layout& layout_;
  std::string gaps_, mattes_, aovs_;
};

/// Bounds of the payload's size that the head allows.
struct SizeBounds {
  size_t low = 0, high = 0;
};
SizeBounds payload_bounds(const Partial& p, const Layout& layout) {
  const auto tile_area = static_cast<size_t>(p.grid.pixels(p.tile.cells).area());
  const auto crop_area = static_cast<size_t>(p.grid.crop.area());
  const size_t camera = layout.has_camera ? plane_bytes(tile_area, layout.camera_range) : 0;
  if (layout.splat_count > crop_area) refuse_partial("more splats than pixels");
  if ((layout.splat_count == 0) != (layout.splat_form == SplatForm::kNone))
    refuse_partial("splat layer without splats");
  const auto count = static_cast<size_t>(layout.splat_count);
  switch (layout.splat_form) {
    case SplatForm::kNone:
      return {camera, camera};
    case SplatForm::kSparse: {
      const size_t planes = plane_bytes(count, layout.splat_range);
      return {camera + planes + count, camera + planes + 5 * count};
    }
    case SplatForm::kDense: {
      const size_t planes = plane_bytes(crop_area, layout.splat_range);
      return {camera + planes, camera + planes};
    }
  }
  refuse_partial("unknown layout");
}

void read_splats(ByteReader* in, const Layout& layout, Partial* p) {
  if (layout.splat_form != SplatForm::kSparse) p->splats.clear();
  if (layout.splat_form == SplatForm::kSparse) {
    p->splats.resize(static_cast<size_t>(layout.splat_count));
    const auto pixels = static_cast<uint64_t>(p->grid.width) * static_cast<uint64_t>(p->grid.height);
    uint64_t next = 0;
    for (Partial::SplatSum& splat : p->splats) {
      const uint64_t delta = in->get_varint();
      if (delta >= pixels || next + delta >= pixels) refuse_partial("splat outside the film");
      splat.pixel = static_cast<uint32_t>(next + delta);
      next = uint64_t{splat.pixel} + 1;
    }
    const size_t size = plane_bytes(p->splats.size(), layout.splat_range);
    read_planes(in->get_bytes(size), layout.splat_range, std::span(p->splats));
  } else if (layout.splat_form == SplatForm::kDense) {
    const PixelRect& crop = p->grid.crop;
    const auto area = static_cast<size_t>(crop.area()), count = static_cast<size_t>(layout.splat_count);
    PlaneStrips strips(in->get_bytes(plane_bytes(area, layout.splat_range)), layout.splat_range, area);
    p->splats.reserve(count);
    const auto width = static_cast<uint32_t>(p->grid.width);
    int x = crop.x0, y = crop.y0;
    for (auto sums = strips.next(); !sums.empty(); sums = strips.next()) {
      for (const ExactRgb& sum : sums) {
        if (!sum.is_zero()) {
          if (p->splats.size() == count) refuse_partial("wrong number of splats");
          p->splats.push_back({static_cast<uint32_t>(y) * width + static_cast<uint32_t>(x), sum});
        }
        if (++x == crop.x1) {
          x = crop.x0;
          ++y;
        }
      }
    }
    if (p->splats.size() != count) refuse_partial("wrong number of splats");
  }
}

std::string content_digest(const std::string& head, std::string_view payload) {
  Sha256 hash;
  hash.update(head);
  hash.update(payload);
  return hash.hex();
}

/// What stands before the zstd frame.
struct Header {
  Partial partial;  // without layers
  Layout layout;
  size_t payload_size = 0;
  std::string digest;
  std::string_view frame;
};

Header read_header(std::string_view bytes) {
  ByteReader in(bytes, kPartial);
  Header h;
  if (in.get<uint32_t>() != kPartialMagic) in.fail("wrong magic word");
  const auto schema = in.get<int32_t>();
  if (schema != kPartialSchema && schema != kPlainPartialSchema) {
    in.fail("schema " + std::to_string(schema) + ", this program reads " + std::to_string(kPartialSchema));
  }
  h.partial.grid.interleaved = schema == kPartialSchema;
  h.layout = read_content_head(&in, &h.partial);
  h.partial.cpu_seconds = in.get<double>();
  h.payload_size = in.get<uint64_t>();
  if (h.layout.has_dropped) {
    for (Dropped::Kind& kind : h.partial.dropped.kinds) kind.amount = in.get<double>();
  }
  h.digest = in.get_bytes(kSha256Bytes);
  const std::string_view head = bytes.substr(0, bytes.size() - in.rest().size());
  if (in.get_bytes(kSha256Bytes) != sha256_hex(head)) in.fail("wrong digest of its head");
  h.frame = in.rest();
  check_partial_head(h.partial);
  return h;
}

/// Into `p`, whose layers may hold what was decoded before.
void decode_layers(const Header& h, size_t most_groups, Aovs most, ReusedBytes* buffer, Partial* out) {
  const SizeBounds bounds = payload_bounds(h.partial, h.layout);
  const auto tile_area = static_cast<size_t>(h.partial.grid.pixels(h.partial.tile.cells).area());
  const size_t aov_bytes =
      h.layout.has_aovs ? max_aov_bytes(tile_area, h.partial.grid, most_groups, most) : 0;
  if (h.layout.has_mattes && !(most & kAovsOfCounts))
    refuse_partial("counts for Cryptomatte that nobody asked for");
  const auto cells = static_cast<size_t>(h.partial.tile.cells.count());
  const uint64_t counts = most_matte_counts(tile_area, h.partial.tile.samples());
  const size_t matte_bytes = h.layout.has_mattes ? max_matte_bytes(cells, counts) : 0;
  if (h.payload_size < bounds.low || h.payload_size > bounds.high + matte_bytes + aov_bytes)
    refuse_partial("payload of a size that does not fit");
  const std::span<char> unpacked = buffer->of(h.payload_size);
  zstd_unpack(h.frame, unpacked, kPartial);
  const std::string_view payload(unpacked.data(), unpacked.size());
  if (content_digest(content_head(h.partial, h.layout), payload) != h.digest) {
    throw Error(ErrorKind::kFailed, "partial is corrupt: wrong digest");
  }
  ByteReader in(payload, kPartial);
  Partial& p = *out;
  std::vector<ExactRgb> camera = std::move(p.camera);
  std::vector<SplatSum> splats = std::move(p.splats);
  p = h.partial;
  p.camera = std::move(camera);
  p.splats = std::move(splats);
  p.camera.resize(h.layout.has_camera ? tile_area : 0);
  if (h.layout.has_camera) {
    const size_t size = plane_bytes(p.camera.size(), h.layout.camera_range);
    read_planes(in.get_bytes(size), h.layout.camera_range, std::span(p.camera));
  }
  read_splats(&in, h.layout, &p);
  if (h.layout.has_mattes) p.mattes = decode_mattes(&in, cells, counts);
  if (h.layout.has_aovs) {
    p.aovs = decode_aovs(in.rest(), tile_area, p.grid, most_groups, most);
  } else {
    in.expect_end();
  }
  const LayerUnits units = check_partial_layers(p);
  if (layout_of(p, units) != h.layout) refuse_partial("not in its canonical layout");
}

/// Throws if the bytes are not of this grid and tile.
Header read_header(std::string_view bytes, const FilmGrid& grid, const TileSpec& tile) {
  Header header = read_header(bytes);
  if (header.partial.grid != grid) refuse_partial("rendered for another film");
  if (header.partial.tile != tile) refuse_partial("rendered for another tile");
  return header;
}

Partial decoded(const Header& header) {
  ReusedBytes buffer;
  Partial partial;
  decode_layers(header, kMaxLightGroups, kAllAovs, &buffer, &partial);
  return partial;
}

}  // namespace

std::string encode_partial(const Partial& partial) {
  check_partial_head(partial);
  const Layout layout = layout_of(partial, check_partial_layers(partial));
  const Payload payload(partial, layout);
  const std::string head = content_head(partial, layout);
  ByteWriter w;
  w.put<uint32_t>(kPartialMagic);
  w.put<int32_t>(partial.grid.interleaved ? kPartialSchema : kPlainPartialSchema);
  w.put_bytes(head);
  w.put<double>(partial.cpu_seconds);
  w.put<uint64_t>(payload.size());
  if (layout.has_dropped) {
    for (const Dropped::Kind& kind : partial.dropped.kinds) w.put<double>(kind.amount);
  }
  std::string& bytes = w.bytes();
  const size_t digests_at = bytes.size();
  bytes.append(2 * kSha256Bytes, '0');  // known once the payload has gone through
  Sha256 content;
  content.update(head);
  ZstdStream frame(payload.size(), kZstdLevel, &bytes);
  payload.for_pieces([&](std::string_view piece) {
    content.update(piece);
    frame.write(piece);
  });
  frame.end();
  bytes.replace(digests_at, kSha256Bytes, content.hex());
  const std::string_view head_bytes = std::string_view(bytes).substr(0, digests_at + kSha256Bytes);
  bytes.replace(digests_at + kSha256Bytes, kSha256Bytes, sha256_hex(head_bytes));
  return std::move(bytes);
}

Partial decode_partial(std::string_view bytes) { return decoded(read_header(bytes)); }

Partial decode_partial(std::string_view bytes, const FilmGrid& grid, const TileSpec& tile) {
  return decoded(read_header(bytes, grid, tile));
}

const Partial& PartialDecoder::decode(std::string_view bytes, const FilmGrid& grid, const TileSpec& tile,
                                      size_t most_groups, Aovs most) {
  decode_layers(read_header(bytes, grid, tile), most_groups, most, &payload_, &partial_);
  return partial_;
}

size_t PartialDecoder::bytes() const {
  size_t aovs = partial_.aovs.direct_splats.capacity() * sizeof(SplatSum);
  for (const auto& layer : partial_.aovs.layers) aovs += layer.capacity() * sizeof(ExactRgb);
  for (const std::vector<GroupSums>* parts : {&partial_.aovs.groups, &partial_.aovs.lobes}) {
    for (const GroupSums& part : *parts)
      aovs += part.camera.capacity() * sizeof(ExactRgb) + part.splats.capacity() * sizeof(SplatSum);
  }
  for (const MatteCell& cell : partial_.mattes.cells)
    aovs += cell.ends.capacity() * sizeof(uint32_t) + cell.counts.capacity() * sizeof(MatteCount);
  return partial_.camera.capacity() * sizeof(ExactRgb) + partial_.splats.capacity() * sizeof(SplatSum) +
         aovs + payload_.capacity();
}

std::string partial_digest(const Partial& partial) {
  const Layout layout = layout_of(partial, check_partial_layers(partial));
  Sha256 content;
  content.update(content_head(partial, layout));
  Payload(partial, layout).for_pieces([&](std::string_view piece) { content.update(piece); });
  return content.hex();
}

std::string encoded_digest(std::string_view bytes) { return read_header(bytes).digest; }

}  // namespace lightmill
