// SPDX-License-Identifier: MIT
// image/image_writer.hpp - writes the flight image of rim/image.h, and loads one on the host.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rim/image.h"

namespace rim {

// Bytes of one section, numbers little-endian on any host. Padding is the caller's business.
class SectionBytes {
public:
  void u8(std::uint8_t value) { bytes_.push_back(value); }
  void u16(std::uint16_t value) { little(value, 2); }
  void u32(std::uint32_t value) { little(value, 4); }
  void u64(std::uint64_t value) { little(value, 8); }
  void f32(float value);
  void f32s(const std::vector<double> &values); // each in single precision
  void f64(double value);
  // The characters and a NUL. Throws std::invalid_argument where the text itself holds a NUL.
  void text(std::string_view value);
  // Zeroes up to the next multiple of `alignment`.
  void pad(std::size_t alignment);

  std::size_t size() const { return bytes_.size(); }
  const std::vector<std::uint8_t> &bytes() const { return bytes_; }

private:
  void little(std::uint64_t value, int count);

  std::vector<std::uint8_t> bytes_;
};

// Collects sections; equal sections in equal order give equal bytes.
class ImageWriter {
public:
  explicit ImageWriter(std::uint32_t model_id) : model_id_(model_id) {}

  // Throws std::invalid_argument: an id twice, or more than RIM_IMAGE_MAX_SECTIONS sections.
  void add_section(std::uint32_t id, std::vector<std::uint8_t> bytes, std::uint32_t count = 0);
  void add_section(std::uint32_t id, const SectionBytes &section, std::uint32_t count = 0) {
    add_section(id, section.bytes(), count);
  }

  // The image with its check sums. Throws std::length_error from 4 GiB on.
  std::vector<std::uint8_t> finish() const;

  // Writes it whole or not at all. Throws DataError.
  void write(const std::string &path) const;

private:
  struct Section {
    std::uint32_t id;
    std::uint32_t count;
    std::vector<std::uint8_t> bytes;
  };
  std::uint32_t model_id_;
  std::vector<Section> sections_;
};

// An image in memory of the alignment that rim_image_open wants. Movable: the view stays good.
class LoadedImage {
public:
  // Throws DataError "NAME: reason" where rim_image_open refuses the bytes, or bytes follow it.
  LoadedImage(std::string_view bytes, const std::string &name);
  LoadedImage(LoadedImage &&) = default;
  LoadedImage &operator=(LoadedImage &&) = default;
  LoadedImage(const LoadedImage &) = delete;
  LoadedImage &operator=(const LoadedImage &) = delete;

  const rim_image &view() const { return view_; }

private:
  std::vector<std::uint64_t> words_;
  rim_image view_{};
};

// Reads a file; throws DataError as above or where the file cannot be read.
LoadedImage load_image(const std::string &path);

struct ImageSection {
  std::uint32_t id;
  std::vector<std::uint8_t> bytes;
  std::uint32_t count = 0;
};
enum class ModelId { kept, of_content }; // of_content: the CRC-32 of what follows the header

// The image with these sections, instead of its own of the same ids; the others come first.
std::vector<std::uint8_t> with_sections(const rim_image &image,
                                        const std::vector<ImageSection> &sections, ModelId id);

} // namespace rim
