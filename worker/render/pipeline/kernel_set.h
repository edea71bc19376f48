#pragma once
// The sets of features that the kernels are compiled for. The compiler leaves out what a set lacks: no code,
// branch or register is spent on it. plan/analysis/stage_kernels.h picks the least set that a scene can do
// with. Any set that has what the scene needs gives the same bits.
//
// Measured on Cornell boxes against SurfaceKernels: DiffuseKernels take 2 to 6 % less time under pt and 7 to
// 12 % less under bdpt, half of it by their lights. They have shading normals, which cost nothing where there
// are none.

namespace lightmill {

/// Everything.
struct MediaKernels {
  static constexpr bool kMedia = true;     // vertices in media
  static constexpr bool kSurfaces = true;  // BSDFs beside the diffuse one; textures, bumps, mixes, instances
  static constexpr bool kLights = true;    // any but even emitters, or more than kAliasLights
  static constexpr bool kObserved = true;  // by a StrategyRecorder or an AovRecorder
};

/// Any surface and light, without media.
struct SurfaceKernels {
  static constexpr bool kMedia = false, kSurfaces = true, kLights = true, kObserved = true;
};

/// Surfaces that reflect diffusely, each in one colour, lit by a few of them.
struct DiffuseKernels {
  static constexpr bool kMedia = false, kSurfaces = false, kLights = false, kObserved = false;
};

enum class KernelSet { kDiffuse, kSurfaces, kMedia };

/// The least set for each kind of stage. Vertices that are joined are never on mirrors or smooth glass, and
/// their textures are looked up already. So diffuse kernels can often join what general ones have followed.
/// On a Cornell box with a mirror and a glass ball that takes 7 to 9 % less time under bdpt than general
/// kernels in all stages.
struct StageKernels {
  KernelSet paths = KernelSet::kSurfaces;       // followed from lights and camera, and emitter hits
  KernelSet next_event = KernelSet::kSurfaces;  // to points on lights
  KernelSet joins = KernelSet::kSurfaces;       // vertex connections and light tracing
};

}  // namespace lightmill
