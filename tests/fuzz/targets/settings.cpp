// A job file, or the value of any option.
#include "common/job/settings.h"

#include "common/base/json.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_settings(std::span<const std::byte> data) {
  const auto pairs = parse_flat_json(text_of(data));
  require_sentence(pairs);
  if (!pairs) return;
  BakeSettings settings;
  for (const auto& [key, value] : *pairs) require_sentence(set_option(settings, key, value, "fuzz"));
  require_sentence(check_settings(settings));
  for (const Setting& row : settings_table()) (void)row.print(settings);
}

}  // namespace kiln::fuzz
