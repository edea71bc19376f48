#pragma once
// What an EXR file says of its mattes by Cryptomatte. Without it programs don't know them as such.
#include <map>
#include <string>
#include <vector>

#include "common/image/image_reader.h"

namespace lightmill {

/// The attributes by their full names. `channels`: the file's.
std::map<std::string, std::string> matte_attributes(const ImageReader& file,
                                                    const std::vector<std::string>& channels);

}  // namespace lightmill
