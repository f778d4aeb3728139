#include "common/base/hash.h"

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/rand.h>
#include <xxhash.h>

#include <vector>

#include "common/base/check.h"

namespace kiln {

std::string Digest::hex() const {
  static const char* kDigits = "0123456789abcdef";
  std::string out;
  for (uint8_t b : bytes) {
    out += kDigits[b >> 4];
    out += kDigits[b & 15];
  }
  return out;
}

Expected<Digest> Digest::from_hex(std::string_view hex) {
  Digest d;
  if (hex.size() != 64) return fail(ErrorKind::kInvalidInput, "a SHA-256 digest has 64 hex digits");
  for (size_t i = 0; i < 64; ++i) {
    const char c = hex[i];
    int v = c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
    if (v < 0) return fail(ErrorKind::kInvalidInput, "a SHA-256 digest has lower-case hex digits only");
    d.bytes[i / 2] = static_cast<uint8_t>(d.bytes[i / 2] << 4 | v);
  }
  return d;
}

Sha256::Sha256() : context_(EVP_MD_CTX_new()) {
  KILN_CHECK(context_ && EVP_DigestInit_ex(static_cast<EVP_MD_CTX*>(context_), EVP_sha256(), nullptr) == 1);
}
Sha256::~Sha256() {
  EVP_MD_CTX_free(static_cast<EVP_MD_CTX*>(context_));
}
void Sha256::add(std::span<const std::byte> data) {
  KILN_CHECK(EVP_DigestUpdate(static_cast<EVP_MD_CTX*>(context_), data.data(), data.size()) == 1);
}
Digest Sha256::finish() {
  Digest d;
  unsigned size = 0;
  KILN_CHECK(EVP_DigestFinal_ex(static_cast<EVP_MD_CTX*>(context_), d.bytes.data(), &size) == 1 &&
             size == 32);
  return d;
}

Digest sha256(std::span<const std::byte> data) {
  Sha256 h;
  h.add(data);
  return h.finish();
}

uint64_t xxh3(std::span<const std::byte> data) {
  return XXH3_64bits(data.data(), data.size());
}

bool equal_secret(std::string_view a, std::string_view b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

std::string random_hex(size_t count) {
  static const char* kDigits = "0123456789abcdef";
  std::vector<uint8_t> bytes(count);
  KILN_CHECK(RAND_bytes(bytes.data(), static_cast<int>(count)) == 1);
  std::string out;
  for (uint8_t b : bytes) {
    out += kDigits[b >> 4];
    out += kDigits[b & 15];
  }
  return out;
}

}  // namespace kiln
