// kiln cert as a person types it.
#include "common/base/files.h"
#include "tests/tls/tls_pair.h"

namespace kiln {
namespace {

struct CertCommand : testing::Test {
  test::CommandResult cert(const std::string& rest) {
    return test::run_command("cd " + dir.path().string() + " && " +
                             (test::binary_dir() / "bin/kiln").string() + " cert " + rest);
  }
  test::TempDir dir;
};

TEST_F(CertCommand, FromNothingToAFarm) {
  EXPECT_SAYS(cert("issue --role worker --name render7").output, "make an authority with `kiln cert ca");
  ASSERT_EQ(cert("ca --name studio").exit_status, 0);
  EXPECT_EQ(cert("ca").exit_status, 2);
  const auto farm = cert("issue --role coordinator --name farm --host farm.studio.lan,10.0.0.7");
  ASSERT_EQ(farm.exit_status, 0) << farm.output;
  EXPECT_SAYS(farm.output, "farm.studio.lan, 10.0.0.7");
  ASSERT_EQ(cert("issue --role worker --name render7 --days 30 -o w7").exit_status, 0);
  const auto loaded = load_identity(tls_files_in(dir.path() / "w7"), test::now());
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->own.identity.not_after / test::kDay, test::now() / test::kDay + 30);

  const auto shown = cert("show w7/cert.pem --json");
  EXPECT_SAYS(shown.output, "\"name\": \"render7\"");
  EXPECT_SAYS(shown.output, loaded->own.identity.serial);
  EXPECT_SAYS(cert("show w7/cert.pem").output, "roles    worker");
  EXPECT_SAYS(cert("show w7/key.pem").output, "holds no certificate");
  EXPECT_SAYS(cert("revoke render7").output, loaded->own.identity.serial);
  EXPECT_SAYS(cert("revoke " + loaded->own.identity.serial).output, "nothing changed");
  EXPECT_EQ(cert("revoke render8").exit_status, 2);
  const auto token = cert("token --role worker --uses 3 --hours 2");
  EXPECT_EQ(token.exit_status, 0);
  EXPECT_EQ(token.output.substr(0, 5), "kiln-");
  EXPECT_SAYS(cert("token --role worker --json").output, "\"uses\": 1");
}

TEST_F(CertCommand, WrongUseIsSaid) {
  EXPECT_EQ(cert("bless").exit_status, 2);
  EXPECT_SAYS(cert("bless").output, "one of ca, issue, show, revoke, token");
  ASSERT_EQ(cert("ca").exit_status, 0);
  EXPECT_SAYS(cert("issue --name x").output, "say --role");
  EXPECT_SAYS(cert("issue --role king --name x").output, "\"king\" is not a role");
  EXPECT_SAYS(cert("issue --role worker").output, "say --name");
  EXPECT_SAYS(cert("issue --role worker --name x --days soon").output, "not a whole number");
  EXPECT_SAYS(cert("issue --role worker --name x --days 0").output, "1 to 36500 days");
  EXPECT_SAYS(cert("issue --role coordinator --name x").output, "--host");
  EXPECT_SAYS(cert("token --role admin").output, "cannot make a certificate of the role admin");
  EXPECT_SAYS(cert("token --role worker --uses 0").output, "1 to 10000 uses");
  EXPECT_SAYS(cert("--help").output, "kiln cert token --role worker --uses 20 --hours 48");
}

}  // namespace
}  // namespace kiln
