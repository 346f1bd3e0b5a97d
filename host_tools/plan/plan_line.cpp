// SPDX-License-Identifier: MIT
#include "plan/plan_line.hpp"

#include "util/error.hpp"
#include "util/json.hpp"

#include <charconv>
#include <cmath>

namespace rim {

namespace {

[[noreturn]] void refuse(const std::string &reason) { throw DataError(reason); }

double number(const Json &value, const char *name) {
  if (value.is_null()) // how JSON writers spell NaN
    return std::nan("");
  if (!value.is_number())
    refuse(std::string(name) + ": not a number");
  return value.get<double>();
}

std::vector<double> numbers(const Json &value, const char *name) {
  if (value.is_number())
    return {value.get<double>()};
  if (!value.is_array())
    refuse(std::string(name) + ": not a list of numbers");
  std::vector<double> out;
  for (const Json &one : value)
    out.push_back(number(one, name));
  return out;
}

std::vector<std::uint8_t> flags(const Json &value) {
  if (!value.is_array())
    refuse("allowed: not a list");
  std::vector<std::uint8_t> out;
  for (const Json &one : value) {
    if (!one.is_boolean() && !one.is_number_integer())
      refuse("allowed: neither true nor false");
    out.push_back(one.is_boolean() ? one.get<bool>() : one.get<int>() != 0);
  }
  return out;
}

PlanRequest request_of(const Json &object) {
  PlanRequest out;
  // Empty is how the planner is told that a list was not given: then every action is allowed.
  for (const char *name : {"nominal", "var", "allowed"}) {
    if (object.contains(name) && object[name].is_array() && object[name].empty())
      refuse(std::string(name) + ": an empty list; give a value for each action, or leave it out");
  }
  if (object.contains("state"))
    out.state = numbers(object["state"], "state");
  if (object.contains("actions")) {
    if (!object["actions"].is_array() || object["actions"].empty())
      refuse("actions: not a list of actions");
    for (const Json &one : object["actions"])
      out.features.push_back(numbers(one, "actions"));
  }
  if (object.contains("nominal"))
    out.nominal = numbers(object["nominal"], "nominal");
  if (object.contains("var"))
    out.var = numbers(object["var"], "var");
  if (object.contains("allowed"))
    out.allowed = flags(object["allowed"]);
  return out;
}

PlanLine read_json(const std::string &text) {
  const Json object = parse_json(text);
  if (object.is_discarded() || !object.is_object())
    refuse("not a JSON object");
  PlanLine line;
  if (object.contains("id"))
    line.id = json_text(object["id"]);
  if (!object.contains("reward")) {
    if (!object.contains("state") && !object.contains("actions"))
      refuse("neither 'state', 'actions' nor 'reward'");
    line.request = request_of(object);
    return line;
  }
  line.kind = PlanLine::REWARD;
  line.reward = number(object["reward"], "reward");
  if (object.contains("x")) {
    line.kind = PlanLine::EXPERIENCE;
    line.x = numbers(object["x"], "x");
    line.nominal = object.contains("nominal") ? number(object["nominal"], "nominal") : 0.0;
    line.var = object.contains("var") ? number(object["var"], "var") : 0.0;
    if (object.contains("plan")) {
      if (!object["plan"].is_number_unsigned())
        refuse("plan: not an index");
      line.plan = object["plan"].get<std::uint32_t>();
    }
  }
  return line;
}

double field_number(const std::string &field) {
  double value = 0.0;
  const char *end = field.data() + field.size();
  const auto result = std::from_chars(field.data(), end, value);
  if (result.ec != std::errc() || result.ptr != end)
    refuse("'" + field + "' is not a number");
  return value;
}

PlanLine read_csv(const std::string &text) {
  std::vector<std::string> fields(1);
  for (const char c : text) {
    if (c == ',')
      fields.emplace_back();
    else if (c != ' ' && c != '\t')
      fields.back() += c;
  }
  std::vector<double> values;
  for (std::size_t i = 1; i < fields.size(); ++i)
    values.push_back(field_number(fields[i]));
  PlanLine line;
  if (fields[0] == "state" && !values.empty()) {
    line.request.state = values;
  } else if (fields[0] == "reward" && values.size() == 1) {
    line.kind = PlanLine::REWARD;
    line.reward = values[0];
  } else {
    refuse("neither JSON, 'state,NUMBER...' nor 'reward,NUMBER'");
  }
  return line;
}

} // namespace

PlanLine read_plan_line(const std::string &line) {
  const std::size_t first = line.find_first_not_of(" \t");
  return first != std::string::npos && line[first] == '{' ? read_json(line) : read_csv(line);
}

std::string plan_answer_json(const PlanLine &line, const PlanAnswer *answer) {
  Json out;
  if (!line.id.empty())
    out["id"] = parse_json(line.id);
  if (answer == nullptr) {
    out["action"] = nullptr;
    out["reason"] = "no action is allowed and usable";
    return json_text(out);
  }
  out["action"] = answer->choice.action;
  if (!answer->action.empty())
    out["a"] = answer->action;
  out["value"] = answer->choice.value;
  out["mean"] = answer->choice.mean;
  out["sd"] = answer->choice.sd;
  out["beta"] = answer->choice.beta;
  out["rim"] = answer->choice.member;
  out["bound_met"] = answer->choice.bound_met;
  return json_text(out);
}

} // namespace rim
