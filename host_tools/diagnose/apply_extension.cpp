// SPDX-License-Identifier: MIT
#include "diagnose/apply_extension.hpp"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

#include "diagnose/extension.hpp"
#include "image/correct.h"
#include "image/image_writer.hpp"
#include "rim/image.h"
#include "util/error.hpp"

namespace rim::diagnose {
namespace {

// The log as a table. Unlike make_measured() it asks nothing of sd, which a term does not need: a
// simulated log may state none, or 0.
Measured table_of(const Log &log) {
  Measured table;
  const auto rows = log.values.rows();
  table.logs = {{log.path, 0, log.t_s.size(), log.rows_in_file}};
  table.t_s = log.t_s;
  for (const double t : log.t_s)
    table.elapsed_s.push_back(t - log.t_s.front());
  table.row = log.row;
  const std::vector<int> features = feature_columns(log);
  table.x.resize(rows, static_cast<Eigen::Index>(features.size()));
  for (std::size_t f = 0; f < features.size(); ++f) {
    const Column &column = log.columns[static_cast<std::size_t>(features[f])];
    table.x.col(static_cast<Eigen::Index>(f)) = log.values.col(features[f]);
    table.features.push_back({column.name, column.unit, column.role == Role::command, false});
  }
  for (const int c : role_columns(log, Role::outcome)) {
    const Column &column = log.columns[static_cast<std::size_t>(c)];
    Channel channel;
    channel.name = column.name.substr(2);
    channel.unit = column.unit;
    channel.z = log.values.col(c);
    channel.m = log.values.col(find_column(log, "m." + channel.name));
    const int sd = find_column(log, "sd." + channel.name);
    channel.sd_estimated = sd < 0;
    channel.sd = sd < 0 ? Vector::Ones(rows) : Vector(log.values.col(sd));
    table.channels.push_back(channel);
  }
  // A term may act where the simulation itself predicts something: make_measured().
  const auto measured = table.x.cols();
  table.x.conservativeResize(Eigen::NoChange,
                             measured + static_cast<Eigen::Index>(table.channels.size()));
  for (std::size_t c = 0; c < table.channels.size(); ++c) {
    const Channel &channel = table.channels[c];
    table.features.push_back({"m." + channel.name, channel.unit, false, false, true});
    table.x.col(measured + static_cast<Eigen::Index>(c)) = channel.m;
  }
  return table;
}

bool same_gate(const Gate &a, const Gate &b) {
  return a.is_ellipse == b.is_ellipse && a.features == b.features && a.lower == b.lower &&
         a.upper == b.upper &&
         (!a.is_ellipse || (a.center == b.center && a.inverse_shape == b.inverse_shape));
}

std::size_t index_of(const std::vector<std::string> &names, const std::string &name) {
  return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
}

constexpr double kFar = 1e30; // no edge: an image holds finite bounds

// Terms gathered region by region.
class CorrectionBuilder {
public:
  CorrectionBuilder(const Layout &layout, std::uint32_t kinds) : layout_(layout), kinds_(kinds) {}
  // Why it cannot be taken; empty: it was.
  std::string add(const Term &term);
  std::vector<std::uint8_t> finish() const;

private:
  std::string outcome_of(const Term &term, std::size_t *outcome) const;
  std::string region_of(const Gate &gate, rim_correct_region *region) const;

  const Layout &layout_;
  std::uint32_t kinds_;
  std::vector<Gate> gates_;
  std::vector<rim_correct_region> regions_;
  std::vector<double> shift_; // regions x outcomes
};

std::string CorrectionBuilder::outcome_of(const Term &term, std::size_t *outcome) const {
  for (std::size_t o = 0; o < layout_.outcomes(); ++o) {
    const std::string &name = layout_.outcome_names[o];
    if (name.substr(name.find('.') + 1) == term.channel) {
      *outcome = o;
      return "";
    }
  }
  return "the image has no such outcome";
}

std::string CorrectionBuilder::region_of(const Gate &gate, rim_correct_region *region) const {
  *region = {};
  region->confidence = 1.0;
  region->is_box = !gate.is_ellipse;
  const std::size_t d = gate.features.size();
  if (d > RIM_REGION_MAX_DIMS)
    return fmt::format("a region has at most {} features on board", RIM_REGION_MAX_DIMS);
  region->region.dims = static_cast<std::uint8_t>(d);
  for (std::size_t k = 0; k < d; ++k) {
    const std::size_t f = index_of(layout_.feature_names, gate.features[k]);
    if (f == layout_.features())
      return fmt::format("the image has no feature '{}'", gate.features[k]);
    region->region.feature[k] = static_cast<std::uint16_t>(f);
    region->region.lower[k] = std::max(gate.lower[k], -kFar);
    region->region.upper[k] = std::min(gate.upper[k], kFar);
    region->region.center[k] = gate.is_ellipse ? gate.center[k] : 0.0;
  }
  for (std::size_t i = 0; i < d * d && gate.is_ellipse; ++i)
    region->region.inverse_shape[i] = gate.inverse_shape[i];
  return "";
}

std::string CorrectionBuilder::add(const Term &term) {
  std::size_t outcome = 0;
  rim_correct_region region{};
  if (term.kind != TermKind::mean || term.basis.size() != 1 || term.basis[0] != "1")
    return "only constant shifts can ride in a flight image";
  if (!term.logs.empty())
    return "it acts in some logs only, and a flight is another";
  if (std::string reason = outcome_of(term, &outcome); !reason.empty())
    return reason;
  if (std::string reason = region_of(term.gate, &region); !reason.empty())
    return reason;
  const auto has_gate = [&](const Gate &gate) { return same_gate(gate, term.gate); };
  const auto found = std::find_if(gates_.begin(), gates_.end(), has_gate);
  const auto k = static_cast<std::size_t>(found - gates_.begin());
  if (found == gates_.end()) {
    if (gates_.size() == RIM_CORRECT_MAX_REGIONS)
      return fmt::format("a flight image holds at most {} regions", RIM_CORRECT_MAX_REGIONS);
    gates_.push_back(term.gate);
    regions_.push_back(region);
    shift_.resize(shift_.size() + layout_.outcomes(), 0.0);
  }
  shift_[k * layout_.outcomes() + outcome] += term.sizes.empty() ? 1.0 : term.sizes[0].value;
  return "";
}

std::vector<std::uint8_t> CorrectionBuilder::finish() const {
  if (regions_.empty())
    return {};
  rim_correct_model model{};
  model.features = static_cast<std::uint32_t>(layout_.features());
  model.outcomes = static_cast<std::uint32_t>(layout_.outcomes());
  model.regions = static_cast<std::uint32_t>(regions_.size());
  model.overlap = RIM_OVERLAP_SUM;
  model.kinds = kinds_;
  model.region = regions_.data();
  model.shift = shift_.data();
  std::vector<std::uint8_t> bytes(RIM_CORRECT_BYTES(model.outcomes, model.regions));
  const rim_status status = rimi_correct_pack(&model, bytes.data(), bytes.size());
  if (status != RIM_OK)
    throw DataError(std::string("the correction cannot be packed: ") + rim_status_text(status));
  return bytes;
}

} // namespace

std::vector<Extension> read_extensions(const std::vector<std::string> &paths) {
  std::vector<Extension> out;
  for (const std::string &path : paths)
    out.push_back({path, read_extension(path)});
  return out;
}

void apply_extension(const std::vector<Extension> &extensions, Log *log) {
  if (log->t_s.empty())
    return;
  const Measured table = table_of(*log);
  std::vector<Term> terms;
  for (const Extension &extension : extensions) {
    check_extension(extension.terms, table, extension.path);
    terms.insert(terms.end(), extension.terms.begin(), extension.terms.end());
  }
  for (const Channel &channel : table.channels) {
    const Prediction extended = extended_prediction(terms, channel, table);
    log->values.col(find_column(*log, "m." + channel.name)) = extended.m;
    if (!channel.sd_estimated)
      log->values.col(find_column(*log, "sd." + channel.name)) = extended.sd;
  }
}

Correction correction_section(const std::vector<Extension> &extensions, const Layout &layout,
                              std::uint32_t kinds) {
  Correction out;
  CorrectionBuilder builder(layout, kinds);
  for (const Extension &extension : extensions) {
    for (const Term &term : extension.terms) {
      const std::string reason = builder.add(term);
      if (reason.empty())
        ++out.terms;
      else
        out.left_out.push_back(
            fmt::format("{}: {}: {}: {}", extension.path, term.channel, term.cause, reason));
    }
  }
  out.section = builder.finish();
  return out;
}

std::vector<std::uint8_t> with_correction(const std::vector<std::uint8_t> &image,
                                          const std::vector<std::uint8_t> &section,
                                          const std::string &name) {
  const LoadedImage loaded(
      std::string_view(reinterpret_cast<const char *>(image.data()), image.size()), name);
  return with_sections(loaded.view(), {{RIM_SECTION_CORRECT, section}}, ModelId::of_content);
}

} // namespace rim::diagnose
