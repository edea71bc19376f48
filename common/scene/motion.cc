#include "common/scene/motion.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "common/scene/transform.h"

namespace lightmill {
namespace {

Transform linear_part(const Transform& t) {
  Transform out = t;
  for (size_t i = 0; i < 3; ++i) out.m[i][3] = 0;
  return out;
}
Transform transposed(const Transform& t) {
  Transform out;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) out.m[i][j] = t.m[j][i];
  }
  return out;
}
double largest_difference(const Transform& a, const Transform& b) {
  double most = 0;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) most = std::max(most, std::fabs(a.m[i][j] - b.m[i][j]));
  }
  return most;
}

/// The rotation R of t = R S with a symmetric S, by Newton's iteration for the polar factor, scaled so that
/// it converges quickly however stretched t is (Higham 1986). A mirroring t has a negative S.
Transform rotation_of(const Transform& t) {
  Transform q = linear_part(t);
  const double sign = determinant3(q) < 0 ? -1 : 1;
  for (int i = 0; i < 100; ++i) {
    const Transform back = transposed(inverse(q));
    double size = 0, back_size = 0;
    for (size_t r = 0; r < 3; ++r) {
      for (size_t c = 0; c < 3; ++c) {
        size += q.m[r][c] * q.m[r][c];
        back_size += back.m[r][c] * back.m[r][c];
      }
    }
    const double factor = std::sqrt(std::sqrt(back_size / size));
    Transform next;
    for (size_t r = 0; r < 3; ++r) {
      for (size_t c = 0; c < 3; ++c) next.m[r][c] = 0.5 * (factor * q.m[r][c] + back.m[r][c] / factor);
    }
    const double change = largest_difference(next, q);
    q = next;
    if (change < 1e-15) break;
  }
  for (size_t r = 0; r < 3; ++r) {
    for (size_t c = 0; c < 3; ++c) q.m[r][c] *= sign;
  }
  return q;
}

/// Axis (times the sine of half the angle) and cosine of half the angle of a rotation, as a unit quaternion
/// of the shorter way: by the component that is surely large (Shepperd 1978).
std::pair<Vec3d, double> quaternion(const Transform& r) {
  const auto& m = r.m;
  const double trace = m[0][0] + m[1][1] + m[2][2];
  Vec3d v{m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]};
  double w = 1 + trace;
  if (trace <= 0) {
    const double d[3] = {m[0][0], m[1][1], m[2][2]};
    const size_t i = static_cast<size_t>(std::max_element(d, d + 3) - d), j = (i + 1) % 3, k = (i + 2) % 3;
    double q[3];
    q[i] = 1 + d[i] - d[j] - d[k];
    q[j] = m[i][j] + m[j][i];
    q[k] = m[i][k] + m[k][i];
    w = m[k][j] - m[j][k];
    v = {q[0], q[1], q[2]};
  }
  const double n = std::copysign(std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z + w * w), w);
  return {{v.x / n, v.y / n, v.z / n}, w / n};
}

Transform between(const Transform& a, const Transform& b, double s) {
  Transform out;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 4; ++j) out.m[i][j] = (1 - s) * a.m[i][j] + s * b.m[i][j];
  }
  return out;
}

}  // namespace

Motion::Motion(const Transform& start, const Transform& end) : start_(start), end_(end) {
  if (linear_part(start).m == linear_part(end).m) {
    linear_part_moves_ = false;
    return;
  }
  rotation_ = rotation_of(start);
  const Transform last = rotation_of(end);
  stretch_ = transposed(rotation_) * linear_part(start);
  stretched_ = transposed(last) * linear_part(end);
  const auto [v, w] = quaternion(last * transposed(rotation_));
  const double sine = length(v);
  if (sine < 1e-14) return;  // rounding alone
  axis_ = {v.x / sine, v.y / sine, v.z / sine};
  degrees_ = 2 * std::atan2(sine, w) * 180 / std::numbers::pi;
}

Transform Motion::at(double s) const {
  if (s <= 0) return start_;
  if (s >= 1) return end_;
  Transform out = start_;
  if (linear_part_moves_)
    out = rotation(s * degrees_, axis_) * (rotation_ * between(stretch_, stretched_, s));
  for (size_t i = 0; i < 3; ++i) out.m[i][3] = (1 - s) * start_.m[i][3] + s * end_.m[i][3];
  return out;
}

bool Motion::is_rigid() const {
  if (!linear_part_moves_) return true;
  double size = 0;
  for (size_t i = 0; i < 3; ++i) size = std::max(size, std::fabs(stretch_.m[i][i]));
  return largest_difference(stretch_, stretched_) <= 1e-5 * size;
}

Way::Way(const Transform& start, int moves_to, const SceneDescription& scene) {
  std::vector<Transform> poses{start};
  if (const auto between = scene.between.find(moves_to); between != scene.between.end())
    poses.insert(poses.end(), between->second.begin(), between->second.end());
  poses.push_back(moves_to < 0 ? start : scene.later[static_cast<size_t>(moves_to)]);
  for (size_t i = 0; i + 1 < poses.size(); ++i) parts_.emplace_back(poses[i], poses[i + 1]);
}

Transform Way::at(double s) const {
  const double along = s * static_cast<double>(parts_.size());
  const size_t part = std::min(static_cast<size_t>(along), parts_.size() - 1);
  return parts_[part].at(along - static_cast<double>(part));
}

double Way::degrees() const {
  double sum = 0;
  for (const Motion& part : parts_) sum += part.degrees();
  return sum;
}

bool can_move(const Transform& start, const Transform& end) {
  return (determinant3(start) < 0) == (determinant3(end) < 0);
}

namespace {

/// The part of all ways that is gone while the shutter is open, and when that is. Nothing moves if it is
/// none.
struct SettledPart {
  double first = 0, last = 0;
  bool moves = false;
};
SettledPart settle_shutter(const MotionTimes& t, ShutterDescription* shutter) {
  // How far along its way everything is when the shutter is open for the fraction u: begin + u rate.
  const double begin = (t.shutter_opens - t.starts) / (t.ends - t.starts),
               close = (t.shutter_closes - t.starts) / (t.ends - t.starts), rate = close - begin;
  const double first = std::clamp(begin, 0.0, 1.0), last = std::clamp(close, 0.0, 1.0);
  const bool moves = first < last;
  if (moves) {
    shutter->moves_from = begin < 0 ? -begin / rate : 0;
    shutter->moves_until = close > 1 ? (1 - begin) / rate : 1;
  }
  return {first, last, moves};
}

/// A light as it is when its space has gone on by `motion`.
LightKind moved_light(LightKind light, const Transform& motion) {
  const auto turn = [&](Vec3d* direction) {
    const Vec3d d = transform_vector(motion, *direction);
    const double n = length(d);
    if (n > 0) *direction = {d.x / n, d.y / n, d.z / n};
  };
  if (auto* point = std::get_if<PointLight>(&light))
    point->position = transform_point(motion, point->position);
  if (auto* spot = std::get_if<SpotLight>(&light)) {
    spot->position = transform_point(motion, spot->position);
    turn(&spot->direction);
  }
  if (auto* lamp = std::get_if<AreaLamp>(&light)) lamp->light_to_world = motion * lamp->light_to_world;
  if (auto* distant = std::get_if<DistantLight>(&light)) turn(&distant->direction);
  return light;
}

}  // namespace

void settle_lights(const MotionTimes& times, const std::vector<LightMotion>& lights,
                   SceneDescription* scene) {
  if (lights.empty()) return;
  const SettledPart part = settle_shutter(times, &scene->shutter);
  for (const LightMotion& l : lights) {
    LightDescription& light = scene->lights[l.light];
    const LightKind described = light.kind;
    const Motion motion(l.start, l.end);
    const Transform back = inverse(l.start);
    const auto at = [&](double s) {
      return moved_light(described, motion.at(part.first + s * (part.last - part.first)) * back);
    };
    light.kind = at(0);
    if (!part.moves) continue;
    constexpr double kDegrees = 2;
    constexpr int kMostSegments = 64;
    int segments = 1;
    while (segments < kMostSegments && motion.degrees() * (part.last - part.first) > kDegrees * segments)
      segments *= 2;
    for (int i = 1; i <= segments; ++i) light.later.push_back(at(static_cast<double>(i) / segments));
  }
}

void settle_motion(const MotionTimes& t, SceneDescription* scene) {
  const SettledPart part = settle_shutter(t, &scene->shutter);
  const double first = part.first, last = part.last;
  const bool moves = part.moves;
  if (moves && first == 0 && last == 1) return;
  // Those of the same index have the same transforms.
  std::map<int, std::pair<Transform, Transform>> settled;
  const auto settle = [&](Transform* start, int* moves_to) {
    if (*moves_to < 0) return;
    const auto [found, is_new] = settled.try_emplace(*moves_to);
    if (is_new) {
      const Way way(*start, *moves_to, *scene);
      found->second = {way.at(first), way.at(last)};
      scene->later[static_cast<size_t>(*moves_to)] = found->second.second;
      if (const auto between = scene->between.find(*moves_to); between != scene->between.end()) {
        const double parts = static_cast<double>(between->second.size() + 1);
        for (size_t i = 0; i < between->second.size(); ++i)
          between->second[i] = way.at(first + (last - first) * static_cast<double>(i + 1) / parts);
      }
    }
    *start = found->second.first;
    if (!moves) *moves_to = -1;
  };
  const auto settle_shapes = [&](std::vector<ShapeDescription>* shapes) {
    for (ShapeDescription& s : *shapes) settle(&s.object_to_world, &s.moves_to);
  };
  settle_shapes(&scene->shapes);
  for (ObjectDescription& object : scene->objects) settle_shapes(&object.shapes);
  for (InstanceDescription& i : scene->instances) settle(&i.object_to_world, &i.moves_to);
  for (MediumDescription& m : scene->media) {
    if (!m.grid || m.grid->moves_to < 0) continue;
    auto grid = std::make_shared<MediumGrid>(*m.grid);
    settle(&grid->medium_to_world, &grid->moves_to);
    m.grid = std::move(grid);
  }
  settle(&scene->camera.camera_to_world, &scene->camera.moves_to);
  if (!moves) {
    scene->later.clear();
    scene->between.clear();
  }
}

}  // namespace lightmill
