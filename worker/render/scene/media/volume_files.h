#pragma once
// Media whose grids are in files.
#include <memory>

#include "common/base/spill/spill_area.h"
#include "common/scene/description.h"

namespace lightmill {

/// The medium with what its file holds in place of the file; as it is, if it has none. `warnings` receives
/// what is rendered otherwise. `area` bounds the memory. Throws Error(kBadScene), with the medium's place, if
/// the file can't be read.
MediumDescription with_file_read(const MediumDescription& medium, const std::shared_ptr<SpillArea>& area,
                                 std::vector<Problem>* warnings);

}  // namespace lightmill
