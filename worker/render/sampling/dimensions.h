#pragma once
// Which dimension of a path's sample stream is used for what.
#include <cstdint>

namespace lightmill {

/// Streams: what a key belongs to.
enum Stream : uint32_t { kCameraStream = 0, kLightStream = 1 };

// Start of a path.
inline constexpr uint32_t kDimFilm = 0;            // 2D, camera: position in the pixel filter
inline constexpr uint32_t kDimLens = 1;            // 2D, camera: position on the lens, if it has a radius
inline constexpr uint32_t kDimLightSelect = 0;     // 1D, light: which light
inline constexpr uint32_t kDimLightPosition = 1;   // 2D, light
inline constexpr uint32_t kDimLightDirection = 2;  // 2D, light
inline constexpr uint32_t kDimLightTexel = 3;      // 1D, light: texel of an environment image
inline constexpr uint32_t kDimTime = 4;            // 1D: when, if anything moves
/// 1D, of a superblock's light key by packet and sample index: the time of all paths that are joined.
inline constexpr uint32_t kDimLayerTime = 5;

// Per vertex: kDimsPerVertex dimensions from kDimVertex0 on, vertex 0 being the first surface hit.
inline constexpr uint32_t kDimVertex0 = 8;
inline constexpr uint32_t kDimsPerVertex = 64;
enum VertexDim : uint32_t {
  kDimBsdfLobe = 0,        // 1D
  kDimBsdfDirection = 1,   // 2D; its first number also chooses the part of a mix
  kDimRoulette = 2,        // 1D
  kDimNeeSelect = 3,       // 1D, camera
  kDimViewerSide = 3,      // 1D, light: a direction or its mirror image
  kDimNeePosition = 4,     // 2D
  kDimManifoldLight = 3,   // 1D, camera: as next event chooses
  kDimManifoldPoint = 4,   // 2D, camera: the same
  kDimNeeRoulette = 6,     // 1D
  kDimSplatLens = 7,       // 2D: the lens point that a light vertex is joined to
  kDimNeeTexel = 7,        // 1D: texel of an environment image
  kDimSplatSmall = 8,      // random, light: which pixels receive small filter weights
  kDimConnectStart = 8,    // 1D, camera: where the draws from the light-vertex cache start
  kDimCameraDistance = 5,  // 1D and random, camera: where the segment before the vertex ends in a medium
  kDimLightDistance = 4,   // the same of light paths
  kDimConnectRoulette = 9  // + number of the draw modulo kConnectRouletteDims: 1D
};
inline constexpr uint32_t kDimPane = kDimsPerVertex - 1;  // 1D: which pane on the way to the vertex reflects
/// Seeds of walks through grids of media: to the vertex, and of what is joined to it.
inline constexpr uint32_t kDimVolume = kDimsPerVertex - 2, kDimJoinedVolume = kDimsPerVertex - 3;
inline constexpr uint32_t kConnectRouletteDims = kDimJoinedVolume - kDimConnectRoulette;
constexpr uint32_t vertex_dim(int vertex, uint32_t dim) {
  return kDimVertex0 + static_cast<uint32_t>(vertex) * kDimsPerVertex + dim;
}

}  // namespace lightmill
