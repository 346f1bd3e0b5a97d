// SPDX-License-Identifier: MIT
// Where the healthy runs' blocks are, in memory, in a file or in part files, changes no bit of what
// is learnt of them; and a part file that is not whole is refused.
#include "made_vehicle.hpp"
#include "temporary.hpp"
#include "train/healthy_runs.hpp"
#include "train/trainer.hpp"
#include "util/atomic_file.hpp"
#include "util/error.hpp"

#include <array>
#include <cmath>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <setjmp.h>
extern "C" {
#include <cmocka.h>
}

namespace {

constexpr std::uint64_t kSeed = 6200;
constexpr std::size_t kRuns = 12, kShards = 8; // one run more than are learnt again without each
constexpr std::size_t kFew = 3;                // each of these is

// Half as long as usual: what is compared are bytes.
MadeVehicle brief() {
  MadeVehicle made;
  made.rows /= 2;
  return made;
}

// 60 blocks in a run, in a quarter of the time; as usual, 240, with RIM_LONG (`make test-long`).
bool is_long() { return std::getenv("RIM_LONG") != nullptr; }
constexpr double kBlock = 2.0; // s

rim::BlockingOptions blocking() {
  rim::BlockingOptions options;
  options.block_s = is_long() ? 0.0 : kBlock;
  return options;
}

rim::TrainOptions training() {
  rim::TrainOptions options;
  options.blocking = blocking();
  return options;
}

// So much memory for the blocks where a run has 240.
std::size_t room(std::size_t bytes) { return is_long() ? bytes : bytes / 4; }

// A folder of its own for a test.
class Temporary {
public:
  Temporary() {
    static int count = 0;
    folder_ = temporary_folder() / ("folder" + std::to_string(++count));
    std::filesystem::create_directory(folder_);
  }
  std::string path() const { return folder_; }
  std::string path(const std::string &name) const { return folder_ / name; }

private:
  std::filesystem::path folder_;
};

const std::vector<rim::Log> &logs() {
  static const std::vector<rim::Log> made = made_vehicles(kSeed, kRuns, brief());
  return made;
}

// Few, of one sensor: learning again without each of them, too, reads blocks from where they are.
const std::vector<rim::Log> &few_logs() {
  static const std::vector<rim::Log> made = [] {
    std::vector<rim::Log> few = made_vehicles(kSeed, kFew, brief());
    for (rim::Log &log : few) { // u.a, u.b and s.lag_m
      log.columns.resize(3);
      log.values = rim::Matrix(log.values.leftCols(3));
    }
    return few;
  }();
  return made;
}

std::vector<std::uint8_t> image_of(const rim::HealthyRuns &healthy) {
  return rim::make_image(rim::train(healthy, training()).plan);
}

const std::vector<std::uint8_t> &image() {
  static const std::vector<std::uint8_t> made =
      rim::make_image(rim::train(logs(), training()).plan);
  return made;
}

std::string part(const std::string &folder, std::size_t shard, std::size_t of,
                 const std::vector<rim::Log> &from = logs(), double block_s = blocking().block_s) {
  const std::string path = folder + "/" + std::to_string(shard) + "_of_" + std::to_string(of);
  rim::LogSet set(from);
  rim::BlockingOptions options;
  options.block_s = block_s;
  (void)rim::write_part(&set, options, {shard, of}, path);
  return path;
}

std::string refusal(const std::vector<std::string> &paths) {
  try {
    (void)rim::merged_parts(paths);
  } catch (const rim::DataError &error) {
    return error.what();
  }
  return "";
}

bool has(const std::string &text, const std::string &some) {
  if (text.find(some) != std::string::npos)
    return true;
  print_message("'%s' not in '%s'\n", some.c_str(), text.c_str());
  return false;
}

// No memory for the wide matrices, and memory for some runs only.
void a_file_instead_of_memory(void **) {
  const auto filed = [](const std::vector<rim::Log> &from, std::size_t bytes) {
    rim::LogSet set(from);
    rim::BlockingOptions options = blocking();
    options.wide_bytes = bytes;
    return image_of(rim::healthy_runs(&set, options));
  };
  const auto few = rim::make_image(rim::train(few_logs(), training()).plan);
  for (const std::size_t bytes : {std::size_t{0}, room(std::size_t{3} << 18)})
    assert_true(filed(logs(), bytes) == image());
  assert_true(filed(few_logs(), room(std::size_t{3} << 16)) == few);
}

void logs_that_are_read_again(void **) {
  const Temporary folder;
  std::vector<std::string> paths;
  std::vector<rim::Log> read;
  for (std::size_t i = 0; i < kFew; ++i) {
    paths.push_back(folder.path("run" + std::to_string(i) + ".csv"));
    rim::write_log(few_logs()[i], paths.back());
    read.push_back(rim::read_log(paths.back()));
  }
  const std::vector<std::uint8_t> kept = rim::make_image(rim::train(read, training()).plan);
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{75000}, rim::LogSet::kKeptBytes}) {
    rim::LogSet set(paths, std::nullopt, bytes);
    assert_true(image_of(rim::healthy_runs(&set, blocking())) == kept);
  }
}

// By its hash a log is known again, and a log that was changed between its two readings is not.
void any_change_of_a_log_changes_its_hash(void **) {
  const auto hash = [](const rim::Log &log) {
    std::array<std::uint64_t, 2> content{};
    rim::hash_of(log, content.data());
    return content;
  };
  const auto own = hash(logs()[1]);
  assert_true(hash(logs()[1]) == own);
  rim::Log other = logs()[1];
  other.values(7, 2) = std::nextafter(other.values(7, 2), 1e9);
  assert_true(hash(other)[0] != own[0] && hash(other)[1] != own[1]);
  other = logs()[1];
  other.values.row(0).swap(other.values.row(1));
  assert_true(hash(other)[0] != own[0] && hash(other)[1] != own[1]);
  other = logs()[1];
  other.values.conservativeResize(other.values.rows() - 1, Eigen::NoChange);
  assert_true(hash(other)[0] != own[0] && hash(other)[1] != own[1]);
}

void eight_shards_teach_what_one_teaches(void **) {
  const Temporary folder;
  assert_true(image_of(rim::merged_parts({part(folder.path(), 1, 1)})) == image());
  std::vector<std::string> parts;
  for (std::size_t i = kShards; i > 0; --i) // in any order
    parts.push_back(part(folder.path(), i, kShards));
  assert_true(image_of(rim::merged_parts(parts)) == image());
}

void parts_that_do_not_belong_are_refused(void **) {
  const Temporary folder;
  const std::string first = part(folder.path(), 1, 3), second = part(folder.path(), 2, 3),
                    third = part(folder.path(), 3, 3);
  assert_true(refusal({first, second, third}).empty());
  assert_true(has(refusal({first, third}), "made6201: its blocks are in none of the 2 part files"));
  assert_true(has(refusal({first, second, third, second}), "2_of_3: holds made6201, which"));
  const std::vector<rim::Log> fewer(logs().begin(), logs().begin() + 6);
  const Temporary elsewhere;
  assert_true(has(refusal({first, part(elsewhere.path(), 2, 3, fewer), third}),
                  "2_of_3: is of other logs"));
  assert_true(has(refusal({first, part(elsewhere.path(), 2, 3, logs(), 3.0), third}),
                  "or of another --block-seconds"));
  assert_true(has(refusal({first, folder.path() + "/none"}), "none: No such file"));
}

// Whatever of a part file is damaged or missing is seen.
void damaged_parts_are_refused(void **) {
  const Temporary folder;
  const std::vector<rim::Log> few(logs().begin(), logs().begin() + 3);
  const std::string whole = part(folder.path(), 1, 1, few), bytes = rim::read_file(whole),
                    path = folder.path("damaged");
  const auto refused = [&](const std::string &changed) {
    rim::AtomicFile file(path);
    file.write(changed);
    file.commit();
    return !refusal({path}).empty();
  };
  assert_false(refused(bytes));
  std::size_t tried = 0;
  for (std::size_t at = 0; at < bytes.size(); at += 1 + bytes.size() / 150, ++tried) {
    std::string changed = bytes;
    changed[at] = static_cast<char>(changed[at] ^ 0x20);
    assert_true(refused(changed));
    assert_true(refused(bytes.substr(0, at)));
  }
  assert_true(refused(bytes + "x"));
  assert_true(tried > 100);
}

} // namespace

int main() {
  print_message("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const CMUnitTest tests[] = {
      cmocka_unit_test(a_file_instead_of_memory),
      cmocka_unit_test(logs_that_are_read_again),
      cmocka_unit_test(any_change_of_a_log_changes_its_hash),
      cmocka_unit_test(eight_shards_teach_what_one_teaches),
      cmocka_unit_test(parts_that_do_not_belong_are_refused),
      cmocka_unit_test(damaged_parts_are_refused),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
