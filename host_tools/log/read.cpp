// SPDX-License-Identifier: MIT
#include "log/read.hpp"

#include <utility>

#include "log/candump_log.hpp"
#include "log/csv_read.hpp"
#include "log/derive.hpp"
#include "log/lcm_log.hpp"
#include "log/log.hpp"
#include "log/source.hpp"
#include "util/error.hpp"

namespace rim {

LogForm form_of_log(std::string_view bytes) {
  return is_lcm_log(bytes)       ? LogForm::lcm_events
         : is_candump_log(bytes) ? LogForm::candump
                                 : LogForm::csv;
}

Log read_log(const std::string &path, const Schema *schema, const ReadOptions &options) {
  LogSource source = read_log_source(path, schema);
  const LogForm form = source.converted ? LogForm::csv : form_of_log(source.text);
  if (form == LogForm::candump) {
    if (schema != nullptr)
      throw DataError(path + ": " + schema->path +
                      ": a schema without [reader] dbc has no meaning for a log of CAN frames, "
                      "whose table of signals is in the model");
    return read_candump_log(path, source.text, options);
  }
  Log log = form == LogForm::lcm_events ? read_lcm_log(path, source.text, schema, options)
                                        : read_csv_log(path, std::move(source), schema, options);
  if (schema != nullptr)
    resample(log, *schema);
  return log;
}

Log read_log(const std::string &path, const Schema *schema) {
  return read_log(path, schema, ReadOptions());
}

} // namespace rim
