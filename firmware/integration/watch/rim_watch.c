/* SPDX-License-Identifier: MIT */
#include "rim_watch.h"

static const rim_watch closed;

rim_status rim_watch_open(rim_watch *watch, void *memory, size_t bytes, const void *image,
                          size_t image_bytes, rim_watch_send *send, void *user) {
  if (watch == NULL)
    return RIM_E_ARGUMENT;
  *watch = closed;
  rim_watch w = closed;
  rim_status status = rim_image_open(&w.image, image, image_bytes);
  if (status == RIM_OK)
    status = rim_monitor_init(&w.monitor, memory, bytes, image, image_bytes);
  if (status != RIM_OK)
    return status;
  const uint32_t outcomes = rim_monitor_config(w.monitor, RIM_CONFIG_OUTCOMES);
  const bool external = rim_monitor_config(w.monitor, RIM_CONFIG_EXTERNAL) != 0;
  w.values = rim_monitor_config(w.monitor, RIM_CONFIG_FEATURES) + (external ? 3u * outcomes : 0u);
  w.digest = RIM_DIGEST_START;
  w.level = RIM_LEVEL_STALE;
  w.reason = RIM_REASON_TOO_FEW;
  w.is_fresh = true;
  w.send = send;
  w.user = user;
  *watch = w;
  return RIM_OK;
}

static void send(rim_watch *watch, const rim_alarm *record) {
  watch->records++;
  if (watch->send != NULL)
    watch->send(watch->user, record);
}

static void send_waiting(rim_watch *watch) {
  rim_alarm record;
  while (rim_monitor_next_record(watch->monitor, &record))
    send(watch, &record);
}

/* It is now_s on the clock of the rows, and no valid one has come since the newest. */
static void note_silence(rim_watch *watch, double now_s) {
  if (rim_monitor_idle(watch->monitor, now_s)) {
    watch->level = RIM_LEVEL_STALE;
    watch->reason = RIM_REASON_SILENT;
  }
  send_waiting(watch);
}

static void note_valid(rim_watch *watch, double t_s) {
  watch->newest_s = t_s;
  watch->has_valid = watch->is_fresh = true;
  watch->is_guessed = false;
}

rim_status rim_watch_row(rim_watch *watch, double t_s, const double *value, size_t count,
                         rim_verdict *verdict) {
  if (watch == NULL || watch->monitor == NULL || value == NULL)
    return RIM_E_ARGUMENT;
  /* A gap in the rows is told before the row, and also where the row will be refused. A time that
   * was guessed is none to measure a gap from. */
  if (!watch->is_guessed)
    note_silence(watch, t_s);
  if (count != watch->values) {
    watch->refused++;
    return RIM_E_SIZE;
  }
  rim_observation row = {.t_s = t_s, .context = value};
  const uint32_t features = rim_monitor_config(watch->monitor, RIM_CONFIG_FEATURES);
  if (count > features) {
    const uint32_t outcomes = rim_monitor_config(watch->monitor, RIM_CONFIG_OUTCOMES);
    row.outcome = value + features;
    row.mean = row.outcome + outcomes;
    row.sd = row.mean + outcomes;
  }
  rim_verdict now;
  const rim_status status = rim_monitor_step(watch->monitor, &row, &now);
  if (status != RIM_OK)
    return status;
  watch->rows++;
  watch->level = now.level;
  watch->reason = now.reason;
  if (now.valid)
    note_valid(watch, t_s);
  watch->digest = rim_verdict_digest(watch->digest, &now);
  if (now.alarm.seq != 0)
    send(watch, &now.alarm);
  send_waiting(watch);
  if (verdict != NULL)
    *verdict = now;
  return RIM_OK;
}

void rim_watch_idle(rim_watch *watch, double silent_s) {
  if (watch == NULL || watch->monitor == NULL)
    return;
  if (!watch->has_valid)
    watch->is_guessed = true;
  note_silence(watch, watch->newest_s + silent_s);
}

void rim_watch_tick(rim_watch *watch, double here_s) {
  if (watch == NULL || watch->monitor == NULL)
    return;
  const double passed_s = here_s - watch->here_s;
  watch->here_s = here_s;
  if (watch->is_fresh)
    watch->silent_s = 0.0;
  else if (passed_s > 0.0)
    watch->silent_s += passed_s;
  watch->is_fresh = false;
  rim_watch_idle(watch, watch->silent_s);
}

void rim_watch_restart(rim_watch *watch, double now_s) {
  if (watch == NULL || watch->monitor == NULL || !(now_s - now_s == 0.0))
    return; /* not finite: the monitor refuses it too */
  rim_monitor_restart(watch->monitor, now_s);
  watch->newest_s = now_s; /* the silence goes on from here: no valid row has come by this */
  if (watch->level <= RIM_LEVEL_ERROR)
    watch->level = rim_monitor_alarms(watch->monitor).level;
  send_waiting(watch);
}

rim_status rim_watch_command(rim_watch *watch, const rim_command *command) {
  if (watch == NULL || watch->monitor == NULL)
    return RIM_E_ARGUMENT;
  const rim_status status = rim_monitor_command(watch->monitor, command, 32);
  if (status == RIM_OK && watch->level <= RIM_LEVEL_ERROR)
    watch->level = rim_monitor_alarms(watch->monitor).level;
  send_waiting(watch);
  return status;
}

typedef struct line {
  char *out;
  size_t length, room; /* room: without the terminator */
} line;

static void put(line *l, const char *text, size_t length) {
  for (size_t i = 0; i < length && l->length < l->room; i++)
    l->out[l->length++] = text[i];
}

static void put_text(line *l, const char *text) {
  while (*text != '\0')
    put(l, text++, 1);
}

static void put_whole(line *l, uint32_t value, unsigned least_digits) {
  char digit[10];
  unsigned count = 0;
  do {
    digit[count++] = (char)('0' + value % 10u);
    value /= 10u;
  } while (value != 0 || count < least_digits);
  while (count > 0)
    put(l, &digit[--count], 1);
}

/* Four decimals, or "e" and an exponent where they would hide the number or it is too large; "nan",
 * "inf" and "-inf" where it is none, which no division would bring to an end. */
static void put_number(line *l, double x, const char *plus) {
  int exponent = 0;
  if (x != x) {
    put_text(l, "nan");
    return;
  }
  put_text(l, x < 0.0 ? "-" : plus);
  x = x < 0.0 ? -x : x;
  if (x - x != 0.0) {
    put_text(l, "inf");
    return;
  }
  if (x > 0.0 && (x >= 1e5 || x < 1e-3)) {
    for (; x >= 10.0; x /= 10.0)
      exponent++;
    for (; x < 1.0; x *= 10.0)
      exponent--;
  }
  uint32_t scaled = (uint32_t)(x * 1e4 + 0.5);
  if (exponent != 0 && scaled >= 100000u) { /* rounded up to the next power of ten */
    scaled = 10000u;
    exponent++;
  }
  put_whole(l, scaled / 10000u, 1);
  put(l, ".", 1);
  put_whole(l, scaled % 10000u, 4);
  if (exponent != 0) {
    put(l, exponent < 0 ? "e-" : "e+", 2);
    put_whole(l, (uint32_t)(exponent < 0 ? -exponent : exponent), 2);
  }
}

static void put_outcome(line *l, const rim_watch *watch, const rim_alarm *record) {
  const char *name = NULL;
  size_t length = 0;
  const uint32_t features = rim_monitor_config(watch->monitor, RIM_CONFIG_FEATURES);
  if (rim_image_name(&watch->image, features + record->channel[0], &name, &length) == RIM_OK) {
    put(l, name, length);
  } else {
    put_text(l, "outcome ");
    put_whole(l, record->channel[0], 1);
  }
  put(l, " ", 1);
  put_number(l, record->shift[0], "+");
  if (record->kind == RIM_KIND_SHIFT || record->kind == RIM_KIND_DRIFT) {
    put(l, " ", 1);
    put_text(l, rim_unit_of_name(name, length));
  }
  put_text(l, " (sd ");
  put_number(l, record->shift_sd[0], "");
  put_text(l, ") since ");
  put_number(l, record->since_s, "");
  put_text(l, " s");
}

size_t rim_watch_words(const rim_watch *watch, const rim_alarm *record, char *out, size_t bytes) {
  static const char kind[7][9] = {"shift",  "gain",    "variance", "drift",
                                  "repeat", "blocked", "pushed"};
  static const char state[4][8] = {"level", "raised", "updated", "cleared"};
  static const char level[4][6] = {"OK", "WARN", "ERROR", "STALE"};
  if (watch == NULL || record == NULL || out == NULL || bytes == 0)
    return 0;
  line l = {out, 0, bytes - 1};
  put_text(&l, state[record->state & 3u]);
  put(&l, " ", 1);
  put_text(&l, level[record->level & 3u]);
  if (record->state != RIM_ALARM_NONE && record->kind <= RIM_KIND_PUSHED) {
    put_text(&l, ": ");
    put_text(&l, kind[record->kind]);
    put(&l, " ", 1);
    if (record->channels > 0)
      put_outcome(&l, watch, record);
  }
  out[l.length] = '\0';
  return l.length;
}
