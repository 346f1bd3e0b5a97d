#include "bus/jsonl.hpp"

#include "bus/sentence.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace rim {

namespace {

using Json = nlohmann::ordered_json;

Json region_json(const rim_region &region) {
  const int dims = std::min<int>(region.dims, RIM_REGION_MAX_DIMS);
  Json center = Json::array(), shape = Json::array(), bounds = Json::array();
  for (int i = 0; i < dims; i++) {
    Json row = Json::array();
    for (int j = 0; j < dims; j++)
      row.push_back(region.inverse_shape[i * dims + j]);
    center.push_back(region.center[i]);
    shape.push_back(row);
    bounds.push_back({region.lower[i], region.upper[i]});
  }
  return {{"center", center}, {"inverse_shape", shape}, {"bounds", bounds}};
}

} // namespace

std::string alarm_json(const rim_alarm &a, const Names &names) {
  Json channels = Json::array(), features = Json::array();
  Json shift = Json::object(), shift_sd = Json::object();
  for (int i = 0; i < std::min<int>(a.channels, RIM_ALARM_MAX_CHANNELS); i++) {
    const std::string name = names.outcome(a.channel[i]).name;
    channels.push_back(name);
    shift[name] = a.shift[i];
    shift_sd[name] = a.shift_sd[i];
  }
  for (int i = 0; i < std::min<int>(a.region.dims, RIM_REGION_MAX_DIMS); i++)
    features.push_back(names.feature(a.region.feature[i]).name);
  Json line;
  line["t_s"] = a.t_s;
  line["seq"] = a.seq;
  line["detector"] = detector_text(a.detector);
  line["state"] = state_text(a.state);
  line["level"] = level_text(a.level);
  line["kind"] = kind_text(a.kind);
  line["channels"] = channels;
  line["features"] = features;
  line["region"] = region_json(a.region);
  line["ln_anom"] = a.ln_anom;
  line["threshold"] = a.threshold;
  line["p_value"] = a.p_value;
  line["observations"] = a.observations;
  line["since_s"] = a.since_s;
  line["shift"] = shift;
  line["shift_sd"] = shift_sd;
  line["model_id"] = a.model_id;
  line["replay"] = (a.flags & RIM_ALARM_FLAG_REPLAY) != 0;
  line["sentence"] = alarm_sentence(a, names);
  return line.dump();
}

} // namespace rim
