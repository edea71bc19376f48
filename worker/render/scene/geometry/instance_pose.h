#pragma once
// Where an instance is at a time: its record (placement.h), made anew for every ray if the instance moves.
//
// A moving instance has poses at even times. Between two poses A and the position change linearly. So every
// point of its object moves on a straight line, and a box around two poses holds all between
// (embree_instances.cc). There are as many poses as the curve needs to be smooth (instancing.cc). W is the
// inverse of A as A is rounded, so the bounds of the rounding of rays hold at any time.
#include <cmath>

#include "worker/render/math/lanes.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// Fills in what follows from A: W, and the constants of both.
inline void finish_record(float* record) {
  double a[3][3], w[3][3];
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) a[i][j] = double{record[kInstanceA + 3 * i + j]};
  }
  const double det = a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
                     a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
                     a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
  const double scale = 1 / det;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      // Cyclic indices give the cofactor its sign.
      const int r0 = (j + 1) % 3, r1 = (j + 2) % 3, c0 = (i + 1) % 3, c1 = (i + 2) % 3;
      w[i][j] = scale * (a[r0][c0] * a[r1][c1] - a[r0][c1] * a[r1][c0]);
      record[kInstanceW + 3 * i + j] = static_cast<float>(w[i][j]);
    }
  }
  double spread = 0;
  for (int i = 0; i < 3; ++i) {
    double sum = 0;
    for (int j = 0; j < 3; ++j) {
      for (int k = 0; k < 3; ++k) sum += std::fabs(a[i][k] * w[k][j]);
    }
    spread = sum > spread ? sum : spread;
  }
  record[kInstanceSpread] = static_cast<float>(spread);
  record[kInstanceHandedness] = det < 0 ? -1.0f : 1.0f;
}

/// The record of moving instance `instance` between pose `pose` (f = 0) and the next one (f = 1).
inline void pose_record(const RenderScene& scene, int32_t instance, int32_t pose, float f, float* record) {
  const InstanceWay& way = scene.ways[static_cast<size_t>(instance - scene.first_moving)];
  const float* from = &scene.poses[static_cast<size_t>(way.first_pose + pose) * kPoseFloats];
  for (int i = 0; i < kPoseFloats; ++i)
    record[i] = f == 0 ? from[i] : from[i] + (from[i + kPoseFloats] - from[i]) * f;
  record[kInstanceTimeScale] =
      scene.instance_records[static_cast<size_t>(instance) * kInstanceFloats + kInstanceTimeScale];
  finish_record(record);
}

/// The same at `time` in [0, 1].
inline void record_at(const RenderScene& scene, int32_t instance, float time, float* record) {
  const int32_t segments = scene.ways[static_cast<size_t>(instance - scene.first_moving)].segments;
  const float at = time * static_cast<float>(segments);  // exact: a power of two
  const auto whole = static_cast<int32_t>(at);
  const int32_t pose = whole < segments ? whole : segments - 1;
  pose_record(scene, instance, pose, at - static_cast<float>(pose), record);
}

/// Records of the instances in lanes, as columns. Only those of `lanes` have a meaning.
template <class F>
struct RecordTable {
  alignas(32) float f[kInstanceFloats][kWidth<F>];

  RecordTable(const RenderScene& scene, IntOf<F> instance, F time, unsigned lanes) {
    float moved[kInstanceFloats] = {};
    int32_t at_instance = -1;
    float at_time = 0;
    for (int l = 0; l < kWidth<F>; ++l) {
      const int32_t i = lane(instance, l);
      const float* record = &scene.instance_records[static_cast<size_t>(i < 0 ? 0 : i) * kInstanceFloats];
      if ((lanes >> l & 1) && i >= scene.first_moving) {
        // Lanes often share both instance and time.
        if (i != at_instance || lane(time, l) != at_time) record_at(scene, i, lane(time, l), moved);
        at_instance = i;
        at_time = lane(time, l);
        record = moved;
      }
      for (int slot = 0; slot < kInstanceFloats; ++slot) f[slot][l] = record[slot];
    }
  }
};

}  // namespace lightmill
