// The file of join tokens, and a token as a person types it.
#include "coordinator/farm/authority/tokens.h"

#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_tokens(std::span<const std::byte> data) {
  require_sentence(parse_join_token(text_of(data)));
  const auto records = parse_token_file(text_of(data));
  require_sentence(records);
  if (!records) return;
  const auto again = parse_token_file(print_token_file(*records));
  require(again.has_value() && *again == *records, "what was read can be written and read");
}

}  // namespace kiln::fuzz
