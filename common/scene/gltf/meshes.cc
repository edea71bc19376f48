#include "common/scene/gltf/meshes.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <unordered_map>

#include "common/scene/gltf/animation/mesh_steps.h"
#include "common/scene/mesh/mesh_check.h"
#include "common/scene/mesh/point_line_mesh.h"

namespace lightmill {
namespace {

enum Mode { kPoints, kLines, kLineLoop, kLineStrip, kTriangles, kStrip, kFan };

/// Numbers the vertices that triangles use in the order of first use, and the triangles after them.
std::vector<uint32_t> keep_used(std::vector<std::array<uint32_t, 3>>* triangles, size_t vertices) {
  std::vector<uint32_t> used;
  const auto renumber = [&](auto&& number_of) {
    for (auto& t : *triangles) {
      for (uint32_t& v : t) v = number_of(v);
    }
  };
  if (vertices / 4 <= triangles->size() + 1024) {
    constexpr uint32_t kNone = ~uint32_t{0};
    std::vector<uint32_t> number(vertices, kNone);
    renumber([&](uint32_t v) {
      if (number[v] == kNone) {
        number[v] = static_cast<uint32_t>(used.size());
        used.push_back(v);
      }
      return number[v];
    });
  } else {  // a few triangles of a large shared array
    std::unordered_map<uint32_t, uint32_t> number;
    renumber([&](uint32_t v) {
      const auto [entry, added] = number.try_emplace(v, static_cast<uint32_t>(used.size()));
      if (added) used.push_back(v);
      return entry->second;
    });
  }
  return used;
}

int mode_of(const GltfValue& primitive) {
  return static_cast<int>(primitive.number_or("mode", kTriangles, kPoints, kFan));
}

/// What a point or a line takes in numbers.
constexpr size_t kLooseCharge = 12 * 6;

Rgb clamped(const float* c) {
  const auto one = [](float x) { return std::isfinite(x) ? std::clamp(x, 0.0f, 1.0f) : 0.0f; };
  return {one(c[0]), one(c[1]), one(c[2])};
}

}  // namespace

const std::vector<GltfPrimitive>& GltfMeshes::primitives(size_t index) {
  if (const auto found = meshes_.find(index); found != meshes_.end()) return found->second;
  return meshes_[index] = read(index, nullptr);
}

std::vector<GltfPrimitive> GltfMeshes::bent(size_t index, const GltfBending& bending) {
  return read(index, &bending);
}

bool GltfMeshes::has_targets(size_t index) const {
  const GltfValue mesh = root_.require("meshes")[index].silent();
  for (size_t i = 0; i < mesh.count("primitives"); ++i) {
    const GltfValue primitive = mesh.require("primitives")[i];
    if (primitive.is_object() && primitive.count("targets") > 0) return true;
  }
  return false;
}

std::vector<GltfPrimitive> GltfMeshes::read(size_t index, const GltfBending* bending) {
  std::vector<GltfPrimitive> list;
  scene_.attempt([&] {
    const GltfValue mesh = root_.require("meshes")[index];
    const size_t count = mesh.count("primitives");
    if (count == 0) mesh.mended("has no primitives, so there is nothing to see");
    for (size_t i = 0; i < count; ++i) {
      const GltfValue primitives = mesh.require("primitives");
      scene_.attempt([&] { add(primitives[i], bending, &list); });
    }
  });
  return list;
}

std::vector<uint32_t> GltfMeshes::order_of(const GltfValue& primitive, size_t vertices) {
  const int of = primitive.index_or_none("indices", root_.count("accessors"), "accessor");
  std::vector<uint32_t> order;
  if (of >= 0) {
    const GltfAccessor indices = buffers_.accessor(static_cast<size_t>(of), {1});
    const GltfValue where = primitive.require("indices");
    if (!indices.holds_indices()) where.fail("must be unsigned whole numbers");
    buffers_.charge(indices.count(), where);
    order.resize(indices.count());
    for (size_t i = 0; i < order.size(); ++i) order[i] = indices.read_index(i);
  } else {
    constexpr size_t kMaxVertices = size_t{1} << 31;
    if (vertices > kMaxVertices) primitive.fail("has more than 2147483648 vertices");
    buffers_.charge(vertices, primitive);
    order.resize(vertices);
    for (size_t i = 0; i < vertices; ++i) order[i] = static_cast<uint32_t>(i);
  }
  return order;
}

std::vector<std::array<uint32_t, 3>> GltfMeshes::triangles(const GltfValue& primitive, size_t vertices) {
  const int mode = mode_of(primitive);
  const std::vector<uint32_t> order = order_of(primitive, vertices);
  std::vector<std::array<uint32_t, 3>> out;
  if (mode == kTriangles) {
    if (order.size() % 3 != 0)
      primitive.mended("has " + std::to_string(order.size()) +
                       " corners, which are no whole triangles; the rest is left out");
    for (size_t i = 0; i + 2 < order.size(); i += 3) out.push_back({order[i], order[i + 1], order[i + 2]});
  }
  for (size_t i = 0; mode != kTriangles && i + 2 < order.size(); ++i) {
    if (mode == kFan) {
      out.push_back({order[i + 1], order[i + 2], order[0]});
    } else {  // every other triangle of a strip is wound the other way round
      out.push_back({order[i], order[i + 1 + i % 2], order[i + 2 - i % 2]});
    }
  }
  // Strips repeat vertices to begin anew.
  if (mode != kTriangles)
    std::erase_if(out, [](const auto& t) { return t[0] == t[1] || t[1] == t[2] || t[0] == t[2]; });
  const size_t beyond = std::erase_if(out, [&](const auto& t) {
    return std::any_of(t.begin(), t.end(), [&](uint32_t v) { return v >= vertices; });
  });
  const std::string there = std::to_string(beyond) + " triangles refer to vertices beyond the " +
                            std::to_string(vertices) + " that there are";
  if (beyond > 0 && out.empty()) primitive.require("indices").fail(there);
  if (beyond > 0) primitive.mended(there + "; they are left out");
  return out;
}

std::shared_ptr<TriangleMesh> GltfMeshes::loose(const GltfValue& primitive, const GltfAccessor& positions,
                                                const std::optional<GltfAccessor>& colors) {
  const int mode = mode_of(primitive);
  const std::vector<uint32_t> order = order_of(primitive, positions.count());
  LooseVertices vertices;
  buffers_.charge(kLooseCharge * std::min(order.size(), kMostLoose) + order.size(), primitive);
  for (const uint32_t v : order) {
    constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN();  // what is there is left out
    float x[4] = {kNowhere, kNowhere, kNowhere, 1};
    const bool there = v < positions.count();
    if (there) positions.read(v, x);
    vertices.positions.push_back({x[0], x[1], x[2]});
    if (!colors) continue;
    if (!there) {
      vertices.colors.push_back({});
      continue;
    }
    x[3] = 1;
    colors->read(v, x);
    const Rgb c = clamped(x);
    vertices.colors.push_back({c.r, c.g, c.b, clamped(x + 1).b});
  }
  const std::string most = std::to_string(kMostLoose);
  if (mode == kPoints) {
    scene_.warning(primitive.pointer(), "points are shown as small spheres, of 1/500 of their extent");
    if (order.size() > kMostLoose) primitive.mended("has over " + most + " points; some are left out");
    return std::make_shared<TriangleMesh>(spheres_at(vertices, loose_radius(vertices)));
  }
  std::vector<std::array<uint32_t, 2>> segments;
  const auto count = static_cast<uint32_t>(order.size());
  for (uint32_t i = 0; i + 1 < count; i += mode == kLines ? 2 : 1) segments.push_back({i, i + 1});
  if (mode == kLineLoop && count > 2) segments.push_back({count - 1, 0});
  scene_.warning(primitive.pointer(), "lines are shown as thin tubes, of 1/1000 of their extent");
  if (segments.size() > kMostLoose) primitive.mended("has over " + most + " lines; some are left out");
  return std::make_shared<TriangleMesh>(tubes_along(vertices, segments, loose_radius(vertices) / 2));
}

std::optional<DracoMesh> GltfMeshes::unpacked(const GltfValue& primitive) {
  const auto extension = primitive.extension("KHR_draco_mesh_compression");
  if (!extension) return std::nullopt;
  const int view = extension->index_or_none("bufferView", root_.count("bufferViews"), "buffer view");
  if (view < 0) extension->fail("needs \"bufferView\"");
  const auto packed = buffers_.view_contents(static_cast<size_t>(view));
  return unpack_draco(*extension, *packed, [&](size_t numbers) { buffers_.charge(numbers, *extension); });
}

void GltfMeshes::bend(const GltfValue& primitive, const GltfDeformer& deformer, const GltfBending& bending,
                      TriangleMesh* mesh) {
  if (!deformer.skinned() && !deformer.morphs()) return;
  const MeshStep rest{std::move(mesh->positions), std::move(mesh->normals)};
  if (!bending.moves) {
    MeshStep step = deformer.bent(rest, bending.still);
    mesh->positions = std::move(step.positions);
    mesh->normals = std::move(step.normals);
    return;
  }
  std::vector<MeshStep> steps = steps_of(deformer, rest, bending);
  buffers_.charge(6 * steps.size() * rest.positions.size(), primitive);
  mesh->positions = std::move(steps.front().positions);
  mesh->normals = std::move(steps.front().normals);
  mesh->later.assign(std::make_move_iterator(steps.begin() + 1), std::make_move_iterator(steps.end()));
}

void GltfMeshes::add(const GltfValue& primitive, const GltfBending* bending,
                     std::vector<GltfPrimitive>* out) {
  const size_t accessors = root_.count("accessors");
  std::optional<DracoMesh> draco = unpacked(primitive);
  const GltfValue attributes = primitive.require("attributes");
  const auto attribute = [&](const std::string& name,
                             std::initializer_list<int> components) -> std::optional<GltfAccessor> {
    const int of = attributes.index_or_none(name.c_str(), accessors, "accessor");
    if (of < 0) return std::nullopt;
    if (draco) {
      if (const auto held = draco->attributes.find(name); held != draco->attributes.end())
        return buffers_.unpacked(static_cast<size_t>(of), components, held->second);
    }
    return buffers_.accessor(static_cast<size_t>(of), components);
  };
  const auto positions = attribute("POSITION", {3});
  if (!positions || positions->count() == 0) {
    primitive.mended("has no POSITION, so there is nothing to see");
    return;
  }
  if (draco && positions->count() != draco->vertices)  // of an accessor beside it
    attributes.fail("have " + std::to_string(positions->count()) + " positions, but the Draco mesh has " +
                    std::to_string(draco->vertices) + " vertices");
  // What a picture can do without.
  const auto optional = [&](const std::string& name,
                            std::initializer_list<int> components) -> std::optional<GltfAccessor> {
    std::optional<GltfAccessor> found;
    scene_.attempt_optional([&] { found = attribute(name, components); });
    if (!found || found->count() >= positions->count()) return found;
    attributes.mended(name + " has " + std::to_string(found->count()) + " elements for " +
                      std::to_string(positions->count()) + " vertices; it is left out");
    return std::nullopt;
  };
  const auto colors = optional("COLOR_0", {3, 4});
  const int material = primitive.index_or_none("material", root_.count("materials"), "material");
  GltfPrimitive result;
  result.surface = materials_.surface(material, colors.has_value());
  if (result.surface.invisible) return;
  result.location = {scene_.name, 1, 1};
  if (mode_of(primitive) < kTriangles) {
    if (bending != nullptr) scene_.unsupported(primitive.pointer(), "points and lines that bend");
    result.mesh = loose(primitive, *positions, colors);
    if (!result.mesh->triangles.empty()) out->push_back(std::move(result));
    return;
  }
  const auto normals = optional("NORMAL", {3});
  const auto uv_set = [&](int n) { return optional("TEXCOORD_" + std::to_string(n), {2}); };
  const auto uvs = uv_set(result.surface.uv_set);
  std::optional<GltfAccessor> second_uvs;
  if (result.surface.second_uv_set >= 0) second_uvs = uv_set(result.surface.second_uv_set);
  if (result.surface.textured && !uvs)
    attributes.mended("has no TEXCOORD_" + std::to_string(result.surface.uv_set) +
                      ", by which its material has textures");
  auto mesh = std::make_shared<TriangleMesh>();
  mesh->triangles = draco ? std::move(draco->triangles) : triangles(primitive, positions->count());
  const std::vector<uint32_t> used = keep_used(&mesh->triangles, positions->count());
  buffers_.charge(used.size(), primitive);
  mesh->positions.reserve(used.size());
  for (const uint32_t v : used) {
    float x[4];
    positions->read(v, x);
    mesh->positions.push_back({x[0], x[1], x[2]});
    if (normals) {
      normals->read(v, x);
      mesh->normals.push_back({x[0], x[1], x[2]});
    }
    if (uvs) {
      uvs->read(v, x);
      mesh->uvs.push_back({x[0], 1 - x[1]});  // v points up here
    }
    if (second_uvs) {
      second_uvs->read(v, x);
      mesh->second_uvs.push_back({x[0], 1 - x[1]});
    }
    if (colors) {
      x[3] = 1;
      colors->read(v, x);
      const Rgb c = clamped(x);
      mesh->colors.push_back({c.r, c.g, c.b, clamped(x + 1).b});
    }
  }
  if (bending != nullptr) {
    const GltfDeformer deformer(scene_, buffers_, root_, primitive, used, optional, positions->count(),
                                bending->still.joints.size());
    result.skinned = deformer.skinned();
    bend(primitive, deformer, *bending, mesh.get());
  }
  const bool had_triangles = !mesh->triangles.empty();
  const MeshRepairs repairs = mend_values(mesh.get());
  const auto say = [&](size_t n, const char* what) {
    if (n > 0) primitive.mended(std::to_string(n) + what);
  };
  say(repairs.triangles, " triangles with a vertex that is not finite are left out");
  if (repairs.triangles > 0 && mesh->triangles.empty()) primitive.fail("no vertex is finite");
  say(repairs.uvs, " texture coordinates that are not finite count as 0");
  if (mesh->later.empty())  // else they may have some later
    say(drop_zero_area_triangles(mesh.get()), " triangles without area are left out");
  say(mend_zero_normals(mesh.get()), " normals without direction are taken from the triangles");
  mend_later(mesh.get());
  if (mesh->triangles.empty()) {
    if (!had_triangles) primitive.mended("has no triangles, so there is nothing to see");
    return;
  }
  result.mesh = std::move(mesh);
  out->push_back(std::move(result));
}

}  // namespace lightmill
