// SPDX-License-Identifier: MIT
#include "bus/key.hpp"
#include "util/error.hpp"
#include "wire/sealed.h"

#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <sodium.h>
#include <sys/stat.h>

namespace rim {

namespace {

std::uint64_t now_us() {
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::microseconds>(since).count());
}

void make_tag(std::uint8_t *tag, const std::uint8_t *bytes, std::size_t length,
              const std::array<std::uint8_t, 32> &key) {
  if (crypto_generichash(tag, RIMI_TAG_BYTES, bytes, length, key.data(), key.size()) != 0)
    throw DataError("libsodium: no tag could be made");
}

} // namespace

Key::Key(const std::string &path) {
  struct stat about {};
  std::ifstream file(path);
  std::string text;
  if (::stat(path.c_str(), &about) != 0 || !file)
    throw DataError(path + ": " + std::strerror(errno));
  if ((about.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    throw DataError(path + ": others may read or write it (chmod 600)");
  std::getline(file, text);
  if (!text.empty() && text.back() == '\r')
    text.pop_back();
  std::size_t bytes = 0;
  if (text.size() != 2 * key_.size() ||
      sodium_hex2bin(key_.data(), key_.size(), text.data(), text.size(), nullptr, &bytes,
                     nullptr) != 0 ||
      bytes != key_.size())
    throw DataError(path + ": a key has 64 hexadecimal digits");
  if (sodium_init() < 0)
    throw DataError("libsodium cannot start");
}

Key::Message Key::lcm(const rim_command &command) const {
  std::array<std::uint8_t, RIM_LCM_COMMAND_SIZE> plain{};
  Message out{};
  static_assert(sizeof(Message) == RIM_LCM_COMMAND_SIZE + RIMI_SEAL_BYTES, "counter and tag");
  if (rim_lcm_pack_command(plain.data(), plain.size(), &command) != RIM_OK)
    throw UsageError("there is no such command");
  std::uint8_t *tag = rimi_lcm_seal(out.data(), plain.data(), rimi_sealed_command(), now_us());
  make_tag(tag, out.data(), static_cast<std::size_t>(tag - out.data()), key_);
  return out;
}

rim_can_frame Key::can(unsigned node, const rim_command &command) const {
  rim_can_frame frame;
  std::uint8_t tag[RIMI_TAG_BYTES];
  rimi_can_seal(&frame, node, &command, now_us());
  make_tag(tag, frame.data, RIMI_SEALED_FRAME_BODY, key_);
  rimi_can_seal_finish(&frame, tag);
  return frame;
}

} // namespace rim
