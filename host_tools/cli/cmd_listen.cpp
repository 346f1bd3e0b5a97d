// rim listen: alarms as they come from LCM and CAN, a table on a terminal, JSON lines into a pipe.
#include "bus/can_bus.hpp"
#include "bus/jsonl.hpp"
#include "bus/lcm_bus.hpp"
#include "bus/sentence.hpp"
#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "util/table.hpp"

#include <chrono>
#include <csignal>
#include <cstdio>
#include <map>
#include <memory>
#include <unistd.h>

namespace {

volatile std::sig_atomic_t stopped = 0;
void stop(int) { stopped = 1; }

// The newest record of every alarm, by model, detector and first channel.
class Listener {
public:
  explicit Listener(rim::Names names) : names_(std::move(names)), live_(::isatty(STDOUT_FILENO)) {}

  void take(const rim_alarm &alarm) {
    count_++;
    if (!live_) {
      std::puts(rim::alarm_json(alarm, names_).c_str());
      std::fflush(stdout);
      return;
    }
    const int channel = alarm.channels > 0 ? alarm.channel[0] : -1;
    alarms_[{alarm.model_id, alarm.detector, channel}] = alarm;
    show();
  }

  void take(const rim_health_message &health) {
    health_ = health;
    if (live_)
      show();
  }

  void take(const rim_can_heartbeat &heartbeat) {
    heartbeats_[heartbeat.node] = heartbeat;
    if (live_)
      show();
  }

  void show() const;
  bool live() const { return live_; }
  std::uint64_t count() const { return count_; }

private:
  using Key = std::tuple<std::uint32_t, int, int>;
  rim::Names names_;
  bool live_;
  std::map<Key, rim_alarm> alarms_;
  rim_health_message health_{};
  std::map<int, rim_can_heartbeat> heartbeats_; // by node
  std::uint64_t count_ = 0;
};

void Listener::show() const {
  std::fputs("\033[H\033[J", stdout);
  if (health_.sequence > 0)
    std::printf("monitor: %s, %u observations, %u rejected, t = %.2f s\n\n",
                rim::level_text(health_.level), health_.observations, health_.rejected,
                health_.t_s);
  for (const auto &[node, h] : heartbeats_)
    std::printf("node %d on CAN: %s%s, %u observations (low bits), %u rejected, %u dropped\n\n",
                node, rim::level_text(h.level), h.acknowledged ? ", acknowledged" : "",
                h.observations, h.rejected, h.dropped);
  rim::Table table({{"t", "s"},
                    {"level", ""},
                    {"state", ""},
                    {"seq", ""},
                    {"ln anom", ""},
                    {"threshold", ""},
                    {"from", ""},
                    {"finding", ""}});
  for (const auto &[key, a] : alarms_)
    table.add({rim::cell(a.t_s, 6), rim::level_text(a.level), rim::state_text(a.state),
               std::to_string(a.seq), rim::cell(a.ln_anom, 3), rim::cell(a.threshold, 3),
               (a.flags & RIM_ALARM_FLAG_REPLAY) != 0 ? "replay" : "live",
               rim::alarm_sentence(a, names_)});
  table.print();
  std::printf("\n%llu records. Ctrl-C ends.\n", static_cast<unsigned long long>(count_));
  std::fflush(stdout);
}

struct Options {
  std::string url, interface, model;
  std::uint64_t count = 0;
  double seconds = 0.0;
};

// The buses asked for: LCM unless only CAN is.
class Buses {
public:
  Buses(const Options &o, Listener &listener) {
    if (!o.interface.empty()) {
      can_ = std::make_unique<rim::CanBus>(o.interface);
      can_->records.on_alarm = [&](const rim_alarm &alarm, bool) { listener.take(alarm); };
      can_->records.on_heartbeat = [&](const rim_can_heartbeat &h) { listener.take(h); };
    }
    if (!o.url.empty()) {
      lcm_ = std::make_unique<rim::LcmBus>(o.url);
      lcm_->on_alarm = [&](const rim_alarm &alarm) { listener.take(alarm); };
      lcm_->on_health = [&](const rim_health_message &health) { listener.take(health); };
      lcm_->receive(0); // subscribes
    }
  }
  void receive() {
    if (lcm_)
      lcm_->receive(can_ ? 20 : 100);
    if (can_)
      can_->receive(lcm_ ? 0 : 100);
  }
  std::uint64_t refused() const {
    return (lcm_ ? lcm_->refused() : 0) + (can_ ? can_->records.refused() : 0);
  }

private:
  std::unique_ptr<rim::LcmBus> lcm_;
  std::unique_ptr<rim::CanBus> can_;
};

void listen(const Options &o) {
  Listener listener(o.model.empty() ? rim::Names() : rim::names_of_model(o.model));
  Buses buses(o, listener);
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  if (listener.live())
    listener.show();
  else
    std::fprintf(stderr, "rim: listening on %s%s%s\n", o.url.c_str(),
                 o.url.empty() || o.interface.empty() ? "" : " and ", o.interface.c_str());
  const auto start = std::chrono::steady_clock::now();
  while (stopped == 0 && (o.count == 0 || listener.count() < o.count)) {
    buses.receive();
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    if (o.seconds > 0.0 && elapsed.count() >= o.seconds)
      break;
  }
  if (buses.refused() > 0)
    std::fprintf(stderr, "rim: warning: %llu messages did not decode\n",
                 static_cast<unsigned long long>(buses.refused()));
}

int cmd_listen(int argc, char **argv) {
  Options o;
  CLI::App app{"Show alarms as they come: a live table on a terminal, JSON lines into a pipe.",
               "rim listen"};
  app.add_option("--lcm", o.url,
                 std::string("LCM URL (default, unless --can is given: ") + rim::kLcmUrl + ")");
  app.add_option("--can", o.interface, "CAN interface, classic or FD");
  app.add_option("--model", o.model, "flight image, for the names of sensors and features");
  app.add_option("--count", o.count, "end after so many alarm records (0: never)");
  app.add_option("--seconds", o.seconds, "end after so long (0: never)")
      ->check(CLI::NonNegativeNumber);
  app.footer(
      "'rim: listening' on stderr says that nothing sent from then on is missed. On CAN a\n"
      "record whose detail was lost is told from its summary: without channel and region.\n\n"
      "Example:\n  rim listen --model lander.rim | jq -r .sentence &\n"
      "  rim replay --model lander.rim faulty.csv --lcm 'udpm://239.255.76.67:7667?ttl=0'\n"
      "Example: both buses of a vehicle\n"
      "  rim listen --lcm 'udpm://239.255.76.67:7667?ttl=1' --can can0 --model lander.rim");
  if (!rim::parse_arguments(app, argc, argv))
    return rim::EXIT_FINE;
  if (o.url.empty() && o.interface.empty())
    o.url = rim::kLcmUrl;
  listen(o);
  return rim::EXIT_FINE;
}

} // namespace

RIM_COMMAND(listen, "show alarms as they come over LCM and CAN", cmd_listen)
