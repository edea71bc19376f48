#pragma once
// Arbitrary output variables (AOVs): what an image records of each pixel besides its colour, by the names of
// --aov. A job that asks for none renders, sends and stores nothing of them.
//
//   albedo    share of light that the first surface reflects, RGB in [0, 1]; through mirrors and glass the
//             first surface that is not purely specular, tinted by them; 0 where nothing is hit
//   normal    unit shading normal of the same surface in world space, on the viewer's side; averaged over the
//             pixel's samples and not normalised again; 0 where nothing is hit
//   depth     distance of the first hit along the viewing direction (spherical cameras: from the camera),
//             scene units, mean over the samples that hit something; 0 if none does
//   position  world position of the first hit, likewise
//   alpha     share of samples that hit something
//   direct    light that came by at most one scattering event; indirect: all the rest of the colour
//   variance  of one camera sample, RGB, without splats; that of the mean is this over `samples`
//   samples   camera samples of the pixel
//   difference  of two halves of the samples (common/film/halves/half_film.h), RGB of the colour and channels
//   of
//             albedo, normal and depth where they are asked for, scaled so that its square is an estimate of
//             the error's: image + difference and image - difference are two images of half the samples each
//   lightgroups  the light of each light group (common/job/light_groups.h), RGB; they add up to the colour.
//   With
//             `difference`, that of each, too
//   cryptoobject, cryptomaterial, cryptoasset  Cryptomatte: ids and coverages of the objects, materials and
//             assets that a pixel shows, in falling order (common/film/cryptomatte/); 0 where there are fewer
//   uv        texture coordinates of the first hit, mean over the samples that hit something; 0 if none does
//   objectid, materialid  number of the object and of the material that most samples of the pixel hit first
//             (common/film/cryptomatte/matte_sums.h); 0 where nothing is hit
//   motion    how far what the first hit shows moves on the film from the shutter's opening to its closing,
//             pixels, X right and Y up; mean over the samples that hit something; 0 if none does
//   diffusealbedo, specularalbedo  what diffuse lobes have of albedo, and the rest; they add up to it
//   lobes     light by the first scattering event that its path has from the camera (common/job/lobes.h),
//             RGB; they add up to the colour
#include <string>
#include <vector>

#include "common/job/light_groups.h"

namespace lightmill {

/// A set of AOVs: their sum.
using Aovs = unsigned;
inline constexpr Aovs kAovAlbedo = 1, kAovNormal = 2, kAovDepth = 4, kAovPosition = 8, kAovAlpha = 16,
                      kAovDirect = 32, kAovIndirect = 64, kAovVariance = 128, kAovSamples = 256,
                      kAovDifference = 512, kAovLightGroups = 1024, kAovCryptoObject = 2048,
                      kAovCryptoMaterial = 4096, kAovCryptoAsset = 8192, kAovUv = 1 << 14,
                      kAovObjectId = 1 << 15, kAovMaterialId = 1 << 16, kAovDiffuseAlbedo = 1 << 17,
                      kAovSpecularAlbedo = 1 << 18, kAovMotion = 1 << 19, kAovLobes = 1 << 20;
inline constexpr Aovs kAllAovs = (1u << 21) - 1;
/// "cryptomatte" among names.
inline constexpr Aovs kAovsOfCryptomatte = kAovCryptoObject | kAovCryptoMaterial | kAovCryptoAsset;
inline constexpr Aovs kAovsOfIds = kAovObjectId | kAovMaterialId;
/// Those that are formed of counts of what samples hit (common/film/cryptomatte/matte_sums.h).
inline constexpr Aovs kAovsOfCounts = kAovsOfCryptomatte | kAovsOfIds;
/// What `lightmill denoise` goes by: "denoise" among names.
inline constexpr Aovs kAovsToDenoise = kAovAlbedo | kAovNormal | kAovDepth | kAovDifference;
/// Those of which `difference` has channels, too.
inline constexpr Aovs kAovsOfHalves = kAovAlbedo | kAovNormal | kAovDepth;
/// How many ids a matte has of a pixel, two in each of its layers of four channels.
inline constexpr int kMatteRanks = 6;

/// "albedo,normal", those in the set, in the order of their bits; empty for none.
std::string aov_names(Aovs set);
/// Inverse; "all" is all of them, "denoise" kAovsToDenoise and "cryptomatte" kAovsOfCryptomatte. Throws
/// Error(kUsage) on a name that does not exist, listing those that do.
Aovs aovs_named(const std::string& names);
/// Names of the channels that an image of the set has in a file, in the order of the bits: "albedo.R", ...
/// "depth.Z", "position.X", "samples.V", "difference.R", "albedo_difference.R", "lightgroup_key.R",
/// "lightgroup_key_difference.R", "CryptoObject00.r", "uv.U", "objectid.V", "diffuse_direct.R", and "A" for
/// alpha. `groups`: of the scene.
std::vector<std::string> aov_channels(Aovs set, const LightGroups& groups);
/// "CryptoObject": what the names of a matte's layers begin with, and programs call it.
std::string matte_layer(Aovs matte);
/// Whether a channel is a matte's. Its ids are bits: half floats can't hold them, and nothing may average
/// them.
bool is_matte_channel(const std::string& channel);

}  // namespace lightmill
