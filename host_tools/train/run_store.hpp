// SPDX-License-Identifier: MIT
// train/run_store.hpp - the blocks of many healthy runs in bounded memory.
//
// A run's narrow matrices (what the outcomes and the context were) stay in memory. Its wide ones
// (the terms of the basis and the integrands, most of the bytes) are needed a few times, one run
// after the other: they stay in memory up to a limit, the others in a file. Where they are changes
// no bit of what is learnt.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "train/healthy_blocks.hpp"

namespace rim {

// A file that is read at any place by several threads.
class BlockFile {
public:
  // An existing file. DataError "PATH: reason".
  explicit BlockFile(const std::string &path);
  // A new file without a name in this folder, which is gone when the program ends.
  static std::shared_ptr<BlockFile> unnamed(const std::string &folder);
  ~BlockFile();
  BlockFile(const BlockFile &) = delete;
  BlockFile &operator=(const BlockFile &) = delete;

  std::uint64_t bytes() const;
  // DataError when the file ends before.
  void read(std::uint64_t at, void *to, std::size_t bytes) const;
  void write(std::uint64_t at, const void *from, std::size_t bytes);

private:
  BlockFile(int descriptor, std::string path);
  int descriptor_;
  std::string path_;
};

constexpr std::size_t kFolds = 6; // run r is left out of fold r % kFolds

// What of a run is not kept in memory.
struct WideBlocks {
  Matrix terms, early, late; // as of BlockRun
};

class RunStore {
public:
  static constexpr std::size_t kWideBytes = std::size_t{256} << 20;

  // Room for n runs. The wide matrices of the first few stay in memory, as many as wide_bytes
  // hold; `folder` is where the file of the others goes ("": $TMPDIR, else /tmp).
  explicit RunStore(std::size_t n = 0, std::size_t wide_bytes = kWideBytes,
                    std::string folder = "");
  explicit RunStore(const std::vector<BlockRun> &runs);

  // Run r. Threads may put different runs at the same time.
  void put(std::size_t r, BlockRun run);
  // Run r, whose wide matrices stand in a file: terms, early and late, one behind the other, by
  // rows.
  void put_from(std::size_t r, BlockRun narrow, std::shared_ptr<BlockFile> file, std::uint64_t at,
                const std::size_t columns[3]);
  // The wide matrices of run r.
  std::shared_ptr<const WideBlocks> wide(std::size_t r) const;

  // The wide matrices are not asked for any more.
  void forget_wide();

  // The same runs with this one behind the others: nothing is learnt from it, but the models that
  // are learnt from the others predict it too. Shares the wide matrices.
  RunStore without(std::size_t run) const;

  // Narrow: terms, early and late are empty. Learnt from are the first size() runs, and so are
  // begin() to end(); with the one that is only judged there are all() runs.
  std::size_t size() const { return learnt_; }
  std::size_t all() const { return runs_.size(); }
  const BlockRun &operator[](std::size_t r) const { return runs_[r]; }
  const BlockRun &front() const { return runs_.front(); }
  std::vector<BlockRun>::const_iterator begin() const { return runs_.begin(); }
  std::vector<BlockRun>::const_iterator end() const {
    return runs_.begin() + static_cast<std::ptrdiff_t>(learnt_);
  }
  // The fold whose models have not seen run r; kFolds: those of all runs that are learnt from.
  std::size_t fold(std::size_t r) const { return r < learnt_ ? r % kFolds : kFolds; }

private:
  struct Place {
    std::shared_ptr<const WideBlocks> memory; // or
    std::shared_ptr<BlockFile> file;
    std::uint64_t at = 0;
    std::size_t columns[3] = {0, 0, 0};
  };
  struct Room; // what threads share
  std::vector<BlockRun> runs_;
  std::vector<Place> places_;
  std::size_t learnt_ = 0;
  std::shared_ptr<Room> room_;
};

} // namespace rim
