// SPDX-License-Identifier: MIT
#include "bus/jsonl.hpp"

#include "bus/sentence.hpp"
#include "util/json.hpp"

#include <algorithm>

namespace rim {

namespace {

Json region_json(const rim_region &region) {
  const int dims = std::min<int>(region.dims, RIM_REGION_MAX_DIMS);
  Json center = Json::array(), shape = Json::array(), bounds = Json::array();
  for (int i = 0; i < dims; ++i) {
    Json row = Json::array();
    for (int j = 0; j < dims; ++j)
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
  for (int i = 0; i < std::min<int>(a.channels, RIM_ALARM_MAX_CHANNELS); ++i) {
    const std::string name = names.outcome(a.channel[i]).name;
    channels.push_back(name);
    shift[name] = a.shift[i];
    shift_sd[name] = a.shift_sd[i];
  }
  for (int i = 0; i < std::min<int>(a.region.dims, RIM_REGION_MAX_DIMS); ++i)
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
  line["since_sd_s"] = a.since_sd_s;
  line["shift"] = shift;
  line["shift_sd"] = shift_sd;
  line["model_id"] = a.model_id;
  line["replay"] = (a.flags & RIM_ALARM_FLAG_REPLAY) != 0;
  line["sentence"] = alarm_sentence(a, names);
  return json_text(line);
}

std::string message_json(const rim_entry &e) {
  Json line;
  line["message"] = "entry";
  line["t_s"] = e.t_s;
  line["to_entry_s"] = e.to_entry_s < 0.0 ? Json(nullptr) : Json(e.to_entry_s);
  line["sequence"] = e.sequence;
  line["alarm_sequence"] = e.alarm_sequence;
  line["plan_sequence"] = e.plan_sequence;
  line["pose"] = e.pose;
  line["model_id"] = e.model_id;
  line["replay"] = (e.flags & RIM_ALARM_FLAG_REPLAY) != 0;
  line["sentence"] = entry_sentence(e);
  return json_text(line);
}

std::string message_json(const rim_health_message &h) {
  Json line;
  line["message"] = "health";
  line["t_s"] = h.t_s;
  line["level"] = level_text(h.level);
  line["sequence"] = h.sequence;
  line["observations"] = h.observations;
  line["rejected"] = h.rejected;
  line["gaps"] = h.gaps;
  line["alarms"] = h.alarms;
  line["dropped"] = h.dropped;
  line["model_id"] = h.model_id;
  line["replay"] = (h.flags & RIM_HEALTH_FLAG_REPLAY) != 0;
  return json_text(line);
}

std::string message_json(const rim_counters &counters) {
  Json line;
  line["message"] = "counters";
  for (std::uint32_t i = 0; i < RIM_COUNTERS_FIELDS; ++i)
    line[rim_counters_name(i)] = rim_counters_value(&counters, i);
  return json_text(line);
}

std::string message_json(const rim_can_heartbeat &h) {
  Json line;
  line["message"] = "heartbeat";
  line["node"] = h.node;
  line["level"] = level_text(h.level);
  line["sequence"] = h.sequence;
  line["observations"] = h.observations;
  line["rejected"] = h.rejected;
  line["dropped"] = h.dropped;
  line["model_id"] = h.model_id;
  line["latched"] = (h.flags & RIM_ALARM_FLAG_LATCHED) != 0;
  line["acknowledged"] = h.acknowledged;
  line["replay"] = (h.flags & RIM_ALARM_FLAG_REPLAY) != 0;
  return json_text(line);
}

} // namespace rim
