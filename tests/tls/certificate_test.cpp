// What certificates say, and what is refused before it is trusted.
#include "common/tls/certificate.h"

#include <sys/stat.h>

#include <random>

#include "common/base/files.h"
#include "common/tls/revocation.h"
#include "tests/tls/tls_pair.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;
using test::Farm;
using test::kDay;

TEST(Certificate, SaysWhatWasAskedFor) {
  const int64_t from = 1'700'000'000, to = from + 90 * kDay;
  const auto authority = make_authority("farm-ca", from, to);
  ASSERT_TRUE(authority);
  const auto ca = read_certificate(authority->certificate);
  EXPECT_TRUE(ca->authority);
  EXPECT_EQ(ca->identity.name, "farm-ca");
  const auto own = make_key_and_request("farm");
  EXPECT_EQ(*request_name(own->request), "farm");
  const std::vector<std::string> hosts{"farm.studio.lan", "10.0.0.7", "fe80::1"};
  const auto pem =
      sign_request(own->request, *authority, {"farm", {Role::kCoordinator, Role::kAdmin}, hosts, from, to});
  ASSERT_TRUE(pem) << pem.error().message;
  const auto c = read_certificate(*pem);
  EXPECT_EQ(c->identity.name, "farm");
  EXPECT_EQ(c->identity.roles, (std::vector<Role>{Role::kCoordinator, Role::kAdmin}));
  EXPECT_EQ(c->identity.not_after, to);
  EXPECT_EQ(c->not_before, from);
  EXPECT_EQ(c->hosts, hosts);
  EXPECT_EQ(c->issuer, "farm-ca");
  EXPECT_FALSE(c->authority);
  EXPECT_EQ(c->identity.serial.size(), 32u);
  const auto again =
      read_certificate(*sign_request(own->request, *authority, {"farm", {Role::kRead}, {}, from, to}));
  EXPECT_NE(again->identity.serial, c->identity.serial);
  EXPECT_EQ(date_text(from), "2023-11-14 22:13 UTC");
}

TEST(Certificate, NamesHostsAndRequestsAreChecked) {
  const auto authority = make_authority("farm-ca", 0, kDay);
  const auto own = make_key_and_request("render7");
  for (const char* bad : {"", "-x", ".x", "a b", "a/b", "a\nb", "name,CN=other", "\xc3\xa4"}) {
    EXPECT_FALSE(make_key_and_request(bad)) << bad;
    EXPECT_FALSE(sign_request(own->request, *authority, {bad, {Role::kWorker}, {}, 0, kDay})) << bad;
  }
  EXPECT_FALSE(make_key_and_request(std::string(65, 'a')));
  for (const char* bad : {"", "a,URI:kiln:role:admin", "a b", "*.lan", "URI:kiln:role:admin"})
    EXPECT_FALSE(sign_request(own->request, *authority, {"farm", {Role::kCoordinator}, {bad}, 0, kDay}))
        << bad;
  EXPECT_FALSE(sign_request(own->request, *authority, {"render7", {}, {}, 0, kDay}));
  const auto other = make_authority("farm-ca", 0, kDay);
  EXPECT_FALSE(
      sign_request(own->request, {other->key, authority->certificate}, {"a", {Role::kRead}, {}, 0, kDay}));

  // A request whose key is not the one that signed it: somebody else's public key under one's own name.
  std::mt19937 random(3);
  size_t refused = 0;
  for (int i = 0; i < 200; ++i) {
    std::string damaged = own->request;
    const size_t at = 30 + random() % (damaged.size() - 60);
    damaged[at] = damaged[at] == 'A' ? 'B' : 'A';
    refused += !request_name(damaged);
  }
  EXPECT_GT(refused, 190u);
}

TEST(Certificate, RevokedListsAreReadLineByLine) {
  const auto list = parse_revoked("0A1b  # render7\n\n# all\n  ff00\r\n12");
  ASSERT_TRUE(list);
  EXPECT_EQ(*list, (std::set<std::string>{"0a1b", "ff00", "12"}));
  for (const char* bad : {"xyz", "12 34", "render7", "0x12"}) {
    const auto refused = parse_revoked(std::string("aa\n") + bad);
    ASSERT_FALSE(refused) << bad;
    EXPECT_SAYS(refused.error().message, "line 2");
  }
}

// The sentence for files that cannot be used.
std::string refusal(const TlsFiles& files) {
  const auto loaded = load_identity(files, test::now());
  return loaded ? "loaded" : loaded.error().message;
}

TEST(Identity, ErrorsNameTheFileAndTheWayOut) {
  Farm farm, other;
  const TlsFiles good = farm.files("render7", {Role::kWorker});
  const TlsFiles second = farm.files("render8", {Role::kWorker});
  EXPECT_EQ(refusal(good), "loaded");
  TlsFiles files = good;
  files.certificate = farm.path() / "nowhere.pem";
  EXPECT_SAYS(refusal(files), "nowhere.pem: no such file");
  EXPECT_SAYS(refusal(files), "kiln cert issue");
  files = good;
  files.ca.clear();
  EXPECT_SAYS(refusal(files), "the authority's certificate");
  files = good;
  files.key = second.key;
  EXPECT_SAYS(refusal(files), "is not the one of the certificate");
  files = good;
  files.ca = other.ca_dir() / "ca.pem";
  EXPECT_SAYS(refusal(files), "was not signed by the authority in " + files.ca.string());
  files = good;
  files.ca = good.certificate;
  EXPECT_SAYS(refusal(files), "not of an authority");
  files = good;
  std::swap(files.key, files.certificate);
  EXPECT_SAYS(refusal(files), "holds no certificate");
  files = good;
  files.key = farm.path() / "locked.pem";
  ASSERT_TRUE(write_private_file(files.key,
                                 "-----BEGIN ENCRYPTED PRIVATE KEY-----\nAAAA\n-----END ENCRYPTED PRIVATE "
                                 "KEY-----\n"));
  EXPECT_SAYS(refusal(files), "without a pass phrase");
  EXPECT_SAYS(refusal(farm.files("old", {Role::kWorker}, -9 * kDay, -kDay)), "expired on");
  EXPECT_SAYS(refusal(farm.files("new", {Role::kWorker}, kDay, 9 * kDay)), "clock");
}

TEST(Identity, WarnsOfAKeyThatOthersCanReadAndOfAnEndThatIsNear) {
  Farm farm;
  const TlsFiles files = farm.files("render7", {Role::kWorker});
  struct stat mode {};
  ASSERT_EQ(::stat(files.key.c_str(), &mode), 0);
  EXPECT_EQ(mode.st_mode & 0777, 0600u);
  EXPECT_TRUE(load_identity(files, test::now())->warnings.empty());
  ::chmod(files.key.c_str(), 0644);
  const auto open = load_identity(files, test::now())->warnings;
  ASSERT_EQ(open.size(), 1u);
  EXPECT_SAYS(open[0], "chmod 600 " + files.key.string());
  const auto soon =
      load_identity(farm.files("render8", {Role::kWorker}, -kDay, 10 * kDay), test::now())->warnings;
  ASSERT_EQ(soon.size(), 1u);
  EXPECT_SAYS(soon[0], "ends on");
}

}  // namespace
}  // namespace kiln
