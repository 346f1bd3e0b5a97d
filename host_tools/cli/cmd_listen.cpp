// SPDX-License-Identifier: MIT
// rim listen: alarms as they come from LCM and CAN, a table on a terminal, JSON lines into a pipe.
#include "bus/board.hpp"
#include "bus/can_bus.hpp"
#include "bus/jsonl.hpp"
#include "bus/lcm_bus.hpp"
#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "report/live_page.hpp"

#include <chrono>
#include <csignal>
#include <cstdio>
#include <memory>
#include <unistd.h>

namespace {

volatile std::sig_atomic_t stopped = 0;
void stop(int) { stopped = 1; }

double steady_s() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double>(now).count();
}

struct Options {
  std::string url, interface, model;
  std::uint64_t count = 0;
  double seconds = 0.0;
  bool all = false;
  int html = -1; // port; -1: no page
};

// Shows what is heard: a board on a terminal, lines into a pipe.
class Listener {
public:
  Listener(rim::Names names, bool all, int html)
      : board_(std::move(names)),
        page_(html < 0 ? nullptr
                       : std::make_unique<rim::report::LivePage>(static_cast<std::uint16_t>(html))),
        all_(all), live_(::isatty(STDOUT_FILENO)) {}
  rim::report::LivePage *page() const { return page_.get(); }

  void take(const rim_alarm &alarm) {
    count_++;
    board_.take(alarm);
    tell(true, [&] { return rim::alarm_json(alarm, board_.names(alarm.model_id)); });
  }
  void take(const rim_model_message &model) { board_.take(model); }
  void take(const rim_entry &entry, const std::string &from) {
    board_.take(entry, from);
    tell(true, [&] { return rim::message_json(entry); });
  }
  void take(const rim_counters &counters) {
    board_.take(counters);
    tell(all_, [&] { return rim::message_json(counters); });
  }
  // rim_health_message or rim_can_heartbeat
  template <class Health> void take(const Health &health) {
    board_.take(health, steady_s());
    tell(all_, [&] { return rim::message_json(health); });
  }

  // On a terminal: when something is new, at most ten times a second, and every second.
  void show(bool last) {
    const double now_s = steady_s();
    if (!live_ || (!last && now_s - shown_s_ < (fresh_ ? 0.1 : 1.0)))
      return;
    shown_s_ = now_s;
    fresh_ = false;
    std::printf("\033[H\033[J%s\n%llu records. Ctrl-C ends.\n", board_.text(now_s).c_str(),
                static_cast<unsigned long long>(count_));
    std::fflush(stdout);
  }
  bool live() const { return live_; }
  std::uint64_t count() const { return count_; }

private:
  template <class Line> void tell(bool wanted, const Line &line) {
    fresh_ = true;
    if (page_)
      page_->add(line());
    if (live_ || !wanted)
      return;
    std::puts(line().c_str());
    std::fflush(stdout);
  }

  rim::Board board_;
  std::unique_ptr<rim::report::LivePage> page_;
  bool all_, live_, fresh_ = true;
  double shown_s_ = 0.0;
  std::uint64_t count_ = 0;
};

// The buses asked for: LCM unless only CAN is.
class Buses {
public:
  Buses(const Options &o, Listener &listener) {
    if (!o.interface.empty()) {
      can_ = std::make_unique<rim::CanBus>(o.interface);
      can_->records.on_alarm = [&](const rim_alarm &alarm, bool) { listener.take(alarm); };
      can_->records.on_heartbeat = [&](const rim_can_heartbeat &h) { listener.take(h); };
      can_->records.on_entry = [&](const rim_entry &entry, std::uint32_t node) {
        listener.take(entry, "node " + std::to_string(node));
      };
    }
    if (!o.url.empty()) {
      lcm_ = std::make_unique<rim::LcmBus>(o.url);
      lcm_->on_alarm = [&](const rim_alarm &alarm) { listener.take(alarm); };
      lcm_->on_health = [&](const rim_health_message &health) { listener.take(health); };
      lcm_->on_counters = [&](const rim_counters &counters) { listener.take(counters); };
      lcm_->on_entry = [&](const rim_entry &entry) {
        listener.take(entry, "model " + std::to_string(entry.model_id));
      };
      lcm_->on_model = [&](const rim_model_message &model) { listener.take(model); };
      lcm_->receive(0); // subscribes
    }
  }
  void receive() {
    if (lcm_)
      lcm_->receive(can_ ? 20 : 100);
    if (can_)
      can_->receive(lcm_ ? 0 : 100);
  }
  // A recording is at its end, and there is no other bus.
  bool ended() const { return lcm_ && !can_ && lcm_->ended(); }
  std::uint64_t refused() const {
    return (lcm_ ? lcm_->refused() : 0) + (can_ ? can_->records.refused() : 0);
  }

private:
  std::unique_ptr<rim::LcmBus> lcm_;
  std::unique_ptr<rim::CanBus> can_;
};

void listen(const Options &o) {
  Listener listener(o.model.empty() ? rim::Names() : rim::names_of_model(o.model), o.all, o.html);
  Buses buses(o, listener);
  if (listener.page() != nullptr)
    std::fprintf(stderr, "rim: page at %s\n", listener.page()->url().c_str());
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  if (!listener.live())
    std::fprintf(stderr, "rim: listening on %s%s%s\n", o.url.c_str(),
                 o.url.empty() || o.interface.empty() ? "" : " and ", o.interface.c_str());
  const double start_s = steady_s();
  while (stopped == 0 && !buses.ended() && (o.count == 0 || listener.count() < o.count) &&
         !(o.seconds > 0.0 && steady_s() - start_s >= o.seconds)) {
    listener.show(false);
    buses.receive();
    if (listener.page() != nullptr)
      listener.page()->serve();
  }
  listener.show(true);
  if (buses.refused() > 0)
    std::fprintf(stderr, "rim: warning: %llu messages did not decode\n",
                 static_cast<unsigned long long>(buses.refused()));
}

const char *const kFooter =
    "The command prints 'rim: listening' to stderr, and receives every message that is sent after\n"
    "that. A record whose detail was lost on CAN is printed from its summary, without outcome and\n"
    "region. A recording (--lcm file://NAME) is played, and the command ends with it.\n"
    "The table also shows health, the monitor's counters, how long a monitor has been\n"
    "silent, and where a plan enters an alarmed region (in a pipe this is a line with\n"
    "\"message\": \"entry\").\n\n"
    "Example:\n  rim listen --model lander.rim | jq -r .sentence &\n"
    "  rim replay --model lander.rim faulty.csv --lcm 'udpm://239.255.76.67:7667?ttl=0'\n"
    "Example: both buses of a vehicle\n"
    "  rim listen --lcm 'udpm://239.255.76.67:7667?ttl=1' --can can0 --model lander.rim";

int cmd_listen(int argc, char **argv) {
  Options o;
  rim::cli::Arguments app{
      "Show alarms as they come: a live table on a terminal, JSON lines into a pipe.",
      "rim listen"};
  app.add_option("--lcm", o.url,
                 std::string("LCM URL (default, unless --can is given: ") + rim::kLcmUrl + ")")
      ->type_name("URL");
  app.add_option("--can", o.interface, "CAN interface, classic or FD")->type_name("IFACE");
  app.add_option(
         "--model", o.model,
         "flight image that gives the names of outcomes and features (default: the message\n"
         "RIM_MODEL, which a monitor on LCM sends every second)")
      ->type_name("MODEL.rim");
  app.add_option("--count", o.count, "end after this many alarm records (0: never)");
  app.add_flag("--all", o.all,
               "into a pipe, write health, counters and heartbeats too, each as a line with\n"
               "\"message\"");
  app.add_option("--html", o.html,
                 "serve a page with the alarms and health to browsers on this machine, at\n"
                 "http://127.0.0.1:PORT/ (0: a free port, which is printed)")
      ->type_name("PORT")
      ->check(rim::cli::range(0, 65535));
  app.add_option("--seconds", o.seconds, "end after this many seconds (0: never)")
      ->check(rim::cli::non_negative_number());
  app.footer(kFooter);
  if (!app.parse(argc, argv))
    return rim::EXIT_FINE;
  if (o.url.empty() && o.interface.empty())
    o.url = rim::kLcmUrl;
  listen(o);
  return rim::EXIT_FINE;
}

} // namespace

RIM_COMMAND(listen, "show alarms as they come over LCM and CAN", cmd_listen)
