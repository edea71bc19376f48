#include "worker/render/guiding/photon_guide_table.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lightmill {
namespace {

constexpr int kLobes = PhotonGuide::kLobes, kGroup = PhotonGuide::kGroup;
static_assert(kGroup == kWidth<Float8> && PhotonGuide::kGroups <= kWidth<Float8>);

/// A photon's direction turns by no more than this over half a side of its box: so near a focus it says
/// nothing about what is around.
constexpr float kMostTurn = 0.5f;

/// Spreads (GuideLobe) are fitted to this many photons in this many rounds. They begin from the nearest
/// photon, which counts as kBefore of one. kElsewhere: share of paths that go anywhere, to which photons are
/// left that no lobe explains. Beginning with the third nearest, or twice as many rounds, made no difference
/// beyond noise.
constexpr size_t kFitted = 128;
constexpr int kRounds = 8;
constexpr float kBefore = 0.5f, kElsewhere = 1e-3f;
constexpr float kNarrowest = 0x1p-30f;

/// As many photons as a table has, each as often as is its due by power.
std::vector<const Photon*> drawn(const std::vector<const Photon*>& photons) {
  double all = 0;
  for (const Photon* p : photons) all += double{p->power};
  std::vector<const Photon*> result;
  double below = 0;
  for (const Photon* p : photons) {
    below += double{p->power};
    while (result.size() < kLobes && (static_cast<double>(result.size()) + 0.5) * all < below * kLobes)
      result.push_back(p);
  }
  result.resize(kLobes, photons.back());
  return result;
}

/// A photon as it is in its table.
struct Lobe {
  const Photon* photon = nullptr;
  Vec3<float> direction;  // as seen from the box's centre; not a unit vector
  std::array<float, 9> turn{};
};

/// Step from the box's centre to p, no longer than its sides.
Vec3<float> step_to(const Vec3<float>& p, const GuideBox& box) {
  const auto along = [&](float x, size_t axis) { return clamp(x - box.centre[axis], -box.half, box.half); };
  return {along(p.x, 0), along(p.y, 1), along(p.z, 2)};
}

/// The most by which a step along each axis to the side of its box changes a direction.
float most_change(const std::array<float, 9>& turn, float half) {
  float square = 0;
  for (const float t : turn) square += t * t;
  return std::sqrt(3 * square) * half;
}

Lobe lobe_of(const Photon& p, const GuideBox& box) {
  Lobe lobe{.photon = &p, .direction = {}};
  const float most = most_change(p.turn, box.half);
  const float scale = most > kMostTurn ? kMostTurn / most : 1.0f;
  for (size_t k = 0; k < p.turn.size(); ++k) lobe.turn[k] = p.turn[k] * scale;
  const Vec3<float> step = step_to(p.p, box);
  const auto change = [&](const float* row) { return row[0] * step.x + row[1] * step.y + row[2] * step.z; };
  const float* t = lobe.turn.data();
  lobe.direction = p.w - Vec3<float>{change(t), change(t + 3), change(t + 6)};
  return lobe;
}

/// Orders [first, last) so that halves, quarters and so on, down to groups, are close to each other.
void group(std::vector<Lobe>::iterator first, std::vector<Lobe>::iterator last) {
  const auto count = last - first;
  if (count <= kGroup) return;
  constexpr std::array axes{&Vec3<float>::x, &Vec3<float>::y, &Vec3<float>::z};
  auto widest = axes[0];
  float most = -1;
  for (const auto axis : axes) {
    const auto less = [axis](const Lobe& a, const Lobe& b) { return a.direction.*axis < b.direction.*axis; };
    const auto [lo, hi] = std::minmax_element(first, last, less);
    const float width = hi->direction.*axis - lo->direction.*axis;
    if (width > most) most = width, widest = axis;
  }
  std::stable_sort(first, last, [widest](const Lobe& a, const Lobe& b) {
    return a.direction.*widest < b.direction.*widest;
  });
  group(first, first + count / 2);
  group(first + count / 2, last);
}

void store_lobes(const std::vector<Lobe>& lobes, float* table) {
  for (size_t i = 0; i < lobes.size(); ++i) {
    const Lobe& l = lobes[i];
    const auto set = [&](int field, float x) { table[static_cast<size_t>(field) * kLobes + i] = x; };
    set(PhotonGuide::kDirection, l.direction.x);
    set(PhotonGuide::kDirection + 1, l.direction.y);
    set(PhotonGuide::kDirection + 2, l.direction.z);
    for (size_t k = 0; k < l.turn.size(); ++k) set(PhotonGuide::kTurn + static_cast<int>(k), l.turn[k]);
  }
}

/// Sets the spreads of a table's lobes so that each photon is likely by the lobes of others: expectation
/// maximisation of the logarithm of their density, which suits photons that are yet to come. Where glass
/// shows a lamp in several places, no lobe need explain photons that came another way.
class SpreadFit {
 public:
  SpreadFit(const std::vector<const Photon*>& photons, const GuideBox& box, const std::vector<Lobe>& lobes,
            float* table)
      : spreads_(table + PhotonGuide::kSpread * kLobes) {
    const size_t stride = (photons.size() + kFitted - 1) / kFitted;
    for (size_t i = 0; i < photons.size(); i += stride) add(*photons[i], box, lobes, table);
  }

  void run() {
    std::array<float, kLobes> nearest;
    nearest.fill(GuideLobe::kWidest);
    for (const auto& row : chords_) {
      for (size_t k = 0; k < kLobes; ++k) nearest[k] = std::min(nearest[k], row[k]);
    }
    for (float& s : nearest) s = std::max(s, kNarrowest);
    std::copy(nearest.begin(), nearest.end(), spreads_);
    for (int round = 0; round < kRounds; ++round) improve(nearest);
  }

 private:
  /// Squares of chords between the direction a photon is from and where it would be by each lobe.
  using Row = std::array<float, kLobes>;
  static constexpr float kNever = 1e6f;  // by its own

  void add(const Photon& p, const GuideBox& box, const std::vector<Lobe>& lobes, const float* table) {
    const Vec3<float> step = step_to(p.p, box);
    Row& row = chords_.emplace_back();
    for (int first = 0; first < kLobes; first += kGroup) {
      Float8 fields[PhotonGuide::kFields];
      for (int k = 0; k < PhotonGuide::kSpread; ++k) fields[k] = load<Float8>(table + k * kLobes + first);
      store(&row[static_cast<size_t>(first)],
            GuideLobe::chord2(splat3<Float8>(p.w.x, p.w.y, p.w.z),
                              GuideLobe::direction(fields, splat3<Float8>(step.x, step.y, step.z))));
    }
    for (size_t k = 0; k < kLobes; ++k) {
      if (lobes[k].photon == &p) row[k] = kNever;
    }
  }

  /// One round. The best s of a lobe that explains photons at chords q with weights g is where those are
  /// equal: sums of g s / (s + q) and of g q / (s + q).
  void improve(const Row& nearest) {
    constexpr int kParts = kLobes / kGroup;
    std::array<Float8, kParts> near, far;
    for (int i = 0; i < kParts; ++i) {
      const Float8 s = load<Float8>(spreads_ + i * kGroup);
      const Float8 first = load<Float8>(&nearest[static_cast<size_t>(i * kGroup)]);
      near[static_cast<size_t>(i)] = kBefore * s / (s + first);
      far[static_cast<size_t>(i)] = kBefore * first / (s + first);
    }
    for (const Row& row : chords_) {
      std::array<Float8, kParts> share, q;
      Float8 sum{};
      for (int i = 0; i < kParts; ++i) {
        const auto part = static_cast<size_t>(i);
        q[part] = load<Float8>(&row[static_cast<size_t>(i * kGroup)]);
        const Float8 s = load<Float8>(spreads_ + i * kGroup), all = s + q[part];
        share[part] = s / (all * all);
        sum = sum + share[part];
      }
      float total = kElsewhere / 4 * kLobes;  // a sphere has an area of 4 by the square of the chord
      for (int l = 0; l < kGroup; ++l) total += sum[l];
      for (int i = 0; i < kParts; ++i) {
        const auto part = static_cast<size_t>(i);
        const Float8 s = load<Float8>(spreads_ + i * kGroup);
        const Float8 each = share[part] / (total * (s + q[part]));
        near[part] = near[part] + each * s;
        far[part] = far[part] + each * q[part];
      }
    }
    for (int i = 0; i < kParts; ++i) {
      const auto part = static_cast<size_t>(i);
      const Float8 s = load<Float8>(spreads_ + i * kGroup) * far[part] / near[part];
      store(spreads_ + i * kGroup, clamp(s, kNarrowest, GuideLobe::kWidest));
    }
  }

  float* spreads_;
  std::vector<Row> chords_;
};

/// Axis and least cosine of a cone that holds all that a group of lobes draws.
std::array<float, 4> cone_of(const Lobe* lobes, const float* spreads, float half) {
  constexpr std::array<float, 4> kAll{0, 0, 1, -2};
  Vec3<float> sum;
  for (int i = 0; i < kGroup; ++i) sum = sum + normalize(lobes[i].direction);
  if (!(dot(sum, sum) > 0.25f)) return kAll;
  const Vec3<float> axis = normalize(sum);
  float most = 0;
  for (int i = 0; i < kGroup; ++i) {
    const float turned =
        most_change(lobes[i].turn, half) / std::sqrt(dot(lobes[i].direction, lobes[i].direction));
    if (!(turned < 1)) return kAll;
    const float cosine = dot(axis, normalize(lobes[i].direction));
    const float chord = std::sqrt(std::min(GuideLobe::kTail2 * spreads[i], 4.0f));
    most = std::max(
        most, std::acos(std::clamp(cosine, -1.0f, 1.0f)) + std::asin(turned) + 2 * std::asin(0.5f * chord));
  }
  if (most >= 3) return kAll;
  return {axis.x, axis.y, axis.z, std::cos(most) - 0x1p-20f};
}

}  // namespace

void add_guide_table(const std::vector<const Photon*>& photons, const GuideBox& box, PhotonGuide* guide) {
  std::vector<Lobe> lobes;
  for (const Photon* p : drawn(photons)) lobes.push_back(lobe_of(*p, box));
  group(lobes.begin(), lobes.end());
  const size_t first = guide->tables.size();
  guide->boxes.push_back(box);
  guide->tables.resize(first + PhotonGuide::kTableSize);
  float* const table = &guide->tables[first];
  store_lobes(lobes, table);
  SpreadFit(photons, box, lobes, table).run();
  float* const cones = table + PhotonGuide::kCones;
  for (int g = 0; g < kWidth<Float8>; ++g) {
    std::array<float, 4> cone{0, 0, 0, 2};  // of a group that there is not: nothing
    if (g < PhotonGuide::kGroups)
      cone = cone_of(&lobes[static_cast<size_t>(g * kGroup)],
                     table + PhotonGuide::kSpread * kLobes + g * kGroup, box.half);
    for (int k = 0; k < 4; ++k) cones[k * kWidth<Float8> + g] = cone[static_cast<size_t>(k)];
  }
}

}  // namespace lightmill
