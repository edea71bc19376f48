#include "common/scene/gltf/view.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "common/scene/motion.h"
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

/// A camera turns about one axis and goes straight.
void set_camera_way(GltfScene& out, const GltfPlacedCamera& placed, CameraDescription* camera) {
  Transform first, last;
  const Transform& middle = placed.way[placed.way.size() / 2];
  if (!without_scale(placed.way.front(), &first) || !without_scale(placed.way.back(), &last)) return;
  const Motion motion(camera_space(first), camera_space(last));
  if (!motion.is_rigid()) {
    placed.camera.mended("its node is skewed while the shutter is open; it stands still");
    return;
  }
  camera->camera_to_world = camera_space(first);
  if (placed.way.size() == 1) return;
  camera->moves_to = static_cast<int>(out.scene.later.size());
  out.scene.later.push_back(camera_space(last));
  if (placed.way.size() == 2) return;
  // What turns while it goes round something is a little off a straight way.
  constexpr double kMuch = 0.05;
  const auto &a = placed.way.front().m, &b = placed.way.back().m, &m = middle.m;
  const auto s = motion.at(0.5).m;
  const double length = std::hypot(b[0][3] - a[0][3], b[1][3] - a[1][3], b[2][3] - a[2][3]);
  if (std::hypot(m[0][3] - s[0][3], m[1][3] - s[1][3], m[2][3] - s[2][3]) > kMuch * length)
    placed.camera.mended("goes along a curve while the shutter is open; it goes straight");
}

void use_camera(GltfScene& out, const GltfPlacedCamera& placed) {
  constexpr double kSmallest = 1e-6, kLargest = 1e30, kWidestAspect = 1000;
  const GltfValue& value = placed.camera;
  CameraDescription camera;
  Transform rigid;
  if (!without_scale(placed.node_to_world, &rigid)) value.fail("its node has no orientation");
  camera.camera_to_world = camera_space(rigid);
  if (!placed.way.empty()) set_camera_way(out, placed, &camera);
  const std::string type = value.require("type").text();
  if (type == "perspective") {
    const GltfValue lens = value.require("perspective");
    constexpr double kLeast = 1e-4, kMost = 179.9 / kDegrees, kUsual = 45 / kDegrees;
    double yfov = lens.number_or("yfov", 0, -1e30, 1e30);
    if (!(yfov >= kLeast && yfov <= kMost)) {
      lens.mended("\"yfov\" must be above 0 and below pi; the camera gets 45 degrees");
      yfov = kUsual;
    }
    double aspect = lens.number_or("aspectRatio", kDefaultAspect, 0, kWidestAspect);
    if (!(aspect >= 1 / kWidestAspect)) {
      lens.mended("\"aspectRatio\" must be above 0; the picture is 16 to 9");
      aspect = kDefaultAspect;
    }
    set_resolution(&out.scene.film, aspect);
    // Ours is of the shorter side.
    camera.fov_degrees = (aspect >= 1 ? yfov : 2 * std::atan(std::tan(yfov / 2) * aspect)) * kDegrees;
  } else if (type == "orthographic") {
    const GltfValue lens = value.require("orthographic");
    double x = std::abs(lens.number_or("xmag", 0, -kLargest, kLargest));
    double y = std::abs(lens.number_or("ymag", 0, -kLargest, kLargest));
    if (!(x >= kSmallest && y >= kSmallest && x / y <= kWidestAspect && y / x <= kWidestAspect)) {
      const double larger = std::max(x, y);
      lens.mended(
          "\"xmag\" and \"ymag\" must not be 0, nor one of them over 1000 times the other; the larger is "
          "used "
          "for both");
      x = y = larger >= kSmallest ? larger : 1;
    }
    camera.kind = CameraKind::kOrthographic;
    camera.screen_window = {-x, x, -y, y};
    set_resolution(&out.scene.film, x / y);
  } else {
    value.require("type").fail("must be \"perspective\" or \"orthographic\", not " + in_quotes(type));
  }
  out.scene.camera = camera;
}

/// Around all that is in the scene.
GltfBox bounds_of(const GltfScene& out) {
  GltfBox box;
  const auto add = [&](const ShapeDescription& s, const Transform& to_world) {
    for (const Vec3f& v : std::get<MeshShape>(s.kind).mesh->positions)
      box.add(transform_point(to_world, {v.x, v.y, v.z}));
  };
  for (const ShapeDescription& s : out.scene.shapes) add(s, s.object_to_world);
  for (const InstanceDescription& i : out.scene.instances) {
    for (const ShapeDescription& s : out.scene.objects[static_cast<size_t>(i.object)].shapes)
      add(s, i.object_to_world);
  }
  return box;
}

/// A box from the front, a little from the right and above.
void frame_scene(GltfScene& out, GltfBox box) {
  constexpr double kFov = 40, kMargin = 1.05;
  if (box.empty()) box.low = box.high = {};
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
    const Vec3d p = transform_point(to_camera, box.corner(corner));
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
  Rgb intensity{color.r * i, color.g * i, color.b * i};
  if (!std::isfinite(intensity.r + intensity.g + intensity.b)) {
    light.mended("is brighter than float can hold; it is clamped");
    const auto finite = [](float x) { return std::min(x, static_cast<float>(kBrightest)); };
    intensity = {finite(intensity.r), finite(intensity.g), finite(intensity.b)};
  }
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
  if (const auto cone = light.find_object("spot")) {
    inner = cone->number_or("innerConeAngle", inner, 0, std::numbers::pi / 2);
    outer = cone->number_or("outerConeAngle", outer, kNarrowest, std::numbers::pi / 2 + 1e-6);
    if (inner > outer) {
      cone->mended("\"innerConeAngle\" is larger than \"outerConeAngle\"; it is made as large");
      inner = outer;
    }
  }
  spot.total_width = outer * kDegrees;
  spot.falloff_start = inner * kDegrees;
  return spot;
}

namespace {

/// What each camera answers to: the name of its node, else its own, else its number. A name that was there
/// before gets a number: "name.1".
std::vector<std::string> labels_of(const std::vector<GltfPlacedCamera>& cameras) {
  std::vector<std::string> labels;
  std::map<std::string, int> seen;
  for (size_t i = 0; i < cameras.size(); ++i) {
    const GltfPlacedCamera& c = cameras[i];
    const std::string& name = c.node_name.empty() ? c.camera_name : c.node_name;
    const int before = seen[name]++;
    labels.push_back(name.empty() ? std::to_string(i)
                     : before > 0 ? name + "." + std::to_string(before)
                                  : name);
  }
  return labels;
}

/// Index of the camera that is meant: by its label, by a name of its own, or by its number. -1: none.
int find_camera(const std::vector<GltfPlacedCamera>& cameras, const std::vector<std::string>& labels,
                const std::string& wanted) {
  if (const auto l = std::find(labels.begin(), labels.end(), wanted); l != labels.end())
    return static_cast<int>(l - labels.begin());
  const auto named = std::find_if(cameras.begin(), cameras.end(), [&](const GltfPlacedCamera& c) {
    return c.node_name == wanted || c.camera_name == wanted;
  });
  if (named != cameras.end()) return static_cast<int>(named - cameras.begin());
  size_t number = 0;
  const auto [end, error] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), number);
  const bool is_number = error == std::errc() && end == wanted.data() + wanted.size();
  return is_number && number < cameras.size() ? static_cast<int>(number) : -1;
}

std::string list_of(const std::vector<std::string>& labels) {
  constexpr size_t kMaxShown = 400;
  std::string list;
  for (const std::string& label : labels) {
    if (list.size() > kMaxShown) return list + ", ...";
    list += (list.empty() ? "" : ", ") + in_quotes(label);
  }
  return list;
}

}  // namespace

void choose_gltf_camera(GltfScene& scene, const std::vector<GltfPlacedCamera>& cameras,
                        const std::string& wanted, const GltfBox& reach) {
  const std::vector<std::string> labels = labels_of(cameras);
  if (!wanted.empty()) {
    if (const int chosen = find_camera(cameras, labels, wanted); chosen >= 0) {
      scene.attempt([&] { use_camera(scene, cameras[static_cast<size_t>(chosen)]); });
      return;
    }
    scene.error(
        {"/cameras", "no camera of the scene is called " + in_quotes(wanted) +
                         (cameras.empty() ? "; there is none" : "; there are " + list_of(labels)) +
                         (cameras.size() > 1 ? ", or 0 to " + std::to_string(cameras.size() - 1) : "")});
    return;
  }
  if (cameras.empty()) {
    scene.warning("", "the scene has no camera; it is shown as a whole, from the front");
    return frame_scene(scene, reach.empty() ? bounds_of(scene) : reach);
  }
  scene.attempt([&] { use_camera(scene, cameras.front()); });
  if (cameras.size() > 1)
    scene.warning("/cameras",
                  "there are several cameras, and the first is used; --camera chooses of " + list_of(labels));
}

}  // namespace lightmill
