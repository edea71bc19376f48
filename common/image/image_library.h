#pragma once
// The seam to OpenImageIO.
//
// Debian's brings three hundred libraries along, and to load them takes longer than most commands do. So no
// program is linked to it: a module, lightmill-images.so, is. It lies beside the program, or in
// ../lib/lightmill once installed, and is loaded when the first image is read or written. It knows files and
// pixels; what these mean is decided on this side. Errors cross as text, as the module has classes of its
// own; of exceptions std::bad_alloc alone.
//
//   std::string why;
//   const ImageLibrary& library = image_library();
//   if (!library.write(image, "a.exr", nullptr, &why)) throw Error(ErrorKind::kFailed, "a.exr: " + why);
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace lightmill {

enum class TexelType { kBytes, kFloats };

/// What is known of an image file once it is open.
struct ImageHeader {
  int width = 0, height = 0, depth = 0, channels = 0;  // as the file says: not checked
  bool is_bytes = false;                               // unsigned, of 8 bits
  bool is_floating_point = false;
  bool says_linear = false;  // that its values are proportional to light, whatever their type
  std::optional<std::array<float, 8>> chromaticities{};  // EXR: CIE xy of red, green, blue and white
};

struct ImageSource {
  std::string path;                // says the format, too
  const void* contents = nullptr;  // read from here in place of the path; must outlive the image
  size_t bytes = 0;
  bool as_stored = false;  // colours are not multiplied by alpha
};

/// Pixels as a file is to hold them, row-major and interleaved, top row first.
struct ImageToWrite {
  enum class Format { kExr, kPng, kHdr };
  enum class Encoding { kLinear, kSrgb, kUnknown };
  struct Layer {
    std::string name;  // of the channel
    bool whole;        // float where the others are half
  };
  Format format = Format::kExr;
  int width = 0, height = 0, channels = 0;
  const float* floats = nullptr;                         // EXR, HDR
  const uint8_t* bytes = nullptr;                        // PNG
  bool half = false;                                     // EXR: in half floats
  Encoding encoding = Encoding::kLinear;                 // what the file says of its values
  std::optional<std::array<float, 8>> chromaticities{};  // EXR: as ImageHeader's
  std::vector<Layer> layers;  // EXR: the last channels; those before have usual names
  std::vector<std::pair<std::string, std::string>> attributes;  // EXR: name and text
};

/// A rectangle [x0, x1) x [y0, y1) in the coordinates of the file, of `channels` channels from `first`.
struct TexelRegion {
  int x0, x1, y0, y1;
  int first, channels;
};

/// What an OpenColorIO configuration has, by name.
struct ColorConfigContents {
  struct Space {
    std::string name;
    std::vector<std::string> aliases;
  };
  struct Display {
    std::string name;
    std::vector<std::string> views;
  };
  std::vector<Space> spaces;
  std::vector<std::pair<std::string, std::string>> roles;  // each with the name of its space
  std::vector<Display> displays;                           // those that are active
  std::string default_display;
};

struct OpenImageFile;    // the module's
struct ImageTiles;       // the module's: a cache of tiles
struct OpenColorConfig;  // the module's
struct ColorTransform;   // the module's

/// The module's functions. Those that can fail return false (or null) and put a reason into `why`, maybe of
/// several lines. All are thread-safe; an open file is for one thread at a time.
struct ImageLibrary {
  // Read before it is known whether the rest is of this build: these three stay where they are.
  const char* build;            // build_id() of the module
  const char* version_built;    // of OpenImageIO: that it was compiled with, "2.4.7",
  const char* version_running;  // and that it runs with

  OpenImageFile* (*open)(const ImageSource& source, ImageHeader* header, std::string* why);
  void (*close)(OpenImageFile* file);
  /// Channels [begin, end) of all pixels. `out` holds bytes or floats, as `type` says.
  bool (*read)(OpenImageFile& file, int begin, int end, TexelType type, void* out, std::string* why);
  /// A string attribute; empty if there is none.
  std::string (*attribute)(const OpenImageFile& file, const std::string& name);
  /// A name a channel, as the file has them.
  std::vector<std::string> (*channel_names)(const OpenImageFile& file);

  /// Into `memory` if it is not null (PNG): then `path` only names it.
  bool (*write)(const ImageToWrite& image, const std::string& path, std::vector<unsigned char>* memory,
                std::string* why);

  /// Tiles of images, as stored, in up to `max_bytes`.
  ImageTiles* (*make_tiles)(uint64_t max_bytes);
  void (*free_tiles)(ImageTiles* tiles);
  /// A handle, which lives as long as `tiles`, and where the image's pixels begin.
  void* (*open_tiled)(ImageTiles& tiles, const std::string& path, int* x, int* y, std::string* why);
  std::string (*tiled_path)(ImageTiles& tiles, void* handle);
  bool (*read_tiled)(ImageTiles& tiles, void* handle, const TexelRegion& region, TexelType type, void* out,
                     std::string* why);

  OpenColorConfig* (*open_color_config)(const std::string& path, ColorConfigContents* contents,
                                        std::string* why);
  void (*close_color_config)(OpenColorConfig* config);
  /// Between colour spaces. A transform lives without its configuration.
  ColorTransform* (*make_conversion)(const OpenColorConfig& config, const std::string& from,
                                     const std::string& to, std::string* why);
  /// From the colour space `space` to the values that the display is sent for the view.
  ColorTransform* (*make_view)(const OpenColorConfig& config, const std::string& space,
                               const std::string& display, const std::string& view, std::string* why);
  void (*free_color_transform)(ColorTransform* transform);
  /// In place, of interleaved RGB.
  void (*apply_color_transform)(const ColorTransform& transform, float* rgb, size_t pixels);
};

/// The program's module, loaded by the first call. Thread-safe. Throws Error(kFailed), at every
/// call, if it is missing, can't be loaded, or does not fit: to fit it must be of this program's build and
/// run with the version of OpenImageIO that the build id names, which vouches for the bits of textures. Where
/// limits of the system let a library crash while it is loaded, the program ends as common/base/load_guard.h
/// says.
const ImageLibrary& image_library();

/// The same of any file, each time anew.
const ImageLibrary& load_image_library(const std::string& path);

}  // namespace lightmill
