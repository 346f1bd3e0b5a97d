/* SPDX-License-Identifier: MIT */
/* The daemon between two CAN buses, in this process (fake_can.h): rows in, alarms out, commands
 * with and without a key, a full queue, a full disk, a day of rows. On LCM: rimd_test.py. */
#define _GNU_SOURCE
#include "fake_can.h"

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#ifdef SEAL_SODIUM
#include <sodium.h>
#endif

#include "base/bytes.h"
#include "rim/can_table.h"
#include "rimd/rimd.h"

#include "../lib/monitor_bench.h"
#include "own_folder.h"

enum { VALUES = D + 3 * O, NODE = 5, ROW_ID = 0x123, LAST_ID = 0x1234567 };

static rimd d;
static const uint8_t key[SEAL_KEY_BYTES] = {1, 2, 3};
static volatile sig_atomic_t stopped;

static void stop(int signal) { stopped = signal; }

static void write_file(const char *name, const void *data, size_t length) {
  FILE *f = fopen(file(name), "wb");
  assert_non_null(f);
  assert_int_equal(fwrite(data, 1, length, f), length);
  assert_int_equal(fclose(f), 0);
  assert_int_equal(chmod(file(name), 0600), 0);
}

/* All values of a row in one FD frame, as f32; the first within 1000. In two: the last value comes
 * in a frame of 29 bits of its own, and the first frame makes the row. */
static void put_table(bytes *b, unsigned frames) {
  u32(b, RIM_CAN_TABLE_LAYOUT);
  const unsigned trigger = frames == 1 ? RIM_CAN_TABLE_NONE : 0;
  const unsigned counts[6] = {VALUES, frames, VALUES, trigger, RIM_CAN_TABLE_NONE, 0};
  for (size_t i = 0; i < 6; ++i)
    u16(b, counts[i]);
  for (unsigned f = 0; f < frames; ++f) {
    u32(b, f == 0 ? ROW_ID : RIM_CAN_EXTENDED | LAST_ID);
    u8(b, f == 0 ? 48 : 4);
    u8(b, f == 0);
    u16(b, f == 0 ? 0 : VALUES - 1);
    u16(b, f == 1 ? 1 : VALUES - (frames - 1));
    u16(b, 0);
  }
  for (unsigned v = 0; v < VALUES; ++v) {
    u16(b, v);
    u8(b, RIM_CAN_F32);
    u8(b, 0);
    u16(b, frames == 2 && v == VALUES - 1 ? 0 : 32 * v);
    u8(b, 32);
    for (size_t i = 0; i < 9; ++i)
      u8(b, 0);
    const double scale[4] = {1.0, 0.0, v == 0 ? -1000.0 : -1e30, v == 0 ? 1000.0 : 1e30};
    for (size_t i = 0; i < 4; ++i) {
      uint8_t eight[8];
      (void)rimi_le_put_f64(eight, scale[i]);
      for (size_t k = 0; k < 8; ++k)
        u8(b, eight[k]);
    }
  }
}

static int make_files(void **state) {
  struct sigaction action;
  sigset_t held;
  char text[2 * SEAL_KEY_BYTES + 2];
  image blob;
  static recipe table;
  (void)set_up(state);
  if (!make_folder())
    return -1;
  build(&blob, &calibrated[1]);
  write_file("run.rim", blob.byte, blob.size);
  put_table(&table.section[RIM_SECTION_CAN_TABLE], 1);
  build(&blob, &table);
  write_file("table.rim", blob.byte, blob.size);
  for (size_t i = 0; i < SEAL_KEY_BYTES; ++i)
    snprintf(text + 2 * i, 3, "%02x", key[i]);
  write_file("key", text, 2 * SEAL_KEY_BYTES);
  memset(&action, 0, sizeof action);
  action.sa_handler = stop;
  sigaction(SIGUSR1, &action, NULL);
  sigemptyset(&held);
  sigaddset(&held, SIGUSR1);
  return sigprocmask(SIG_BLOCK, &held, NULL);
}

static int remove_files(void **state) {
  (void)state;
  const char *const name[] = {"run.rim", "table.rim", "key", "state", "state.old"};
  for (size_t i = 0; i < sizeof name / sizeof name[0]; ++i)
    unlink(file(name[i]));
  return rmdir(folder);
}

static int start_daemon(const char *more) {
  char text[1024];
  const int length = snprintf(text, sizeof text,
                              "image = %s\ncan = can0\ncan_fd = yes\nnode = 5\ninput = can\n"
                              "can_input = can1\ncan_table = %s\nmax_jump_s = 1000000\n%s",
                              file("run.rim"), file("table.rim"), more);
  memset(&d, 0, sizeof d);
  memset(&fake, 0, sizeof fake);
  assert_int_equal(config_parse(&d.config, "test", text, (size_t)length), 0);
  return rimd_start(&d);
}

/* Until everything that waits was read, and what time brings done. */
static void run(void) {
  stopped = 0;
  raise(SIGUSR1); /* let in when nothing else is ready */
  rimd_run(&d, &stopped);
}

static void send_row(uint32_t t, double shift) {
  row r;
  uint8_t data[48] = {0};
  float f[VALUES];
  make_row(&r, true, 900, t, shift);
  for (size_t i = 0; i < D; ++i)
    f[i] = (float)r.context[i];
  for (size_t o = 0; o < O; ++o) {
    f[D + o] = (float)r.outcome[o];
    f[D + O + o] = (float)r.mean[o];
    f[D + 2 * O + o] = (float)r.sd[o];
  }
  memcpy(data, f, sizeof f);
  fake_send(d.can_input.fd, ROW_ID, data, 48, true);
}

typedef struct heard {
  uint32_t summaries, heartbeats, findings, details, other;
  rim_can_summary summary;
  rim_can_heartbeat heartbeat;
  rim_alarm detail;
} heard;

static void hear(heard *h) {
  struct canfd_frame in;
  ssize_t got;
  rim_can_finding finding;
  while (d.can.fd >= 0 && fake_take(d.can.fd, &in, &got)) {
    rim_can_frame f = {.id = in.can_id, .length = in.len, .fd = got == CANFD_MTU};
    memcpy(f.data, in.data, sizeof f.data);
    if (rim_can_unpack_summary(&h->summary, &f) == RIM_OK)
      h->summaries++;
    else if (rim_can_unpack_heartbeat(&h->heartbeat, &f) == RIM_OK)
      h->heartbeats++;
    else if (rim_can_unpack_finding(&finding, &f) == RIM_OK)
      h->findings++;
    else if (rim_can_unpack_detail_fd(&h->detail, &f) == RIM_OK)
      h->details++;
    else
      h->other++;
  }
}

/* Rows until an alarm stands, each handled before the next. */
static uint32_t fly_to_alarm(heard *h) {
  for (uint32_t t = 0; t < ROWS; ++t) {
    send_row(t, 2.0);
    run();
    hear(h);
    if (rim_monitor_alarms(d.monitor).level == RIM_LEVEL_ERROR)
      return t;
  }
  return ROWS;
}

static void rows_become_an_alarm(void **state) {
  (void)state;
  heard h = {0};
  assert_int_equal(start_daemon("health_ms = 1\n"), 0);
  assert_true(fake.filters == 1 && fake.filter[0].can_id == ROW_ID);
  const uint32_t t = fly_to_alarm(&h);
  assert_true(t >= 2 && t < ROWS);
  assert_int_equal(d.kept.counters.rows, t + 1);
  usleep(200000); /* a summary may wait for the one before, 100 ms */
  run();
  usleep(10000);
  run();
  hear(&h);
  assert_true(h.heartbeats > 0 && h.summaries > 0 && h.findings >= 5 && h.details >= 1);
  assert_int_equal(h.other, 0);
  assert_true(h.summary.node == NODE && h.summary.level == RIM_LEVEL_ERROR);
  assert_true(h.heartbeat.node == NODE && h.heartbeat.level == RIM_LEVEL_ERROR);
  const rim_alarm newest = rim_monitor_alarms(d.monitor).newest;
  assert_true(h.detail.seq == (newest.seq & 255u) && h.detail.channel[0] == newest.channel[0]);
  assert_true(h.summary.seq == newest.seq);
  /* What is no row is counted by what is wrong with it. */
  uint8_t data[48] = {0};
  const float beyond = 2000.0f;
  fake_send(d.can_input.fd, 0x77, data, 8, false);
  fake_send(d.can_input.fd, ROW_ID, data, 8, false);
  memcpy(data, &beyond, sizeof beyond);
  fake_send(d.can_input.fd, ROW_ID, data, 48, true);
  run();
  const rim_counters c = d.kept.counters;
  assert_true(c.can_other == 1 && c.can_refused == 2 && c.rows == t + 1 && c.incomplete == 0);
  /* A row whose sd is 0 is no row either: all values 0. */
  memset(data, 0, sizeof data);
  fake_send(d.can_input.fd, ROW_ID, data, 48, true);
  run();
  assert_int_equal(d.kept.counters.not_finite, 1);
  assert_int_equal(rimd_finish(&d), 0);
}

static void send_command(uint8_t code, uint32_t sequence, uint32_t model) {
  const rim_command command = {sequence, model, code};
  rim_can_frame f;
  assert_int_equal(rim_can_pack_command(&f, NODE, &command), RIM_OK);
  fake_send(d.can.fd, f.id, f.data, 8, false);
  run();
}

static void commands_on_can(void **state) {
  (void)state;
  heard h = {0};
  assert_int_equal(start_daemon("health_ms = 1\n"), 0);
  assert_true(fly_to_alarm(&h) < ROWS);
  const rim_alarm a = rim_monitor_alarms(d.monitor).newest;
  send_command(RIM_COMMAND_ACKNOWLEDGE, a.seq + 1, a.model_id);
  assert_true(d.kept.counters.commands_refused == 1 && d.kept.counters.commands == 0);
  send_command(RIM_COMMAND_ACKNOWLEDGE, a.seq, a.model_id);
  assert_true(d.kept.counters.commands == 1 && rim_monitor_alarms(d.monitor).acknowledged);
  fake_send(d.can.fd, RIM_CAN_COMMAND_ID + NODE, (const uint8_t *)"\1\1\1\0\0\0\0\0", 8, false);
  run();
  assert_int_equal(d.kept.counters.commands_refused, 2); /* damaged */
  usleep(10000);
  run();
  hear(&h);
  const uint32_t details = h.details;
  send_command(RIM_COMMAND_DESCRIBE, 0, 0); /* the newest record's details once more */
  usleep(10000);
  run();
  hear(&h);
  assert_true(h.details == details + 1 && d.kept.counters.commands == 2);
  send_command(RIM_COMMAND_DESCRIBE, 0, 0); /* not at once again */
  hear(&h);
  assert_true(h.details == details + 1 && d.kept.counters.commands == 3);
  assert_int_equal(rimd_finish(&d), 0);
}

#ifdef SEAL_SODIUM
/* As lib/src/wire/sealed.h describes it. */
static void send_sealed(uint8_t code, uint64_t counter, bool right_key) {
  const rim_alarm a = rim_monitor_alarms(d.monitor).newest;
  const uint8_t other[SEAL_KEY_BYTES] = {0}, id[2] = {NODE, 2};
  uint8_t data[48] = {1, NODE, code};
  (void)rimi_le_put_u32(rimi_le_put_u32(data + 4, a.seq), a.model_id);
  (void)rimi_le_put_u64(data + 12, counter);
  assert_int_equal(crypto_generichash(data + 20, 16, data, 20, right_key ? key : other, sizeof key),
                   0);
  data[47] = rimi_crc8(rimi_crc8(0, id, 2), data, 47);
  fake_send(d.can.fd, RIM_CAN_COMMAND_ID + NODE, data, 48, true);
  run();
}

static void sealed_commands_on_can(void **state) {
  (void)state;
  heard h = {0};
  char more[300];
  snprintf(more, sizeof more, "key = %s\nstate = %s\nhealth_ms = 1\n", file("key"), file("state"));
  assert_int_equal(start_daemon(more), 0);
  assert_true(fly_to_alarm(&h) < ROWS);
  const rim_alarm a = rim_monitor_alarms(d.monitor).newest;
  send_command(RIM_COMMAND_CLEAR, a.seq, a.model_id); /* of 8 bytes: none is obeyed */
  send_sealed(RIM_COMMAND_CLEAR, 10, false);
  assert_true(d.kept.counters.commands_refused == 2 && d.kept.counters.commands == 0);
  assert_true(d.kept.sealed.unsealed == 1 && d.kept.sealed.forged == 1);
  assert_int_equal(rim_monitor_alarms(d.monitor).level, RIM_LEVEL_ERROR);
  send_sealed(RIM_COMMAND_ACKNOWLEDGE, 10, true);
  assert_true(d.kept.counters.commands == 1 && rim_monitor_alarms(d.monitor).acknowledged);
  send_sealed(RIM_COMMAND_CLEAR, 10, true); /* that number is used */
  assert_true(d.kept.counters.commands == 1 && d.kept.sealed.replayed == 1);
  assert_int_equal(rimd_finish(&d), 0);
  assert_int_equal(start_daemon(more), 0); /* nor after a restart */
  assert_int_equal(rim_monitor_alarms(d.monitor).level, RIM_LEVEL_ERROR);
  send_sealed(RIM_COMMAND_CLEAR, 10, true);
  assert_true(d.kept.sealed.replayed == 2 && d.kept.counters.restarts == 1);
  send_sealed(RIM_COMMAND_CLEAR, 11, true);
  assert_true(d.kept.counters.commands == 2 &&
              rim_monitor_alarms(d.monitor).level != RIM_LEVEL_ERROR);
  assert_int_equal(rimd_finish(&d), 0);
}

#endif

/* A queue that stays full: the summary waits, the detail is given up after half a second. */
static void a_full_queue(void **state) {
  (void)state;
  heard h = {0};
  assert_int_equal(start_daemon("health_ms = 3600000\n"), 0);
  fake.write_fails = ENOBUFS;
  fake.fails = UINT32_MAX;
  assert_true(fly_to_alarm(&h) < ROWS);
  assert_true(d.outbox.summary_waits && d.outbox.details > 0 && d.outbox.next == 0);
  assert_true(h.summaries + h.findings + h.details == 0);
  const uint32_t frames = d.outbox.details;
  assert_true(outbox_pump(&d.outbox, rimd_now_ns()) > 0);
  assert_int_equal(d.outbox.details, frames); /* patience */
  assert_true(outbox_pump(&d.outbox, rimd_now_ns() + UINT64_C(600000000)) > 0);
  assert_true(d.outbox.details == 0 && d.outbox.frames_unsent == frames);
  fake.fails = 0;
  run();
  hear(&h);
  assert_true(h.summaries == 1 && h.summary.level == RIM_LEVEL_ERROR && h.details == 0);
  assert_true(d.can.counts.full > 0 || d.kept.counters.can_full > 0);
  assert_int_equal(rimd_finish(&d), 0);
  assert_int_equal(d.kept.counters.can_unsent, frames);
}

/* The interface of the alarms goes away and comes back: the newest summary follows it. */
static void the_bus_goes_and_comes(void **state) {
  (void)state;
  heard h = {0};
  assert_int_equal(start_daemon("health_ms = 1\n"), 0);
  assert_true(fly_to_alarm(&h) < ROWS);
  fake.absent = true;
  fake.write_fails = ENODEV;
  fake.fails = 1;
  usleep(150000);
  run();
  assert_int_equal(d.can.fd, -1);
  for (uint32_t t = ROWS; t < ROWS + 20; ++t) { /* rows go on */
    send_row(t, 2.0);
    usleep(2000);
    run();
  }
  assert_true(d.can.fd == -1 && d.kept.counters.can_down + d.can.counts.down == 1);
  fake.absent = false;
  usleep(5000);
  run();
  assert_true(d.can.fd >= 0);
  memset(&h, 0, sizeof h);
  usleep(150000);
  run();
  hear(&h);
  assert_true(h.heartbeats >= 1 && h.heartbeat.level == RIM_LEVEL_ERROR);
  assert_true(h.summaries >= 1 && h.summary.level == RIM_LEVEL_ERROR);
  assert_int_equal(rimd_finish(&d), 0);
}

/* The medium takes nothing any more: records go out all the same, every failure is counted, and a
 * restart goes on from what was written before; then the medium is back. */
static void a_full_disk(void **state) {
  (void)state;
  const int why[2] = {ENOSPC, EROFS};
  char more[200];
  snprintf(more, sizeof more, "state = %s\nhealth_ms = 1\n", file("state"));
  for (int i = 0; i < 2; ++i) {
    heard h = {0};
    unlink(file("state"));
    unlink(file("state.old"));
    assert_int_equal(start_daemon(more), 0);
    fake.disk_fails = why[i];
    assert_true(fly_to_alarm(&h) < ROWS);
    const uint64_t end = rimd_now_ns() + UINT64_C(5000000000);
    while ((h.details == 0 || d.kept.counters.state_failures == 0) && rimd_now_ns() < end) {
      usleep(10000);
      run();
      hear(&h);
    }
    assert_true(h.details >= 1 && d.kept.counters.state_failures >= 1);
    assert_int_equal(rimd_finish(&d), 3);
    assert_int_equal(access(file("state"), F_OK), -1); /* nothing half-written */
    assert_int_equal(start_daemon(more), 0);
    assert_true(d.kept.counters.restarts == 0 && d.kept.counters.state_refused == 0);
    assert_int_equal(rimd_finish(&d), 0);
    assert_int_equal(start_daemon(more), 0);
    assert_int_equal(d.kept.counters.restarts, 1);
    assert_int_equal(rimd_finish(&d), 0);
  }
}

typedef struct day {
  uint64_t woke_ns;
  double offset_s; /* of the source's clock */
  uint64_t sent, lost, wrong_length, not_finite, stale;
} day;

static void tick_day(day *x) {
  x->woke_ns += (uint64_t)(1e9 * PERIOD_S);
  (void)rimd_tick(&d, x->woke_ns);
}

/* A row, or what becomes of one on a bad day. */
static void send_day(day *x, uint32_t t, uint32_t fate) {
  row r;
  double values[VALUES];
  make_row(&r, true, 901, t, 0.0);
  put_values(&r, values);
  double t_s = r.t_s + x->offset_s;
  uint32_t n = VALUES;
  if (fate < 100) { /* one in a hundred is lost on the way */
    x->lost++;
    return;
  }
  if (fate < 120)
    values[fate % VALUES] = fate % 2 == 0 ? (double)NAN : -(double)INFINITY;
  x->not_finite += fate < 120;
  n -= fate >= 120 && fate < 130;
  x->wrong_length += n != VALUES;
  t_s += fate == 130 ? 3600.0 : fate == 131 ? -3600.0 : 0.0;             /* a bit of a time stamp */
  for (uint32_t k = 0; k < (fate >= 132 && fate < 160 ? 2u : 1u); ++k) { /* sent twice */
    rimd_row(&d, t_s, values, n, x->woke_ns);
    x->sent++;
  }
}

static void reconcile(const day *x) {
  const rim_counters *c = &d.kept.counters;
  rimd_collect_counts(&d);
  assert_int_equal(c->not_finite, x->not_finite);
  assert_int_equal(c->wrong_length, x->wrong_length);
  assert_int_equal(c->rows + (uint64_t)c->not_finite + c->wrong_length + c->time_back + c->future,
                   x->sent);
  assert_int_equal(c->stale, x->stale);
}

/* A day of rows (make day; without RIM_DAY its hours have three minutes): one in a hundred lost,
 * others damaged, doubled, or with a wrong time; the source silent every hour; its clock put on and
 * put back by ten minutes; a restart at six in the evening. Every row that was sent is counted
 * once, as what became of it. */
static void a_day(void **state) {
  (void)state;
  char more[200];
  const uint32_t hour = (uint32_t)(3600.0 / PERIOD_S) / (getenv("RIM_DAY") != NULL ? 1u : 20u);
  rim_rng rng;
  day x = {.woke_ns = rimd_now_ns()};
  uint32_t sequence = 0;
  rimi_rng_seed(&rng, SEED, 24);
  unlink(file("state"));
  unlink(file("state.old"));
  snprintf(more, sizeof more, "state = %s\nhealth_ms = 3600000\n", file("state"));
  assert_int_equal(start_daemon(more), 0);
  d.guard_config.max_jump_s = 60.0;
  for (uint32_t t = 0; t < 24 * hour; ++t) {
    x.offset_s += t == 6 * hour ? 600.0 : t == 12 * hour ? -600.0 : 0.0;
    if (t % hour < 20 && t > hour) { /* silent for five seconds: STALE after two */
      x.lost++;
      x.stale += t % hour == 19;
    } else {
      send_day(&x, t, rimi_rng_below(&rng, 10000));
    }
    tick_day(&x);
    assert_true(d.kept.health_sequence >= sequence);
    sequence = d.kept.health_sequence;
    if (t % hour == hour - 1)
      reconcile(&x);
    if (t == 18 * hour + 100) {
      const rim_alarm_status before = rim_monitor_alarms(d.monitor);
      assert_int_equal(rimd_finish(&d), 0);
      assert_int_equal(start_daemon(more), 0);
      d.guard_config.max_jump_s = 60.0;
      d.valid_ns = x.woke_ns;
      const rim_alarm_status after = rim_monitor_alarms(d.monitor);
      assert_true(after.level == before.level && after.newest.seq >= before.newest.seq);
    }
  }
  assert_true(x.lost + d.kept.counters.rows > 23 * (uint64_t)hour);
  assert_true(d.kept.counters.clock_resets == 1 && d.kept.counters.restarts == 1);
  assert_true(d.kept.counters.future >= 99 && d.kept.counters.time_back >= 99);
  print_message("%u rows used, %u of another time, %u doubled or late, %u lost\n",
                d.kept.counters.rows, d.kept.counters.future, d.kept.counters.time_back,
                (unsigned)x.lost);
  assert_int_equal(rimd_finish(&d), 0);
}

static void what_cannot_start(void **state) {
  (void)state;
  char more[300];
  snprintf(more, sizeof more, "key = %s\nstate = %s\n", file("run.rim"), file("state"));
  assert_int_equal(start_daemon(more), 3); /* that is no key */
  assert_int_equal(start_daemon("state = /nowhere/at/all\n"), 3);
  char text[600];
  const int length =
      snprintf(text, sizeof text, "image = %s\ncan = can0\ninput = can\ncan_table = %s\n",
               file("run.rim"), file("run.rim"));
  memset(&d, 0, sizeof d);
  assert_int_equal(config_parse(&d.config, "test", text, (size_t)length), 0);
  assert_int_equal(rimd_start(&d), 3); /* an image without a table */
  memset(&fake, 0, sizeof fake);
  memset(&d, 0, sizeof d);
  const int again =
      snprintf(text, sizeof text, "image = %s\ncan = can0\ninput = can\ncan_table = %s\n",
               file("run.rim"), file("table.rim"));
  assert_int_equal(config_parse(&d.config, "test", text, (size_t)again), 0);
  fake.no_can = true;
  assert_int_equal(rimd_start(&d), 3); /* no CAN in this kernel */
}

static int start_with(const char *table, const char *more) {
  char text[600];
  const int length =
      snprintf(text, sizeof text, "image = %s\ncan = can0\ninput = can\ncan_table = %s\n%s",
               file("run.rim"), table, more);
  memset(&d, 0, sizeof d);
  assert_int_equal(config_parse(&d.config, "test", text, (size_t)length), 0);
  return rimd_start(&d);
}

static void tables_that_are_none(void **state) {
  (void)state;
  static recipe table;
  image blob;
  memset(&fake, 0, sizeof fake);
  assert_int_equal(start_with("/nowhere/at/all", ""), 3);
  assert_int_equal(start_with(file("key"), ""), 3);
  memset(&table, 0, sizeof table);
  put_table(&table.section[RIM_SECTION_CAN_TABLE], 1);
  table.section[RIM_SECTION_CAN_TABLE].byte[4]--; /* a value less, and its signal one too many */
  build(&blob, &table);
  write_file("other.rim", blob.byte, blob.size);
  assert_int_equal(start_with(file("other.rim"), ""), 3);
  bytes *b = &table.section[RIM_SECTION_CAN_TABLE];
  b->byte[8]--; /* now it is not of this length either */
  b->size -= 48;
  b->byte[16 + 8]--;
  build(&blob, &table);
  write_file("other.rim", blob.byte, blob.size);
  assert_int_equal(start_with(file("other.rim"), ""), 3); /* good, and of 9 values instead of 10 */
  assert_int_equal(d.table.values, VALUES - 1);
  unlink(file("other.rim"));
}

/* An interface that is not there, down, or takes no FD frames holds up no start. */
static void interfaces_that_are_waited_for(void **state) {
  (void)state;
  char more[300];
  snprintf(more, sizeof more, "key = %s\nstate = %s\n", file("key"), file("state"));
  memset(&fake, 0, sizeof fake);
  fake.absent = true;
  assert_int_equal(start_with(file("table.rim"), ""), 0);
  assert_true(d.can.fd == -1 && d.can_input.fd == -1);
  assert_int_equal(rimd_finish(&d), 0);
  memset(&fake, 0, sizeof fake);
  fake.down = true;
  assert_int_equal(start_with(file("table.rim"), ""), 0);
  assert_true(d.can.fd >= 0 && d.can.is_down);
  assert_int_equal(rimd_finish(&d), 0);
  memset(&fake, 0, sizeof fake);
  fake.classic = true;
  assert_int_equal(start_with(file("table.rim"), "can_fd = yes\n"), 0);
  assert_false(d.can.fd_capable);
  assert_int_equal(rimd_finish(&d), 0);
#ifdef SEAL_SODIUM
  assert_int_equal(start_with(file("table.rim"), more), 0); /* says that no command can come */
  send_command(RIM_COMMAND_DESCRIBE, 0, 0);
  assert_int_equal(d.kept.counters.commands_refused, 1);
  assert_int_equal(rimd_finish(&d), 0);
#endif
}

/* A good check sum over memory that is no monitor: refused, counted, and begun anew. */
static void a_state_that_is_no_monitor(void **state) {
  (void)state;
  char more[200];
  unlink(file("state"));
  unlink(file("state.old"));
  snprintf(more, sizeof more, "state = %s\n", file("state"));
  assert_int_equal(start_daemon(more), 0);
  const state_parts parts = rimd_parts(&d);
  memset(d.memory, 0x41, d.memory_bytes);
  assert_int_equal(state_finish(&d.state, &parts), 0);
  assert_int_equal(start_daemon(more), 0);
  assert_true(d.kept.counters.state_refused == 1 && d.kept.counters.restarts == 0);
  heard h = {0};
  assert_true(fly_to_alarm(&h) < ROWS);
  assert_int_equal(rimd_finish(&d), 0);
}

/* A row of two frames: whole when both have come and neither is too old, else counted. */
static void rows_that_are_not_whole(void **state) {
  (void)state;
  static recipe table;
  image blob;
  uint8_t data[48] = {0}, last[4];
  const float one = 1.0f;
  memset(&table, 0, sizeof table);
  memset(&fake, 0, sizeof fake);
  put_table(&table.section[RIM_SECTION_CAN_TABLE], 2);
  build(&blob, &table);
  write_file("other.rim", blob.byte, blob.size);
  assert_int_equal(start_with(file("other.rim"), ""), 0);
  assert_true(fake.filters == 2 && fake.filter[1].can_id == (LAST_ID | CAN_EFF_FLAG) &&
              (fake.filter[1].can_mask & CAN_EFF_MASK) == CAN_EFF_MASK);
  for (size_t i = 0; i + 1 < VALUES; ++i)
    memcpy(data + 4 * i, &one, sizeof one);
  memcpy(last, &one, sizeof one);
  fake.dropped = 1; /* the kernel's stamp comes with it */
  fake_send(d.can_input.fd, ROW_ID, data, 48, true);
  run();
  assert_true(d.kept.counters.incomplete == 1 && d.kept.counters.rows == 0);
  fake_send(d.can_input.fd, LAST_ID | CAN_EFF_FLAG, last, 4, false);
  fake_send(d.can_input.fd, ROW_ID, data, 48, true);
  fake.read_fails = EIO; /* once: the next turn reads on */
  fake.fails = 1;
  run();
  run();
  assert_true(d.kept.counters.incomplete == 1 && d.kept.counters.rows == 1);
  assert_true(d.kept.has_origin && d.kept.can_origin_s == 100.25);
  assert_int_equal(rimd_finish(&d), 0);
  unlink(file("other.rim"));
}

/* What the system refuses is no interface that is waited for. */
static void interfaces_that_are_refused(void **state) {
  (void)state;
  memset(&fake, 0, sizeof fake);
  fake.bind_fails = EPERM;
  assert_int_equal(start_with(file("table.rim"), ""), 3);
  memset(&fake, 0, sizeof fake);
  fake.absent = true;
  assert_int_equal(start_with(file("table.rim"), "can_fd = yes\n"), 0);
  assert_true(d.can.fd == -1);
  assert_int_equal(rimd_finish(&d), 0);
}

/* Records that wait for a medium that hangs: the ninth sends the eight before it, and counters stay
 * at their end. */
static void what_waits_is_bounded(void **state) {
  (void)state;
  char more[200];
  heard h = {0};
  unlink(file("state"));
  unlink(file("state.old"));
  snprintf(more, sizeof more, "state = %s\nhealth_ms = 3600000\n", file("state"));
  assert_int_equal(start_daemon(more), 0);
  for (uint32_t i = 0; i < RIMD_HELD; ++i)
    d.held[i] = (rim_alarm){
        .seq = i + 1, .state = RIM_ALARM_UPDATED, .level = RIM_LEVEL_WARN, .p_value = 1.0};
  d.held_count = RIMD_HELD;
  d.held_ns = rimd_now_ns();
  atomic_store(&d.state.busy, true); /* as if the medium hung */
  for (uint32_t t = 0; t < ROWS && d.held_count != 1; ++t) {
    row r;
    double values[VALUES];
    make_row(&r, true, 900, t, 2.0);
    put_values(&r, values);
    rimd_row(&d, r.t_s, values, VALUES, rimd_now_ns());
  }
  assert_int_equal(d.held_count, 1); /* the alarm that was found, with a number of its own */
  assert_true(d.held[0].state == RIM_ALARM_RAISED && d.held[0].seq == 1);
  hear(&h);
  assert_true(h.summaries >= 1 && h.summary.seq == 1);
  atomic_store(&d.state.busy, false);
  /* A clock that runs back is no silence. */
  d.policy.stale_s = 0.0;
  assert_true(rimd_tick(&d, d.valid_ns - 1) >= -1);
  assert_int_not_equal(rim_monitor_alarms(d.monitor).level, RIM_LEVEL_STALE);
  d.kept.counters.can_unsent = UINT32_MAX - 1;
  d.outbox.frames_unsent = 5;
  d.kept.counters.wrong_length = UINT32_MAX;
  rimd_row(&d, 1e6, NULL, 0, rimd_now_ns());
  rimd_collect_counts(&d);
  assert_true(d.kept.counters.can_unsent == UINT32_MAX && d.outbox.frames_unsent == 0);
  assert_int_equal(d.kept.counters.wrong_length, UINT32_MAX);
  assert_int_equal(rimd_finish(&d), 0);
  unlink(file("state"));
  unlink(file("state.old"));
}

/* Memory is damaged, and the image's file is gone, cut, or another image of the same size: nothing
 * is known from then on, and said so; no row is used. */
static void an_image_that_cannot_be_read_again(void **state) {
  (void)state;
  recipe retrained = calibrated[1];
  image other;
  set_word(&retrained, RIM_CONFIG_SEED, 6);
  build(&other, &retrained);
  for (int cut = 0; cut < 3; ++cut) {
    heard h = {0};
    assert_int_equal(start_daemon("health_ms = 1\n"), 0);
    send_row(0, 0.0);
    run();
    assert_int_equal(d.kept.counters.rows, 1);
    assert_int_equal(rename(file("run.rim"), file("away.rim")), 0);
    assert_int_equal(other.size, d.image_bytes);
    if (cut != 0)
      write_file("run.rim", cut == 1 ? (const void *)"RIM" : other.byte, cut == 1 ? 3 : other.size);
    const uint32_t model = d.view.model_id;
    ((uint8_t *)(uintptr_t)d.image)[d.image_bytes / 2] ^= 1u;
    for (uint32_t t = 1; t < 100 && !d.was_damaged; ++t) {
      send_row(t, 0.0);
      run();
    }
    assert_true(d.was_damaged && d.is_damaged);
    rim_image now;
    assert_true(rim_image_open(&now, d.image, d.image_bytes) != RIM_OK || now.model_id == model);
    const uint32_t rows = d.kept.counters.rows;
    send_row(200, 0.0);
    run();
    usleep(2000);
    run();
    hear(&h);
    assert_int_equal(d.kept.counters.rows, rows);
    assert_true(h.heartbeats > 0 && h.heartbeat.level == RIM_LEVEL_STALE);
    assert_int_equal(rename(file("away.rim"), file("run.rim")), 0);
    assert_int_equal(rimd_finish(&d), 0);
  }
}

/* Observations over LCM where rows come by CAN are nobody's; where they must be sealed, one that is
 * not is refused. */
static void observations_by_another_way(void **state) {
  (void)state;
  static lcm_udp sender;
  static rim_observation_message sample;
  uint8_t bytes_of[RIM_LCM_OBSERVATION_SIZE];
  const char *what;
  char more[500];
  const char *const bus = "lcm = udpm://239.255.76.69:7671?ttl=0\nlcm_interface = 127.0.0.1\n";
  sample.count = VALUES;
  assert_int_equal(rim_lcm_pack_observation(bytes_of, sizeof bytes_of, &sample), RIM_OK);
  for (int sealed = 0; sealed < 2; ++sealed) {
    memset(&fake, 0, sizeof fake);
    snprintf(more, sizeof more, "image = %s\n%s", file("run.rim"), bus);
    const size_t length = strlen(more);
    snprintf(more + length, sizeof more - length,
             sealed ? "key = %s\nkey_observations = yes\nstate = %s\n"
                    : "can = can0\ninput = can\ncan_table = %s\nmax_jump_s = 0\n",
             file(sealed ? "key" : "table.rim"), file("state"));
#ifndef SEAL_SODIUM
    if (sealed)
      break;
#endif
    memset(&d, 0, sizeof d);
    assert_int_equal(config_parse(&d.config, "test", more, strlen(more)), 0);
    assert_int_equal(rimd_start(&d), 0);
    assert_int_equal(lcm_udp_open(&sender, &d.config.address, false, &what), 0);
    assert_int_equal(lcm_udp_send(&sender, RIM_LCM_CHANNEL_OBSERVATION, bytes_of, sizeof bytes_of),
                     0);
    for (int i = 0; i < 100 && d.kept.counters.lcm_refused == 0; ++i) {
      usleep(1000);
      run();
    }
    assert_int_equal(d.kept.counters.lcm_refused, sealed);
    assert_true(d.kept.counters.rows == 0 && d.kept.counters.not_finite == 0);
    assert_int_equal(d.kept.sealed.unsealed, sealed);
    lcm_udp_close(&sender);
    assert_int_equal(rimd_finish(&d), 0);
  }
  unlink(file("state"));
  unlink(file("state.old"));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(rows_become_an_alarm),
      cmocka_unit_test(rows_that_are_not_whole),
      cmocka_unit_test(interfaces_that_are_refused),
      cmocka_unit_test(what_waits_is_bounded),
      cmocka_unit_test(an_image_that_cannot_be_read_again),
      cmocka_unit_test(observations_by_another_way),
      cmocka_unit_test(commands_on_can),
#ifdef SEAL_SODIUM
      cmocka_unit_test(sealed_commands_on_can),
#endif
      cmocka_unit_test(a_full_queue),
      cmocka_unit_test(the_bus_goes_and_comes),
      cmocka_unit_test(what_cannot_start),
      cmocka_unit_test(a_full_disk),
      cmocka_unit_test(a_day),
      cmocka_unit_test(tables_that_are_none),
      cmocka_unit_test(interfaces_that_are_waited_for),
      cmocka_unit_test(a_state_that_is_no_monitor),
  };
  return cmocka_run_group_tests(tests, make_files, remove_files);
}
