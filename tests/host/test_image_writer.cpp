// SPDX-License-Identifier: MIT
// What the writer writes the library opens, and gives back unchanged; misuse throws.
#include <cstdio>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <unistd.h>

#include "base/bytes.h"
#include "check.hpp"
#include "image/image_writer.hpp"
#include "rim/image.h"
#include "util/error.hpp"

namespace {

constexpr std::uint32_t kNumbers = 0x314d554e;
constexpr std::uint32_t kText = 0x31545854;

rim::ImageWriter example() {
  rim::ImageWriter writer(99);
  rim::SectionBytes numbers;
  numbers.u8(7);
  numbers.u16(0x1234);
  numbers.pad(4);
  numbers.u32(0x89abcdef);
  numbers.f32(-1.5F);
  numbers.pad(8);
  numbers.f64(0.1);
  numbers.u64(0x0123456789abcdefU);
  rim::SectionBytes text;
  text.text("altitude");
  writer.add_section(kText, text, 1);
  writer.add_section(kNumbers, numbers, 6);
  return writer;
}

std::string as_text(const std::vector<std::uint8_t> &bytes) {
  return {reinterpret_cast<const char *>(bytes.data()), bytes.size()};
}

template <class Error, class Action> void assert_throws(Action action) {
  bool thrown = false;
  try {
    action();
  } catch (const Error &) {
    thrown = true;
  }
  assert_true(thrown);
}

void what_is_written_is_read(void **) {
  const rim::LoadedImage first(as_text(example().finish()), "example");
  rim::LoadedImage moved = rim::LoadedImage(as_text(example().finish()), "example");
  moved = rim::LoadedImage(as_text(example().finish()), "again");
  const rim_image *view = &moved.view();
  assert_int_equal(view->model_id, 99);
  const std::uint8_t *data = nullptr;
  std::size_t size = 0;
  assert_int_equal(rim_image_section(view, kText, &data, &size), RIM_OK);
  assert_int_equal(size, 9);
  assert_string_equal(reinterpret_cast<const char *>(data), "altitude");
  assert_int_equal(rim_image_section(view, kNumbers, &data, &size), RIM_OK);
  assert_int_equal(size, 32);
  assert_int_equal(rimi_le_u8(data, 0), 7);
  assert_int_equal(rimi_le_u16(data + 1, 0), 0x1234);
  assert_int_equal(rimi_le_u32(data, 1), 0x89abcdef);
  assert_true(rimi_le_f32(data, 2) == -1.5F);
  assert_true(rimi_le_f64(data, 2) == 0.1);
  assert_true(rimi_le_u64(data, 3) == 0x0123456789abcdefU);
}

void equal_sections_give_equal_bytes(void **) {
  assert_true(example().finish() == example().finish());
  assert_int_equal(rim::ImageWriter(1).finish().size(), RIM_IMAGE_HEADER_BYTES);
  const rim::LoadedImage empty(as_text(rim::ImageWriter(1).finish()), "empty");
  assert_int_equal(empty.view().sections, 0);
}

void a_file_comes_back(void **) {
  const std::string path = "test_image_writer." + std::to_string(getpid()) + ".rim";
  example().write(path);
  assert_int_equal(rim::load_image(path).view().model_id, 99);
  assert_int_equal(std::remove(path.c_str()), 0);
  assert_throws<rim::DataError>([&] { rim::load_image(path); });
}

void damage_is_named(void **) {
  std::string bytes = as_text(example().finish());
  assert_throws<rim::DataError>([&] { rim::LoadedImage(bytes + "x", "longer"); });
  assert_throws<rim::DataError>([&] { rim::LoadedImage("", "empty"); });
  bytes[100] = static_cast<char>(bytes[100] ^ 1);
  try {
    const rim::LoadedImage image(bytes, "bad.rim");
    fail_msg("nothing was thrown");
  } catch (const rim::DataError &error) {
    assert_string_equal(error.what(),
                        "bad.rim: not a usable flight image: check sum mismatch: damaged data");
  }
}

void misuse_throws(void **) {
  rim::ImageWriter writer(1);
  writer.add_section(0, std::vector<std::uint8_t>{});
  assert_throws<std::invalid_argument>([&] { writer.add_section(0, std::vector<std::uint8_t>{}); });
  for (std::uint32_t id = 1; id < RIM_IMAGE_MAX_SECTIONS; ++id) {
    writer.add_section(id, std::vector<std::uint8_t>{1});
  }
  const rim::LoadedImage full(as_text(writer.finish()), "full");
  assert_int_equal(full.view().sections, RIM_IMAGE_MAX_SECTIONS);
  assert_throws<std::invalid_argument>(
      [&] { writer.add_section(1000, std::vector<std::uint8_t>{}); });
  rim::SectionBytes text;
  assert_throws<std::invalid_argument>([&] { text.text(std::string("a\0b", 3)); });
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(what_is_written_is_read), cmocka_unit_test(equal_sections_give_equal_bytes),
      cmocka_unit_test(a_file_comes_back),       cmocka_unit_test(damage_is_named),
      cmocka_unit_test(misuse_throws),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
