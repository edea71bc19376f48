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

}  // namespace lightmill::openimageio
