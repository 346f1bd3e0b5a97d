// SPDX-License-Identifier: MIT
#include "image/image_writer.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

#include "base/crc.h"
#include "util/atomic_file.hpp"
#include "util/error.hpp"
#include "base/bytes.h"
#include "rim/image.h"

namespace rim {

void SectionBytes::little(std::uint64_t value, int count) {
  for (int i = 0; i < count; ++i) {
    bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  }
}

void SectionBytes::f32s(const std::vector<double> &values) {
  for (const double v : values)
    f32(static_cast<float>(v));
}

void SectionBytes::f32(float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  u32(bits);
}

void SectionBytes::f64(double value) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  u64(bits);
}

void SectionBytes::text(std::string_view value) {
  if (value.find('\0') != std::string_view::npos) {
    throw std::invalid_argument("text with a NUL inside");
  }
  bytes_.insert(bytes_.end(), value.begin(), value.end());
  bytes_.push_back(0);
}

void SectionBytes::pad(std::size_t alignment) {
  while (bytes_.size() % alignment != 0) {
    bytes_.push_back(0);
  }
}

void ImageWriter::add_section(std::uint32_t id, std::vector<std::uint8_t> bytes,
                              std::uint32_t count) {
  if (sections_.size() >= RIM_IMAGE_MAX_SECTIONS) {
    throw std::invalid_argument("too many sections in an image");
  }
  if (std::any_of(sections_.begin(), sections_.end(),
                  [id](const Section &section) { return section.id == id; })) {
    throw std::invalid_argument("section id used twice in an image");
  }
  sections_.push_back({id, count, std::move(bytes)});
}

std::vector<std::uint8_t> ImageWriter::finish() const {
  SectionBytes table;
  const std::size_t first = RIM_IMAGE_HEADER_BYTES + RIM_IMAGE_ENTRY_BYTES * sections_.size();
  std::vector<std::uint8_t> body;
  for (const Section &section : sections_) {
    const std::size_t offset = first + body.size();
    if (offset + section.bytes.size() > std::numeric_limits<std::uint32_t>::max() - 8) {
      throw std::length_error("image of 4 GiB or more");
    }
    table.u32(section.id);
    table.u32(static_cast<std::uint32_t>(offset));
    table.u32(static_cast<std::uint32_t>(section.bytes.size()));
    table.u32(section.count);
    body.insert(body.end(), section.bytes.begin(), section.bytes.end());
    body.resize((body.size() + RIM_IMAGE_ALIGN - 1) / RIM_IMAGE_ALIGN * RIM_IMAGE_ALIGN);
  }
  body.insert(body.begin(), table.bytes().begin(), table.bytes().end());

  SectionBytes header;
  for (const char c : std::string_view(RIM_IMAGE_MAGIC, 8)) {
    header.u8(static_cast<std::uint8_t>(c));
  }
  header.u32(RIM_IMAGE_ENDIAN_TAG);
  header.u16(RIM_IMAGE_MAJOR);
  header.u16(RIM_IMAGE_MINOR);
  header.u32(static_cast<std::uint32_t>(RIM_IMAGE_HEADER_BYTES + body.size()));
  header.u32(model_id_);
  header.u32(static_cast<std::uint32_t>(sections_.size()));
  header.u32(rimi_crc32(0, body.data(), body.size()));
  SectionBytes checked = header;
  checked.u32(0);
  checked.pad(RIM_IMAGE_HEADER_BYTES);
  header.u32(rimi_crc32(0, checked.bytes().data(), checked.size()));
  header.pad(RIM_IMAGE_HEADER_BYTES);

  std::vector<std::uint8_t> image = header.bytes();
  image.insert(image.end(), body.begin(), body.end());
  return image;
}

void ImageWriter::write(const std::string &path) const {
  const std::vector<std::uint8_t> image = finish();
  AtomicFile file(path);
  file.write(image.data(), image.size());
  file.commit();
}

LoadedImage::LoadedImage(std::string_view bytes, const std::string &name)
    : words_((bytes.size() + 7) / 8 + 1) {
  std::memcpy(words_.data(), bytes.data(), bytes.size());
  const rim_status status = rim_image_open(&view_, words_.data(), bytes.size());
  if (status != RIM_OK) {
    throw DataError(name + ": not a usable flight image: " + rim_status_text(status));
  }
  if (view_.bytes != bytes.size()) {
    throw DataError(name + ": bytes follow the flight image");
  }
}

LoadedImage load_image(const std::string &path) { return LoadedImage(read_file(path), path); }

std::vector<std::uint8_t> with_sections(const rim_image &image,
                                        const std::vector<ImageSection> &sections, ModelId id) {
  const auto write = [&](std::uint32_t model_id) {
    ImageWriter writer(model_id);
    for (std::uint32_t i = 0; i < image.sections; ++i) {
      const std::uint8_t *entry =
          image.data + RIM_IMAGE_HEADER_BYTES + RIM_IMAGE_ENTRY_BYTES * std::size_t{i};
      const std::uint8_t *begin = image.data + rimi_le_u32(entry, 1);
      const std::uint32_t own = rimi_le_u32(entry, 0);
      if (std::none_of(sections.begin(), sections.end(),
                       [own](const ImageSection &s) { return s.id == own; }))
        writer.add_section(own, {begin, begin + rimi_le_u32(entry, 2)}, rimi_le_u32(entry, 3));
    }
    for (const ImageSection &section : sections)
      writer.add_section(section.id, section.bytes, section.count);
    return writer.finish();
  };
  if (id == ModelId::kept)
    return write(image.model_id);
  const std::vector<std::uint8_t> first = write(0);
  return write(
      rimi_crc32(0, first.data() + RIM_IMAGE_HEADER_BYTES, first.size() - RIM_IMAGE_HEADER_BYTES));
}

} // namespace rim
