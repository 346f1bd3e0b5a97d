// SPDX-License-Identifier: MIT
// The small things that everything leans on: files that are whole or absent, shards, threads,
// tables.
#include "check.hpp"
#include "interrupted.hpp"
#include "temporary.hpp"
#include "thesis/shard.hpp"
#include "util/atomic_file.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "util/parallel_for.hpp"
#include "util/table.hpp"
#include "util/utf8.hpp"

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <sys/resource.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace {

namespace fs = std::filesystem;

std::size_t files_in(const std::string &path) {
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator(path), fs::directory_iterator()));
}

template <class Error, class Body> void assert_throws(Body body, const char *part) {
  try {
    body();
  } catch (const Error &e) {
    if (std::strstr(e.what(), part) == nullptr)
      fail_msg("'%s' does not contain '%s'", e.what(), part);
    return;
  }
  fail_msg("nothing was thrown; expected '%s'", part);
}

void a_file_appears_whole_or_not_at_all(void **) {
  const std::string here = temporary_path("atomic"), path = here + "/x";
  rim::make_folder(here);
  {
    rim::AtomicFile out(path);
    out.write("half");
  }
  assert_int_equal(files_in(here), 0);
  {
    rim::AtomicFile out(path);
    out.write(std::string(1000000, 'a'));
    assert_false(fs::exists(path));
    out.commit();
  }
  assert_true(rim::read_file(path) == std::string(1000000, 'a'));
  {
    rim::AtomicFile out(path);
    out.write("new");
  }
  assert_int_equal(rim::read_file(path).size(), 1000000);
  assert_int_equal(files_in(here), 1);
}

void a_full_disk_leaves_nothing(void **) {
  const std::string here = temporary_path("full"), path = here + "/x";
  rim::make_folder(here);
  rlimit before{}, tight{};
  getrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, SIG_IGN);
  tight = before;
  tight.rlim_cur = 300000;
  setrlimit(RLIMIT_FSIZE, &tight);
  bool thrown = false;
  try {
    rim::AtomicFile out(path);
    out.write(std::string(1000000, 'a'));
    out.commit();
  } catch (const rim::DataError &e) {
    thrown = std::strstr(e.what(), path.c_str()) != nullptr;
  }
  setrlimit(RLIMIT_FSIZE, &before);
  assert_true(thrown);
  assert_int_equal(files_in(here), 0);
  assert_throws<rim::DataError>(
      [] {
        rim::AtomicFile out("/dev/full");
        out.write("x");
        out.commit();
      },
      "/dev/full: write failed: No space left");
  assert_true(fs::exists("/dev/full"));
}

void files_that_cannot_be_are_said_so(void **) {
  assert_throws<rim::DataError>([] { rim::AtomicFile out(temporary_folder().string()); },
                                "is a folder");
  assert_throws<rim::DataError>([] { rim::AtomicFile out("/nonexistent/x"); }, "No such file");
  assert_throws<rim::DataError>([] { rim::read_file("/nonexistent/x"); }, "No such file");
  assert_throws<rim::DataError>([] { rim::read_file(temporary_folder().string()); }, "is a folder");
  rim::AtomicFile out(temporary_path("plain"));
  out.commit();
  assert_throws<rim::DataError>([] { rim::make_folder(temporary_path("plain")); }, "cannot make");
  rim::AtomicFile device("/dev/null");
  device.write("x");
  device.commit();
  assert_true(fs::is_character_file("/dev/null"));
}

// What an interrupted program says, and its files, of which several threads put one after the other
// in place. The signal comes when `enough` are there.
std::string interrupted_after(int enough, const fs::path &folder) {
  const auto write = [&folder](int thread) {
    for (int i = 0; i < 1000000; ++i)
      rim::AtomicFile(folder / (std::to_string(thread) + "_" + std::to_string(i))).commit();
  };
  const auto files = [&folder] {
    return std::distance(fs::directory_iterator(folder), fs::directory_iterator());
  };
  return interrupted(
      [&write] {
        std::thread(write, 1).detach();
        write(0);
      },
      [&files, enough](pid_t program) {
        while (files() < enough && waitpid(program, nullptr, WNOHANG) == 0)
          continue;
        kill(program, SIGINT);
      });
}

void an_interrupted_program_counts_every_file_it_leaves(void **) {
  for (int round = 0; round < 40; ++round) {
    const fs::path folder = temporary_path("interrupted" + std::to_string(round));
    fs::create_directory(folder);
    const std::string text = interrupted_after(5 + round, folder);
    const auto left = std::distance(fs::directory_iterator(folder), fs::directory_iterator());
    const std::string count = "interrupted: " + std::to_string(left) + " files are complete";
    if (text.find(count) == std::string::npos)
      fail_msg("%ld files are there, and it says: %s", static_cast<long>(left), text.c_str());
  }
}

void every_item_is_done_once(void **) {
  for (const char *threads : {"1", "2", "7"}) {
    setenv("RIM_THREADS", threads, 1);
    std::vector<int> done(1000);
    rim::parallel_for(done.size(), [&](std::size_t i) { done[i] += static_cast<int>(i); });
    for (std::size_t i = 0; i < done.size(); ++i)
      assert_int_equal(done[i], i);
    rim::parallel_for(0, [](std::size_t) { fail_msg("nothing was thrown"); });
  }
  unsetenv("RIM_THREADS");
  assert_int_equal(rim::parallel_threads(), 2);
}

void an_exception_reaches_the_caller(void **) {
  assert_throws<rim::DataError>(
      [] {
        rim::parallel_for(100, [](std::size_t i) {
          if (i == 5)
            throw rim::DataError("item 5");
        });
      },
      "item 5");
}

rim::Campaign shard_of(const std::string &text) {
  const rim::Shard shard = rim::parse_shard(text);
  rim::Campaign campaign{"test", {{"seed", 1}}, 10, {}};
  for (std::uint64_t i = 0; i < 10; ++i)
    if (shard.owns(i))
      campaign.units[i] = {{"x", 1.0 / (3.0 + static_cast<double>(i))}};
  return campaign;
}

void shards_fold_to_the_same_bytes(void **) {
  const std::string whole = temporary_path("whole.json"), merged = temporary_path("merged.json");
  rim::write_campaign(shard_of("1/1"), whole);
  std::vector<std::string> parts;
  for (const char *text : {"3/3", "1/3", "2/3"}) {
    parts.push_back(temporary_path(std::string("part") + text[0] + ".json"));
    rim::write_campaign(shard_of(text), parts.back());
  }
  const rim::Campaign folded = rim::merge_campaigns(parts);
  assert_true(folded.complete());
  rim::write_campaign(folded, merged);
  assert_true(rim::read_file(whole) == rim::read_file(merged));
  assert_true(folded.units.at(4).at("x").get<double>() == 1.0 / 7.0);
  assert_false(rim::merge_campaigns({parts[0], parts[1]}).complete());
  rim::merge_campaigns({parts[0], parts[0]}); // twice the same is no conflict
}

void campaigns_that_do_not_belong_together_are_refused(void **) {
  const std::string a = temporary_path("a.json"), b = temporary_path("b.json");
  rim::Campaign one = shard_of("1/2"), other = shard_of("1/2");
  other.config["seed"] = 2;
  rim::write_campaign(one, a);
  rim::write_campaign(other, b);
  assert_throws<rim::DataError>([&] { rim::merge_campaigns({a, b}); }, "of another campaign");
  other = one;
  other.units[0]["x"] = 5;
  rim::write_campaign(other, b);
  assert_throws<rim::DataError>([&] { rim::merge_campaigns({a, b}); }, "unit 0 differs");
  rim::AtomicFile text(b);
  text.write("{\"schema\":1}");
  text.commit();
  assert_throws<rim::DataError>([&] { rim::read_campaign(b); }, "not a rim-campaign/1 file");
  for (const char *bad : {"", "1", "0/2", "3/2", "1/0", "-1/2", "1/2x", "a/b", "1/"})
    assert_throws<rim::UsageError>([&] { rim::parse_shard(bad); }, "expected I/N");
}

void tables_line_up(void **) {
  rim::Table table({{"name", ""}, {"speed", "m/s"}});
  table.add({"a", rim::cell(12.345)});
  table.add({"longer", rim::cell(0.00012346)});
  table.add({"none"});
  assert_string_equal(table.text().c_str(), "name        speed\n"
                                            "              m/s\n"
                                            "------  ---------\n"
                                            "a           12.35\n"
                                            "longer  0.0001235\n"
                                            "none\n");
  assert_string_equal(rim::cell(0.0).c_str(), "0");
  assert_string_equal(rim::cell(1e9, 3).c_str(), "1e+09");
  assert_string_equal(rim::cell(-150.0, 2).c_str(), "-150");
}

// What a caller in Python does at Ctrl-C.
void work_that_is_stopped_ends_at_its_next_item(void **) {
  std::atomic<int> begun{0};
  const auto stopping = [&](std::size_t) {
    begun++;
    rim::stop_work(true);
  };
  bool stopped = false;
  try {
    rim::parallel_for(1000, stopping);
  } catch (const rim::WorkStopped &) {
    stopped = true;
  }
  assert_true(stopped && begun <= static_cast<int>(rim::parallel_threads()));
  rim::stop_work(false);
  int done = 0;
  rim::parallel_for(1, [&](std::size_t) { done++; });
  assert_int_equal(done, 1);
}

void text_of_other_encodings_becomes_utf8(void **) {
  const std::string word = "\u00d6ldr\u00fcck \u20ac \U0001f600";
  assert_string_equal(rim::as_utf8(word).c_str(), word.c_str());
  assert_string_equal(rim::as_utf8("\xd6ldr\xfc"
                                   "ck")
                          .c_str(),
                      "\u00d6ldr\u00fcck");
  assert_string_equal(rim::as_utf8("a\xe4\u00e4").c_str(), "a\u00e4\u00e4"); // both in one file
  const char little[] = "\xff\xfe\xd6\0l\0\xac\x20\x3d\xd8\0\xde";
  assert_string_equal(rim::as_utf8(std::string(little, sizeof little - 1)).c_str(),
                      "\u00d6l\u20ac\U0001f600");
  const char big[] = "\xfe\xff\0\xd6\0l";
  assert_string_equal(rim::as_utf8(std::string(big, sizeof big - 1)).c_str(), "\u00d6l");
  const char half[] = "\xff\xfe\x3d\xd8"; // of a pair, and an odd byte behind it
  assert_string_equal(rim::as_utf8(std::string(half, sizeof half)).c_str(), "\ufffd");
  assert_string_equal(rim::without_accents("\u00d6l \u00e9t\u00e9 \u00b0C").c_str(),
                      "Ol ete \u00b0C");
}

void data_is_found_where_it_is_told(void **) {
  assert_true(fs::exists(rim::data_path("falcon9.toml")));
  setenv("RIM_DATA", temporary_folder().string().c_str(), 1);
  assert_throws<rim::DataError>([] { rim::data_path("falcon9.toml"); }, "not found in");
  unsetenv("RIM_DATA");
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      // First: it counts the files that the process has written since it began.
      cmocka_unit_test(an_interrupted_program_counts_every_file_it_leaves),
      cmocka_unit_test(a_file_appears_whole_or_not_at_all),
      cmocka_unit_test(a_full_disk_leaves_nothing),
      cmocka_unit_test(files_that_cannot_be_are_said_so),
      cmocka_unit_test(every_item_is_done_once),
      cmocka_unit_test(an_exception_reaches_the_caller),
      cmocka_unit_test(work_that_is_stopped_ends_at_its_next_item),
      cmocka_unit_test(text_of_other_encodings_becomes_utf8),
      cmocka_unit_test(shards_fold_to_the_same_bytes),
      cmocka_unit_test(campaigns_that_do_not_belong_together_are_refused),
      cmocka_unit_test(tables_line_up),
      cmocka_unit_test(data_is_found_where_it_is_told),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
