#pragma once
// Media whose grids are in files.
#include "common/scene/description.h"

namespace lightmill {

/// The medium with what its file holds in place of the file; as it is, if it has none. `warnings` receives
/// what is rendered otherwise. Throws Error(kBadScene), with the medium's place, if the file can't be read.
MediumDescription with_file_read(const MediumDescription& medium, std::vector<Problem>* warnings);

}  // namespace lightmill
