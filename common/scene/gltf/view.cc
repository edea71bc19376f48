#include "common/scene/gltf/view.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr int kLongerSide = 1280;  // pixels
constexpr double kDefaultAspect = 16.0 / 9;

/// Rotation and position without scale; false if the axes have no length.
bool without_scale(const Transform& t, Transform* out) {
  *out = t;
  for (size_t j = 0; j < 3; ++j) {
    const double n = std::hypot(t.m[0][j], t.m[1][j], t.m[2][j]);
    if (!(n > 0)) return false;
    for (size_t i = 0; i < 3; ++i) out->m[i][j] /= n;
  }
  return true;
}

/// Our camera space looks along +z: glTF's with z turned round.
Transform camera_space(const Transform& gltf_camera_to_world) {
  return gltf_camera_to_world * scaling({1, 1, -1});
}

void set_resolution(FilmDescription* film, double aspect) {
  const double longer = kLongerSide, shorter = std::max(1.0, longer * std::min(aspect, 1 / aspect));
  film->width = static_cast<int>(std::lround(aspect >= 1 ? longer : shorter));
  film->height = static_cast<int>(std::lround(aspect >= 1 ? shorter : longer));
}

void use_camera(GltfScene& out, const GltfPlacedCamera& placed) {
  constexpr double kSmallest = 1e-6, kLargest = 1e30, kWidestAspect = 1000;
  const GltfValue& value = placed.camera;
  CameraDescription camera;
  Transform rigid;
  if (!without_scale(placed.node_to_world, &rigid)) value.fail("its node has no orientation");
  camera.camera_to_world = camera_space(rigid);
  const std::string type = value.require("type").text();
  if (type == "perspective") {
    const GltfValue lens = value.require("perspective");
    const double yfov = lens.require("yfov").number(1e-4, 179.9 / kDegrees);
    const double aspect = lens.number_or("aspectRatio", kDefaultAspect, 1 / kWidestAspect, kWidestAspect);
    set_resolution(&out.scene.film, aspect);
    // Ours is of the shorter side.
    camera.fov_degrees = (aspect >= 1 ? yfov : 2 * std::atan(std::tan(yfov / 2) * aspect)) * kDegrees;
  } else if (type == "orthographic") {
    const GltfValue lens = value.require("orthographic");
    const double x = std::abs(lens.require("xmag").number(-kLargest, kLargest));
    const double y = std::abs(lens.require("ymag").number(-kLargest, kLargest));
    if (!(x >= kSmallest && y >= kSmallest && x / y <= kWidestAspect && y / x <= kWidestAspect))
      lens.fail("\"xmag\" and \"ymag\" must not be 0, nor one of them over 1000 times the other");
    camera.kind = CameraKind::kOrthographic;
    camera.screen_window = {-x, x, -y, y};
    set_resolution(&out.scene.film, x / y);
  } else {
    value.require("type").fail("must be \"perspective\" or \"orthographic\", not " + in_quotes(type));
  }
  out.scene.camera = camera;
}

struct Box {
  Vec3d low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
  void add(const Vec3d& p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
};

/// The whole scene from the front, a little from the right and above.
void frame_scene(GltfScene& out) {
  constexpr double kFov = 40, kMargin = 1.05;
  Box box;
  const auto add = [&](const ShapeDescription& s, const Transform& to_world) {
    for (const Vec3f& v : std::get<MeshShape>(s.kind).mesh->positions)
      box.add(transform_point(to_world, {v.x, v.y, v.z}));
  };
  for (const ShapeDescription& s : out.scene.shapes) add(s, s.object_to_world);
  for (const InstanceDescription& i : out.scene.instances) {
    for (const ShapeDescription& s : out.scene.objects[static_cast<size_t>(i.object)].shapes)
      add(s, i.object_to_world);
  }
  if (box.low.x > box.high.x) box.low = box.high = {};
  const Vec3d center{(box.low.x + box.high.x) / 2, (box.low.y + box.high.y) / 2,
                     (box.low.z + box.high.z) / 2};
  const Vec3d towards{0.35, 0.35, 0.87};
  const auto camera_at = [&](double distance) {
    const double d = distance / length(towards);
    const Vec3d eye{center.x + towards.x * d, center.y + towards.y * d, center.z + towards.z * d};
    // look_at's x axis is for left-handed worlds; mirrored it is right-handed.
    return inverse(scaling({-1, 1, 1}) * look_at(eye, center, {0, 1, 0}));
  };
  // As near as every corner of the box is still in the picture.
  const double up = std::tan(kFov / 2 / kDegrees), right = up * kDefaultAspect;
  const double size =
      std::max(length({box.high.x - box.low.x, box.high.y - box.low.y, box.high.z - box.low.z}), 1e-30);
  const Transform to_camera = inverse(camera_at(size));
  double distance = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d p =
        transform_point(to_camera, {corner & 1 ? box.high.x : box.low.x, corner & 2 ? box.high.y : box.low.y,
                                    corner & 4 ? box.high.z : box.low.z});
    distance = std::max({distance, size - p.z + std::abs(p.y) / up, size - p.z + std::abs(p.x) / right});
  }
  out.scene.camera = CameraDescription{};
  out.scene.camera.camera_to_world = camera_at(std::max(distance * kMargin, 1e-30));
  out.scene.camera.fov_degrees = kFov;
  set_resolution(&out.scene.film, kDefaultAspect);
}

}  // namespace

LightKind gltf_light(const GltfValue& light, const Transform& node_to_world) {
  constexpr double kBrightest = 1e30;
  const Rgb color = light.color_or("color", {1, 1, 1}, kBrightest);
  const auto i = static_cast<float>(light.number_or("intensity", 1, 0, kBrightest));
  const Rgb intensity{color.r * i, color.g * i, color.b * i};
  if (!std::isfinite(intensity.r + intensity.g + intensity.b))
    light.fail("is brighter than float can hold; lower its \"intensity\"");
  const Vec3d position{node_to_world.m[0][3], node_to_world.m[1][3], node_to_world.m[2][3]};
  Vec3d direction = transform_vector(node_to_world, {0, 0, -1});
  const double n = length(direction);
  direction = {direction.x / n, direction.y / n, direction.z / n};
  const std::string type = light.require("type").text();
  if (type == "point") return PointLight{intensity, position};
  if (type == "directional") return DistantLight{intensity, direction};
  if (type != "spot")
    light.require("type").fail("must be \"point\", \"spot\" or \"directional\", not " + in_quotes(type));
  constexpr double kNarrowest = kLeastCone / kDegrees;
  SpotLight spot{intensity, position, direction};
  double inner = 0, outer = std::numbers::pi / 4;
  if (const auto cone = light.find("spot")) {
    inner = cone->number_or("innerConeAngle", inner, 0, std::numbers::pi / 2);
    outer = cone->number_or("outerConeAngle", outer, kNarrowest, std::numbers::pi / 2 + 1e-6);
    if (inner > outer) cone->fail("\"innerConeAngle\" must not be larger than \"outerConeAngle\"");
  }
  spot.total_width = outer * kDegrees;
  spot.falloff_start = inner * kDegrees;
  return spot;
}

void choose_gltf_camera(GltfScene& scene, const std::vector<GltfPlacedCamera>& cameras,
                        const std::string& wanted) {
  const auto names = [&] {
    std::string list;
    for (const GltfPlacedCamera& c : cameras) {
      if (list.size() > 400) return list + ", ...";
      list += (list.empty() ? "" : ", ") + in_quotes(c.node_name.empty() ? c.camera_name : c.node_name);
    }
    return list;
  };
  if (!wanted.empty()) {
    for (const GltfPlacedCamera& c : cameras) {
      if (c.node_name != wanted && c.camera_name != wanted) continue;
      scene.attempt([&] { use_camera(scene, c); });
      return;
    }
    scene.error({"/cameras", "no camera of the scene is called " + in_quotes(wanted) +
                                 (cameras.empty() ? "; there is none" : "; there are " + names())});
    return;
  }
  if (cameras.empty()) {
    scene.warning("", "the scene has no camera; it is shown as a whole, from the front");
    return frame_scene(scene);
  }
  scene.attempt([&] { use_camera(scene, cameras.front()); });
  if (cameras.size() > 1)
    scene.warning("/cameras",
                  "there are several cameras, and the first is used; --camera chooses of " + names());
}

}  // namespace lightmill
