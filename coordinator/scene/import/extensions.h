// The glTF extensions that the importer knows, and the note for each one that a file uses.
#pragma once

#include "coordinator/scene/import/context.h"

namespace kiln {

// Fails when the file requires an extension that is not supported, naming all of them; notes how each used
// one is treated.
Status check_extensions(const ImportContext& context, ImportNotes& notes);

}  // namespace kiln
