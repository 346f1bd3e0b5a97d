// SPDX-License-Identifier: MIT
#include "log/source.hpp"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>
#include <mutex>
#include <string_view>

#include <zlib.h>
#include <zstd.h>

#include "log/candump_log.hpp"
#include "log/lcm_log.hpp"
#include "util/atomic_file.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "util/run_program.hpp"
#include "util/utf8.hpp"

namespace rim {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kChunk = 1u << 20;

std::string gunzipped(const std::string &path, const std::string &bytes) {
  z_stream stream{};
  if (inflateInit2(&stream, 15 + 16) != Z_OK) // 16: gzip
    throw DataError(path + ": gzip: no memory");
  std::string out;
  std::size_t fed = 0;
  int status = Z_OK;
  while (status != Z_STREAM_END || fed < bytes.size() || stream.avail_in > 0) {
    if (status == Z_STREAM_END) // the next member
      inflateReset(&stream);
    if (stream.avail_in == 0 && fed < bytes.size()) {
      const std::size_t some = std::min(kChunk, bytes.size() - fed);
      stream.next_in = reinterpret_cast<Bytef *>(const_cast<char *>(bytes.data() + fed));
      stream.avail_in = static_cast<uInt>(some);
      fed += some;
    }
    const std::size_t used = out.size();
    out.resize(used + kChunk);
    stream.next_out = reinterpret_cast<Bytef *>(&out[used]);
    stream.avail_out = static_cast<uInt>(kChunk);
    status = inflate(&stream, Z_NO_FLUSH);
    out.resize(used + kChunk - stream.avail_out);
    if (status != Z_OK && status != Z_STREAM_END)
      break;
  }
  inflateEnd(&stream);
  if (status != Z_STREAM_END)
    throw DataError(path + ": gzip: " + (status == Z_BUF_ERROR ? "is cut off" : "is damaged"));
  return out;
}

std::string zstd_unpacked(const std::string &path, const std::string &bytes) {
  const auto release = [](ZSTD_DStream *s) { ZSTD_freeDStream(s); };
  const std::unique_ptr<ZSTD_DStream, decltype(release)> stream(ZSTD_createDStream(), release);
  std::string out, chunk(ZSTD_DStreamOutSize(), '\0');
  ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
  std::size_t wanted = 0;
  bool full = false; // what it holds back comes out before the end is judged
  while (in.pos < in.size || full) {
    ZSTD_outBuffer made{&chunk[0], chunk.size(), 0};
    wanted = ZSTD_decompressStream(stream.get(), &made, &in);
    if (ZSTD_isError(wanted) != 0)
      throw DataError(path + ": Zstandard: " + ZSTD_getErrorName(wanted));
    out.append(chunk.data(), made.pos);
    full = made.pos == made.size && wanted != 0;
  }
  if (wanted != 0)
    throw DataError(path + ": Zstandard: is cut off");
  return out;
}

bool begins(const std::string &bytes, std::string_view with) {
  return bytes.compare(0, with.size(), with) == 0;
}

// Text of any encoding has none of the control bytes but tab, the ends of lines and pages, escape.
bool is_text(const std::string &bytes) {
  const auto end = bytes.begin() + static_cast<long>(std::min<std::size_t>(bytes.size(), 4096));
  return std::none_of(bytes.begin(), end, [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < 0x20 && (byte < 0x09 || byte > 0x0d) && byte != 0x1b;
  });
}

// Text and bytes that only a reader understands.
bool needs_reader(const std::string &path, const std::string &bytes, const Schema *schema) {
  if (is_lcm_log(bytes))
    return schema != nullptr && !schema->reader.types.empty();
  if (is_candump_log(bytes))
    return schema != nullptr && !schema->reader.dbc.empty();
  const std::string suffix = fs::path(path).extension().string();
  const bool lines = suffix == ".jsonl" || suffix == ".ndjson";
  const bool columns = begins(bytes, "PAR1"); // may hold no zero byte near its beginning
  return !bytes.empty() && (lines || columns || !is_text(bytes) ||
                            (schema != nullptr && !schema->reader.packets.empty()));
}

std::string converted(const std::string &path, const Schema *schema) {
  std::vector<std::string> command = {python_program(), readers_path(), path};
  if (schema != nullptr) {
    const ReaderOptions &r = schema->reader;
    const auto add = [&](const char *option, const std::string &value) {
      if (!value.empty())
        command.insert(command.end(), {option, value});
    };
    add("--dbc", r.dbc);
    add("--packets", r.packets);
    add("--rows", r.rows);
    for (const std::string &file : r.types)
      add("--types", file);
  }
  const ProgramResult result = run_program(command);
  if (result.status == 127)
    throw DataError(path + ": its reader needs " + command.front() +
                    ", which cannot be started (RIM_PYTHON names another)");
  std::string said = result.err;
  while (!said.empty() && said.back() == '\n')
    said.pop_back();
  if (result.status != 0)
    throw DataError(said.empty()
                        ? path + ": its reader ended with status " + std::to_string(result.status)
                        : said);
  if (!said.empty())
    std::fprintf(stderr, "rim: %s\n", said.c_str());
  return result.out;
}

// What every reader of lines relies on. Lines that end as on old Macs, by a carriage return alone,
// end by a newline. A zero byte becomes U+FFFD: it would cut off the message that shows its field.
std::string as_lines(std::string text) {
  if (text.find('\n') == std::string::npos)
    std::replace(text.begin(), text.end(), '\r', '\n');
  if (text.find('\0') == std::string::npos)
    return text;
  std::string out;
  for (const char letter : text)
    out += letter == '\0' ? std::string("\xef\xbf\xbd") : std::string(1, letter);
  return out;
}

// Standard input and pipes can be read once; commands may ask twice.
std::string content(const std::string &path) {
  const std::string name = path == "-" ? "/dev/stdin" : path;
  std::error_code ignored;
  if (fs::is_regular_file(name, ignored) && path != "-")
    return read_file(path);
  static std::mutex guard;
  static std::map<std::string, std::string> kept;
  const std::lock_guard<std::mutex> lock(guard);
  const auto found = kept.find(name);
  if (found != kept.end())
    return found->second;
  std::string bytes;
  try {
    bytes = read_file(name);
  } catch (const DataError &e) {
    throw DataError(path == "-" ? std::string("-: standard input cannot be read") : e.what());
  }
  return kept[name] = std::move(bytes);
}

} // namespace

std::string unpacked(const std::string &path, std::string bytes) {
  if (begins(bytes, "\x1F\x8B"))
    return gunzipped(path, bytes);
  if (begins(bytes, "\x28\xB5\x2F\xFD"))
    return zstd_unpacked(path, bytes);
  return bytes;
}

LogSource read_log_source(const std::string &path, const Schema *schema) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored) && fs::exists(fs::path(path) / "metadata.yaml", ignored))
    return {converted(path, schema), true}; // rosbag2
  const std::string bytes = content(path);
  std::string text = unpacked(path, bytes);
  if (begins(text, "\xFF\xFE") || begins(text, "\xFE\xFF"))
    text = as_utf8(std::move(text));
  if (begins(text, "PK\x03\x04") || begins(text, "\xD0\xCF\x11\xE0"))
    throw DataError(path + ": is a spreadsheet or a zip archive: save the table as CSV, or unpack "
                           "the archive");
  if (begins(text, "<!DOCTYPE") || begins(text, "<html") || begins(text, "<?xml"))
    throw DataError(path + ": is a page of HTML or XML, no log: a browser shows it");
  if (!needs_reader(path, text, schema))
    return {is_lcm_log(text) ? std::move(text) : as_lines(as_utf8(std::move(text))), false};
  if (text.size() != bytes.size() || !fs::is_regular_file(path, ignored))
    throw DataError(path + ": is neither CSV nor an LCM event log nor candump text; other formats "
                           "are read from a plain file of their own, not packed nor from a pipe");
  return {converted(path, schema), true};
}

} // namespace rim
