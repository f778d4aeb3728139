#include "coordinator/farm/authority/tokens.h"

#include <algorithm>
#include <charconv>

#include "common/base/format.h"

namespace kiln {
namespace {

constexpr size_t kIdDigits = 8, kSecretDigits = 32, kMaxTokens = 100'000;
constexpr uint32_t kMaxUses = 100'000;
constexpr int64_t kMaxExpiry = int64_t{1} << 40;

bool is_hex(std::string_view text, size_t digits) {
  return text.size() == digits && std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
         });
}

// Removes and returns the text up to `separator`; removes the separator too.
std::string_view next_field(std::string_view& rest, char separator) {
  const size_t end = std::min(rest.find(separator), rest.size());
  const std::string_view field = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  return field;
}

template <class T>
bool parse_number(std::string_view text, T& value) {
  const auto [stop, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  return code == std::errc() && stop == text.data() + text.size();
}

Expected<TokenRecord> parse_record(std::string_view line) {
  TokenRecord record;
  record.id = next_field(line, ' ');
  if (!is_hex(record.id, kIdDigits)) return fail(ErrorKind::kInvalidInput, "its id is not 8 hex digits");
  KILN_TRY(record.secret, Digest::from_hex(next_field(line, ' ')));
  KILN_TRY(record.role, parse_role(next_field(line, ' ')));
  const std::string_view uses = next_field(line, ' ');
  if (!parse_number(uses, record.uses) || record.uses > kMaxUses || !parse_number(line, record.expires) ||
      record.expires < 0 || record.expires > kMaxExpiry)
    return fail(ErrorKind::kInvalidInput, "its uses or its end are not numbers of a token");
  return record;
}

}  // namespace

std::string JoinToken::text() const {
  return kiln::text("kiln-{}-{}-{}", id, secret, authority.hex());
}

Expected<JoinToken> parse_join_token(std::string_view token) {
  const auto refuse = [] {
    return fail(ErrorKind::kUsage,
                "this is not a join token: `kiln cert token` prints one, kiln- and three groups of "
                "hex digits");
  };
  if (next_field(token, '-') != "kiln") return refuse();
  const std::string_view id = next_field(token, '-'), secret = next_field(token, '-');
  const auto authority = Digest::from_hex(token);
  if (!is_hex(id, kIdDigits) || !is_hex(secret, kSecretDigits) || !authority) return refuse();
  return JoinToken{std::string(id), std::string(secret), *authority};
}

Expected<std::vector<TokenRecord>> parse_token_file(std::string_view file) {
  std::vector<TokenRecord> records;
  for (size_t line = 1; !file.empty(); ++line) {
    auto record = parse_record(next_field(file, '\n'));
    if (!record)
      return fail(ErrorKind::kInvalidInput, text("token in line {}: {}", line, record.error().message));
    if (records.size() == kMaxTokens) return fail(ErrorKind::kInvalidInput, "too many tokens");
    records.push_back(std::move(*record));
  }
  return records;
}

std::string print_token_file(const std::vector<TokenRecord>& records) {
  std::string file;
  for (const TokenRecord& r : records)
    file += text("{} {} {} {} {}\n", r.id, r.secret.hex(), role_name(r.role), r.uses, r.expires);
  return file;
}

}  // namespace kiln
