// SPDX-License-Identifier: MIT
// rimwatch._core: the objects of `rim` for Python. The package beside it (rimwatch/) is what users
// see: it takes and gives tables of pandas; here are arrays, names, bytes and JSON.
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>
#include <nlohmann/json.hpp>

#include "bus/jsonl.hpp"
#include "diagnose/apply_extension.hpp"
#include "diagnose/diagnose.hpp"
#include "diagnose/extension.hpp"
#include "image/facts.hpp"
#include "log/log.hpp"
#include "log/schema.hpp"
#include "predict/predictor.hpp"
#include "replay/replay.hpp"
#include "report/outputs.hpp"
#include "report/show.hpp"
#include "train/train_report.hpp"
#include "train/trainer.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "util/parallel_for.hpp"
#include "util/version.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Bytes = std::vector<std::uint8_t>;
using Numbers = nb::ndarray<nb::numpy, double, nb::ndim<1>>;
using Table = nb::ndarray<nb::numpy, double, nb::ndim<2>>;
using GivenNumbers = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using GivenTable = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

// Runs work that does not need Python on a thread of its own, while this one looks for Ctrl-C ten
// times a second: the work is then stopped at its next item, and KeyboardInterrupt raised. What the
// work throws is thrown here.
template <class Work> void run_interruptibly(const Work &work) {
  std::exception_ptr failure;
  std::mutex guard;
  std::condition_variable ended;
  bool done = false;
  std::thread worker([&] {
    try {
      work();
    } catch (...) {
      failure = std::current_exception();
    }
    const std::lock_guard<std::mutex> lock(guard);
    done = true;
    ended.notify_one();
  });
  bool interrupted = false;
  for (bool waiting = true; waiting;) {
    {
      nb::gil_scoped_release free;
      std::unique_lock<std::mutex> lock(guard);
      waiting = !ended.wait_for(lock, std::chrono::milliseconds(100), [&] { return done; });
    }
    if (waiting && !interrupted && PyErr_CheckSignals() != 0) {
      interrupted = true;
      rim::stop_work(true);
    }
  }
  worker.join();
  if (interrupted) {
    rim::stop_work(false);
    throw nb::python_error();
  }
  if (failure)
    std::rethrow_exception(failure);
}

Bytes bytes_of(const nb::bytes &image) {
  const auto *data = reinterpret_cast<const std::uint8_t *>(image.c_str());
  return Bytes(data, data + image.size());
}

nb::bytes to_bytes(const Bytes &image) {
  return nb::bytes(reinterpret_cast<const char *>(image.data()), image.size());
}

// The array owns the vector.
Numbers to_numbers(std::vector<double> values) {
  auto *kept = new std::vector<double>(std::move(values));
  nb::capsule owner(kept, [](void *p) noexcept { delete static_cast<std::vector<double> *>(p); });
  return Numbers(kept->data(), {kept->size()}, owner);
}

Table to_table(const rim::Matrix &values) {
  auto *kept = new rim::Matrix(values);
  nb::capsule owner(kept, [](void *p) noexcept { delete static_cast<rim::Matrix *>(p); });
  return Table(kept->data(),
               {static_cast<std::size_t>(kept->rows()), static_cast<std::size_t>(kept->cols())},
               owner);
}

std::vector<std::string> names_of(const rim::Log &log) {
  std::vector<std::string> names;
  for (const rim::Column &column : log.columns)
    names.push_back(column.name);
  return names;
}

// A log of what a table holds: rows that are not finite are left out and counted, as by the reader.
rim::Log make_log(const std::string &path, const std::vector<std::string> &names,
                  const std::vector<std::string> &units, const GivenNumbers &t_s,
                  const GivenTable &values) {
  rim::Log log;
  log.path = path;
  const std::size_t rows = t_s.shape(0), columns = values.shape(1);
  if (values.shape(0) != rows || names.size() != columns || units.size() != columns)
    throw rim::DataError(path + ": the sizes of times, names and values differ");
  for (std::size_t c = 0; c < columns; ++c) {
    rim::Role role = rim::Role::context;
    if (!rim::role_of_name(names[c], role))
      throw rim::DataError(path + ": column '" + names[c] +
                           "': must begin with a role: x. u. s. "
                           "z. m. sd.");
    log.columns.push_back(
        {names[c], units[c].empty() ? rim::unit_of_name(names[c]) : units[c], role});
  }
  const Eigen::Map<const rim::Matrix> all(values.data(), static_cast<Eigen::Index>(rows),
                                          static_cast<Eigen::Index>(columns));
  log.values.resize(all.rows(), all.cols());
  for (std::size_t r = 0; r < rows; ++r) {
    ++log.rows_in_file;
    const auto row = all.row(static_cast<Eigen::Index>(r));
    if (!std::isfinite(t_s(r)) || !row.allFinite()) {
      ++log.rows_skipped;
      continue;
    }
    if (!log.t_s.empty() && t_s(r) <= log.t_s.back())
      throw rim::DataError(path + ":row " + std::to_string(r + 1) + ": column 't_s': time " +
                           (t_s(r) < log.t_s.back() ? "runs backwards" : "repeats"));
    log.values.row(static_cast<Eigen::Index>(log.t_s.size())) = row;
    log.t_s.push_back(t_s(r));
    log.row.push_back(log.rows_in_file);
  }
  if (log.t_s.empty())
    throw rim::DataError(path + ": none of its rows can be used");
  log.values.conservativeResize(static_cast<Eigen::Index>(log.t_s.size()), Eigen::NoChange);
  return log;
}

rim::Log read_log(const std::string &path, const std::string &schema_path, bool skip_bad_time) {
  rim::ReadOptions options;
  options.skip_bad_time = skip_bad_time;
  if (schema_path.empty())
    return rim::read_log(path, nullptr, options);
  const rim::Schema schema = rim::read_schema(schema_path);
  return rim::read_log(path, &schema, options);
}

// --- training

nb::dict train(const std::vector<const rim::Log *> &given, double false_alarm, double block_s,
               bool flight) {
  std::vector<rim::Log> logs;
  for (const rim::Log *log : given)
    logs.push_back(*log);
  rim::TrainOptions options;
  options.calibration.false_alarm = false_alarm;
  options.calibration.flight = flight;
  options.blocking.block_s = block_s;
  rim::Training training;
  Bytes image;
  std::string report;
  run_interruptibly([&] {
    training = rim::train(logs, options);
    image = rim::make_image(training.plan);
    report = rim::outcome_report(training) + rim::choice_report(training) +
             rim::promise_report(training, false_alarm) + rim::image_report(image);
  });
  nb::dict out;
  out["image"] = to_bytes(image);
  out["report"] = report;
  out["warnings"] = training.warnings;
  return out;
}

nb::dict external_image(const std::vector<const rim::Log *> &given, double false_alarm) {
  std::vector<rim::Log> logs;
  for (const rim::Log *log : given)
    logs.push_back(*log);
  rim::CalibrationOptions options;
  options.false_alarm = false_alarm;
  rim::ExternalImage made;
  run_interruptibly([&] { made = rim::external_image(logs, 0, options); });
  nb::dict out;
  out["image"] = to_bytes(made.image);
  out["report"] = made.residuals_sentence;
  return out;
}

// --- the monitor

// Numbers of a list, a tuple or an array of float64, without a copy where it is an array.
class RowView {
public:
  RowView(nb::handle given, std::size_t wanted, const char *what, bool needed) {
    if (given.is_none()) {
      if (needed)
        throw nb::value_error((std::string(what) + " is missing").c_str());
      return;
    }
    std::size_t count = 0;
    if (PyList_Check(given.ptr()) || PyTuple_Check(given.ptr())) {
      count = static_cast<std::size_t>(PySequence_Fast_GET_SIZE(given.ptr()));
      own_.resize(count);
      PyObject **items = PySequence_Fast_ITEMS(given.ptr());
      for (std::size_t i = 0; i < count; ++i)
        own_[i] = PyFloat_AsDouble(items[i]);
      if (PyErr_Occurred() != nullptr)
        throw nb::python_error();
      data_ = own_.data();
    } else {
      array_ = nb::cast<GivenNumbers>(given);
      count = array_.shape(0);
      data_ = array_.data();
    }
    if (count != wanted)
      throw nb::value_error((std::string(what) + " has " + std::to_string(count) +
                             " values, the image wants " + std::to_string(wanted))
                                .c_str());
  }
  const double *data() const { return data_; }

private:
  std::vector<double> own_;
  GivenNumbers array_;
  const double *data_ = nullptr;
};

struct Verdict {
  rim_verdict v;
  const rim::Names *names;
};

class Monitor {
public:
  explicit Monitor(const nb::bytes &image)
      : monitor_(bytes_of(image), "image"), layout_(rim::layout_of_image(monitor_.image())),
        names_(rim::names_of_image(monitor_.image(), "image")) {}

  Verdict step(double t_s, nb::handle x, nb::handle z, nb::handle m, nb::handle sd) {
    const std::size_t outcomes = layout_.external ? layout_.outcomes() : 0;
    const RowView context(x, layout_.features(), "x", true);
    const RowView outcome(z, outcomes, "z", layout_.external);
    const RowView mean(m, outcomes, "m", layout_.external);
    const RowView scatter(sd, outcomes, "sd", layout_.external);
    rim_observation row = {};
    row.t_s = t_s;
    row.context = context.data();
    row.outcome = outcome.data();
    row.mean = mean.data();
    row.sd = scatter.data();
    (void)rim_monitor_idle(monitor_.get(), t_s);
    Verdict verdict{{}, &names_};
    const rim_status status = rim_monitor_step(monitor_.get(), &row, &verdict.v);
    if (status != RIM_OK)
      throw std::runtime_error(rim_status_text(status));
    digest_ = rim_verdict_digest(digest_, &verdict.v);
    return verdict;
  }
  // Records that wait beside the verdicts' own.
  std::vector<std::string> records() {
    std::vector<std::string> out;
    for (rim_alarm record; rim_monitor_next_record(monitor_.get(), &record);)
      out.push_back(rim::alarm_json(record, names_));
    return out;
  }
  void reset() {
    rim_monitor_reset(monitor_.get());
    digest_ = RIM_DIGEST_START;
  }
  std::uint64_t digest() const { return digest_; }
  std::size_t bytes() const { return monitor_.bytes(); }

private:
  rim::Monitor monitor_;
  rim::Layout layout_;
  rim::Names names_;
  std::uint64_t digest_ = RIM_DIGEST_START;
};

const char *level_text(const Verdict &verdict) {
  switch (verdict.v.level) {
  case RIM_LEVEL_OK:
    return "OK";
  case RIM_LEVEL_WARN:
    return "WARN";
  case RIM_LEVEL_ERROR:
    return "ERROR";
  case RIM_LEVEL_STALE:
    return "STALE";
  default:
    return "OUT_OF_RANGE";
  }
}

// Verdicts of a whole log, a column each.
struct Trace {
  std::vector<double> t_s, ln_anom, threshold, score, level;
  void add(const rim_verdict &v) {
    t_s.push_back(v.t_s);
    ln_anom.push_back(v.ln_anom);
    threshold.push_back(v.threshold);
    score.push_back(v.score);
    level.push_back(v.level);
  }
};

nb::dict replay_one(rim::Replayer &replayer, const rim::Log &log) {
  Trace trace;
  std::vector<std::string> alarms;
  rim::ReplayOptions options;
  options.label = true;
  options.record = [&](const rim_alarm &record) {
    if (record.state != RIM_ALARM_NONE)
      alarms.push_back(rim::alarm_json(record, replayer.names()));
  };
  rim::ReplayedLog result;
  {
    nb::gil_scoped_release free;
    result =
        replayer.replay(log, options, [&](std::size_t, const rim_verdict &v) { trace.add(v); });
  }
  std::vector<double> finding;
  for (const std::uint32_t row : log.row)
    finding.push_back(result.labels.finding[row - 1]);
  nb::dict out;
  out["path"] = log.path;
  out["text"] = rim::replay_text(result, replayer.names());
  out["doubt"] = rim::doubt(result, replayer.names());
  out["raised"] = result.raised + result.interference.raised;
  out["score"] = result.score;
  out["alarm_score"] = result.alarm_score;
  out["alarms"] = alarms;
  out["t_s"] = to_numbers(std::move(trace.t_s));
  out["ln_anom"] = to_numbers(std::move(trace.ln_anom));
  out["threshold"] = to_numbers(std::move(trace.threshold));
  out["row_score"] = to_numbers(std::move(trace.score));
  out["level"] = to_numbers(std::move(trace.level));
  out["finding"] = to_numbers(std::move(finding));
  return out;
}

// --- diagnosis

// The user's own simulation: called with a log, it gives the columns that it predicts.
class Simulation final : public rim::world::Predictor {
public:
  Simulation(nb::callable call, double step_s) : call_(std::move(call)), step_s_(step_s) {}
  std::string name() const override { return "a simulation in Python"; }
  double step_s() const override { return step_s_; }
  rim::Log predict(const rim::Log &log) const override {
    nb::gil_scoped_acquire held;
    return nb::cast<rim::Log>(call_(nb::cast(log), nb::none()));
  }
  bool advance(const rim::Log &now, const rim::Matrix &outcome, rim::Log *next) const override {
    nb::gil_scoped_acquire held;
    const nb::object made = call_(nb::cast(*next), to_table(outcome));
    (void)now;
    if (made.is_none())
      return false;
    *next = nb::cast<rim::Log>(made);
    return true;
  }

private:
  nb::callable call_;
  double step_s_;
};

struct Diagnosed {
  rim::diagnose::Diagnosis diagnosis;
  rim::diagnose::Measured measured;

  std::vector<rim::diagnose::Term> terms() const {
    std::vector<rim::diagnose::Term> list;
    for (const auto &finding : diagnosis.findings)
      list.push_back(finding.term);
    return list;
  }
};

struct DiagnoseGiven {
  double false_alarm, horizon_s;
  std::uint64_t seed;
  std::string causes, command;
};

Diagnosed diagnose(const std::vector<const rim::Log *> &given,
                   const std::vector<const rim::Log *> &holdout, nb::object simulate, double step_s,
                   const DiagnoseGiven &o) {
  using namespace rim::diagnose;
  std::unique_ptr<Simulation> simulation;
  if (!simulate.is_none())
    simulation = std::make_unique<Simulation>(nb::cast<nb::callable>(simulate), step_s);
  const auto predicted = [&](const std::vector<const rim::Log *> &logs) {
    std::vector<rim::Log> list;
    for (const rim::Log *log : logs)
      list.push_back(simulation ? simulation->predict(*log) : *log);
    return list;
  };
  Options options;
  options.catalogue = read_catalogue(rim::data_path("causes.toml"));
  if (!o.causes.empty())
    options.catalogue = merged(options.catalogue, read_catalogue(o.causes));
  const std::vector<rim::Log> logs = predicted(given);
  options.holdout = predicted(holdout);
  options.horizon_s = o.horizon_s;
  options.predictor = simulation.get();
  options.false_alarm = o.false_alarm;
  options.seed = o.seed;
  options.command = o.command;
  options.model = simulation ? simulation->name() : "the logs' own predictions";
  Diagnosed out;
  const auto work = [&] { out.diagnosis = rim::diagnose::diagnose(logs, options, &out.measured); };
  if (simulation) { // its own Python code sees Ctrl-C, and may want the thread that it was made in
    nb::gil_scoped_release free;
    work();
  } else {
    run_interruptibly(work);
  }
  return out;
}

std::string extension_text(const Diagnosed &d) {
  return rim::diagnose::extension_toml(d.terms(), "rimwatch for Python");
}

// The log with the predictions of the extended model.
rim::Log extended(const std::string &path, const rim::Log &log) {
  rim::Log out = log;
  rim::diagnose::apply_extension(rim::diagnose::read_extensions({path}), &out);
  return out;
}

void bind_logs(nb::module_ &m) {
  const auto owned = nb::rv_policy::move; // the arrays have owners of their own
  nb::class_<rim::Log>(m, "Log")
      .def_prop_ro("names", &names_of)
      .def_prop_ro("units",
                   [](const rim::Log &log) {
                     std::vector<std::string> units;
                     for (const auto &column : log.columns)
                       units.push_back(column.unit);
                     return units;
                   })
      .def_prop_ro(
          "t_s", [](const rim::Log &log) { return to_numbers(log.t_s); }, owned)
      .def_prop_ro(
          "values", [](const rim::Log &log) { return to_table(log.values); }, owned)
      .def_prop_ro(
          "row",
          [](const rim::Log &log) {
            return to_numbers(std::vector<double>(log.row.begin(), log.row.end()));
          },
          owned)
      .def_ro("path", &rim::Log::path)
      .def_rw("rows_in_file", &rim::Log::rows_in_file)
      .def_ro("rows_skipped", &rim::Log::rows_skipped)
      .def("with_rows", [](const rim::Log &log, const std::vector<std::uint32_t> &row,
                           std::uint32_t rows_in_file) {
        if (row.size() != log.t_s.size())
          throw rim::DataError(log.path + ": as many row numbers as rows are needed");
        rim::Log out = log;
        out.row = row;
        out.rows_in_file = rows_in_file;
        return out;
      });
  m.def("make_log", &make_log, "path"_a, "names"_a, "units"_a, "t_s"_a, "values"_a);
  m.def("read_log", &read_log, "path"_a, "schema"_a, "skip_bad_time"_a);
}

void bind_monitor(nb::module_ &m) {
  m.def("train", &train);
  m.def("external_image", &external_image);
  m.def("image_json", [](const nb::bytes &image, const std::string &name) {
    return rim::show_image_bytes(bytes_of(image), name).json;
  });
  m.def("image_text", [](const nb::bytes &image, const std::string &name) {
    return rim::show_image_bytes(bytes_of(image), name).text;
  });
  nb::class_<Verdict>(m, "Verdict", "What the monitor says of one row.")
      .def_prop_ro("t_s", [](const Verdict &v) { return v.v.t_s; })
      .def_prop_ro("score", [](const Verdict &v) { return v.v.score; })
      .def_prop_ro("ln_anom", [](const Verdict &v) { return v.v.ln_anom; })
      .def_prop_ro("threshold", [](const Verdict &v) { return v.v.threshold; })
      .def_prop_ro("p_value", [](const Verdict &v) { return v.v.p_value; })
      .def_prop_ro("level", &level_text)
      .def_prop_ro("valid", [](const Verdict &v) { return v.v.valid; })
      .def_prop_ro("blocks", [](const Verdict &v) { return v.v.blocks; })
      .def_prop_ro("alarm_json",
                   [](const Verdict &v) {
                     return v.v.alarm.seq == 0 ? std::string()
                                               : rim::alarm_json(v.v.alarm, *v.names);
                   })
      .def("__repr__", [](const Verdict &v) {
        return std::string("<Verdict ") + level_text(v) + " at " + std::to_string(v.v.t_s) + " s>";
      });
  nb::class_<Monitor>(m, "Monitor")
      .def(nb::init<const nb::bytes &>())
      .def("step", &Monitor::step, "t_s"_a, "x"_a, "z"_a = nb::none(), "m"_a = nb::none(),
           "sd"_a = nb::none(), nb::keep_alive<0, 1>())
      .def("records", &Monitor::records)
      .def("reset", &Monitor::reset)
      .def_prop_ro("digest", &Monitor::digest)
      .def_prop_ro("bytes", &Monitor::bytes);
  nb::class_<rim::Replayer>(m, "Replayer")
      .def("__init__",
           [](rim::Replayer *self, const nb::bytes &image, const std::string &name) {
             new (self) rim::Replayer(bytes_of(image), name);
           })
      .def("replay", &replay_one)
      .def_prop_ro("digest", &rim::Replayer::digest);
}

void bind_diagnosis(nb::module_ &m) {
  nb::class_<DiagnoseGiven>(m, "DiagnoseGiven")
      .def("__init__",
           [](DiagnoseGiven *self, double false_alarm, double horizon_s, std::uint64_t seed,
              const std::string &causes, const std::string &command) {
             new (self) DiagnoseGiven{false_alarm, horizon_s, seed, causes, command};
           });
  nb::class_<Diagnosed>(m, "Diagnosed")
      .def(
          "json",
          [](const Diagnosed &d) { return rim::diagnose::diagnosis_json(d.diagnosis, d.measured); })
      .def("html",
           [](const Diagnosed &d) { return rim::diagnose::report_html(d.diagnosis, d.measured); })
      .def("write",
           [](const Diagnosed &d, const std::string &folder) {
             rim::diagnose::write_outputs(d.diagnosis, d.measured, folder);
           })
      .def_prop_ro("sentence", [](const Diagnosed &d) { return d.diagnosis.sentence; })
      .def_prop_ro("adequate", [](const Diagnosed &d) { return d.diagnosis.adequate(); })
      .def("extension_toml", &extension_text);
  m.def("diagnose", &diagnose, "logs"_a, "holdout"_a, "simulate"_a.none(), "step_s"_a, "given"_a);
  m.def("extended", &extended);
}

} // namespace

NB_MODULE(_core, m) {
  nb::set_leak_warnings(false); // an interpreter that ends early is no leak of ours
  nb::exception<rim::DataError>(m, "DataError", PyExc_ValueError);
  nb::exception<rim::UsageError>(m, "UsageError", PyExc_ValueError);
  m.attr("__version__") = RIM_VERSION;
  bind_logs(m);
  bind_monitor(m);
  bind_diagnosis(m);
}
