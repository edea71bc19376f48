#pragma once
// How things move while the shutter is open: between two transforms, each taken apart into a translation, a
// rotation and a stretch (Shoemake and Duff, "Matrix animation and polar decomposition", 1992), as pbrt does.
#include "common/scene/description.h"

namespace lightmill {

/// The way from one affine transform to another of the same handedness: translation and stretch change
/// evenly, the rotation turns evenly about one axis, the shorter way round (which is what slerp does). A part
/// of the way is the way between its ends.
class Motion {
 public:
  Motion(const Transform& start, const Transform& end);
  /// At `s` in [0, 1]; at 0 and 1 the very transforms that it was made from.
  Transform at(double s) const;

  const Vec3d& axis() const { return axis_; }  // unit; in the space that the transforms lead to
  double degrees() const { return degrees_; }  // in [0, 180]
  /// The stretch stays what it is, within 1e-5.
  bool is_rigid() const;

 private:
  Transform start_, end_;
  Transform rotation_;             // at the start
  Transform stretch_, stretched_;  // before the rotation, at both ends
  Vec3d axis_{1, 0, 0};
  double degrees_ = 0;
  bool linear_part_moves_ = true;
};

/// The way of a thing of a scene, from `start`: a motion, or several in equal times
/// (SceneDescription::between).
class Way {
 public:
  /// `moves_to` as a shape's; if it is -1 the thing stands still.
  Way(const Transform& start, int moves_to, const SceneDescription& scene);
  /// At `s` in [0, 1].
  Transform at(double s) const;
  /// That it turns by, in all.
  double degrees() const;

 private:
  std::vector<Motion> parts_;
};

/// Whether something can move from `start` to `end`: between transforms of different handedness it would be
/// flat on its way.
bool can_move(const Transform& start, const Transform& end);

/// Times of a scene file, in its units.
struct MotionTimes {
  double shutter_opens = 0, shutter_closes = 1;  // opens < closes
  double starts = 0, ends = 1;                   // of all motion; starts < ends
};

/// Makes of transforms at the start and the end of motion those at the shutter's opening and closing, and
/// sets scene->shutter. Before the start things stand where they start, after the end where they end; if
/// nothing moves while the shutter is open, nothing moves.
void settle_motion(const MotionTimes& times, SceneDescription* scene);
/// A point, spot or distant light of no width whose space moves from `start`, at which it has been described.
struct LightMotion {
  size_t light = 0;  // index into SceneDescription::lights
  Transform start, end;
};
/// The same for lights: their places at the shutter's opening, and later ones. After settle_motion.
void settle_lights(const MotionTimes& times, const std::vector<LightMotion>& lights, SceneDescription* scene);

}  // namespace lightmill
