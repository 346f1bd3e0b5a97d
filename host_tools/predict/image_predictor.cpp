// SPDX-License-Identifier: MIT
// A trained image's behaviour models as a simulation: what the commands alone let sensors read,
// block by block.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "image/flight_image.hpp"
#include "image/image_writer.hpp"
#include "image/layout.hpp"
#include "predict/columns.hpp"
#include "predict/predictor.hpp"
#include "rim/monitor.h"
#include "util/error.hpp"

extern "C" {
#include "base/bytes.h"
#include "image/noise.h"
#include "monitor/blocks.h"
#include "rim/image.h"
}

namespace rim::world {

namespace {

// "s.altitude_m" -> "altitude_m"
std::string bare_name(const std::string &name) { return name.substr(name.find('.') + 1); }

class ImagePredictor final : public Predictor {
public:
  explicit ImagePredictor(const std::string &path);
  std::string name() const override { return "image " + path_; }
  double step_s() const override { return config_.period_s * config_.block_rows; }

  Log predict(const Log &log) const override;
  // The models see commands alone: what was predicted for later does not depend on the outcomes.
  bool advance(const Log &, const Matrix &, Log *) const override { return false; }

private:
  const std::uint8_t *section(rim_section id, std::size_t *bytes) const;
  std::vector<double> raw_fields(const blocks *block) const;
  double disturbance_of(const blocks *block, const std::vector<double> &predicted,
                        std::size_t outcomes) const;
  void add_noise(std::size_t outcome, double predicted, double activity, double disturbance,
                 std::vector<double> *raw, std::vector<double> *values) const;

  std::string path_;
  LoadedImage image_;
  Layout layout_;
  blocks_config config_{};
  rim_behaviour behaviour_{};
  rim_noise noise_{};
};

const std::uint8_t *ImagePredictor::section(rim_section id, std::size_t *bytes) const {
  const std::uint8_t *data = nullptr;
  if (rim_image_section(&image_.view(), id, &data, bytes) != RIM_OK)
    throw DataError(path_ + ": this image has no model of the outcomes; diagnose needs one that "
                            "rim train made of logs with s. columns, or logs with m. columns");
  return data;
}

ImagePredictor::ImagePredictor(const std::string &path)
    : path_(path), image_(load_image(path)), layout_(layout_of_image(image_.view())) {
  std::size_t bytes = 0;
  const std::uint8_t *words = section(RIM_SECTION_CONFIG, &bytes);
  const std::uint8_t *data = section(RIM_SECTION_BEHAVIOUR, &bytes);
  const std::size_t behaviour_bytes = bytes;
  config_.features = static_cast<std::uint16_t>(layout_.features());
  config_.outcomes = static_cast<std::uint16_t>(layout_.outcomes());
  config_.block_rows = static_cast<std::uint16_t>(rimi_le_u32(words, RIM_CONFIG_BLOCK_ROWS));
  config_.period_s = 1e-6 * rimi_le_u32(words, RIM_CONFIG_PERIOD_US);
  config_.role = section(RIM_SECTION_COMMANDS, &bytes);
  config_.range = section(RIM_SECTION_FEATURES, &bytes);
  config_.outcome_feature = section(RIM_SECTION_OUTCOMES, &bytes);
  const std::uint8_t *basis = section(RIM_SECTION_BASIS, &bytes);
  rim_status status =
      rimi_basis_open(&config_.basis, basis, bytes, config_.features, config_.outcomes);
  if (status == RIM_OK)
    status = rimi_behaviour_open(&behaviour_, data, behaviour_bytes, config_.basis.terms,
                                 config_.outcomes);
  const std::uint8_t *noise = section(RIM_SECTION_NOISE, &bytes);
  if (status == RIM_OK)
    status = rimi_noise_open(&noise_, noise, bytes,
                             rimi_noise_kinds(noise, bytes, config_.outcomes) * config_.outcomes,
                             config_.basis.means);
  if (status != RIM_OK)
    throw DataError(path + ": its models: " + rim_status_text(status));
}

// What runs differ along (image/noise.h), but for the prediction, which is the outcome's own.
std::vector<double> ImagePredictor::raw_fields(const blocks *block) const {
  const double t_s = rimi_blocks_since_start_s(block);
  std::vector<double> raw{1.0, 0.0,
                          (1.0 - std::exp(-t_s / noise_.trend_s)) * noise_.trend_s / noise_.run_s,
                          std::exp(-t_s / noise_.decay_s)};
  for (std::uint32_t m = NOISE_RAW_FIRST; m < noise_.raw; ++m)
    raw.push_back(rimi_blocks_means(block)[m - NOISE_RAW_FIRST]);
  return raw;
}

// rimi_noise_disturbance() of the block.
double ImagePredictor::disturbance_of(const blocks *block, const std::vector<double> &predicted,
                                      std::size_t outcomes) const {
  std::vector<double> in_sd;
  for (std::size_t o = 0; o < outcomes; ++o)
    in_sd.push_back(
        (rimi_blocks_outcomes(block)[o] - predicted[o]) /
        static_cast<double>(rimi_noise_channel(&noise_, static_cast<std::uint32_t>(o)).s));
  return rimi_noise_disturbance(in_sd.data(), in_sd.size());
}

// How a healthy run scatters in this block, and by how much it may be off as a whole.
void ImagePredictor::add_noise(std::size_t outcome, double predicted, double activity,
                               double disturbance, std::vector<double> *raw,
                               std::vector<double> *values) const {
  const noise_channel c = rimi_noise_channel(&noise_, static_cast<std::uint32_t>(outcome));
  const double p = (predicted - static_cast<double>(c.p_center)) / static_cast<double>(c.p_scale),
               s = static_cast<double>(c.s), rho = rimi_noise_rho(&c, activity > 0.0);
  values->push_back(s / rimi_noise_weight(&c, p, activity, disturbance) /
                    std::sqrt(1.0 - rho * rho));
  (*raw)[1] = p;
  for (std::uint32_t k = 0; k < c.fields; ++k) {
    double field = 0.0;
    for (std::uint32_t r = 0; r < noise_.raw; ++r)
      field += static_cast<double>(
                   rimi_le_f32(c.combination, static_cast<std::size_t>(k) * noise_.raw + r)) *
               (*raw)[r];
    values->push_back(s * field / std::sqrt(static_cast<double>(rimi_le_f32(c.inverse_prior, k))));
  }
}

Log ImagePredictor::predict(const Log &log) const {
  std::vector<int> features;
  std::vector<std::string> names;
  for (const std::string &feature : layout_.feature_names)
    features.push_back(needed_column(log, feature, name()));
  for (const std::string &outcome : layout_.outcome_names)
    names.push_back(bare_name(outcome));
  std::vector<std::uint64_t> memory(rimi_blocks_size(&config_) / 8 + 1);
  blocks *blocks = nullptr;
  if (rimi_blocks_init(&blocks, memory.data(), memory.size() * 8, &config_) != RIM_OK)
    throw std::logic_error("rimi_blocks_init");
  // An outcome's own reading explains it entirely, and by nothing: of outcomes the predictions are
  // the features.
  std::vector<std::size_t> given;
  std::vector<std::string> given_names;
  for (std::size_t f = 0; f < features.size(); ++f) {
    const auto &of = layout_.outcome_feature;
    if (std::find(of.begin(), of.end(), f) != of.end())
      continue;
    given.push_back(f);
    given_names.push_back(layout_.feature_names[f]);
  }
  std::vector<std::size_t> run_effects;
  for (std::size_t o = 0; o < names.size(); ++o)
    run_effects.push_back(rimi_noise_channel(&noise_, static_cast<std::uint32_t>(o)).fields);
  PredictionRows rows(log, given_names, names, run_effects);
  std::vector<double> context(features.size()), predicted(2 * names.size());
  std::vector<float> before(names.size()); // predicted for the block before
  for (std::size_t t = 0; t < log.t_s.size(); ++t) {
    for (std::size_t f = 0; f < features.size(); ++f)
      context[f] = log.values(static_cast<Eigen::Index>(t), features[f]);
    if (rimi_blocks_row(blocks, log.t_s[t], context.data(), nullptr, nullptr, nullptr) !=
            BLOCKS_DONE ||
        !rimi_blocks_has_first(blocks))
      continue;
    rimi_behaviour_predict(&behaviour_, rimi_blocks_terms(blocks), rimi_blocks_first(blocks),
                           predicted.data());
    std::vector<double> values;
    for (const std::size_t f : given)
      values.push_back(rimi_blocks_context(blocks)[f]);
    std::vector<double> raw = raw_fields(blocks);
    const double disturbance = disturbance_of(blocks, predicted, names.size());
    const bool adjoins = rows.rows() > 0 && rimi_blocks_adjoins(blocks);
    const double activity =
        adjoins ? rimi_noise_activity(&noise_, predicted.data(), before.data(), names.size())
                : NOISE_APART;
    std::copy_n(predicted.begin(), before.size(), before.begin());
    for (std::size_t o = 0; o < names.size(); ++o) {
      values.push_back(rimi_blocks_outcomes(blocks)[o]);
      values.push_back(predicted[o]);
      add_noise(o, predicted[o], activity, disturbance, &raw, &values);
    }
    rows.add(log.t_s[t], log.row[t], values);
  }
  if (rows.rows() == 0)
    throw DataError(log.path + ": no " + std::to_string(config_.block_rows) + " rows " +
                    std::to_string(config_.period_s) + " s apart, the period of " + name());
  return std::move(rows).finish();
}

} // namespace

std::unique_ptr<Predictor> make_image_predictor(const std::string &path) {
  return std::make_unique<ImagePredictor>(path);
}

} // namespace rim::world
