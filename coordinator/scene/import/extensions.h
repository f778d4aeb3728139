// Which glTF extensions the importer knows, and what it says about each one that a file uses.
#pragma once

#include "coordinator/scene/import/context.h"

namespace kiln {

// Fails when the file requires an extension that is not supported, naming all of them; notes what becomes
// of each one used.
Status check_extensions(const ImportContext& context, ImportNotes& notes);

}  // namespace kiln
