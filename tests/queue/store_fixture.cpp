// Writes the data folder of store_schema_test: store_fixture FOLDER. Once for each schema that is released:
//
//   build/bin/store_fixture tests/queue/schema/3
#include <cstdio>

#include "tests/queue/samples.h"

int main(int argc, char** argv) {
  using namespace kiln;
  if (argc != 2) {
    std::fprintf(stderr, "usage: store_fixture FOLDER\n");
    return 2;
  }
  const auto store = Store::open(argv[1], {});
  if (!store) {
    std::fprintf(stderr, "%s\n", store.error().message.c_str());
    return 1;
  }
  JobRecord kitchen = test::sample_job(), second = test::sample_job("cellar");
  kitchen.submission = "one";
  const auto first = (*store)->submit(kitchen);
  second.submission = "another";
  if (first) second.after = {*first};
  const auto job = (*store)->submit(second);
  bool good = first && job;
  for (uint64_t unit = 0; good && unit < 3; ++unit)
    good = test::commit_now(**store, *job, unit, 40).has_value();
  good = good && test::wait_for([&](auto done) { (*store)->put_pass(*job, {1, 64}, done); });
  good = good && test::wait_for([&](auto done) {
           (*store)->quarantine("render9", "its answers differ from two others'", 1'700'000'000'000, done);
         });
  if (good) (*store)->event(*job, 1'700'000'000'000, "submitted by ada");
  good = good && (*store)->flush();
  return good ? 0 : 1;
}
