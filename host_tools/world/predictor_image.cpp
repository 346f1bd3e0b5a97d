// A trained image's one-step model as a simulation: what the next row's sensors will read.
#include <cmath>

#include "rim/monitor.h"
#include "train/blocks.hpp"
#include "train/flight_image.hpp"
#include "train/image_writer.hpp"
#include "util/error.hpp"
#include "world/predictor.hpp"
#include "world/predictor_columns.hpp"

namespace rim::world {

namespace {

// "s.altitude_m" -> "altitude_m"
std::string bare_name(const std::string &name) { return name.substr(name.find('.') + 1); }

class ImagePredictor final : public Predictor {
public:
  explicit ImagePredictor(const std::string &path);
  std::string name() const override { return "image " + path_; }
  double step_s() const override { return period_s_; }

  Log predict(const Log &log) const override;
  bool advance(const Log &now, const Matrix &outcome, Log *next) const override;

private:
  std::string path_;
  LoadedImage image_;
  Layout layout_;
  rim_nominal model_{};
  double period_s_ = 0.0;
};

ImagePredictor::ImagePredictor(const std::string &path)
    : path_(path), image_(load_image(path)), layout_(layout_of_image(image_.view())) {
  const std::uint8_t *section = nullptr, *config = nullptr;
  std::size_t bytes = 0, config_bytes = 0;
  (void)rim_image_section(&image_.view(), RIM_SECTION_CONFIG, &config, &config_bytes);
  period_s_ = 1e-6 * rim_image_u32(config, RIM_CONFIG_PERIOD_US);
  if (layout_.external ||
      rim_image_section(&image_.view(), RIM_SECTION_STEP, &section, &bytes) != RIM_OK) {
    throw DataError(path + ": this image has no model of the next row; diagnose needs one that "
                           "rim train made of logs with s. columns, or logs with m. columns");
  }
  const rim_status status = rim_nominal_open(&model_, section, bytes);
  if (status != RIM_OK)
    throw DataError(path + ": its model of the next row: " + rim_status_text(status));
  if (model_.inputs != layout_.features() || model_.outputs != layout_.outcomes())
    throw DataError(path + ": its model does not fit its names");
}

Log ImagePredictor::predict(const Log &log) const {
  const std::string who = "image " + path_;
  std::vector<int> features, outcomes;
  std::vector<std::string> names;
  for (const std::string &feature : layout_.feature_names)
    features.push_back(needed_column(log, feature, who));
  for (const std::string &outcome : layout_.outcome_names) {
    outcomes.push_back(needed_column(log, outcome, who));
    names.push_back(bare_name(outcome));
  }
  PredictionRows rows(log, layout_.feature_names, names);
  std::vector<double> context(features.size()), mean(names.size()), sd(names.size());
  for (std::size_t t = 0; t + 1 < log.t_s.size(); ++t) {
    // As in training: a row missing voids the step that spans it.
    if (period_s_ > 0.0 && log.t_s[t + 1] - log.t_s[t] > 1.5 * period_s_)
      continue;
    const auto now = static_cast<Eigen::Index>(t);
    for (std::size_t f = 0; f < features.size(); ++f)
      context[f] = log.values(now, features[f]);
    if (rim_nominal_predict(&model_, context.data(), mean.data(), sd.data(), nullptr) != RIM_OK)
      continue;
    std::vector<double> values = context;
    for (std::size_t o = 0; o < names.size(); ++o) {
      values.push_back(log.values(now + 1, outcomes[o]));
      values.push_back(mean[o]);
      values.push_back(sd[o]);
    }
    rows.add(log.t_s[t], log.row[t], values);
  }
  if (rows.rows() == 0)
    throw DataError(log.path + ": no two rows " + std::to_string(period_s_) +
                    " s apart, the period of " + who);
  return std::move(rows).finish();
}

bool ImagePredictor::advance(const Log &now, const Matrix &outcome, Log *next) const {
  const auto count = next->values.rows();
  if (outcome.rows() != count || now.values.rows() != count ||
      outcome.cols() != static_cast<Eigen::Index>(layout_.outcomes()))
    throw std::logic_error("ImagePredictor::advance: rows do not correspond");
  std::vector<int> features;
  for (const std::string &feature : layout_.feature_names)
    features.push_back(needed_column(*next, feature, name()));
  std::vector<double> context(features.size()), mean(layout_.outcomes()), sd(layout_.outcomes());
  for (Eigen::Index r = 0; r < count; ++r) {
    for (std::size_t o = 0; o < layout_.outcomes(); ++o) {
      next->values(r, features[layout_.outcome_feature[o]]) =
          outcome(r, static_cast<Eigen::Index>(o));
    }
    for (std::size_t f = 0; f < features.size(); ++f)
      context[f] = next->values(r, features[f]);
    if (rim_nominal_predict(&model_, context.data(), mean.data(), sd.data(), nullptr) != RIM_OK)
      return false;
    for (std::size_t o = 0; o < layout_.outcomes(); ++o) {
      const OutcomeColumns c = outcome_columns(*next, bare_name(layout_.outcome_names[o]));
      next->values(r, c.m) = mean[o];
      next->values(r, c.sd) = sd[o];
    }
  }
  return true;
}

} // namespace

std::unique_ptr<Predictor> make_image_predictor(const std::string &path) {
  return std::make_unique<ImagePredictor>(path);
}

} // namespace rim::world
