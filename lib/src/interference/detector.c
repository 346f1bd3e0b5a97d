/* SPDX-License-Identifier: MIT */
#include "interference/detector.h"

#include <string.h>

#include "base/bytes.h"
#include "base/crc.h"
#include "base/real.h"

#define STATES RIM_INTERFERENCE_STATES
#define GAUSSIANS RIM_INTERFERENCE_GAUSSIANS
#define ROWS RIM_INTERFERENCE_J_ROWS
#define COMMANDS RIM_INTERFERENCE_COMMANDS
#define HEADER 16u
#define CRC_AT 12u
#define MOST_Z 1e4           /* an observation is limited to this many sd */
#define STANDING_MPS 1e-6    /* commands below are 0 */
#define CLEAR 0.5            /* score at which an alarm ends */
#define LN_ODDS_UNIT 10.0    /* of the HMM's score */
#define LN_ODDS_QUIET (-4.6) /* P(MI) below 1 %: the onset lies later */

_Static_assert(sizeof(rim_interference_model) == 8u * RIM_INTERFERENCE_NUMBERS, "layout");

static uint32_t crc_of(const uint8_t *section) {
  const uint32_t crc = rimi_crc32(0, section, CRC_AT);
  return rimi_crc32(crc, section + HEADER, RIM_INTERFERENCE_BYTES - HEADER);
}

static bool is_positive(double x) { return x > 0.0 && rimi_is_finite(x); }
static bool is_not_negative(double x) { return x >= 0.0 && rimi_is_finite(x); }

static bool cusum_ok(const rim_interference_cusum *c) {
  return is_positive(c->sd_steady) && is_positive(c->sd_ramp) && is_not_negative(c->slack) &&
         is_positive(c->threshold);
}

static rim_hmm_model hmm_of(const rim_interference_model *m) {
  rim_hmm_model h;
  memset(&h, 0, sizeof h);
  h.states = STATES;
  h.initial[RIM_MOTION_STOP] = 1.0;
  for (size_t i = 0; i < STATES; ++i)
    memcpy(h.transition[i], m->transition[i], sizeof m->transition[i]);
  return h;
}

static rim_status check(const rim_interference_model *m) {
  for (size_t i = 0; i < STATES; ++i) {
    for (size_t k = 0; k < GAUSSIANS; ++k) {
      if (!rimi_is_finite(m->mean[i][k]) || !is_positive(m->sd[i][k]))
        return RIM_E_DATA;
    }
  }
  const bool ok = rimi_is_finite(m->ln_odds) && is_not_negative(m->latency_s) &&
                  is_positive(m->accel_mps2) && is_positive(m->decel_mps2) &&
                  m->limit_spread >= 0.0 && m->limit_spread <= 0.9 &&
                  is_not_negative(m->settle_s) && is_positive(m->gap_s) && cusum_ok(&m->one_step) &&
                  cusum_ok(&m->open_loop);
  for (size_t i = 0; i < STATES; ++i) {
    double sum = 0.0;
    for (size_t j = 0; j < STATES; ++j) {
      if (!(m->transition[i][j] >= 0.0 && m->transition[i][j] <= 1.0))
        return RIM_E_DATA;
      sum += m->transition[i][j];
    }
    if (rimi_abs(sum - 1.0) > 1e-6)
      return RIM_E_DATA;
  }
  return ok ? RIM_OK : RIM_E_DATA;
}

rim_status rimi_interference_pack(const rim_interference_model *model, uint8_t *section,
                                  size_t bytes) {
  if (model == NULL || section == NULL)
    return RIM_E_ARGUMENT;
  if (bytes != RIM_INTERFERENCE_BYTES)
    return RIM_E_SIZE;
  const rim_status status = check(model);
  if (status != RIM_OK)
    return status;
  double number[RIM_INTERFERENCE_NUMBERS];
  memcpy(number, model, sizeof number);
  (void)rimi_le_put_u32(section, RIM_INTERFERENCE_LAYOUT);
  (void)rimi_le_put_u32(section + 4, RIM_INTERFERENCE_BYTES);
  (void)rimi_le_put_u32(section + 8, 0);
  for (size_t i = 0; i < RIM_INTERFERENCE_NUMBERS; ++i)
    (void)rimi_le_put_f64(section + HEADER + 8 * i, number[i]);
  (void)rimi_le_put_u32(section + CRC_AT, crc_of(section));
  return RIM_OK;
}

rim_status rimi_interference_open(rim_interference_model *model, const uint8_t *section,
                                  size_t bytes) {
  if (model == NULL || section == NULL)
    return RIM_E_ARGUMENT;
  if (bytes < RIM_INTERFERENCE_BYTES)
    return RIM_E_TRUNCATED;
  if (bytes > RIM_INTERFERENCE_BYTES)
    return RIM_E_SIZE;
  if (rimi_le_u32(section, 0) != RIM_INTERFERENCE_LAYOUT)
    return RIM_E_VERSION;
  if (rimi_le_u32(section, 1) != RIM_INTERFERENCE_BYTES)
    return RIM_E_SIZE;
  if (rimi_le_u32(section, 3) != crc_of(section))
    return RIM_E_CRC;
  if (rimi_le_u32(section, 2) != 0)
    return RIM_E_DATA;
  double number[RIM_INTERFERENCE_NUMBERS];
  for (size_t i = 0; i < RIM_INTERFERENCE_NUMBERS; ++i)
    number[i] = rimi_le_f64(section + HEADER, i);
  rim_interference_model read;
  memcpy(&read, number, sizeof read);
  const rim_status status = check(&read);
  if (status == RIM_OK)
    *model = read;
  return status;
}

rim_status rimi_interference_of_image(rim_interference_model *model, const rim_image *image) {
  if (model == NULL || image == NULL)
    return RIM_E_ARGUMENT;
  const uint8_t *data = NULL;
  size_t bytes = 0;
  const rim_status status = rim_image_section(image, RIM_SECTION_INTERFERENCE, &data, &bytes);
  return status == RIM_OK ? rimi_interference_open(model, data, bytes) : status;
}

/* ---- begin and begin again ---- */

static void count_up(uint32_t *n) {
  if (*n < UINT32_MAX)
    ++*n;
}

static void forget(rim_interference *s) {
  memset(s->sum, 0, sizeof s->sum);
  s->rows = s->commands = s->command_first = 0;
  s->started = s->has_command = s->alarmed = s->is_observed = false;
  s->kind = RIM_INTERFERENCE_NONE;
}

rim_status rimi_interference_init(rim_interference *state, const rim_interference_model *model) {
  if (state == NULL || model == NULL)
    return RIM_E_ARGUMENT;
  const rim_status status = check(model);
  if (status != RIM_OK)
    return status;
  const rim_interference_model copy = *model;
  memset(state, 0, sizeof *state);
  state->model = copy;
  for (size_t i = 0; i < STATES; ++i) {
    for (size_t k = 0; k < GAUSSIANS; ++k) {
      state->inverse_sd[i][k] = 1.0 / copy.sd[i][k];
      state->ln_norm[i] -= rimi_log(copy.sd[i][k]) + RIM_LN_SQRT_2PI;
    }
  }
  const rim_hmm_model h = hmm_of(&copy);
  return rimi_hmm_init(&state->hmm, &h);
}

void rimi_interference_reset(rim_interference *state) {
  if (state == NULL)
    return;
  forget(state);
  rimi_hmm_reset(&state->hmm);
}

/* ---- the limited motion model ---- */

/* One speed, dt_s on, towards the command in force (eq. 4.10). */
static double ramp(const rim_interference_model *m, double v, double target, double dt_s) {
  const double change = target - v;
  const bool is_rising = rimi_abs(target) > rimi_abs(v) && target * v >= 0.0;
  const double most = (is_rising ? m->accel_mps2 : m->decel_mps2) * dt_s;
  return v + rimi_clamp(change, -most, most);
}

static void note_command(rim_interference *s, double t_s, double command) {
  if (s->has_command && rimi_bits(command) == rimi_bits(s->command))
    return;
  if (!s->has_command)
    s->in_force = command; /* nothing is known of what went before */
  s->command = command;
  s->has_command = true;
  if (s->commands == COMMANDS) { /* the oldest takes effect early */
    s->in_force = s->command_v[s->command_first];
    s->command_first = (s->command_first + 1) % COMMANDS;
    --s->commands;
    count_up(&s->health.command_overflow);
  }
  const uint32_t at = (s->command_first + s->commands) % COMMANDS;
  s->command_t_s[at] = t_s + s->model.latency_s;
  s->command_v[at] = command;
  ++s->commands;
}

/* Carries both predictions from the last row to t_s, command by command as they take effect. */
static void predict(rim_interference *s, double t_s, double *one_step) {
  double now_s = s->t_s;
  *one_step = s->speed;
  for (uint32_t i = 0; i <= COMMANDS; ++i) { /* at most each command that waits, then the rest */
    const bool changes = s->commands > 0 && s->command_t_s[s->command_first] <= t_s;
    const double until_s = changes ? rimi_max(now_s, s->command_t_s[s->command_first]) : t_s;
    if (rimi_abs(s->in_force - s->open_loop[0]) > 0.0)
      s->ramp_until_s = until_s + s->model.settle_s;
    *one_step = ramp(&s->model, *one_step, s->in_force, until_s - now_s);
    for (int k = 0; k < 2; ++k) {
      const double share = 1.0 + (k == 0 ? -s->model.limit_spread : s->model.limit_spread);
      s->open_loop[k] = ramp(&s->model, s->open_loop[k], s->in_force, share * (until_s - now_s));
    }
    now_s = until_s;
    if (!changes)
      return;
    s->in_force = s->command_v[s->command_first];
    s->command_first = (s->command_first + 1) % COMMANDS;
    --s->commands;
  }
}

/* ---- CUSUMs ---- */

/* residual[0] counts when it is below 0, residual[1] when above. */
static double accumulate(rim_interference *s, int which, const rim_interference_cusum *c,
                         const double residual[2], double t_s) {
  const double sd = t_s <= s->ramp_until_s ? c->sd_ramp : c->sd_steady;
  for (int side = 0; side < 2; ++side) {
    const double z = rimi_clamp(residual[side] / sd, -RIM_INTERFERENCE_CLIP, RIM_INTERFERENCE_CLIP);
    double *sum = &s->sum[which][side];
    if (!(*sum > 0.0))
      s->sum_from_s[which][side] = s->t_s; /* the row before: interference lies after it */
    /* Never far above the threshold, or an alarm would outlast its cause. */
    *sum = rimi_clamp(*sum + (side == 0 ? -z : z) - c->slack, 0.0, 2.0 * c->threshold);
  }
  return rimi_max(s->sum[which][0], s->sum[which][1]) / c->threshold;
}

/* ---- the HMM's observations ---- */

/* Slope of the last n velocities over time; times must differ. */
static double slope(const rim_interference *s, uint32_t n) {
  double t_mean = 0.0, v_mean = 0.0;
  for (uint32_t k = 1; k <= n; ++k) {
    const uint32_t at = (s->rows - k) % ROWS;
    t_mean += s->row_t_s[at] - s->t_s;
    v_mean += s->row_v[at];
  }
  const double inverse = 1.0 / (double)n;
  t_mean *= inverse;
  v_mean *= inverse;
  double tv = 0.0, tt = 0.0;
  for (uint32_t k = 1; k <= n; ++k) {
    const uint32_t at = (s->rows - k) % ROWS;
    const double t = s->row_t_s[at] - s->t_s - t_mean;
    tv += t * (s->row_v[at] - v_mean);
    tt += t * t;
  }
  return tt > 0.0 ? tv / tt : 0.0;
}

typedef struct motion_observation {
  double value[GAUSSIANS];
  bool is_full;
} motion_observation;

static motion_observation observe(rim_interference *s) {
  motion_observation o = {{0.0, 0.0, 0.0}, false};
  if (s->rows < ROWS)
    return o;
  const double accel_8 = slope(s, ROWS);
  if (s->rows > ROWS) {
    o.value[0] = s->command - s->speed;
    o.value[1] = slope(s, RIM_INTERFERENCE_A_ROWS);
    o.value[2] = (accel_8 - s->accel_8) / (s->t_s - s->accel_8_t_s);
    o.is_full = true;
  }
  s->accel_8 = accel_8;
  s->accel_8_t_s = s->t_s;
  return o;
}

static void step_hmm(rim_interference *s, const motion_observation *o,
                     rim_interference_verdict *verdict) {
  double ln_b[STATES];
  for (size_t i = 0; i < STATES; ++i) { /* eq. C.3, C.4 */
    double quadratic = 0.0;
    for (size_t k = 0; k < GAUSSIANS; ++k) {
      const double z =
          rimi_clamp((o->value[k] - s->model.mean[i][k]) * s->inverse_sd[i][k], -MOST_Z, MOST_Z);
      quadratic += z * z;
    }
    ln_b[i] = s->ln_norm[i] - 0.5 * quadratic;
  }
  /* eq. C.5 */
  const bool is_standing = rimi_abs(s->command) <= STANDING_MPS;
  ln_b[is_standing ? RIM_MOTION_CONSTANT : RIM_MOTION_STOP] = RIM_HMM_LN_ZERO;
  rim_status taken = rimi_hmm_step(&s->hmm, ln_b);
  if (taken == RIM_E_DATA && s->hmm.steps == 0) { /* under way: it did not begin by standing */
    rimi_hmm_begin_anywhere(&s->hmm);
    taken = rimi_hmm_step(&s->hmm, ln_b);
  }
  if (taken != RIM_OK)
    return;
  verdict->ln_odds = rimi_hmm_ln_odds(&s->hmm, RIM_MOTION_MI);
  verdict->score[RIM_INTERFERENCE_HMM] =
      rimi_max(0.0, 1.0 + (verdict->ln_odds - s->model.ln_odds) * (1.0 / LN_ODDS_UNIT));
  if (verdict->ln_odds < LN_ODDS_QUIET)
    s->hmm_from_s = s->t_s;
  for (uint8_t i = 1; i < STATES; ++i) {
    if (s->hmm.ln_alpha[i] > s->hmm.ln_alpha[verdict->motion])
      verdict->motion = i;
  }
}

/* ---- the alarm ---- */

static uint8_t kind_of(const rim_interference *s, double residual) {
  const double travel = rimi_abs(s->open_loop[0]) > STANDING_MPS ? s->open_loop[0] : s->in_force;
  return travel * residual < 0.0 ? RIM_INTERFERENCE_BLOCKED : RIM_INTERFERENCE_PUSHED;
}

static void judge(rim_interference *s, rim_interference_verdict *verdict) {
  int most = 0;
  for (int i = 1; i < 3; ++i) {
    if (verdict->score[i] > verdict->score[most])
      most = i;
  }
  if (!s->alarmed && verdict->score[most] >= 1.0) {
    s->alarmed = true;
    verdict->raised = true;
    count_up(&s->health.alarms);
    if (most == RIM_INTERFERENCE_HMM) {
      s->onset_s = s->hmm_from_s;
      s->kind = kind_of(s, verdict->residual_mps);
    } else {
      const int side = s->sum[most - 1][1] > s->sum[most - 1][0];
      s->onset_s = s->sum_from_s[most - 1][side];
      s->kind = kind_of(s, side ? 1.0 : -1.0);
    }
  } else if (s->alarmed && verdict->score[most] < CLEAR) {
    s->alarmed = false;
    s->kind = RIM_INTERFERENCE_NONE;
  }
  verdict->alarmed = s->alarmed;
  if (s->alarmed) {
    verdict->kind = s->kind;
    verdict->onset_s = s->onset_s;
    verdict->since_onset_s = s->t_s - s->onset_s;
  }
}

/* Whether the row can be used, and the command it has or had before. */
static bool admit(rim_interference *s, double t_s, double *command, double speed) {
  count_up(&s->health.rows);
  if (!rimi_is_finite(t_s) || !rimi_is_finite(speed)) {
    count_up(&s->health.not_finite);
    return false;
  }
  if (s->started && !(t_s > s->t_s)) {
    count_up(&s->health.time_back);
    return false;
  }
  if (s->started && t_s - s->t_s > s->model.gap_s) {
    count_up(&s->health.gaps);
    rimi_interference_reset(s);
  }
  if (rimi_is_finite(*command)) {
    s->last_command_s = t_s;
    return true;
  }
  count_up(&s->health.no_command);
  *command = s->command;
  if (s->has_command && t_s - s->last_command_s > s->model.gap_s)
    rimi_interference_reset(s);
  return s->has_command;
}

rim_status rimi_interference_step(rim_interference *state, double t_s, double command_mps,
                                  double speed_mps, rim_interference_verdict *verdict) {
  if (state == NULL || verdict == NULL || state->hmm.model.states != STATES)
    return RIM_E_ARGUMENT;
  rim_interference *const s = state;
  memset(verdict, 0, sizeof *verdict);
  verdict->t_s = t_s;
  verdict->ln_odds = RIM_HMM_LN_ZERO;
  double command = command_mps;
  if (!admit(s, t_s, &command, speed_mps))
    return RIM_OK;
  verdict->valid = true;
  note_command(s, t_s, command);
  if (!s->started) {
    s->started = true;
    s->open_loop[0] = s->open_loop[1] = s->speed = speed_mps;
    s->hmm_from_s = s->ramp_until_s = s->t_s = t_s;
  } else {
    double one_step = 0.0;
    predict(s, t_s, &one_step);
    const double below = speed_mps - rimi_min(s->open_loop[0], s->open_loop[1]);
    const double above = speed_mps - rimi_max(s->open_loop[0], s->open_loop[1]);
    verdict->residual_mps = below < 0.0 ? below : rimi_max(above, 0.0);
    verdict->one_step_mps = speed_mps - one_step;
    const double one[2] = {verdict->one_step_mps, verdict->one_step_mps};
    const double open[2] = {below, above};
    verdict->score[RIM_INTERFERENCE_ONE_STEP] = accumulate(s, 0, &s->model.one_step, one, t_s);
    verdict->score[RIM_INTERFERENCE_OPEN_LOOP] = accumulate(s, 1, &s->model.open_loop, open, t_s);
  }
  s->t_s = t_s;
  s->speed = speed_mps;
  s->row_t_s[s->rows % ROWS] = t_s;
  s->row_v[s->rows % ROWS] = speed_mps;
  if (++s->rows == UINT32_MAX)
    s->rows -= UINT32_MAX / 2 / ROWS * ROWS; /* the ring's place stays */
  const motion_observation o = observe(s);
  memcpy(s->observation, o.value, sizeof o.value);
  s->is_observed = o.is_full;
  if (o.is_full)
    step_hmm(s, &o, verdict);
  judge(s, verdict);
  return RIM_OK;
}

bool rimi_interference_observation(const rim_interference *state, double observation[GAUSSIANS]) {
  if (state == NULL || observation == NULL || !state->is_observed)
    return false;
  memcpy(observation, state->observation, sizeof state->observation);
  return true;
}

bool rimi_interference_alarm(const rim_interference_verdict *verdict, uint32_t model_id,
                             uint16_t channel, rim_alarm *candidate) {
  if (verdict == NULL || candidate == NULL)
    return false;
  memset(candidate, 0, sizeof *candidate);
  candidate->detector = RIM_DETECTOR_INTERFERENCE;
  candidate->model_id = model_id;
  candidate->t_s = verdict->t_s;
  candidate->p_value = 1.0;
  if (!verdict->alarmed)
    return false;
  candidate->level = RIM_LEVEL_ERROR;
  candidate->kind = verdict->kind == RIM_INTERFERENCE_PUSHED ? RIM_KIND_PUSHED : RIM_KIND_BLOCKED;
  candidate->since_s = verdict->onset_s;
  candidate->channels = 1;
  candidate->channel[0] = channel;
  candidate->shift[0] = verdict->residual_mps;
  candidate->ln_anom = rimi_clamp(verdict->ln_odds, 0.0, -RIM_HMM_LN_ZERO);
  return true;
}

/* ---- wheels ---- */

/* Ticks from one reading to the next, the shorter way round. */
static double ticks_between(uint32_t before, uint32_t now, uint32_t bits) {
  const uint32_t mask = UINT32_MAX >> (32u - bits);
  const uint32_t up = (now - before) & mask;
  const uint32_t down = (before - now) & mask;
  return up <= down ? (double)up : -(double)down;
}

/* Solves the symmetric 3 x 3 system a x = b by elimination; false where a pivot vanishes. */
static bool solve_3(double a[3][3], double b[3]) {
  for (int k = 0; k < 3; ++k) {
    if (!(a[k][k] > 1e-12))
      return false;
    for (int i = k + 1; i < 3; ++i) {
      const double f = a[i][k] / a[k][k];
      for (int j = k; j < 3; ++j)
        a[i][j] -= f * a[k][j];
      b[i] -= f * b[k];
    }
  }
  for (int k = 2; k >= 0; --k) {
    for (int j = k + 1; j < 3; ++j)
      b[k] -= a[k][j] * b[j];
    b[k] /= a[k][k];
  }
  return true;
}

rim_status rimi_wheels_velocity(const rim_wheels *wheels, const uint32_t before[4],
                                const uint32_t now[4], double dt_s, double velocity[3]) {
  if (wheels == NULL || before == NULL || now == NULL || velocity == NULL)
    return RIM_E_ARGUMENT;
  if (!is_positive(dt_s) || !is_positive(wheels->radius_m) || !is_positive(wheels->tick_m) ||
      wheels->bits < 2 || wheels->bits > 32)
    return RIM_E_DATA;
  double a[3][3] = {{0}}, b[3] = {0};
  for (int w = 0; w < 4; ++w) {
    const uint32_t mask = UINT32_MAX >> (32u - wheels->bits);
    if (before[w] > mask || now[w] > mask)
      return RIM_E_DATA;
    const double row[3] = {-wheels->sine[w], wheels->cosine[w], wheels->radius_m};
    const double speed = ticks_between(before[w], now[w], wheels->bits) * wheels->tick_m / dt_s;
    for (int i = 0; i < 3; ++i) {
      b[i] += row[i] * speed;
      for (int j = 0; j < 3; ++j)
        a[i][j] += row[i] * row[j];
    }
  }
  if (!solve_3(a, b))
    return RIM_E_SINGULAR;
  memcpy(velocity, b, sizeof b);
  return RIM_OK;
}
