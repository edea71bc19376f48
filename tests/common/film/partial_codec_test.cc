#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "common/base/error.h"
#include "common/film/packing.h"
#include "common/film/partial.h"
#include "common/film/partial_decoder.h"
#include "common/film/unit_planes.h"
#include "tests/common/film/test_partials.h"

namespace lightmill {
namespace {

using testing::random_partial;

const FilmGrid kGrid{90, 50, {7, 3, 88, 49}};
const TileSpec kTile{{1, 0, 3, 2}, 16, 32};

std::string refusal(const Partial& partial) {
  try {
    encode_partial(partial);
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::kFailed);
    return e.what();
  }
  return "";
}

TEST(PartialCodec, RoundTripsEveryLayout) {
  for (const bool camera : {true, false}) {
    for (const uint64_t splat_every : {0, 1, 2, 40}) {
      const Partial p = random_partial(kGrid, kTile, 5, camera, splat_every);
      const std::string bytes = encode_partial(p);
      const Partial q = decode_partial(bytes);
      EXPECT_EQ(p, q);
      EXPECT_EQ(decode_partial(bytes, kGrid, kTile), p);
      EXPECT_EQ(partial_digest(q), partial_digest(p));
      EXPECT_EQ(encoded_digest(bytes), partial_digest(p));
      EXPECT_EQ(encode_partial(q), bytes);
    }
  }
}

TEST(PartialCodec, ADecoderForgetsWhatItDecodedBefore) {
  PartialDecoder decoder;
  EXPECT_EQ(decoder.bytes(), 0u);
  const FilmGrid small = testing::full_grid(40, 30);
  for (int round = 0; round < 2; ++round) {
    for (const uint64_t splat_every : {1, 40, 0, 2}) {
      for (const bool camera : {true, false}) {
        const Partial p = random_partial(kGrid, kTile, 5 + splat_every, camera, splat_every);
        std::string bytes = encode_partial(p);
        EXPECT_EQ(decoder.decode(bytes, kGrid, kTile), p);
        const Partial q = random_partial(small, {{0, 0, 2, 1}, 0, 16}, splat_every, camera, splat_every);
        EXPECT_EQ(decoder.decode(encode_partial(q), small, q.tile), q);
        bytes.back() = static_cast<char>(bytes.back() + 1);
        EXPECT_THROW(decoder.decode(bytes, kGrid, kTile), Error);
        EXPECT_THROW(decoder.decode(encode_partial(p), small, kTile), Error);
      }
    }
  }
  EXPECT_GT(decoder.bytes(), static_cast<size_t>(kGrid.crop.area()) * sizeof(SplatSum));
}

TEST(PartialCodec, RoundTripsExtremes) {
  Partial p = random_partial(kGrid, kTile, 6, true, 9);
  for (ExactRgb& sum : p.camera) sum = {};
  EXPECT_EQ(decode_partial(encode_partial(p)), p);  // black is not "no layer"
  p.camera[3].c[1] = Units{16} << kMaxContributionBits;
  p.camera[4].c[2] = 1;
  p.splats[0].sum.c[0] = (Units{1} << kMaxSumBits) - 1;
  EXPECT_EQ(decode_partial(encode_partial(p)), p);
  const FilmGrid one = testing::full_grid(1, 1);
  const Partial tiny = random_partial(one, {{0, 0, 1, 1}, 0, 1}, 1, true, 1);
  EXPECT_EQ(decode_partial(encode_partial(tiny)), tiny);
  const FilmGrid tall = testing::full_grid(1, 20000);
  const Partial column = random_partial(tall, {{0, 3, 1, 40}, 0, 1}, 1, true, 3);
  EXPECT_EQ(decode_partial(encode_partial(column)), column);
}

TEST(PartialCodec, SparseSplatsAreSmallerThanTheFrame) {
  const FilmGrid grid = testing::full_grid(640, 480);
  const Partial few = random_partial(grid, {{0, 0, 1, 1}, 0, 1}, 2, false, 5000);
  ASSERT_FALSE(few.splats.empty());
  EXPECT_LT(encode_partial(few).size(), few.splats.size() * 40 + 1000);
}

TEST(PartialCodec, CpuSecondsIsNotPartOfTheDigest) {
  Partial p = random_partial(kGrid, kTile, 5, true, 4);
  const std::string digest = partial_digest(p);
  p.cpu_seconds += 1;
  EXPECT_EQ(partial_digest(p), digest);
  p.counters.shadow_rays += 1;
  EXPECT_NE(partial_digest(p), digest);
}

Partial with_dropped(Partial p) {
  p.dropped.of(DropKind::kNotFinite) = {3, 0.75};
  p.dropped.of(DropKind::kOutOfRange) = {2, 4e37};
  p.dropped.of(DropKind::kCapped) = {uint64_t{1} << 40, 12};
  p.counters.nonfinite = 5;
  return p;
}

TEST(PartialCodec, WhatWasDroppedTravelsAndItsCountsAreContent) {
  Partial p = with_dropped(random_partial(kGrid, kTile, 5, true, 4));
  const std::string bytes = encode_partial(p);
  EXPECT_EQ(decode_partial(bytes, kGrid, kTile), p);
  EXPECT_EQ(encoded_digest(bytes), partial_digest(p));
  const std::string digest = partial_digest(p);
  p.dropped.of(DropKind::kCapped).amount = 13;
  EXPECT_EQ(partial_digest(p), digest) << "amounts depend on the order of adding";
  p.dropped.of(DropKind::kCapped).count = 13;
  EXPECT_NE(partial_digest(p), digest);
  p = random_partial(kGrid, kTile, 5, true, 4);
  EXPECT_EQ(bytes.size(), encode_partial(p).size() + 80) << "no bytes where nothing was dropped";
}

/// As version 0.1 wrote it, which counted without kinds.
std::string older_partial() {
  const std::string hex =
      "4c6d70740300000002000000020000000000000000000000020000000200000000000000000000000100000001000000"
      "ccffffff0000000000000000010000000000000004000000000000000400000000000000040000000000000000000000"
      "000000000900000000000000000000000000000000000000000000000300000000000000010000000000000001010007"
      "0001000000000000e03f5800000000000000323035386263653437643535353135653932373937396635356664346431"
      "653530356430393262303966386463376238363235393662323030653266636330376661323963393832363031353838"
      "663032396233346464366431633663326230613934393861376438633832316461666261346639306163346633653637"
      "333528b52ffd2058bd000078000004080c10070707070001050607020000e7510016";
  std::string bytes;
  for (size_t i = 0; i < hex.size(); i += 2)
    bytes.push_back(static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  return bytes;
}

TEST(PartialCodec, PartialsOfVersionsWithoutKindsAreReadAndKeepTheirDigest) {
  const std::string bytes = older_partial();
  const Partial p = decode_partial(bytes, {2, 2, {0, 0, 2, 2}}, {{0, 0, 1, 1}, 0, 1});
  EXPECT_EQ(p.counters.nonfinite, 3u);
  EXPECT_EQ(p.counters.shadow_rays, 9u);
  EXPECT_EQ(p.dropped, Dropped{});
  EXPECT_EQ(p.camera[3].c[0], Units{4} << 50);
  EXPECT_EQ(p.splats.size(), 1u);
  EXPECT_EQ(partial_digest(p), "2058bce47d55515e927979f55fd4d1e505d092b09f8dc7b862596b200e2fcc07");
}

TEST(PartialCodec, RefusesFiguresOfWhatWasDroppedThatCanNotBe) {
  const Partial good = with_dropped(random_partial(kGrid, kTile, 5, true, 4));
  EXPECT_EQ(refusal(good), "");
  Partial p = good;
  p.counters.nonfinite = 4;
  EXPECT_THAT(refusal(p), ::testing::HasSubstr("do not add up"));
  for (const double amount : {-1.0, std::numeric_limits<double>::quiet_NaN(), 1e300}) {
    p = good;
    p.dropped.of(DropKind::kCapped).amount = amount;
    EXPECT_THAT(refusal(p), ::testing::HasSubstr("amount"));
  }
  p = good;
  p.dropped.of(DropKind::kBelowRange).amount = 1;
  EXPECT_THAT(refusal(p), ::testing::HasSubstr("amount"));
  p = good;
  p.dropped.of(DropKind::kBelowRange).count = ~uint64_t{0};
  EXPECT_THAT(refusal(p), ::testing::HasSubstr("out of range"));
}

TEST(PartialCodec, AnyFlippedByteIsNoticed) {
  const FilmGrid grid = testing::full_grid(8, 8);
  for (const uint64_t splat_every : {1, 9}) {
    Partial p = random_partial(grid, {{0, 0, 1, 1}, 0, 1}, 8, true, splat_every);
    if (splat_every == 9) p = with_dropped(p);
    const std::string bytes = encode_partial(p);
    for (size_t i = 0; i < bytes.size(); ++i) {
      for (const int flip : {0x01, 0x80, 0xff}) {
        std::string bad = bytes;
        bad[i] = static_cast<char>(bad[i] ^ flip);
        try {
          EXPECT_EQ(decode_partial(bad), p) << "byte " << i;
        } catch (const Error& e) {
          EXPECT_EQ(e.kind(), ErrorKind::kFailed);
        }
      }
    }
  }
}

TEST(PartialCodec, AnyTruncationAndAnyTailIsRefused) {
  const FilmGrid grid = testing::full_grid(8, 8);
  const std::string bytes = encode_partial(random_partial(grid, {{0, 0, 1, 1}, 0, 1}, 8, true, 2));
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_THROW(decode_partial(std::string_view(bytes).substr(0, size)), Error) << size;
  }
  EXPECT_THROW(decode_partial(bytes + "x"), Error);
  EXPECT_THROW(decode_partial(bytes + bytes), Error);
}

TEST(PartialCodec, RandomBytesAreRefused) {
  std::mt19937_64 rng(1);
  const std::string good = encode_partial(random_partial(kGrid, kTile, 5, true, 4));
  for (int trial = 0; trial < 500; ++trial) {
    std::string bytes(rng() % 400, '\0');
    for (char& c : bytes) c = static_cast<char>(rng());
    EXPECT_THROW(decode_partial(bytes), Error);
    EXPECT_THROW(decode_partial(good.substr(0, 8) + bytes), Error);
  }
}

TEST(PartialCodec, RefusesContentThatDoesNotAddUp) {
  const Partial good = random_partial(kGrid, kTile, 5, true, 4);
  const auto changed = [&](auto&& change) {
    Partial p = good;
    change(&p);
    return refusal(p);
  };
  using ::testing::HasSubstr;
  EXPECT_EQ(changed([](Partial*) {}), "");
  EXPECT_THAT(changed([](Partial* p) { p->light_paths = 1 << 20; }), HasSubstr("more paths"));
  EXPECT_THAT(changed([](Partial* p) { p->counters.camera_paths = 1 << 20; }), HasSubstr("more paths"));
  EXPECT_THAT(changed([](Partial* p) { p->counters.shadow_rays = ~uint64_t{0}; }), HasSubstr("counter"));
  EXPECT_THAT(changed([](Partial* p) { p->light_paths = 0; }), HasSubstr("without light paths"));
  EXPECT_THAT(changed([](Partial* p) { p->camera.pop_back(); }), HasSubstr("another size"));
  EXPECT_THAT(changed([](Partial* p) { p->camera[0].c[0] = Units{65} << kMaxContributionBits; }),
              HasSubstr("camera sum"));
  EXPECT_THAT(changed([](Partial* p) { p->splats[0].sum.c[0] = Units{1} << kMaxSumBits; }),
              HasSubstr("splat sum"));
  EXPECT_THAT(changed([](Partial* p) { std::swap(p->splats[0], p->splats[1]); }), HasSubstr("ascending"));
  EXPECT_THAT(changed([](Partial* p) { p->splats[1] = p->splats[0]; }), HasSubstr("ascending"));
  EXPECT_THAT(changed([](Partial* p) { p->splats[0].pixel = 0; }), HasSubstr("outside"));
  EXPECT_THAT(changed([](Partial* p) { p->splats[0].sum = {}; }), HasSubstr("zero"));
  EXPECT_THAT(changed([](Partial* p) { p->tile.sample_end = p->tile.sample_begin; }),
              HasSubstr("sample range"));
  EXPECT_THAT(changed([](Partial* p) { p->tile.sample_end = int64_t{1} << 50; }), HasSubstr("sample range"));
  EXPECT_THAT(changed([](Partial* p) { p->tile.sample_begin = -1; }), HasSubstr("sample range"));
  EXPECT_THAT(changed([](Partial* p) { p->tile.cells.x1 = 4; }), HasSubstr("tile outside"));
  EXPECT_THAT(changed([](Partial* p) { p->grid.crop.x1 = 91; }), HasSubstr("crop"));
  EXPECT_THAT(changed([](Partial* p) { p->grid.width = 1 << 30; }), HasSubstr("resolution"));
  EXPECT_THAT(changed([](Partial* p) { p->quantum_exponent = 1000; }), HasSubstr("quantum"));
  EXPECT_THAT(changed([](Partial* p) { p->cpu_seconds = std::numeric_limits<double>::quiet_NaN(); }),
              HasSubstr("cpu_seconds"));
}

TEST(PartialCodec, AnotherLeaseIsRefusedBeforeItsLayersAreRead) {
  const std::string bytes = encode_partial(random_partial(kGrid, kTile, 5, true, 4));
  TileSpec other = kTile;
  other.sample_end += 16;
  EXPECT_THROW(decode_partial(bytes, kGrid, other), Error);
  EXPECT_THROW(decode_partial(bytes, testing::full_grid(90, 50), kTile), Error);
}

TEST(Packing, ADecompressionBombIsRefusedByItsDeclaredSize) {
  const std::string zeros(1 << 24, '\0');
  const std::string bomb = zstd_pack(zeros, 1);
  EXPECT_LT(bomb.size(), 10000u);
  EXPECT_THROW(zstd_unpack(bomb, 1000, "bomb"), Error);
  EXPECT_EQ(zstd_unpack(bomb, zeros.size(), "bomb"), zeros);
}

TEST(Packing, SealedBytesNoticeAnyChange) {
  const std::string sealed = seal(1, 2, "hello, film");
  EXPECT_EQ(unseal(1, 2, sealed, "test"), "hello, film");
  EXPECT_THROW(unseal(2, 2, sealed, "test"), Error);
  EXPECT_THROW(unseal(1, 3, sealed, "test"), Error);
  for (size_t i = 0; i < sealed.size(); ++i) {
    std::string bad = sealed;
    bad[i] = static_cast<char>(bad[i] ^ 0x10);
    EXPECT_THROW(unseal(1, 2, bad, "test"), Error) << i;
    EXPECT_THROW(unseal(1, 2, sealed.substr(0, i), "test"), Error) << i;
  }
}

TEST(Packing, VarintsRoundTripAndHaveOneSpelling) {
  for (const uint64_t v : {uint64_t{0}, uint64_t{127}, uint64_t{128}, uint64_t{1} << 32, ~uint64_t{0}}) {
    ByteWriter w;
    w.put_varint(v);
    ByteReader r(w.bytes(), "test");
    EXPECT_EQ(r.get_varint(), v);
    r.expect_end();
  }
  EXPECT_THROW(ByteReader(std::string_view("\x80\x00", 2), "test").get_varint(), Error);
  EXPECT_THROW(ByteReader(std::string(11, '\xff'), "test").get_varint(), Error);
  EXPECT_THROW(ByteReader("\x80", "test").get_varint(), Error);
}

TEST(UnitPlanes, PiecesAreTheWhole) {
  const Partial p = random_partial(kGrid, kTile, 5, true, 3);
  ASSERT_GT(p.splats.size(), 300u);
  const ByteRange camera = used_bytes(std::span(p.camera)), splat = used_bytes(std::span(p.splats));
  std::string whole, pieces;
  append_planes(std::span(p.camera), camera, &whole);
  append_planes(std::span(p.splats), splat, &whole);
  const auto take = [&](std::string_view piece) { pieces += piece; };
  for_planes(std::span(p.camera), camera, take);
  for_planes(std::span(p.splats), splat, take);
  EXPECT_EQ(pieces, whole);
  const auto area = static_cast<size_t>(kGrid.crop.area());
  std::vector<ExactRgb> frame(area), read(area);
  for (const SplatSum& s : p.splats) frame[static_cast<size_t>(kGrid.crop_index(s.pixel))] = s.sum;
  pieces.clear();
  for_planes(
      std::span(p.splats), splat, area,
      [](const SplatSum& s) { return static_cast<size_t>(kGrid.crop_index(s.pixel)); }, take);
  read_planes(pieces, splat, std::span(read));
  EXPECT_EQ(read, frame);
  std::vector<ExactRgb> strips;
  PlaneStrips planes(pieces, splat, area);
  for (auto sums = planes.next(); !sums.empty(); sums = planes.next())
    strips.insert(strips.end(), sums.begin(), sums.end());
  EXPECT_EQ(strips, frame);
}

TEST(Sealer, PiecesAreSealedLikeTheWhole) {
  std::mt19937_64 rng(4);
  std::string raw(300000, '\0');
  for (char& c : raw) c = static_cast<char>(rng() % 17);
  Sealer sealer(1, 2, raw.size());
  for (size_t at = 0; at < raw.size(); at += 7001) sealer.write(std::string_view(raw).substr(at, 7001));
  EXPECT_EQ(unseal(1, 2, sealer.finish(), "test"), raw);
  EXPECT_EQ(unseal(1, 2, seal(1, 2, raw), "test"), raw);
  EXPECT_EQ(unseal(1, 2, seal(1, 2, ""), "test"), "");
  Sealer wrong(1, 2, raw.size());
  wrong.write("short");
  EXPECT_THROW(wrong.finish(), std::logic_error);
}

TEST(UnitPlanes, UsedBytesAreTheSmallestRange) {
  std::vector<ExactRgb> sums(3);
  EXPECT_EQ(used_bytes(std::span<const ExactRgb>(sums)), (ByteRange{0, 0}));
  sums[1].c[2] = Units{0x1ff} << 40;
  EXPECT_EQ(used_bytes(std::span<const ExactRgb>(sums)), (ByteRange{5, 7}));
  sums[2].c[0] = Units{1} << 127;
  EXPECT_EQ(used_bytes(std::span<const ExactRgb>(sums)), (ByteRange{5, 16}));
}

}  // namespace
}  // namespace lightmill
