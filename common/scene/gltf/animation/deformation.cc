#include "common/scene/gltf/animation/deformation.h"

#include <algorithm>
#include <cmath>

#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr double kSmallWeight = 1e-9;

Vec3f unit(const double n[3]) {
  const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  if (!(length > 0) || !std::isfinite(length)) return {};
  return {static_cast<float>(n[0] / length), static_cast<float>(n[1] / length),
          static_cast<float>(n[2] / length)};
}

}  // namespace

GltfDeformer::GltfDeformer(GltfScene& scene, GltfBuffers& buffers, const GltfValue& root,
                           const GltfValue& primitive, std::span<const uint32_t> used,
                           const Attribute& attribute, size_t vertices, size_t joints)
    : scene_(scene), used_(used.begin(), used.end()) {
  scene_.attempt_optional([&] { read_targets(buffers, root, primitive, vertices); });
  if (joints > 0) scene_.attempt_optional([&] { read_influences(buffers, primitive, attribute, joints); });
}

void GltfDeformer::read_targets(GltfBuffers& buffers, const GltfValue& root, const GltfValue& primitive,
                                size_t vertices) {
  const size_t accessors = root.count("accessors");
  for (size_t t = 0; t < primitive.count("targets"); ++t) {
    const GltfValue value = primitive.require("targets")[t];
    Target& target = targets_.emplace_back();
    const auto open = [&](const char* name, std::optional<GltfAccessor>* out) {
      scene_.attempt_optional([&] {
        const int of = value.index_or_none(name, accessors, "accessor");
        if (of < 0) return;
        const GltfAccessor a = buffers.accessor(static_cast<size_t>(of), {3});
        if (a.count() < vertices) {
          value.fail(std::string(name) + " has " + std::to_string(a.count()) + " elements for " +
                     std::to_string(vertices) + " vertices");
        }
        *out = a;
      });
    };
    open("POSITION", &target.positions);
    open("NORMAL", &target.normals);
    // Tangents follow the texture coordinates of the vertices as they are bent.
    for (const std::string& name : value.keys()) {
      if (name.starts_with("COLOR_") || name.starts_with("TEXCOORD_"))
        scene_.unsupported(value.pointer(), "morph targets of colours and texture coordinates are ignored");
    }
  }
}

void GltfDeformer::read_influences(GltfBuffers& buffers, const GltfValue& primitive,
                                   const Attribute& attribute, size_t joints) {
  constexpr size_t kMostSets = 8;
  std::vector<std::pair<GltfAccessor, GltfAccessor>> sets;
  for (size_t n = 0; n < kMostSets; ++n) {
    const auto j = attribute("JOINTS_" + std::to_string(n), {4});
    const auto w = attribute("WEIGHTS_" + std::to_string(n), {4});
    if (!j || !w) break;
    sets.emplace_back(*j, *w);
  }
  if (sets.empty()) primitive.fail("has a skin but no JOINTS_0 and WEIGHTS_0");
  per_vertex_ = 4 * sets.size();
  buffers.charge(2 * per_vertex_ * used_.size(), primitive);
  influences_.reserve(per_vertex_ * used_.size());
  size_t beyond = 0, unequal = 0, none = 0;
  for (const uint32_t v : used_) {
    const size_t first = influences_.size();
    double sum = 0;
    for (const auto& [joint_of, weight_of] : sets) {
      float joint[4], weight[4];
      joint_of.read(v, joint);
      weight_of.read(v, weight);
      for (int k = 0; k < 4; ++k) {
        Influence& i = influences_.emplace_back(Influence{0, weight[k] > 0 ? std::min(weight[k], 1e6f) : 0});
        if (joint[k] >= 0 && joint[k] < static_cast<float>(joints)) {
          i.joint = static_cast<uint32_t>(joint[k]);
        } else if (i.weight > 0) {
          ++beyond;
          i.weight = 0;
        }
        sum += double{i.weight};
      }
    }
    if (!(sum > kSmallWeight)) {
      ++none;
      influences_[first].weight = 1;
      continue;
    }
    // Sums of rounded weights are a little off; bytes have 255 steps.
    constexpr double kSlack = 0.02;
    unequal += std::fabs(sum - 1) > kSlack;
    for (size_t i = first; i < influences_.size(); ++i)
      influences_[i].weight = static_cast<float>(double{influences_[i].weight} / sum);
  }
  const auto say = [&](size_t n, const char* what) {
    if (n > 0) primitive.mended(std::to_string(n) + what);
  };
  say(beyond, " weights are of joints that the skin does not have; they are left out");
  say(unequal, " vertices have weights whose sum is not 1; they are normalised");
  say(none, " vertices have no weight above 0; the first of their joints carries them");
}

void GltfDeformer::morph(const GltfBend& bend, size_t i, double position[3], double normal[3]) const {
  const size_t count = std::min(targets_.size(), bend.weights.size());
  for (size_t t = 0; t < count; ++t) {
    const double w = bend.weights[t];
    if (w == 0) continue;
    float x[4];
    const auto add = [&](const std::optional<GltfAccessor>& a, double* to) {
      if (!a) return;
      a->read(used_[i], x);
      for (int k = 0; k < 3; ++k) to[k] += w * double{x[k]};
    };
    add(targets_[t].positions, position);
    if (normal) add(targets_[t].normals, normal);
  }
}

void GltfDeformer::carry(const GltfBend& bend, size_t i, double position[3], double normal[3]) const {
  double m[3][4] = {};
  for (size_t k = 0; k < per_vertex_; ++k) {
    const Influence& influence = influences_[i * per_vertex_ + k];
    if (influence.weight == 0) continue;
    const Transform& joint = bend.joints[influence.joint];
    for (size_t r = 0; r < 3; ++r) {
      for (size_t c = 0; c < 4; ++c) m[r][c] += double{influence.weight} * joint.m[r][c];
    }
  }
  const double p[3] = {position[0], position[1], position[2]};
  for (size_t r = 0; r < 3; ++r) position[r] = m[r][0] * p[0] + m[r][1] * p[1] + m[r][2] * p[2] + m[r][3];
  if (!normal) return;
  // The inverse transpose but for its length: the cofactors, with the determinant's sign.
  const double n[3] = {normal[0], normal[1], normal[2]};
  double cofactor[3][3], determinant = 0;
  for (size_t r = 0; r < 3; ++r) {
    const size_t r1 = (r + 1) % 3, r2 = (r + 2) % 3;
    for (size_t c = 0; c < 3; ++c) {
      const size_t c1 = (c + 1) % 3, c2 = (c + 2) % 3;
      cofactor[r][c] = m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
    }
  }
  for (size_t c = 0; c < 3; ++c) determinant += m[0][c] * cofactor[0][c];
  const double sign = determinant < 0 ? -1 : 1;
  for (size_t r = 0; r < 3; ++r)
    normal[r] = sign * (cofactor[r][0] * n[0] + cofactor[r][1] * n[1] + cofactor[r][2] * n[2]);
}

MeshStep GltfDeformer::bent(const MeshStep& rest, const GltfBend& bend) const {
  MeshStep out;
  out.positions.reserve(rest.positions.size());
  out.normals.reserve(rest.normals.size());
  const bool carried = skinned() && !bend.joints.empty();
  for (size_t i = 0; i < rest.positions.size(); ++i) {
    const Vec3f& p = rest.positions[i];
    double position[3] = {double{p.x}, double{p.y}, double{p.z}}, normal[3] = {};
    const bool has_normal = !rest.normals.empty();
    if (has_normal) {
      const Vec3f& n = rest.normals[i];
      normal[0] = double{n.x}, normal[1] = double{n.y}, normal[2] = double{n.z};
    }
    double* const n = has_normal ? normal : nullptr;
    morph(bend, i, position, n);
    if (carried) carry(bend, i, position, n);
    out.positions.push_back(
        {static_cast<float>(position[0]), static_cast<float>(position[1]), static_cast<float>(position[2])});
    if (has_normal) out.normals.push_back(unit(normal));
  }
  return out;
}

GltfSkin read_gltf_skin(GltfScene& scene, GltfBuffers& buffers, const GltfValue& root, size_t index) {
  const GltfValue value = root.require("skins")[index];
  const size_t nodes = root.count("nodes"), count = value.count("joints");
  GltfSkin skin;
  if (count == 0) value.fail("has no joints");
  for (size_t j = 0; j < count; ++j) {
    const GltfValue joint = value.require("joints")[j];
    const double node = joint.number(0, 1e9);
    if (node >= static_cast<double>(nodes))
      joint.fail("refers to node " + std::to_string(static_cast<size_t>(node)) + ", but there are " +
                 std::to_string(nodes));
    skin.joints.push_back(static_cast<size_t>(node));
  }
  skin.inverse_binds.resize(count);
  scene.attempt_optional([&] {
    const int of = value.index_or_none("inverseBindMatrices", root.count("accessors"), "accessor");
    if (of < 0) return;
    const GltfAccessor matrices = buffers.accessor(static_cast<size_t>(of), {16});
    buffers.charge(16 * matrices.count(), value);
    if (matrices.count() < count) {
      value.mended("has " + std::to_string(matrices.count()) + " inverse bind matrices for " +
                   std::to_string(count) + " joints; the others are at the origin");
    }
    for (size_t j = 0; j < std::min(count, matrices.count()); ++j) {
      float x[16];
      matrices.read(j, x);
      std::array<double, 16> columns;
      std::copy(x, x + 16, columns.begin());
      if (!std::all_of(x, x + 16, [](float f) { return std::isfinite(f); })) {
        value.mended("has inverse bind matrices that are not finite; they are left out");
        continue;
      }
      skin.inverse_binds[j] = from_columns(columns);
      skin.inverse_binds[j].m[3] = {0, 0, 0, 1};
    }
  });
  return skin;
}

}  // namespace lightmill
