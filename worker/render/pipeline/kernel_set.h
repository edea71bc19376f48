#pragma once
// The sets of features that kernels are compiled for. What a set lacks the compiler leaves out of its
// kernels: no code, no branch and no register is spent on it. The scene plan picks the least set that a scene
// can do with (analysis/scene_analysis.h); any set that has what the scene needs gives the same bits.
//
// Measured on Cornell boxes against SurfaceKernels, DiffuseKernels take 2 to 6 % less time under pt and 7 to
// 12 % less under bdpt, half of it by their lights. Shading normals, which they have, cost nothing where
// there are none.

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

/// The least set for each kind of stage. What is joined is never a mirror nor smooth glass, and has its
/// textures looked up: diffuse kernels often join what general ones have followed. Measured on a Cornell box
/// with a mirror and a glass ball against general kernels in all stages, that takes 7 to 9 % less time under
/// bdpt.
struct StageKernels {
  KernelSet paths = KernelSet::kSurfaces;       // that start at lights and end on them
  KernelSet next_event = KernelSet::kSurfaces;  // to points on lights
  KernelSet joins = KernelSet::kSurfaces;       // of vertices to each other and to the lens
};

}  // namespace lightmill
