// What the store takes as a record, bound by bound.
#include "coordinator/farm/queue/records.h"

#include <functional>

#include "tests/queue/samples.h"

namespace kiln::test {
namespace {

struct Bound {
  const char* word;                              // of the refusal
  std::function<void(JobRecord&)> most, beyond;  // the last value that is allowed, and one that is not
};

const std::vector<Bound>& bounds() {
  static const std::vector<Bound> all = {
      {"name", [](JobRecord& j) { j.name.assign(256, 'a'); }, [](JobRecord& j) { j.name.assign(257, 'a'); }},
      {"user", [](JobRecord& j) { j.user = "~"; }, [](JobRecord& j) { j.user = "\x7f"; }},
      {"reason", [](JobRecord& j) { j.reason.assign(4096, 'a'); },
       [](JobRecord& j) { j.reason.assign(4097, 'a'); }},
      {"taint", [](JobRecord& j) { j.taint = " "; }, [](JobRecord& j) { j.taint = "\x1f"; }},
      {"verification", [](JobRecord& j) { j.verification.assign(4096, 'a'); },
       [](JobRecord& j) { j.verification.assign(4097, 'a'); }},
      {"submission", [](JobRecord& j) { j.submission.assign(256, 'a'); },
       [](JobRecord& j) { j.submission.assign(257, 'a'); }},
      {"numeric class", [](JobRecord& j) { j.numeric_class.assign(256, 'a'); },
       [](JobRecord& j) { j.numeric_class.assign(257, 'a'); }},
      {"settings", [](JobRecord& j) { j.settings.assign(1 << 20, ' '); },
       [](JobRecord& j) { j.settings.assign((1 << 20) + 1, ' '); }},
      {"priority", [](JobRecord& j) { j.priority = 100; }, [](JobRecord& j) { j.priority = 101; }},
      {"priority", [](JobRecord& j) { j.priority = -100; }, [](JobRecord& j) { j.priority = -101; }},
      {"quorum", [](JobRecord& j) { j.quorum = 1; }, [](JobRecord& j) { j.quorum = 0; }},
      {"quorum", [](JobRecord& j) { j.quorum = 16; }, [](JobRecord& j) { j.quorum = 17; }},
      {"state", [](JobRecord& j) { j.state = JobState::kCancelled; },
       [](JobRecord& j) { j.state = static_cast<JobState>(8); }},
      {"policy", [](JobRecord& j) { j.poison = PoisonPolicy::kSkip; },
       [](JobRecord& j) { j.poison = static_cast<PoisonPolicy>(2); }},
      {"waits for", [](JobRecord& j) { j.after.assign(1024, 1); },
       [](JobRecord& j) { j.after.assign(1025, 1); }},
      {"relative path", [](JobRecord& j) { j.inputs.back().path.assign(4096, 'a'); },
       [](JobRecord& j) { j.inputs.back().path.assign(4097, 'a'); }},
      {"result file",
       [](JobRecord& j) {
         j.results.push_back({"...", {}, 1});
       },
       [](JobRecord& j) {
         j.results.push_back({"..", {}, 1});
       }},
      {"scene", [](JobRecord& j) { j.scene.clear(), j.inputs.clear(); },
       [](JobRecord& j) { j.scene = "room.gltf", j.inputs.clear(); }},
      {"scene", [](JobRecord& j) { j.scene = j.inputs.back().path; }, [](JobRecord& j) { j.scene.clear(); }}};
  return all;
}

TEST(Records, EveryBoundIsWhereItIsSaid) {
  ASSERT_TRUE(check_job(sample_job()));
  for (const Bound& bound : bounds()) {
    JobRecord job = sample_job();
    bound.most(job);
    const Status good = check_job(job);
    EXPECT_TRUE(good) << bound.word << ": " << good.error().message;
    job = sample_job();
    bound.beyond(job);
    const Status refused = check_job(job);
    ASSERT_FALSE(refused) << bound.word;
    EXPECT_EQ(refused.error().kind, ErrorKind::kInvalidInput);
    EXPECT_NE(refused.error().message.find(bound.word), std::string::npos) << refused.error().message;
  }
}

TEST(Records, AHundredThousandFilesAreTheMost) {
  std::vector<FileRecord> files;
  for (int i = 0; i < 100000; ++i) files.push_back({std::to_string(i), {}, 1});
  EXPECT_TRUE(check_files("input", files));
  files.push_back({"one more", {}, 1});
  EXPECT_FALSE(check_files("input", files));
}

TEST(Records, StatesHaveTheirNamesAndThreeAreEnds) {
  EXPECT_EQ(job_state_name(JobState::kWaiting), "waiting");
  EXPECT_EQ(job_state_name(JobState::kBaking), "baking");
  EXPECT_EQ(job_state_name(JobState::kCancelled), "cancelled");
  int ends = 0;
  for (int state = 0; state < 8; ++state) ends += job_ended(static_cast<JobState>(state));
  EXPECT_EQ(ends, 3);
  EXPECT_TRUE(job_ended(JobState::kFailed));
  EXPECT_FALSE(job_ended(JobState::kFinishing));
}

TEST(Records, AResultIsSuspectIfOnlyTheQuarantinedGavePartsOfIt) {
  JobRecord job;
  job.state = JobState::kDone;
  job.tainted = true;
  job.taint = "5 " + suspect_words("liar") + "it lied";
  EXPECT_TRUE(job.result_is_suspect(""));
  EXPECT_TRUE(job.result_is_suspect("liar"));
  EXPECT_FALSE(job.result_is_suspect("honest"));
  job.tainted = false;
  EXPECT_FALSE(job.result_is_suspect("liar"));
  job.tainted = true;
  job.state = JobState::kBaking;
  EXPECT_FALSE(job.result_is_suspect("liar")) << "not published yet";
  job.state = JobState::kDone;
  job.taint = "unit 5 was skipped";
  EXPECT_FALSE(job.result_is_suspect(""));
}

}  // namespace
}  // namespace kiln::test
