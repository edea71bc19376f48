#pragma once
// What the module's files give to its table of functions; each is described at common/image/image_library.h.
#include <OpenImageIO/typedesc.h>

#include "common/image/image_library.h"

namespace lightmill::openimageio {

inline OIIO::TypeDesc type_of(TexelType type) {
  return type == TexelType::kBytes ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::FLOAT;
}

OpenImageFile* open(const ImageSource& source, ImageHeader* header, std::string* why);
void close(OpenImageFile* file);
bool read(OpenImageFile& file, int begin, int end, TexelType type, void* out, std::string* why);
std::string attribute(const OpenImageFile& file, const std::string& name);
std::vector<std::string> channel_names(const OpenImageFile& file);

bool write(const ImageToWrite& image, const std::string& path, std::vector<unsigned char>* memory,
           std::string* why);

ImageTiles* make_tiles(uint64_t max_bytes);
void free_tiles(ImageTiles* tiles);
void* open_tiled(ImageTiles& tiles, const std::string& path, int* x, int* y, std::string* why);
std::string tiled_path(ImageTiles& tiles, void* handle);
bool read_tiled(ImageTiles& tiles, void* handle, const TexelRegion& region, TexelType type, void* out,
                std::string* why);

OpenColorConfig* open_color_config(const std::string& path, ColorConfigContents* contents, std::string* why);
void close_color_config(OpenColorConfig* config);
ColorTransform* make_conversion(const OpenColorConfig& config, const std::string& from, const std::string& to,
                                std::string* why);
ColorTransform* make_view(const OpenColorConfig& config, const std::string& space, const std::string& display,
                          const std::string& view, std::string* why);
void free_color_transform(ColorTransform* transform);
void apply_color_transform(const ColorTransform& transform, float* rgb, size_t pixels);

}  // namespace lightmill::openimageio
