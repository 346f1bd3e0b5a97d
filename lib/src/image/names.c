/* SPDX-License-Identifier: MIT */
#include "image/names.h"

#include <stdint.h>
#include <string.h>

#include "rim/image.h"

const rimi_unit *rimi_unit_at(size_t i) {
  static const rimi_unit unit[RIMI_UNITS] = {
      {"m", "m"},          {"km", "km"},       {"mm", "mm"},       {"s", "s"},
      {"ms", "ms"},        {"us", "us"},       {"mps", "m/s"},     {"mps2", "m/s^2"},
      {"kmph", "km/h"},    {"rad", "rad"},     {"radps", "rad/s"}, {"radps2", "rad/s^2"},
      {"deg", "deg"},      {"degps", "deg/s"}, {"kg", "kg"},       {"kgps", "kg/s"},
      {"kgpm3", "kg/m^3"}, {"n", "N"},         {"N", "N"},         {"nm", "N m"},
      {"Nm", "N m"},       {"kn", "kN"},       {"kN", "kN"},       {"pa", "Pa"},
      {"Pa", "Pa"},        {"kpa", "kPa"},     {"kPa", "kPa"},     {"mpa", "MPa"},
      {"MPa", "MPa"},      {"bar", "bar"},     {"K", "K"},         {"degc", "degC"},
      {"degC", "degC"},    {"V", "V"},         {"A", "A"},         {"mA", "mA"},
      {"W", "W"},          {"J", "J"},         {"hz", "Hz"},       {"Hz", "Hz"},
      {"pct", "%"},        {"rpm", "rpm"},     {"g", "g"},         {"cm", "cm"},
      {"L", "L"},          {"Lpm", "L/min"},   {"m3ph", "m^3/h"},  {"mV", "mV"},
      {"kW", "kW"},        {"Wh", "Wh"},       {"kWh", "kWh"},     {"Ah", "Ah"},
      {"ohm", "ohm"},      {"uT", "uT"},       {"dB", "dB"},       {"mmps", "mm/s"},
      {"kgph", "kg/h"},    {"degF", "degF"}};
  return i < RIMI_UNITS ? &unit[i] : NULL;
}

rim_status rim_image_name(const rim_image *view, uint32_t index, const char **text,
                          size_t *length) {
  const uint8_t *names;
  size_t bytes;
  if (text == NULL || length == NULL)
    return RIM_E_ARGUMENT;
  *text = NULL;
  *length = 0;
  const rim_status status = rim_image_section(view, RIM_SECTION_NAMES, &names, &bytes);
  if (status != RIM_OK)
    return status;
  size_t start = 0;
  for (size_t i = 0; i < bytes; ++i) {
    if (names[i] != '\n')
      continue;
    if (index == 0) {
      *text = (const char *)names + start;
      *length = i - start;
      return RIM_OK;
    }
    index--;
    start = i + 1;
  }
  return RIM_E_RANGE;
}

/* Bytes of the prefix that says the role; 0: none. */
static size_t role_prefix(const char *name, size_t length) {
  if (length > 2 && name[1] == '.' &&
      (name[0] == 'x' || name[0] == 'u' || name[0] == 's' || name[0] == 'z' || name[0] == 'm'))
    return 2;
  return length > 3 && memcmp(name, "sd.", 3) == 0 ? 3 : 0;
}

const char *rim_unit_of_name(const char *name, size_t length) {
  if (name == NULL)
    return "";
  const size_t start = role_prefix(name, length);
  size_t cut = length;
  while (cut > start && name[cut - 1] != '_')
    cut--;
  if (cut <= start + 1) /* no '_', or nothing before it */
    return "";
  char suffix[sizeof((rimi_unit *)0)->suffix] = {0};
  if (length - cut >= sizeof suffix)
    return "";
  memcpy(suffix, name + cut, length - cut);
  for (size_t i = 0; i < RIMI_UNITS; ++i)
    if (memcmp(rimi_unit_at(i)->suffix, suffix, sizeof suffix) == 0)
      return rimi_unit_at(i)->text;
  return "";
}
