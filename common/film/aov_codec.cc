// The bytes of AOV layers:
//
//   set (packed_set), frame                      32 bytes
//   with kAovLightGroups: the groups' names     byte of length, text
//   per layer of the set: byte range, planes    (unit_planes.h)
//   direct splats: count, byte range, gaps between their pixels as varints, planes
//   per light group but the last: as a layer, and as direct splats
//   with kAovLobes: the same per lobe but the last
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/error.h"
#include "common/film/aov_layers.h"
#include "common/film/crop_walk.h"
#include "common/film/packing.h"
#include "common/film/partial.h"
#include "common/film/partial_check.h"
#include "common/film/signed_sum.h"
#include "common/film/unit_planes.h"

namespace lightmill {

namespace {

constexpr const char* kAovPartial = "partial";
constexpr size_t kHeadBytes = 32, kRangeBytes = 2, kCountBytes = 8, kMaxVarint = 5;
constexpr size_t kSumBytes = 3 * sizeof(Units);
constexpr int kMaxScaleExponent = 1100;  // beyond any double's

void put_range(ByteRange range, ByteWriter* w) {
  w->put<uint8_t>(range.low);
  w->put<uint8_t>(range.high);
}

ByteRange get_range(ByteReader* in) {
  ByteRange range;
  range.low = in->get<uint8_t>();
  range.high = in->get<uint8_t>();
  if (!range.valid()) refuse_partial("unknown layout of an AOV");
  return range;
}

void write_layer(const std::vector<ExactRgb>& values, ByteWriter* w) {
  const ByteRange range = used_bytes(std::span(values));
  put_range(range, w);
  append_planes(std::span(values), range, &w->bytes());
}

void read_layer(ByteReader* in, size_t tile_pixels, std::vector<ExactRgb>* values) {
  const ByteRange range = get_range(in);
  const std::string_view planes = in->get_bytes(plane_bytes(tile_pixels, range));
  values->resize(tile_pixels);
  read_planes(planes, range, std::span(*values));
  if (used_bytes(std::span(std::as_const(*values))) != range)
    refuse_partial("an AOV is not in its canonical layout");
}

void write_splats(const std::vector<SplatSum>& splats, ByteWriter* w) {
  w->put<uint64_t>(splats.size());
  const ByteRange range = used_bytes(std::span(splats));
  put_range(range, w);
  int64_t last = -1;
  for (const SplatSum& splat : splats) {
    w->put_varint(static_cast<uint64_t>(splat.pixel - last - 1));
    last = splat.pixel;
  }
  append_planes(std::span(splats), range, &w->bytes());
}

void read_splats(ByteReader* in, const FilmGrid& grid, std::vector<SplatSum>* splats) {
  const auto count = in->get<uint64_t>();
  if (count > static_cast<uint64_t>(grid.crop.area())) refuse_partial("more splats than pixels");
  const ByteRange range = get_range(in);
  // Each takes a byte at least: the count must not make us allocate what was never sent.
  if (count > in->rest().size()) refuse_partial("splats that are not there");
  splats->resize(static_cast<size_t>(count));
  const auto pixels = static_cast<uint64_t>(grid.width) * static_cast<uint64_t>(grid.height);
  uint64_t next = 0;
  for (SplatSum& splat : *splats) {
    const uint64_t gap = in->get_varint();
    if (gap >= pixels || next + gap >= pixels) refuse_partial("splat of an AOV outside the film");
    splat.pixel = static_cast<uint32_t>(next + gap);
    next = uint64_t{splat.pixel} + 1;
  }
  read_planes(in->get_bytes(plane_bytes(splats->size(), range)), range, std::span(*splats));
  if (used_bytes(std::span(std::as_const(*splats))) != range)
    refuse_partial("an AOV is not in its canonical layout");
}

LightGroups read_groups(ByteReader* in, size_t most) {
  const auto count = size_t{in->get<uint8_t>()};
  if (count > std::min(most, kMaxLightGroups)) refuse_partial("more light groups than the scene has");
  LightGroups groups(count);
  for (std::string& name : groups) name = in->get_bytes(in->get<uint8_t>());
  if (!valid_light_groups(groups)) refuse_partial("unknown light groups");
  return groups;
}

bool within(const ExactRgb& part, const ExactRgb& whole) {
  const auto at_most = [](Units a, Units b) { return static_cast<__int128>(a) <= static_cast<__int128>(b); };
  return at_most(part.c[0], whole.c[0]) && at_most(part.c[1], whole.c[1]) && at_most(part.c[2], whole.c[2]);
}

void check_direct_splats(const std::vector<SplatSum>& direct, const std::vector<SplatSum>& splats) {
  auto whole = splats.begin();
  int64_t last = -1;
  for (const SplatSum& splat : direct) {
    if (int64_t{splat.pixel} <= last) refuse_partial("direct splats are not in ascending order");
    last = splat.pixel;
    while (whole != splats.end() && whole->pixel < splat.pixel) ++whole;
    if (whole == splats.end() || whole->pixel != splat.pixel || !within(splat.sum, whole->sum) ||
        splat.sum.is_zero()) {
      refuse_partial("more direct light than light");
    }
  }
}

void write_parts(const std::vector<GroupSums>& parts, ByteWriter* w) {
  for (const GroupSums& part : parts) {
    write_layer(part.camera, w);
    write_splats(part.splats, w);
  }
}

void read_parts(ByteReader* in, size_t tile_pixels, const FilmGrid& grid, std::vector<GroupSums>* parts) {
  for (GroupSums& part : *parts) {
    read_layer(in, tile_pixels, &part.camera);
    read_splats(in, grid, &part.splats);
  }
}

/// Of a signed film they may be larger than the whole, which groups and lobes cancel in.
void check_part_splats(const std::vector<SplatSum>& splats, const FilmGrid& grid) {
  CropWalk crop_index(grid);
  int64_t last = -1;
  for (const SplatSum& splat : splats) {
    if (int64_t{splat.pixel} <= last) refuse_partial("splats of a part of light are not in ascending order");
    last = splat.pixel;
    if (crop_index(splat.pixel) < 0) refuse_partial("splat of a part of light outside the crop window");
    if (splat.sum.is_zero()) refuse_partial("splat of zero");
    for (const Units u : splat.sum.c) {
      if (magnitude(u) >> kMaxSumBits) refuse_partial("splat sum of a part of light out of range");
    }
  }
}

}  // namespace

std::string encode_aovs(const AovSums& sums) {
  ByteWriter w;
  w.put<uint32_t>(packed_set(sums.spec));
  w.put<int32_t>(sums.spec.frame.scale_exponent);
  for (const double x : sums.spec.frame.origin) w.put<double>(x);
  if (sums.spec.set & kAovLightGroups) {
    w.put<uint8_t>(static_cast<uint8_t>(sums.spec.groups.size()));
    for (const std::string& name : sums.spec.groups) {
      w.put<uint8_t>(static_cast<uint8_t>(name.size()));
      w.put_bytes(name);
    }
  }
  for (int layer = 0; layer < kAovLayers; ++layer) {
    if (!has_layer(sums.spec, layer)) continue;
    write_layer(sums.layers[static_cast<size_t>(layer)], &w);
  }
  write_splats(sums.direct_splats, &w);
  write_parts(sums.groups, &w);
  write_parts(sums.lobes, &w);
  return std::move(w.bytes());
}

AovSums decode_aovs(std::string_view bytes, size_t tile_pixels, const FilmGrid& grid, size_t most_groups,
                    Aovs most) {
  ByteReader in(bytes, kAovPartial);
  AovSums sums;
  unpack_set(in.get<uint32_t>(), &sums.spec);
  AovFrame& frame = sums.spec.frame;
  frame.scale_exponent = in.get<int32_t>();
  for (double& x : frame.origin) x = in.get<double>();
  if (sums.spec.set == 0 || (sums.spec.set & ~kAllAovs)) refuse_partial("unknown AOVs");
  if (sums.spec.set & ~most & kAovLobes) refuse_partial("lobes that nobody asked for");
  if (std::abs(frame.scale_exponent) > kMaxScaleExponent) refuse_partial("scale out of range");
  for (const double x : frame.origin) {
    if (!std::isfinite(x)) refuse_partial("origin out of range");
  }
  if (sums.spec.set & kAovLightGroups) sums.spec.groups = read_groups(&in, most_groups);
  for (int layer = 0; layer < kAovLayers; ++layer) {
    if (!has_layer(sums.spec, layer)) continue;
    read_layer(&in, tile_pixels, &sums.layers[static_cast<size_t>(layer)]);
  }
  read_splats(&in, grid, &sums.direct_splats);
  sums.groups.resize(group_layers(sums.spec.groups));
  read_parts(&in, tile_pixels, grid, &sums.groups);
  sums.lobes.resize(lobe_layers(sums.spec.set));
  read_parts(&in, tile_pixels, grid, &sums.lobes);
  in.expect_end();
  return sums;
}

size_t max_aov_bytes(size_t tile_pixels, const FilmGrid& grid, size_t groups, Aovs most) {
  const auto crop_pixels = static_cast<size_t>(grid.crop.area());
  const size_t layer = kRangeBytes + tile_pixels * kSumBytes,
               splats = kCountBytes + kRangeBytes + crop_pixels * (kMaxVarint + kSumBytes);
  return kHeadBytes + 1 + groups * (1 + kMaxLightGroupName) + kAovLayers * layer + splats +
         ((groups > 0 ? groups - 1 : 0) + lobe_layers(most)) * (layer + splats);
}

void check_aovs(const AovSums& sums, const FilmGrid& grid, size_t tile_pixels, int64_t samples,
                const std::vector<ExactRgb>& camera, const std::vector<SplatSum>& splats) {
  const int64_t most = sums.spec.weighted ? samples * kMaxSamplesPerIndex : samples;
  const Units limit = static_cast<Units>(most) << kMaxContributionBits;
  const auto check_layer = [&](const std::vector<ExactRgb>& values, bool needed) {
    if (values.size() != (needed ? tile_pixels : 0)) refuse_partial("an AOV of another size than the tile");
    for (const ExactRgb& sum : values) {
      for (const Units u : sum.c) {
        if (magnitude(u) > limit) refuse_partial("AOV sum out of range");
      }
    }
  };
  for (int layer = 0; layer < kAovLayers; ++layer)
    check_layer(sums.layers[static_cast<size_t>(layer)], has_layer(sums.spec, layer));
  if (sums.groups.size() != group_layers(sums.spec.groups)) refuse_partial("a light group is missing");
  if (sums.lobes.size() != lobe_layers(sums.spec.set)) refuse_partial("a lobe is missing");
  for (const std::vector<GroupSums>* parts : {&sums.groups, &sums.lobes}) {
    for (const GroupSums& part : *parts) {
      check_layer(part.camera, true);
      check_part_splats(part.splats, grid);
    }
  }
  const std::vector<ExactRgb>& weights = sums.layers[kWeightsLayer];
  for (const ExactRgb& sum : weights) {
    // A sample of the least level has the largest weight.
    if (sum.c[0] > static_cast<Units>(samples) * (kWeightOne << -kLeastLevel) ||
        sum.c[1] > static_cast<Units>(most))
      refuse_partial("more weight than samples");
  }
  const auto check_hits = [&](AovLayer layer, size_t c) {
    const std::vector<ExactRgb>& hits = sums.layers[layer];
    for (size_t i = 0; i < hits.size(); ++i) {
      if (hits[i].c[c] > (weights.empty() ? static_cast<Units>(samples) : weights[i].c[0]))
        refuse_partial("more hits than samples");
    }
  };
  check_hits(kDepthLayer, 1);
  check_hits(kUvLayer, 2);
  check_hits(kMotionLayer, 2);
  const std::vector<ExactRgb>&albedo = sums.layers[kAlbedoLayer], &diffuse = sums.layers[kDiffuseAlbedoLayer];
  for (size_t i = 0; i < std::min(albedo.size(), diffuse.size()); ++i) {
    if (!within(diffuse[i], albedo[i])) refuse_partial("more diffuse albedo than albedo");
  }
  const std::vector<ExactRgb>& direct = sums.layers[kDirectLayer];
  for (size_t i = 0; i < direct.size(); ++i) {
    if (!within(direct[i], i < camera.size() ? camera[i] : ExactRgb{})) {
      refuse_partial("more direct light than light");
    }
  }
  if (!sums.direct_splats.empty() && direct.empty()) refuse_partial("direct splats that nobody asked for");
  check_direct_splats(sums.direct_splats, splats);
}

}  // namespace lightmill
