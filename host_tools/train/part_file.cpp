// SPDX-License-Identifier: MIT
#include "train/part_file.hpp"

#include <cstring>

#include <nlohmann/json.hpp>
#include <zlib.h>

#include "util/error.hpp"
#include "util/version.hpp"

namespace rim {

namespace {

static_assert(sizeof(double) == 8 && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__,
              "part files are written as the host holds numbers");

constexpr char kMagic[] = "RIMPART1";
constexpr std::size_t kMagicBytes = 8;
constexpr std::uint64_t kMostHeader = std::uint64_t{1} << 30;
constexpr const char *kSchema = "rim-train-part/1";

std::uint64_t crc_of(const std::string &bytes) {
  uLong crc = crc32(0, nullptr, 0);
  return crc32_z(crc, reinterpret_cast<const Bytef *>(bytes.data()), bytes.size());
}

void put_u64(std::string *out, std::uint64_t value) {
  out->append(reinterpret_cast<const char *>(&value), sizeof value);
}

void put(std::string *out, const double *values, Eigen::Index count) {
  put_u64(out, static_cast<std::uint64_t>(count));
  out->append(reinterpret_cast<const char *>(values), 8 * static_cast<std::size_t>(count));
}

// Reads what put() wrote.
class Reader {
public:
  Reader(const std::string &path, const std::string &bytes) : path_(path), bytes_(bytes) {}

  std::uint64_t u64() {
    std::uint64_t value = 0;
    take(&value, sizeof value);
    return value;
  }
  void values(double *to, Eigen::Index count) {
    if (u64() != static_cast<std::uint64_t>(count))
      throw DataError(path_ + ": a run's blocks are not of the size that its header says");
    take(to, 8 * static_cast<std::size_t>(count));
  }
  bool at_end() const { return at_ == bytes_.size(); }

private:
  void take(void *to, std::size_t count) {
    if (count > bytes_.size() - at_)
      throw DataError(path_ + ": a run's blocks are cut off");
    std::memcpy(to, bytes_.data() + at_, count);
    at_ += count;
  }
  const std::string &path_;
  const std::string &bytes_;
  std::size_t at_ = 0;
};

// The narrow matrices of a run, with their columns.
struct Narrow {
  Matrix *matrix;
  std::size_t columns;
};
std::vector<Narrow> narrow_of(BlockRun *run, const FlightPlan &plan) {
  const std::size_t features = plan.layout.features(), outcomes = plan.layout.outcomes();
  return {{&run->context, features},   {&run->outcome, outcomes},
          {&run->predicted, outcomes}, {&run->scatter, outcomes},
          {&run->repeats, outcomes},   {&run->means, plan.basis.means.size()}};
}

std::string narrow_bytes(const BlockRun &run) {
  std::string out;
  put_u64(&out, static_cast<std::uint64_t>(run.blocks()));
  put_u64(&out, run.left_out);
  for (const Matrix *m :
       {&run.context, &run.outcome, &run.predicted, &run.scatter, &run.repeats, &run.means})
    put(&out, m->data(), m->size());
  for (const Eigen::VectorXd *v : {&run.first, &run.start, &run.time_s, &run.share})
    put(&out, v->data(), v->size());
  for (const bool follows : run.follows)
    out += follows ? '\1' : '\0';
  return out;
}

BlockRun narrow_run(const std::string &path, const std::string &bytes, const FlightPlan &plan) {
  // What its last part does not hold: a byte per block.
  Reader length(path, bytes);
  const std::uint64_t blocks = length.u64();
  if (blocks > bytes.size())
    throw DataError(path + ": a run's blocks are cut off");
  const std::string numbers = bytes.substr(0, bytes.size() - static_cast<std::size_t>(blocks));
  Reader in(path, numbers);
  const auto n = static_cast<Eigen::Index>(in.u64());
  BlockRun run;
  run.left_out = static_cast<std::size_t>(in.u64());
  for (const Narrow &m : narrow_of(&run, plan)) {
    m.matrix->resize(n, static_cast<Eigen::Index>(m.columns));
    in.values(m.matrix->data(), m.matrix->size());
  }
  run.first.resize(static_cast<Eigen::Index>(plan.layout.outcomes()));
  run.start.resize(static_cast<Eigen::Index>(plan.layout.features()));
  run.time_s.resize(n);
  run.share.resize(n);
  for (Eigen::VectorXd *v : {&run.first, &run.start, &run.time_s, &run.share})
    in.values(v->data(), v->size());
  if (!in.at_end())
    throw DataError(path + ": a run's blocks are not of the size that its header says");
  for (std::size_t i = numbers.size(); i < bytes.size(); ++i)
    run.follows.push_back(bytes[i] != '\0');
  return run;
}

std::string wide_bytes(const BlockRun &run) {
  std::string out;
  for (const Matrix *m : {&run.terms, &run.early, &run.late})
    out.append(reinterpret_cast<const char *>(m->data()), 8 * static_cast<std::size_t>(m->size()));
  return out;
}

nlohmann::json basis_json(const Basis &basis) {
  nlohmann::json inputs = nlohmann::json::array(), terms = inputs;
  for (const Basis::Input &i : basis.inputs)
    inputs.push_back({i.a, i.b});
  for (const Basis::Term &t : basis.terms)
    terms.push_back({t.op, t.a, t.b, t.c, static_cast<int>(t.group)});
  return {{"inputs", inputs},     {"share", basis.share}, {"terms", terms},
          {"means", basis.means}, {"first", basis.first}, {"first_sd", basis.first_sd},
          {"begin", basis.begin}};
}

Basis basis_of(const nlohmann::json &j) {
  Basis basis;
  for (const auto &i : j.at("inputs"))
    basis.inputs.push_back({i.at(0), i.at(1)});
  for (const auto &t : j.at("terms"))
    basis.terms.push_back(
        {t.at(0), t.at(1), t.at(2), t.at(3), static_cast<TermGroup>(t.at(4).get<int>())});
  j.at("share").get_to(basis.share);
  j.at("means").get_to(basis.means);
  j.at("first").get_to(basis.first);
  j.at("first_sd").get_to(basis.first_sd);
  j.at("begin").get_to(basis.begin);
  basis.center.assign(basis.terms.size(), 0.0);
  basis.inverse_sd.assign(basis.terms.size(), 1.0);
  basis.mean_center.assign(basis.means.size(), 0.0);
  basis.mean_inverse_sd.assign(basis.means.size(), 1.0);
  return basis;
}

nlohmann::json layout_json(const Layout &l) {
  return {{"features", l.feature_names},     {"feature_units", l.feature_units},
          {"outcomes", l.outcome_names},     {"outcome_units", l.outcome_units},
          {"of_feature", l.outcome_feature}, {"roles", l.command},
          {"external", l.external}};
}

Layout layout_from(const nlohmann::json &j) {
  Layout l;
  j.at("features").get_to(l.feature_names);
  j.at("feature_units").get_to(l.feature_units);
  j.at("outcomes").get_to(l.outcome_names);
  j.at("outcome_units").get_to(l.outcome_units);
  j.at("of_feature").get_to(l.outcome_feature);
  j.at("roles").get_to(l.command);
  j.at("external").get_to(l.external);
  return l;
}

HealthyRuns header_from(const std::string &path, const std::string &text) {
  try {
    const auto j = nlohmann::json::parse(text);
    if (j.at("schema") != kSchema)
      throw DataError(path + ": is no part of a training");
    if (j.at("version") != RIM_VERSION)
      throw DataError(path + ": was made by version " + j.at("version").get<std::string>() +
                      ", this is " RIM_VERSION);
    HealthyRuns healthy;
    healthy.plan.layout = layout_from(j.at("layout"));
    healthy.plan.basis = basis_of(j.at("basis"));
    j.at("low").get_to(healthy.plan.low);
    j.at("high").get_to(healthy.plan.high);
    j.at("block_rows").get_to(healthy.plan.block_rows);
    j.at("period_s").get_to(healthy.plan.period_s);
    j.at("least").get_to(healthy.low);
    j.at("most").get_to(healthy.high);
    j.at("runs").get_to(healthy.paths);
    j.at("warnings").get_to(healthy.warnings);
    j.at("rows").at(0).get_to(healthy.input.rows);
    j.at("rows").at(1).get_to(healthy.input.skipped);
    j.at("rows").at(2).get_to(healthy.input.filtered);
    healthy.integrands = possible_integrands(healthy.plan.layout);
    return healthy;
  } catch (const nlohmann::json::exception &e) {
    throw DataError(path + ": is no part of a training: " + e.what());
  }
}

// The header's text; *at: where the number of runs stands.
std::string header_text(const BlockFile &file, const std::string &path, std::uint64_t *at) {
  char magic[kMagicBytes] = {};
  std::uint64_t bytes = 0, crc = 0;
  const std::uint64_t all = file.bytes();
  if (all >= kMagicBytes + 8)
    file.read(0, magic, kMagicBytes);
  if (std::memcmp(magic, kMagic, kMagicBytes) != 0)
    throw DataError(path + ": is no part of a training (rim train --shard makes one)");
  file.read(kMagicBytes, &bytes, 8);
  if (bytes > kMostHeader || bytes > all - kMagicBytes - 8)
    throw DataError(path + ": is cut off or damaged");
  std::string text(static_cast<std::size_t>(bytes), '\0');
  file.read(kMagicBytes + 8, text.data(), text.size());
  file.read(kMagicBytes + 8 + bytes, &crc, 8);
  if (crc != crc_of(text))
    throw DataError(path + ": its header is damaged");
  *at = kMagicBytes + 16 + bytes;
  return text;
}

} // namespace

std::string plan_text(const HealthyRuns &healthy) {
  const FlightPlan &plan = healthy.plan;
  const nlohmann::json j = {
      {"schema", kSchema},
      {"version", RIM_VERSION},
      {"layout", layout_json(plan.layout)},
      {"basis", basis_json(plan.basis)},
      {"low", plan.low},
      {"high", plan.high},
      {"block_rows", plan.block_rows},
      {"period_s", plan.period_s},
      {"least", healthy.low},
      {"most", healthy.high},
      {"runs", healthy.paths},
      {"warnings", healthy.warnings},
      {"rows", {healthy.input.rows, healthy.input.skipped, healthy.input.filtered}}};
  return j.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void PartWriter::begin(const HealthyRuns &healthy, std::size_t runs) {
  const std::string text = plan_text(healthy);
  std::string out(kMagic, kMagicBytes);
  put_u64(&out, text.size());
  out += text;
  put_u64(&out, crc_of(text));
  put_u64(&out, runs);
  file_.write(out);
}

void PartWriter::add(std::size_t number, const BlockRun &run) {
  const std::string narrow = narrow_bytes(run), wide = wide_bytes(run);
  std::string out;
  put_u64(&out, number);
  put_u64(&out, narrow.size());
  put_u64(&out, wide.size());
  put_u64(&out, crc_of(out + narrow + wide));
  file_.write(out);
  file_.write(narrow);
  file_.write(wide);
}

HealthyRuns read_part_header(const std::string &path) {
  std::uint64_t at = 0;
  return header_from(path, header_text(BlockFile(path), path, &at));
}

void read_part_runs(const std::string &path, HealthyRuns *healthy,
                    std::vector<std::string> *holder) {
  const auto file = std::make_shared<BlockFile>(path);
  const std::uint64_t all = file->bytes();
  std::uint64_t at = 0, runs = 0;
  header_text(*file, path, &at);
  file->read(at, &runs, 8);
  at += 8;
  const std::size_t columns[3] = {healthy->plan.basis.terms.size(), healthy->integrands.size(),
                                  healthy->integrands.size()};
  for (std::uint64_t k = 0; k < runs; ++k) {
    std::uint64_t word[4]; // number, bytes of the narrow and the wide, check sum
    file->read(at, word, sizeof word);
    at += sizeof word;
    if (word[0] >= holder->size() || word[1] > all - at || word[2] > all - at - word[1])
      throw DataError(path + ": is cut off or damaged");
    const std::size_t words = 3 * sizeof word[0];
    std::string bytes(words + static_cast<std::size_t>(word[1] + word[2]), '\0');
    std::memcpy(bytes.data(), word, words);
    file->read(at, bytes.data() + words, bytes.size() - words);
    const auto r = static_cast<std::size_t>(word[0]);
    if (crc_of(bytes) != word[3])
      throw DataError(path + ": the blocks of " + healthy->paths[r] + " are damaged");
    if (!(*holder)[r].empty())
      throw DataError(path + ": holds " + healthy->paths[r] + ", which " + (*holder)[r] +
                      " holds too");
    bytes = bytes.substr(words, static_cast<std::size_t>(word[1]));
    BlockRun run = narrow_run(path, bytes, healthy->plan);
    if (word[2] !=
        8 * static_cast<std::uint64_t>(run.blocks()) * (columns[0] + columns[1] + columns[2]))
      throw DataError(path + ": a run's blocks are not of the size that its header says");
    healthy->runs.put_from(r, std::move(run), file, at + word[1], columns);
    (*holder)[r] = path;
    at += word[1] + word[2];
  }
  if (at != all)
    throw DataError(path + ": has bytes behind its last run");
}

} // namespace rim
