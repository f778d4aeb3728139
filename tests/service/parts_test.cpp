// The pure parts: whose turn it is, what waits no more, JSON and settings from elsewhere.
#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/service/fields.h"
#include "coordinator/service/job_settings.h"
#include "coordinator/service/people.h"
#include "coordinator/service/turn.h"

namespace kiln::test {
namespace {

JobRecord job(JobId id, const std::string& user, JobState state, int32_t priority = 0) {
  JobRecord record;
  record.id = id;
  record.user = user;
  record.state = state;
  record.priority = priority;
  return record;
}

JobId next(const std::vector<JobRecord>& jobs) {
  return next_job(jobs, [](JobId) { return true; });
}

TEST(Turn, UsersWithFewActiveJobsThenPriorityThenAge) {
  using S = JobState;
  EXPECT_EQ(next({}), 0u);
  EXPECT_EQ(next({job(1, "a", S::kQueued), job(2, "a", S::kQueued)}), 1u);
  EXPECT_EQ(next({job(1, "a", S::kQueued), job(2, "a", S::kQueued, 5)}), 2u);
  EXPECT_EQ(next({job(1, "a", S::kBaking), job(2, "a", S::kQueued, 100), job(3, "b", S::kQueued, -100)}), 3u);
  EXPECT_EQ(next({job(1, "a", S::kDone), job(2, "a", S::kQueued), job(3, "b", S::kQueued)}), 2u);
  std::vector<JobRecord> jobs{job(1, "a", S::kQueued), job(2, "a", S::kWaiting), job(3, "a", S::kQueued)};
  jobs[0].paused = true;
  EXPECT_EQ(next(jobs), 3u);
  EXPECT_EQ(next_job(jobs, [](JobId id) { return id != 3; }), 0u);
}

TEST(Turn, WaitingEndsWhenAllAreDoneOrOneCannotBe) {
  using S = JobState;
  std::vector<JobRecord> jobs{job(1, "a", S::kDone), job(2, "a", S::kBaking), job(3, "a", S::kWaiting)};
  jobs[2].after = {1, 2};
  EXPECT_TRUE(ended_waits(jobs).empty());
  jobs[1].state = S::kDone;
  ASSERT_EQ(ended_waits(jobs).size(), 1u);
  EXPECT_EQ(ended_waits(jobs)[0].failure, "");
  jobs[0].state = S::kFailed;
  EXPECT_NE(ended_waits(jobs)[0].failure.find("job 1"), std::string::npos);
  jobs.erase(jobs.begin());
  EXPECT_NE(ended_waits(jobs)[0].failure.find("forgotten"), std::string::npos);
}

TEST(Json, ReadsValuesExactlyAndRefusesWhatIsNone) {
  const auto v = parse_json(R"({"a":18446744073709551615,"b":-9,"c":[1.5,"x\n",true,null],"d":{"e":{}}})");
  ASSERT_TRUE(v);
  EXPECT_EQ(v->find("a")->whole, ~uint64_t{0});
  EXPECT_TRUE(v->find("b")->negative);
  EXPECT_EQ(v->find("b")->whole, 9u);
  ASSERT_EQ(v->find("c")->items.size(), 4u);
  EXPECT_FALSE(v->find("c")->items[0].is_whole);
  EXPECT_EQ(v->find("c")->items[1].text, "x\n");
  EXPECT_EQ(v->find("d")->members.size(), 1u);
  for (const char* bad :
       {"", "{", "{\"a\":}", "{\"a\":1,\"a\":2}", "[1,]", "1 2", "\"\xff\"", "nul", "{'a':1}"})
    EXPECT_FALSE(parse_json(bad)) << bad;
  EXPECT_TRUE(parse_json(std::string(16, '[') + std::string(16, ']')));
  EXPECT_FALSE(parse_json(std::string(17, '[') + std::string(17, ']')));
}

TEST(JobSettings, ComeBackAsTheyWereSet) {
  BakeSettings s;
  for (const auto& [name, value] : {std::pair{"sun", "0,1,0:1,2,3"},
                                    {"sun", "1,1,0:4,5,6"},
                                    {"importance-box", "0,0,0:1,1,1:2"},
                                    {"error", "0.125"},
                                    {"seed", "9007199254740992"},
                                    {"threads", "3"}})
    ASSERT_TRUE(set_option(s, name, value, "test"));
  const auto back = read_job_settings(write_job_settings(s), {});
  ASSERT_TRUE(back) << back.error().message;
  ASSERT_EQ(back->suns.size(), 2u);
  EXPECT_EQ(back->suns[1].irradiance[2], 6);
  EXPECT_EQ(back->importance_boxes.size(), 1u);
  EXPECT_EQ(back->error, 0.125);
  EXPECT_EQ(back->seed, 9007199254740992u);
  EXPECT_EQ(back->threads, 0u);  // of the machine it was typed on
}

TEST(People, WorkersTokensOfSingleOwners) {
  const test::TempDir dir;
  const auto file = dir.path() / "worker.token";
  const auto read = [&](const std::string& words) {
    EXPECT_TRUE(write_private_file(file, words));
    return read_worker_tokens(file);
  };
  const std::string all = "the-token-of-all-of-them", ada = "the-token-of-ada-alone";
  EXPECT_TRUE(read(all)->owners.empty());
  EXPECT_EQ(read(all + "\r\n")->shared, all);
  const auto both = read(all + "\n# lent\n\nada " + ada + "\n");
  ASSERT_TRUE(both) << both.error().message;
  EXPECT_EQ(both->shared, all);
  EXPECT_EQ(both->owners, (std::map<std::string, std::string>{{"ada", ada}}));
  for (const std::string& line :
       std::vector<std::string>{"ada", "ada short", "a/da " + ada, "ada " + ada + " x", " " + ada}) {
    const auto refused = read(all + "\n" + line + "\n");
    ASSERT_FALSE(refused) << line;
    EXPECT_NE(refused.error().message.find("line 2"), std::string::npos) << refused.error().message;
  }
  EXPECT_FALSE(read(all + "\nada " + ada + "\nada " + ada + "2\n"));
  EXPECT_FALSE(read("short\nada " + ada));
}

TEST(People, ByCertificate) {
  const ServiceTokens tokens{"a", "s", "r", "p", {"w", {}}};
  const auto access = [&](const std::vector<Role>& roles, const char* serial) {
    return recognise({"", "a", "mallory", ""}, {"ada", roles, serial, 0}, true, tokens);
  };
  EXPECT_EQ(access({Role::kRead, Role::kAdmin}, "1f")->access, Access::kAdmin);
  EXPECT_EQ(access({Role::kSubmit}, "1f")->user, "ada");  // not what the program states
  EXPECT_EQ(access({}, "")->access, Access::kEnrol);      // whatever token it shows
  EXPECT_FALSE(access({Role::kWorker}, "1f"));
}

}  // namespace
}  // namespace kiln::test
