/* SPDX-License-Identifier: MIT */
#define _GNU_SOURCE
#include "rimd/rimd.h"

#include <errno.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <string.h>
#include <time.h>

#include "rim/lcm.h"
#include "rimd/say.h"

#define MS UINT64_C(1000000)
#define SECOND (1000 * MS)
#define BATCH 64       /* datagrams or frames in a row, so that time is looked at in between */
#define HELD_NS SECOND /* a record waits at most so long for the medium */
#define LATE 64        /* an observation so many behind the newest was overtaken, or came twice */
#define MOST_MISSING 100000    /* in succession: beyond, the source has begun again elsewhere */
#define DESCRIBE_NS (100 * MS) /* between two answers to a command that asks for a description */

static void count(uint32_t *counter) {
  if (*counter != UINT32_MAX)
    ++*counter;
}

static void add(uint32_t *counter, uint32_t more) {
  *counter = more > UINT32_MAX - *counter ? UINT32_MAX : *counter + more;
}

uint64_t rimd_now_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (uint64_t)now.tv_sec * SECOND + (uint64_t)now.tv_nsec;
}

static double day_s(void) {
  struct timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Sends what the library decides to say about the plan and the region of the alarm that stands. */
static void look_ahead(rimd *d, bool again) {
  rim_entry entry;
  if (!d->config.look_ahead || d->held_count > 0) /* the record of the alarm goes before */
    return;
  d->ahead.sequence = d->kept.entry_sequence;
  if (!rim_lookahead_update(&d->ahead, &d->config.ahead, d->monitor, d->view.model_id,
                            d->kept.row_s, d->config.replay, again, &entry))
    return;
  d->kept.entry_sequence = d->ahead.sequence;
  outbox_entry(&d->outbox, &entry, rimd_now_ns());
}

static void release(rimd *d, uint32_t number) {
  const uint64_t now_ns = rimd_now_ns();
  for (uint32_t i = 0; i < number; ++i)
    outbox_alarm(&d->outbox, &d->held[i], now_ns);
  memmove(d->held, d->held + number, (d->held_count - number) * sizeof d->held[0]);
  d->held_count -= number;
  d->held_copied = d->held_copied > number ? d->held_copied - number : 0;
  d->held_ns = now_ns;
  if (number > 0)
    look_ahead(d, true);
}

void rimd_release_records(rimd *d) { release(d, d->held_count); }

/* A record is sent once it is on the medium: a restart then knows of every record that anybody has
 * heard. Without a state file, at once. */
static void send_record(rimd *d, const rim_alarm *record) {
  if (d->held_count == RIMD_HELD) /* more at once than a vehicle has alarms: late is worse */
    release(d, RIMD_HELD);
  if (d->held_count == 0)
    d->held_ns = rimd_now_ns();
  d->held[d->held_count++] = *record;
  d->state_wanted = true;
  if (d->config.state[0] == '\0')
    release(d, d->held_count);
}

void rimd_send_records(rimd *d) {
  rim_alarm record;
  while (rim_monitor_next_record(d->monitor, &record))
    send_record(d, &record);
}

/* What the monitor has counted since the last time; one that counts from 0 again all of it. */
static void take_over(uint32_t *total, uint32_t now, uint32_t *taken) {
  add(total, now >= *taken ? now - *taken : now);
  *taken = now;
}

/* Differences, so that what is published never falls where the monitor's own counts do. A damaged
 * one's are nothing to go by. */
static void collect_monitor(rimd *d) {
  rimd_kept *k = &d->kept;
  const rim_monitor_health monitor = rim_monitor_get_health(d->monitor);
  if (monitor.damage != 0)
    return;
  take_over(&k->counters.stale, monitor.stale, &k->stale_taken);
  uint32_t not_ours = 0; /* on LCM the source's numbers say what is missing */
  take_over(d->config.input_can ? &k->counters.gaps : &not_ours, monitor.rows.gaps, &k->gaps_taken);
}

void rimd_counts_began(rimd *d) {
  const rim_monitor_health monitor = rim_monitor_get_health(d->monitor);
  d->kept.stale_taken = monitor.stale;
  d->kept.gaps_taken = monitor.rows.gaps;
}

/* The source's clock went elsewhere: what was gathered belongs to another run. */
static void begin_anew(rimd *d, double t_s) {
  count(&d->kept.counters.clock_resets);
  collect_monitor(d);
  rim_monitor_restart(d->monitor, t_s);
  rimd_counts_began(d);
  d->kept.row_s = t_s;
  rimd_send_records(d);
}

/* Whether the time is good; what is not was counted. */
static bool time_is_good(rimd *d, double t_s, uint64_t woke_ns) {
  switch (rim_clock_guard_take(&d->kept.guard, &d->guard_config, t_s, 1e-9 * (double)woke_ns,
                               day_s())) {
  case RIM_CLOCK_BACK:
    count(&d->kept.counters.time_back);
    return false;
  case RIM_CLOCK_FUTURE:
    count(&d->kept.counters.future);
    return false;
  case RIM_CLOCK_RESTARTED:
    begin_anew(d, t_s);
    return true;
  case RIM_CLOCK_BELIEVED:
    break;
  }
  return true;
}

static bool all_finite(const double *x, uint32_t n) {
  for (uint32_t i = 0; i < n; ++i)
    if (!isfinite(x[i]))
      return false;
  return true;
}

/* How long the answer took, from waking up to all of it handed to the buses. */
static void note_deadline(rimd *d, uint64_t woke_ns) {
  const uint64_t took_us = (rimd_now_ns() - woke_ns) / 1000;
  const uint32_t us = took_us < UINT32_MAX ? (uint32_t)took_us : UINT32_MAX;
  if (us > d->kept.counters.step_us)
    d->kept.counters.step_us = us;
  if (d->config.deadline_us != 0 && us > d->config.deadline_us)
    count(&d->kept.counters.overruns);
}

void rimd_row(rimd *d, double t_s, const double *values, uint32_t n, uint64_t woke_ns) {
  rim_counters *counters = &d->kept.counters;
  if (n != d->values) {
    count(&counters->wrong_length);
    return;
  }
  if (!all_finite(values, n)) { /* its time says as little as its values */
    count(&counters->not_finite);
    return;
  }
  if (!time_is_good(d, t_s, woke_ns))
    return;
  rim_observation row = {.t_s = t_s, .context = values};
  if (d->external) {
    row.outcome = values + d->features;
    row.mean = row.outcome + d->outcomes;
    row.sd = row.mean + d->outcomes;
  }
  rim_verdict verdict = {0};
  (void)rim_monitor_step(d->monitor, &row, &verdict); /* refuses NULL alone */
  if (verdict.level == RIM_LEVEL_INTEGRITY) {
    if (!d->is_damaged)
      rimd_damaged(d);
  } else if (verdict.valid) {
    count(&counters->rows);
    d->valid_ns = woke_ns;
    d->kept.row_s = t_s;
  } else {
    count(&counters->not_finite); /* an sd that is not above 0 */
  }
  if (verdict.alarm.seq != 0)
    send_record(d, &verdict.alarm);
  rimd_send_records(d);
  note_deadline(d, woke_ns);
}

static void send_model(rimd *d, uint64_t now_ns) {
  d->next_model_ns = now_ns + SECOND;
  outbox_model(&d->outbox, &d->view, d->config.replay ? RIM_ALARM_FLAG_REPLAY : 0);
}

/* For who has come late: what the indices mean, and the newest record's details. A flood of such
 * commands makes no flood of answers. */
static void describe(rimd *d) {
  const uint64_t now_ns = rimd_now_ns();
  const rim_alarm newest = rim_monitor_alarms(d->monitor).newest;
  if (d->next_model_ns != 0 && now_ns + SECOND < d->next_model_ns + DESCRIBE_NS) {
    count(&d->kept.counters.commands);
    return;
  }
  send_model(d, now_ns);
  if (d->held_count == 0)
    outbox_repeat(&d->outbox, &newest, now_ns);
  count(&d->kept.counters.commands);
}

static void take_command(rimd *d, const rim_command *command, unsigned bits) {
  if (command->command == RIM_COMMAND_DESCRIBE) {
    describe(d);
    return;
  }
  if (rim_monitor_command(d->monitor, command, bits) != RIM_OK) {
    count(&d->kept.counters.commands_refused);
    return;
  }
  count(&d->kept.counters.commands);
  rimd_send_records(d);
}

/* A number that was missing stays counted when it comes late: counters never fall. A source that
 * counts from elsewhere has begun again, and nobody knows what it has sent before. */
static void note_sequence(rimd *d, uint32_t sequence) {
  const uint32_t missing = sequence - d->kept.source_next;
  const uint32_t behind = d->kept.source_next - sequence;
  if (d->kept.has_source && behind > 0 && behind <= LATE)
    return;
  if (d->kept.has_source && missing <= MOST_MISSING)
    add(&d->kept.counters.gaps, missing);
  d->kept.has_source = true;
  d->kept.source_next = sequence + 1;
}

/* The plain message in a sealed one, plain[0..bytes); NULL where it is none, or not to be taken. */
static const uint8_t *opened(rimd *d, seal_window *used, const lcm_udp_message *message,
                             uint8_t *plain, size_t bytes) {
  return seal_open_lcm(&d->seal, used, &d->kept.sealed, message->payload, message->bytes, plain,
                       bytes)
             ? plain
             : NULL;
}

static void take_observation(rimd *d, const lcm_udp_message *message, uint64_t woke_ns) {
  rim_observation_message sample;
  uint8_t plain[RIM_LCM_OBSERVATION_SIZE];
  const uint8_t *payload = message->payload;
  size_t bytes = message->bytes;
  if (d->config.key_observations) {
    bytes = sizeof plain;
    payload = opened(d, &d->kept.observations_used, message, plain, bytes);
  }
  if (payload == NULL || rim_lcm_unpack_observation(&sample, payload, bytes) != RIM_OK) {
    count(&d->kept.counters.lcm_refused);
    return;
  }
  if (d->config.input_can)
    return; /* observations come from elsewhere */
  note_sequence(d, sample.sequence);
  /* Divided: the double that a log with these decimals has; a product differs in its last bit. */
  rimd_row(d, (double)sample.t_us / 1e6, sample.value, sample.count, woke_ns);
}

static void take_lcm_command(rimd *d, const lcm_udp_message *message) {
  rim_command command;
  uint8_t plain[RIM_LCM_COMMAND_SIZE];
  const uint8_t *payload = message->payload;
  size_t bytes = message->bytes;
  if (d->seal.has_key) {
    bytes = sizeof plain;
    payload = opened(d, &d->kept.commands_used, message, plain, bytes);
    if (payload != NULL)
      d->state_wanted = true; /* a restart must not take this counter again */
  }
  if (payload != NULL && rim_lcm_unpack_command(&command, payload, bytes) == RIM_OK)
    take_command(d, &command, 32);
  else
    count(&d->kept.counters.commands_refused);
}

static void take_message(rimd *d, const lcm_udp_message *message, uint64_t woke_ns) {
  static const char *const ours[] = {RIM_LCM_CHANNEL_ALARM, RIM_LCM_CHANNEL_HEALTH,
                                     RIM_LCM_CHANNEL_COUNTERS, RIM_LCM_CHANNEL_ENTRY,
                                     RIM_LCM_CHANNEL_MODEL};
  if (strcmp(message->channel, RIM_LCM_CHANNEL_OBSERVATION) == 0) {
    take_observation(d, message, woke_ns);
    return;
  }
  if (strcmp(message->channel, RIM_LCM_CHANNEL_COMMAND) == 0) {
    take_lcm_command(d, message);
    return;
  }
  if (d->config.look_ahead && strcmp(message->channel, RIM_LCM_CHANNEL_PLAN) == 0) {
    if (rim_lcm_unpack_plan(&d->ahead.plan, message->payload, message->bytes) == RIM_OK)
      look_ahead(d, true);
    else /* noise on the bus ends no plan */
      count(&d->kept.counters.lcm_refused);
    return;
  }
  for (size_t i = 0; i < sizeof ours / sizeof ours[0]; ++i)
    if (strcmp(message->channel, ours[i]) == 0)
      return;
  count(&d->kept.counters.lcm_other);
}

/* woke_ns: when poll() returned, so that a row that queues behind others of the batch is late. */
static void read_lcm(rimd *d, uint64_t woke_ns) {
  lcm_udp_message message;
  for (int i = 0; i < BATCH; ++i) {
    const int got = lcm_udp_receive(&d->lcm, &message);
    if (got == 0)
      return;
    if (got > 0)
      take_message(d, &message, woke_ns);
  }
}

/* Seconds since the first CAN row: the clock of the day in seconds leaves few digits, and none in
 * the 32 bits of an FD detail. */
static double since_origin(rimd *d, double stamp_s) {
  const double t_s = stamp_s > 0.0 ? stamp_s : day_s();
  if (!d->kept.has_origin)
    d->kept.can_origin_s = t_s;
  d->kept.has_origin = true;
  return t_s - d->kept.can_origin_s;
}

static void take_input_frame(rimd *d, const rim_can_frame *frame, double stamp_s,
                             uint64_t woke_ns) {
  bool complete = false;
  double row_s = 0.0;
  const rim_status status =
      rim_can_gather_frame(&d->gather, &d->table, frame, since_origin(d, stamp_s),
                           1e-3 * (double)d->config.signal_age_ms, &complete, &row_s);
  if (status == RIM_E_MAGIC)
    count(&d->kept.counters.can_other);
  else if (status == RIM_E_TRUNCATED)
    count(&d->kept.counters.incomplete);
  else if (status != RIM_OK)
    count(&d->kept.counters.can_refused);
  if (complete)
    rimd_row(d, row_s, d->gather.value, d->table.values, woke_ns);
}

static void read_can_input(rimd *d, uint64_t woke_ns) {
  rim_can_frame frame;
  double stamp_s;
  for (int i = 0; i < BATCH; ++i) {
    const int got = socketcan_receive(&d->can_input, &frame, &stamp_s);
    if (got == 0)
      return;
    if (got > 0)
      take_input_frame(d, &frame, stamp_s, woke_ns);
  }
}

static void take_can_command(rimd *d, const rim_can_frame *frame) {
  rim_command command;
  const uint32_t node = d->config.node;
  if (d->seal.has_key) {
    if (seal_open_can(&d->seal, &d->kept.commands_used, &d->kept.sealed, frame, node, &command)) {
      d->state_wanted = true;
      take_command(d, &command, 32);
      return;
    }
  } else if (rim_can_unpack_command(&command, node, frame) == RIM_OK) {
    take_command(d, &command, 8);
    return;
  }
  count(&d->kept.counters.commands_refused);
}

static void read_can_commands(rimd *d) {
  rim_can_frame frame;
  double stamp_s;
  for (int i = 0; i < BATCH; ++i) {
    const int got = socketcan_receive(&d->can, &frame, &stamp_s);
    if (got == 0)
      return;
    if (got > 0)
      take_can_command(d, &frame);
  }
}

/* The transports' own counts into the daemon's: what came since the last time. */
static void collect(uint32_t *total, uint32_t *since) {
  add(total, *since);
  *since = 0;
}

static void collect_can(rim_counters *c, socketcan_counts *from, bool input) {
  if (input)
    collect(&c->can_frames, &from->frames);
  collect(&c->can_refused, &from->refused);
  collect(&c->can_errors, &from->errors);
  collect(&c->can_bus_off, &from->bus_off);
  collect(&c->can_down, &from->down);
  collect(&c->can_full, &from->full);
  collect(&c->input_lost, &from->lost);
}

void rimd_collect_counts(rimd *d) {
  rim_counters *c = &d->kept.counters;
  collect(&c->lcm_malformed, &d->lcm.counts.malformed);
  collect(&c->lcm_fragments, &d->lcm.counts.fragments);
  collect(&c->lcm_unsent, &d->lcm.counts.unsent);
  collect(&c->input_lost, &d->lcm.counts.lost);
  collect_can(c, &d->can.counts, false);
  collect_can(c, &d->can_input.counts, true);
  collect(&c->can_unsent, &d->outbox.frames_unsent);
  collect_monitor(d);
}

static rim_health_message health_of(rimd *d, const rim_alarm_status *alarms) {
  const rim_counters *c = &d->kept.counters;
  rim_health_message health;
  memset(&health, 0, sizeof health);
  health.t_s = d->kept.row_s;
  health.sequence = ++d->kept.health_sequence;
  health.model_id = d->view.model_id;
  health.observations = c->rows;
  const uint32_t reasons[] = {c->wrong_length, c->not_finite,  c->time_back,  c->future,
                              c->incomplete,   c->lcm_refused, c->can_refused};
  for (size_t i = 0; i < sizeof reasons / sizeof reasons[0]; ++i)
    add(&health.rejected, reasons[i]);
  health.gaps = c->gaps;
  health.alarms = alarms->records;
  health.dropped = d->kept.dropped;
  add(&health.dropped, d->outbox.dropped);
  health.level = alarms->level;
  health.flags = (uint8_t)((d->config.replay ? RIM_HEALTH_FLAG_REPLAY : 0u) |
                           (d->was_damaged ? RIM_HEALTH_FLAG_DAMAGED : 0u));
  return health;
}

static void send_health(rimd *d, uint64_t now_ns) {
  rimd_collect_counts(d);
  d->kept.counters.sequence = d->kept.health_sequence + 1;
  const rim_alarm_status alarms = rim_monitor_alarms(d->monitor);
  const rim_health_message health = health_of(d, &alarms);
  outbox_health(&d->outbox, &health, &d->kept.counters, &alarms.newest, alarms.acknowledged,
                now_ns);
}

/* Records leave when the copy that holds them is written, or cannot be; a medium that hangs does
 * not hold them longer than HELD_NS. */
static void release_written(rimd *d, uint64_t now_ns) {
  if (d->held_copied > 0 && atomic_load(&d->state.finished) == d->state.taken)
    release(d, d->held_copied);
  if (d->held_count > 0 && now_ns > d->held_ns + HELD_NS)
    release(d, d->held_count);
}

static void keep_state(rimd *d, uint64_t now_ns) {
  release_written(d, now_ns);
  if (d->is_damaged || (!d->state_wanted && now_ns < d->next_state_ns))
    return;
  const state_parts parts = rimd_parts(d);
  if (!state_save(&d->state, &parts))
    return; /* the writer is still busy: at the next tick */
  d->state_wanted = false;
  d->held_copied = d->held_count;
  d->next_state_ns = now_ns + SECOND * d->config.state_s;
  const uint32_t failures = atomic_load(&d->state.failures);
  if (failures == d->state_failures)
    return;
  add(&d->kept.counters.state_failures, failures - d->state_failures);
  if (d->state_failures == 0) /* once: the counter goes on */
    say("%s: %s", d->config.state, strerror(atomic_load(&d->state.why)));
  d->state_failures = failures;
}

/* How long it has been silent, on the clock of the rows: from the newest row's time on. */
static void note_silence(rimd *d, uint64_t now_ns) {
  const uint64_t silent_ns = now_ns > d->valid_ns ? now_ns - d->valid_ns : 0;
  if (rim_monitor_idle(d->monitor, d->kept.row_s + 1e-9 * (double)silent_ns))
    rimd_send_records(d);
}

/* Where no row comes for a while, and a state file is due, a step would find it too late. */
static void look_for_damage(rimd *d) {
  if (!d->is_damaged && rim_monitor_get_health(d->monitor).damage != 0)
    rimd_damaged(d);
}

static int earlier(int a_ms, int b_ms) {
  return a_ms < 0 || (b_ms >= 0 && b_ms < a_ms) ? b_ms : a_ms;
}

static int until(uint64_t then_ns, uint64_t now_ns) {
  return then_ns <= now_ns ? 0 : (int)((then_ns - now_ns) / MS) + 1;
}

int rimd_tick(rimd *d, uint64_t now_ns) {
  note_silence(d, now_ns);
  look_for_damage(d);
  watchdog_feed(&d->watchdog, now_ns);
  /* On CAN a cyclic summary would go before a record that is held. */
  if (now_ns >= d->next_health_ns && d->held_count == 0) {
    d->next_health_ns = now_ns + MS * d->config.health_ms;
    if (d->outbox.can != NULL)
      socketcan_tend(&d->can);
    if (d->config.input_can)
      socketcan_tend(&d->can_input);
    send_health(d, now_ns);
    look_ahead(d, true);
  }
  if (d->outbox.lcm != NULL && now_ns >= d->next_model_ns)
    send_model(d, now_ns);
  int wait_ms = outbox_pump(&d->outbox, now_ns);
  if (d->outbox.lcm != NULL)
    wait_ms = earlier(wait_ms, until(d->next_model_ns, now_ns));
  if (d->config.state[0] != '\0') {
    keep_state(d, now_ns);
    if (d->state_wanted || d->held_count > 0)
      wait_ms = earlier(wait_ms, d->held_count > 0 ? 1 : 10);
  }
  const uint64_t stale_ns = (uint64_t)(1e9 * d->policy.stale_s);
  if (stale_ns != 0 && rim_monitor_alarms(d->monitor).level != RIM_LEVEL_STALE)
    wait_ms = earlier(wait_ms, until(d->valid_ns + stale_ns, now_ns));
  wait_ms = earlier(wait_ms, watchdog_wait_ms(&d->watchdog, now_ns));
  return d->held_count > 0 ? wait_ms : earlier(wait_ms, until(d->next_health_ns, now_ns));
}

void rimd_run(rimd *d, const volatile sig_atomic_t *stopped) {
  sigset_t waiting;
  sigemptyset(&waiting); /* while it waits, signals come in */
  int wait_ms = 0;
  while (*stopped == 0 && !d->ending) {
    const struct timespec wait = {wait_ms / 1000, (long)(wait_ms % 1000) * 1000000L};
    /* poll() ignores a descriptor of -1; a CAN socket that is down says so by POLLERR once. */
    struct pollfd ready[3] = {
        {d->lcm.in, POLLIN, 0}, {d->can.fd, POLLIN, 0}, {d->can_input.fd, POLLIN, 0}};
    const int count_ready = ppoll(ready, 3, &wait, &waiting);
    const uint64_t woke_ns = rimd_now_ns();
    if (count_ready > 0) {
      if (ready[0].revents != 0)
        read_lcm(d, woke_ns);
      if (ready[1].revents != 0)
        read_can_commands(d);
      if (ready[2].revents != 0)
        read_can_input(d, woke_ns);
    }
    wait_ms = rimd_tick(d, rimd_now_ns());
  }
}
