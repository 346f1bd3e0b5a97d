// SPDX-License-Identifier: MIT
#include "log/lcm_log.hpp"

#include "rim/lcm.h"
#include "util/error.hpp"

#include <algorithm>
#include <cmath>

namespace rim {

namespace {

// Header, big-endian: sync, int64 number, int64 microseconds, int32 channel and data lengths.
constexpr std::size_t kHeader = 28;
constexpr std::string_view kSync("\xED\xA1\xDA\x01", 4);
constexpr std::uint64_t kMaxChannel = 63; // liblcm's own limit
constexpr std::uint64_t kMaxData = 1u << 28;

std::uint64_t big_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char c : bytes)
    value = (value << 8) | static_cast<unsigned char>(c);
  return value;
}

std::string big_endian_bytes(std::uint64_t value, std::size_t count) {
  std::string bytes(count, '\0');
  for (std::size_t i = 0; i < count; ++i)
    bytes[count - 1 - i] = static_cast<char>(value >> (8 * i));
  return bytes;
}

class LcmLogReader {
public:
  LcmLogReader(const std::string &path, const std::vector<std::string> &names, bool skip_bad_time)
      : names_(names), skip_bad_time_(skip_bad_time) {
    log_.path = path;
    for (const auto &name : names) {
      Role role = Role::context;
      if (!role_of_name(name, role))
        throw DataError(path + ": column '" + name + "': the name must begin with a role");
      log_.columns.push_back({name, unit_of_name(name), role});
    }
  }

  void take(const LcmEvent &event);
  Log finish(const LcmEventReader &events, const ReadOptions &options);

private:
  std::string where() const { return log_.path + ":row " + std::to_string(log_.rows_in_file); }
  void skip(const std::string &reason) {
    log_.rows_skipped++;
    if (first_skipped_.empty())
      first_skipped_ = "row " + std::to_string(log_.rows_in_file) + ": " + reason;
  }

  Log log_;
  const std::vector<std::string> &names_;
  bool skip_bad_time_;
  std::vector<double> flat_;
  std::string first_skipped_;
};

void LcmLogReader::take(const LcmEvent &event) {
  log_.rows_in_file++;
  rim_observation_message sample;
  const rim_status status = rim_lcm_unpack_observation(
      &sample, reinterpret_cast<const std::uint8_t *>(event.data.data()), event.data.size());
  if (status != RIM_OK)
    return skip(rim_status_text(status));
  if (sample.count != names_.size())
    return skip(std::to_string(sample.count) + " values where " + std::to_string(names_.size()) +
                " are named");
  const double t_s = static_cast<double>(sample.t_us) / 1e6;
  note_time(&log_, t_s);
  for (std::uint32_t i = 0; i < sample.count; ++i)
    if (!std::isfinite(sample.value[i]))
      return skip("column '" + names_[i] + "': not finite");
  if (!log_.t_s.empty() && t_s <= log_.t_s.back()) {
    const std::string reason = t_s < log_.t_s.back() ? "time runs backwards" : "time repeats";
    if (!skip_bad_time_)
      throw DataError(where() + ": column 't_us': " + reason +
                      "; a schema with not_increasing = \"skip\" under [time] skips such rows");
    return skip(reason);
  }
  log_.t_s.push_back(t_s);
  log_.row.push_back(log_.rows_in_file);
  flat_.insert(flat_.end(), sample.value, sample.value + sample.count);
}

Log LcmLogReader::finish(const LcmEventReader &events, const ReadOptions &options) {
  if (options.warnings != nullptr && events.resyncs() > 0)
    std::fprintf(options.warnings, "rim: warning: %s: damaged in %zu places, %zu bytes skipped\n",
                 log_.path.c_str(), events.resyncs(), events.bytes_skipped());
  if (options.warnings != nullptr && log_.rows_skipped > 0)
    std::fprintf(options.warnings, "rim: warning: %s: %u of %u rows skipped, the first: %s\n",
                 log_.path.c_str(), log_.rows_skipped, log_.rows_in_file, first_skipped_.c_str());
  if (log_.t_s.empty())
    throw DataError(log_.path + ": no usable " RIM_LCM_CHANNEL_OBSERVATION " among its events" +
                    (first_skipped_.empty() ? "" : " (" + first_skipped_ + ")"));
  log_.values = Eigen::Map<const Matrix>(flat_.data(), static_cast<Eigen::Index>(log_.t_s.size()),
                                         static_cast<Eigen::Index>(names_.size()));
  return std::move(log_);
}

} // namespace

bool is_lcm_log(std::string_view bytes) { return bytes.substr(0, kSync.size()) == kSync; }

bool LcmEventReader::parse(std::size_t at, LcmEvent &event, std::size_t &end) const {
  if (bytes_.size() - at < kHeader || bytes_.compare(at, kSync.size(), kSync) != 0)
    return false;
  const std::uint64_t channel = big_endian(bytes_.substr(at + 20, 4));
  const std::uint64_t data = big_endian(bytes_.substr(at + 24, 4));
  if (channel > kMaxChannel || data > kMaxData || channel + data > bytes_.size() - at - kHeader)
    return false;
  event.number = static_cast<std::int64_t>(big_endian(bytes_.substr(at + 4, 8)));
  event.t_us = static_cast<std::int64_t>(big_endian(bytes_.substr(at + 12, 8)));
  event.channel = bytes_.substr(at + kHeader, channel);
  event.data = bytes_.substr(at + kHeader + channel, data);
  end = at + kHeader + channel + data;
  if (end == bytes_.size() || bytes_.compare(end, kSync.size(), kSync) == 0)
    return true;
  // What follows is damaged, or this length is wrong: then the next event begins inside.
  return bytes_.find(kSync, at + kSync.size()) >= end;
}

bool LcmEventReader::next(LcmEvent &event) {
  const std::size_t from = at_;
  while (at_ < bytes_.size()) {
    std::size_t end = 0;
    if (parse(at_, event, end)) {
      if (at_ != from) {
        skipped_ += at_ - from;
        resyncs_++;
      }
      at_ = end;
      return true;
    }
    const std::size_t sync = bytes_.find(kSync, at_ + 1);
    at_ = sync == std::string_view::npos ? bytes_.size() : sync;
  }
  if (at_ != from) {
    skipped_ += at_ - from;
    resyncs_++;
  }
  return false;
}

namespace {

// What a schema says of the columns of a file has no meaning for messages, whose values have the
// names that 'observation' gives: said, rather than silently ignored.
void refuse_unused(const std::string &path, const Schema *schema) {
  if (schema == nullptr)
    return;
  const ColumnMap time = Schema().time;
  const char *unused = !schema->columns.empty()     ? "[[column]]"
                       : !schema->keep.empty()      ? "[[keep]]"
                       : !schema->derive.empty()    ? "[[derive]]"
                       : !schema->leave_out.empty() ? "leave_out"
                       : schema->time.from != time.from || schema->time.scale != time.scale ||
                               schema->time.offset != time.offset
                           ? "[time]"
                           : nullptr;
  if (unused != nullptr)
    throw DataError(path + ": " + schema->path + ": " + unused +
                    " does not apply to an LCM event log: 'observation', 'not_increasing' and "
                    "resampling do");
}

} // namespace

Log read_lcm_log(const std::string &path, std::string_view bytes, const Schema *schema,
                 const ReadOptions &options) {
  const bool named = schema != nullptr && !schema->observation.empty();
  const auto &names = named ? schema->observation : options.observation_names;
  if (names.empty())
    throw DataError(path + ": an LCM event log carries no names: give a model, or a schema with "
                           "'observation'");
  refuse_unused(path, schema);
  LcmLogReader reader(path, names,
                      options.skip_bad_time || (schema != nullptr && schema->skip_bad_time));
  LcmEventReader events(bytes);
  LcmEvent event;
  while (events.next(event))
    if (event.channel == RIM_LCM_CHANNEL_OBSERVATION)
      reader.take(event);
  return reader.finish(events, options);
}

std::string lcm_event_bytes(const LcmEvent &event) {
  return std::string(kSync) + big_endian_bytes(static_cast<std::uint64_t>(event.number), 8) +
         big_endian_bytes(static_cast<std::uint64_t>(event.t_us), 8) +
         big_endian_bytes(event.channel.size(), 4) + big_endian_bytes(event.data.size(), 4) +
         std::string(event.channel) + std::string(event.data);
}

} // namespace rim
