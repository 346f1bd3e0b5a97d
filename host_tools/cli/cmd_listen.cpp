// rim listen: alarms as they come, a table on a terminal, JSON lines into a pipe.
#include "bus/can_refusal.hpp"
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

  void show() const;
  bool live() const { return live_; }
  std::uint64_t count() const { return count_; }

private:
  using Key = std::tuple<std::uint32_t, int, int>;
  rim::Names names_;
  bool live_;
  std::map<Key, rim_alarm> alarms_;
  rim_health_message health_{};
  std::uint64_t count_ = 0;
};

void Listener::show() const {
  std::fputs("\033[H\033[J", stdout);
  if (health_.sequence > 0)
    std::printf("monitor: %s, %u observations, %u rejected, t = %.2f s\n\n",
                rim::level_text(health_.level), health_.observations, health_.rejected,
                health_.t_s);
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

int cmd_listen(int argc, char **argv) {
  std::string url = rim::kLcmUrl, interface, model;
  std::uint64_t count = 0;
  double seconds = 0.0;
  CLI::App app{"Show alarms as they come: a live table on a terminal, JSON lines into a pipe.",
               "rim listen"};
  app.add_option("--lcm", url, "LCM URL")->capture_default_str();
  app.add_option("--can", interface, "CAN interface");
  app.add_option("--model", model, "flight image, for the names of sensors and features");
  app.add_option("--count", count, "end after so many alarm records (0: never)");
  app.add_option("--seconds", seconds, "end after so long (0: never)")
      ->check(CLI::NonNegativeNumber);
  app.footer("'rim: listening' on stderr says that nothing sent from then on is missed.\n\n"
             "Example:\n  rim listen --model lander.rim | jq -r .sentence &\n"
             "  rim replay --model lander.rim faulty.csv --lcm 'udpm://239.255.76.67:7667?ttl=0'");
  if (!rim::parse_arguments(app, argc, argv))
    return rim::EXIT_FINE;
  if (!interface.empty())
    rim::refuse_can(interface, "listening", "rim replay --candump writes a log of frames");
  Listener listener(model.empty() ? rim::Names() : rim::names_of_model(model));
  rim::LcmBus bus(url);
  bus.on_alarm = [&](const rim_alarm &alarm) { listener.take(alarm); };
  bus.on_health = [&](const rim_health_message &health) { listener.take(health); };
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  bus.receive(0); // subscribes
  if (listener.live())
    listener.show();
  else
    std::fprintf(stderr, "rim: listening on %s\n", url.c_str());
  const auto start = std::chrono::steady_clock::now();
  while (stopped == 0 && (count == 0 || listener.count() < count)) {
    bus.receive(100);
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    if (seconds > 0.0 && elapsed.count() >= seconds)
      break;
  }
  if (bus.refused() > 0)
    std::fprintf(stderr, "rim: warning: %llu messages did not decode\n",
                 static_cast<unsigned long long>(bus.refused()));
  return rim::EXIT_FINE;
}

} // namespace

RIM_COMMAND(listen, "show alarms as they come over LCM", cmd_listen)
