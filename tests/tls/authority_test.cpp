// The authority's folder: issuing, revoking, and join tokens that are never worth more than they say.
#include "coordinator/farm/authority/authority.h"

#include <sys/stat.h>

#include <thread>

#include "common/base/files.h"
#include "coordinator/farm/authority/tokens.h"
#include "tests/tls/tls_pair.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;
using test::Farm;
using test::kDay;

std::string text_of(const fs::path& path) {
  const auto bytes = read_file(path);
  return bytes ? std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size()) : "";
}

mode_t mode_of(const fs::path& path) {
  struct stat s {};
  return ::stat(path.c_str(), &s) == 0 ? s.st_mode & 0777 : 0;
}

TEST(Authority, IssuesAFolderThatConnects) {
  Farm farm;
  const fs::path out = farm.path() / "render7";
  const auto c = issue(farm.ca_dir(), {"render7", {Role::kWorker}}, out, test::now());
  ASSERT_TRUE(c) << c.error().message;
  EXPECT_TRUE(load_identity(tls_files_in(out), test::now()));
  for (const char* file : {"key.pem", "cert.pem", "ca.pem"}) EXPECT_EQ(mode_of(out / file), 0600u) << file;
  EXPECT_EQ(mode_of(out), 0700u);
  for (const char* file : {"ca.key", "issued"}) EXPECT_EQ(mode_of(farm.ca_dir() / file), 0600u) << file;
  const auto issued = read_issued(farm.ca_dir());
  ASSERT_EQ(issued->size(), 1u);
  EXPECT_EQ((*issued)[0].serial, c->identity.serial);
  EXPECT_EQ((*issued)[0].roles, c->identity.roles);

  const auto again = issue(farm.ca_dir(), {"render7", {Role::kWorker}}, out, test::now());
  ASSERT_FALSE(again) << "a key was overwritten";
  EXPECT_SAYS(again.error().message, "holds a key already");
  EXPECT_SAYS(
      issue(farm.ca_dir(), {"farm", {Role::kCoordinator}}, farm.path() / "f", test::now()).error().message,
      "--host");
  EXPECT_SAYS(
      issue(farm.path() / "none", {"x", {Role::kRead}}, farm.path() / "f", test::now()).error().message,
      "kiln cert ca --dir");
  EXPECT_SAYS(make_authority_folder(farm.ca_dir(), "farm-ca", 10, test::now()).error().message,
              "has an authority already");
  // Nothing outlives the authority: 50 of its 100 days are gone.
  const auto late =
      issue(farm.ca_dir(), {"late", {Role::kRead}, {}, 3650}, farm.path() / "late", test::now());
  EXPECT_LE(late->identity.not_after, test::now() + 50 * kDay);
}

TEST(Authority, RevokesBySerialAndByName) {
  Farm farm;
  const auto make = [&](const std::string& name, const std::string& folder) {
    return issue(farm.ca_dir(), {name, {Role::kWorker}}, farm.path() / folder, test::now())->identity.serial;
  };
  const std::string a = make("render7", "a"), b = make("render7", "b"), c = make("render8", "c");
  std::string upper = c;
  for (char& k : upper) k = static_cast<char>(std::toupper(k));
  EXPECT_EQ(revoke(farm.ca_dir(), upper, test::now())->size(), 1u);
  EXPECT_EQ(revoke(farm.ca_dir(), "render7", test::now())->size(), 2u);
  EXPECT_EQ(revoke(farm.ca_dir(), "render7", test::now())->size(), 0u);
  EXPECT_FALSE(revoke(farm.ca_dir(), "render9", test::now()));
  const auto context = farm.coordinator();
  for (const std::string& serial : {a, b, c}) EXPECT_TRUE(*context->is_revoked(serial));
  EXPECT_FALSE(*context->is_revoked(context->own().identity.serial));
}

TEST(Tokens, GiveACertificateOfTheirRoleAlone) {
  Farm farm;
  const auto token = make_token(farm.ca_dir(), Role::kWorker, 1, 24, test::now());
  ASSERT_TRUE(token);
  EXPECT_EQ(text_of(farm.ca_dir() / "tokens").find(token->secret), std::string::npos)
      << "the secret is on disk";
  EXPECT_EQ(mode_of(farm.ca_dir() / "tokens"), 0600u);
  const auto typed = parse_join_token(token->text());
  EXPECT_EQ(typed->secret, token->secret);
  EXPECT_EQ(typed->authority, read_certificate(text_of(farm.ca_dir() / "ca.pem"))->fingerprint);

  const auto own = make_key_and_request("render7");
  const auto got = redeem_token(farm.ca_dir(), token->text(), own->request, test::now());
  ASSERT_TRUE(got) << got.error().message;
  const auto c = read_certificate(got->certificate);
  EXPECT_EQ(c->identity.name, "render7");
  EXPECT_EQ(c->identity.roles, std::vector<Role>{Role::kWorker});
  const fs::path out = farm.path() / "joined";
  fs::create_directories(out);
  ASSERT_TRUE(write_private_file(out / "ca.pem", got->authority));
  ASSERT_TRUE(write_private_file(out / "cert.pem", got->certificate));
  ASSERT_TRUE(write_private_file(out / "key.pem", own->key));
  EXPECT_TRUE(load_identity(tls_files_in(out), test::now()));
  EXPECT_EQ(read_issued(farm.ca_dir())->size(), 1u) << "a machine that joined can be revoked by its name";

  EXPECT_FALSE(redeem_token(farm.ca_dir(), token->text(), own->request, test::now())) << "spent twice";
  for (const Role role : {Role::kCoordinator, Role::kAdmin})
    EXPECT_FALSE(make_token(farm.ca_dir(), role, 1, 24, test::now()));
}

TEST(Tokens, RefusalsDoNotTellWhatIsWrong) {
  Farm farm;
  const auto own = make_key_and_request("render7");
  const auto token = *make_token(farm.ca_dir(), Role::kWorker, 1, 2, test::now());
  JoinToken wrong = token, unknown = token;
  wrong.secret[0] = wrong.secret[0] == 'a' ? 'b' : 'a';
  unknown.id[0] = unknown.id[0] == 'a' ? 'b' : 'a';
  const auto refusal = [&](const std::string& text, int64_t at) {
    const auto got = redeem_token(farm.ca_dir(), text, own->request, at);
    return got ? "got one" : got.error().message;
  };
  const std::string words = refusal(wrong.text(), test::now());
  EXPECT_SAYS(words, "not valid here");
  EXPECT_EQ(refusal(unknown.text(), test::now()), words);
  EXPECT_EQ(refusal(token.text(), test::now() + 2 * 3600), words);
  // A request that cannot be signed costs no use, nor do wrong secrets.
  EXPECT_FALSE(redeem_token(farm.ca_dir(), token.text(), "no request", test::now()));
  for (const char* bad : {"", "kiln", "kiln-1-2-3", "token"})
    EXPECT_SAYS(refusal(bad, test::now()), "not a join token");
  EXPECT_EQ(refusal(token.text(), test::now()), "got one");
  EXPECT_EQ(refusal(token.text(), test::now()), words);
}

TEST(Tokens, TakeNobodysName) {
  Farm farm;
  const auto ada = issue(farm.ca_dir(), {"ada", {Role::kSubmit}}, farm.path() / "ada", test::now());
  const auto token = *make_token(farm.ca_dir(), Role::kWorker, 2, 24, test::now());
  const auto join = [&](const std::string& name, int64_t at) {
    const auto got = redeem_token(farm.ca_dir(), token.text(), make_key_and_request(name)->request, at);
    return got ? "got one" : got.error().message;
  };
  EXPECT_SAYS(join("ada", test::now()), "ada has a certificate until");
  EXPECT_EQ(parse_token_file(text_of(farm.ca_dir() / "tokens"))->front().uses, 2u) << "it costs no use";
  EXPECT_EQ(join("eve", test::now()), "got one");
  EXPECT_SAYS(join("eve", test::now()), "join under another name");
  ASSERT_TRUE(revoke(farm.ca_dir(), ada->identity.serial, test::now()));
  EXPECT_EQ(join("ada", test::now()), "got one");
}

// Many at once, each with its own request: as many certificates as uses.
TEST(Tokens, AreNotSpentTwiceByThoseWhoComeAtOnce) {
  Farm farm;
  const auto token = *make_token(farm.ca_dir(), Role::kWorker, 5, 24, test::now());
  std::atomic<int> got = 0;
  std::vector<std::thread> machines;
  for (int i = 0; i < 12; ++i)
    machines.emplace_back([&, i] {
      const auto own = make_key_and_request("render" + std::to_string(i));
      got += redeem_token(farm.ca_dir(), token.text(), own->request, test::now()).has_value();
    });
  for (std::thread& machine : machines) machine.join();
  EXPECT_EQ(got, 5);
  EXPECT_EQ(read_issued(farm.ca_dir())->size(), 5u);
  EXPECT_EQ(parse_token_file(text_of(farm.ca_dir() / "tokens"))->front().uses, 0u);
}

// The use is taken before anything is signed: what fails in between costs the use.
TEST(Tokens, AUseIsOnDiskBeforeTheCertificate) {
  Farm farm;
  const auto token = *make_token(farm.ca_dir(), Role::kWorker, 2, 24, test::now());
  const auto own = make_key_and_request("render7");
  fs::rename(farm.ca_dir() / "ca.key", farm.ca_dir() / "gone");  // as good as a crash before the signature
  EXPECT_FALSE(redeem_token(farm.ca_dir(), token.text(), own->request, test::now()));
  fs::rename(farm.ca_dir() / "gone", farm.ca_dir() / "ca.key");
  EXPECT_TRUE(redeem_token(farm.ca_dir(), token.text(), own->request, test::now()));
  EXPECT_FALSE(redeem_token(farm.ca_dir(), token.text(), own->request, test::now()));
}

TEST(Tokens, ADamagedFileGivesNothing) {
  const Digest d = sha256({});
  for (const std::string& bad :
       {"0123456 " + d.hex() + " worker 1 5\n", "01234567 " + d.hex() + " worker -1 5\n",
        "01234567 " + d.hex() + " king 1 5\n", "01234567 " + d.hex() + " worker 1\n",
        std::string("01234567 abc worker 1 5\n"), "01234567 " + d.hex() + " worker 4294967296 5\n"}) {
    const auto refused = parse_token_file(bad);
    ASSERT_FALSE(refused) << bad;
    EXPECT_SAYS(refused.error().message, "line 1");
  }
}

}  // namespace
}  // namespace kiln
