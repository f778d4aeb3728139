// Data folders that earlier schemas wrote, kept as files (store_fixture.cpp), and one that a later schema
// wrote.
#include "coordinator/farm/queue/schema.h"

#include "tests/queue/samples.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

fs::path kept_schemas() {
  return source_dir() / "tests/queue/schema";
}

TEST(Schema, EveryReleasedSchemaIsOpenedWithAllThatIsInIt) {
  ASSERT_TRUE(fs::exists(kept_schemas() / std::to_string(store_schema().size())))
      << "keep a folder of this schema: build/bin/store_fixture tests/queue/schema/" << store_schema().size();
  for (const auto& kept : fs::directory_iterator(kept_schemas())) {
    const MemoryDir dir;
    fs::copy(kept.path(), dir.path(), fs::copy_options::recursive | fs::copy_options::overwrite_existing);
    const auto opened = Store::open(dir.path(), {});
    ASSERT_TRUE(opened) << kept.path() << opened.error().message;
    Store& store = **opened;
    JobRecord first = sample_job(), second = sample_job("cellar");
    first.id = 1, first.submission = "one", second.id = 2, second.submission = "another", second.after = {1};
    EXPECT_EQ(store.jobs(), (std::vector<JobRecord>{first, second})) << kept.path();
    EXPECT_EQ(store.epoch(), 2u);
    for (uint64_t unit = 0; unit < 3; ++unit) {
      const Bytes payload = sample_payload(unit, 40);
      const auto read = store.read_result(2, unit, sample_commit(2, unit, payload).digest);
      ASSERT_TRUE(read) << read.error().message;
      EXPECT_EQ(*read, payload);
    }
    EXPECT_EQ(*store.passes(2), (std::vector<PassRecord>{{1, 64}}));
    ASSERT_EQ(store.events(2)->size(), 1u);
    EXPECT_EQ(store.events(2)->front().text, "submitted by ada");
    ASSERT_TRUE(store.worker("render9"));
    EXPECT_TRUE(store.worker("render9")->quarantined);
    EXPECT_TRUE(store.check()->empty());
    ASSERT_TRUE(commit_now(store, 2, 9));  // and it goes on
  }
}

TEST(Schema, ALaterOneIsRefusedAndLeftAlone) {
  const MemoryDir dir;
  open_store(dir.path())->close();
  {
    Database database = std::move(*Database::open(dir.path() / "kiln.db"));
    ASSERT_TRUE(database.script("PRAGMA user_version=" + std::to_string(store_schema().size() + 1)));
    ASSERT_TRUE(database.checkpoint());
  }
  const auto refused = Store::open(dir.path(), {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::kUsage);
  EXPECT_NE(
      refused.error().message.find("was written by a newer release of Kiln (schema 4, this release knows 3): "
                                   "start that release, or choose another folder"),
      std::string::npos)
      << refused.error().message;
}

}  // namespace
}  // namespace kiln::test
