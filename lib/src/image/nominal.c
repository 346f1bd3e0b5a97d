/* SPDX-License-Identifier: MIT */
#include "image/nominal.h"

#include <stdbool.h>
#include <string.h>

#include "base/bytes.h"
#include "base/real.h"
#include "base/usable.h"
#include "rim/image.h"

/* Word offsets of a prototype's scalars. */
enum { P_BANDWIDTH = 0, P_REACH = 1, P_LN_MASS = 2, P_RESERVED = 3, P_CENTRE = 4 };

/* What the gate decided for one context. */
typedef struct gate {
  uint32_t index[RIM_NOMINAL_MAX_TOP];
  double weight[RIM_NOMINAL_MAX_TOP]; /* sums to 1 */
  double extrapolation;
} gate;

static double value_at(const rim_nominal *m, size_t word) {
  return (double)rimi_le_f32(m->section, word);
}

static size_t inputs_at(const rim_nominal *m, uint32_t block) {
  return RIM_NOMINAL_HEADER_WORDS + (size_t)block * m->inputs;
}

static size_t prototype_at(const rim_nominal *m, uint32_t p) {
  return inputs_at(m, 3u) + (size_t)p * m->stride;
}

static bool in_range(uint32_t value, uint32_t low, uint32_t high) {
  return value >= low && value <= high;
}

static const uint8_t *word_at(const rim_nominal *m, size_t word) { return m->section + 4u * word; }

static bool gate_weights_ok(const rim_nominal *m) {
  for (uint32_t i = 0; i < m->inputs; ++i) {
    const double g = value_at(m, inputs_at(m, 2u) + i);
    if (!rimi_is_finite(g) || g < 0.0) {
      return false;
    }
  }
  return true;
}

static bool prototype_ok(const rim_nominal *m, uint32_t p) {
  const size_t at = prototype_at(m, p);
  const size_t variance = at + P_CENTRE + m->inputs;
  const size_t rest = variance + m->outputs;
  return numbers_are_positive(word_at(m, at + P_BANDWIDTH), 2) &&
         numbers_are_finite(word_at(m, at + P_LN_MASS), 1) &&
         rimi_le_u32(m->section, at + P_RESERVED) == 0u &&
         numbers_are_finite(word_at(m, at + P_CENTRE), m->inputs) &&
         numbers_are_positive(word_at(m, variance), m->outputs) &&
         numbers_are_finite(word_at(m, rest), at + m->stride - rest);
}

static rim_status read_header(rim_nominal *m, const uint8_t *section) {
  m->section = section;
  if (rimi_le_u32(section, 0) != RIM_NOMINAL_LAYOUT) {
    return RIM_E_VERSION;
  }
  m->inputs = rimi_le_u32(section, 1);
  m->outputs = rimi_le_u32(section, 2);
  m->prototypes = rimi_le_u32(section, 3);
  m->top = rimi_le_u32(section, 4);
  m->order = rimi_le_u32(section, 5);
  if (!in_range(m->inputs, 1, RIM_NOMINAL_MAX_INPUTS) ||
      !in_range(m->outputs, 1, RIM_NOMINAL_MAX_OUTPUTS) ||
      !in_range(m->prototypes, 1, RIM_NOMINAL_MAX_PROTOTYPES) ||
      !in_range(m->top, 1, RIM_NOMINAL_MAX_TOP) || m->top > m->prototypes || m->order > 1u ||
      rimi_le_u32(section, 6) != 0u || rimi_le_u32(section, 7) != 0u) {
    return RIM_E_RANGE;
  }
  m->stride = RIM_NOMINAL_STRIDE(m->inputs, m->outputs, m->order);
  return RIM_OK;
}

rim_status rimi_nominal_open(rim_nominal *model, const uint8_t *section, size_t bytes) {
  rim_nominal m;
  if (model == NULL || section == NULL) {
    return RIM_E_ARGUMENT;
  }
  if (((uintptr_t)section & 3u) != 0u) {
    return RIM_E_ALIGN;
  }
  if (bytes < 4u * RIM_NOMINAL_HEADER_WORDS) {
    return RIM_E_TRUNCATED;
  }
  const rim_status status = read_header(&m, section);
  if (status != RIM_OK) {
    return status;
  }
  /* At most 4 (8 + 3*128 + 64*16772) bytes: far from overflow. */
  const size_t need = 4u * prototype_at(&m, m.prototypes);
  if (bytes != need) {
    return bytes < need ? RIM_E_TRUNCATED : RIM_E_SIZE;
  }
  bool ok = numbers_are_finite(word_at(&m, inputs_at(&m, 0)), m.inputs) &&
            numbers_are_positive(word_at(&m, inputs_at(&m, 1u)), m.inputs) && gate_weights_ok(&m);
  for (uint32_t p = 0; ok && p < m.prototypes; ++p) {
    ok = prototype_ok(&m, p);
  }
  if (!ok) {
    return RIM_E_DATA;
  }
  *model = m;
  return RIM_OK;
}

/* False when an input is not finite. Clamping bounds every product below: |xs| <= 1e6, f32 factors.
 */
static bool standardise(const rim_nominal *m, const double *x, double *xs) {
  const size_t centre = inputs_at(m, 0);
  const size_t scale = inputs_at(m, 1u);
  for (uint32_t i = 0; i < m->inputs; ++i) {
    if (!rimi_is_finite(x[i])) {
      return false;
    }
    const double v = (x[i] - value_at(m, centre + i)) * value_at(m, scale + i);
    xs[i] = rimi_min(rimi_max(v, -RIM_NOMINAL_MAX_STANDARDISED), RIM_NOMINAL_MAX_STANDARDISED);
  }
  return true;
}

static double squared_distance(const rim_nominal *m, uint32_t p, const double *xs) {
  const size_t weight = inputs_at(m, 2u);
  const size_t centre = prototype_at(m, p) + P_CENTRE;
  double sum = 0.0;
  for (uint32_t i = 0; i < m->inputs; ++i) {
    const double d = value_at(m, weight + i) * (xs[i] - value_at(m, centre + i));
    sum += d * d;
  }
  return sum;
}

/* Puts p with its logit among the best `count` of at most `top`, best first; returns the new count.
 */
static uint32_t keep_best(gate *g, uint32_t count, uint32_t top, uint32_t p, double logit) {
  uint32_t at = count;
  while (at > 0u && logit > g->weight[at - 1u]) {
    --at;
  }
  if (at >= top) {
    return count;
  }
  for (uint32_t i = count < top ? count : top - 1u; i > at; --i) {
    g->weight[i] = g->weight[i - 1u];
    g->index[i] = g->index[i - 1u];
  }
  g->weight[at] = logit;
  g->index[at] = p;
  return count < top ? count + 1u : top;
}

/* Logits are kept in g->weight until they are turned into weights at the end. */
static void open_gate(const rim_nominal *m, const double *xs, gate *g) {
  uint32_t count = 0;
  uint32_t nearest = 0;
  double nearest_d2 = 0.0;
  for (uint32_t p = 0; p < m->prototypes; ++p) {
    const size_t at = prototype_at(m, p);
    const double h = value_at(m, at + P_BANDWIDTH);
    const double d2 = squared_distance(m, p, xs);
    if (p == 0u || d2 < nearest_d2) {
      nearest = p;
      nearest_d2 = d2;
    }
    count = keep_best(g, count, m->top, p, value_at(m, at + P_LN_MASS) - d2 / (2.0 * h * h));
  }
  g->extrapolation = rimi_sqrt(nearest_d2) / value_at(m, prototype_at(m, nearest) + P_REACH);
  const double largest = g->weight[0];
  double sum = 0.0;
  for (uint32_t k = 0; k < m->top; ++k) {
    g->weight[k] = rimi_exp(g->weight[k] - largest);
    sum += g->weight[k];
  }
  for (uint32_t k = 0; k < m->top; ++k) {
    g->weight[k] /= sum;
  }
}

/* What prototype p says of outcome o. */
static double local_value(const rim_nominal *m, uint32_t p, uint32_t o, const double *xs) {
  const size_t offset = prototype_at(m, p) + P_CENTRE + m->inputs + m->outputs;
  double sum = value_at(m, offset + o);
  if (m->order != 0u) {
    const size_t row = offset + m->outputs + (size_t)o * m->inputs;
    for (uint32_t i = 0; i < m->inputs; ++i) {
      sum += value_at(m, row + i) * xs[i];
    }
  }
  return sum;
}

static void predict_outcome(const rim_nominal *m, const gate *g, const double *xs, uint32_t o,
                            double *mean, double *sd) {
  double value[RIM_NOMINAL_MAX_TOP];
  double sum = 0.0;
  double variance = 0.0;
  for (uint32_t k = 0; k < m->top; ++k) {
    const size_t at = prototype_at(m, g->index[k]) + P_CENTRE + m->inputs;
    value[k] = local_value(m, g->index[k], o, xs);
    sum += g->weight[k] * value[k];
    variance += g->weight[k] * value_at(m, at + o);
  }
  for (uint32_t k = 0; m->order == 0u && k < m->top; ++k) {
    variance += g->weight[k] * (value[k] - sum) * (value[k] - sum);
  }
  *mean = sum;
  *sd = rimi_sqrt(variance);
}

rim_status rimi_nominal_predict(const rim_nominal *model, const double *x, double *mean, double *sd,
                                double *extrapolation) {
  double xs[RIM_NOMINAL_MAX_INPUTS];
  gate g;
  if (model == NULL || model->section == NULL || x == NULL || mean == NULL || sd == NULL) {
    return RIM_E_ARGUMENT;
  }
  if (!standardise(model, x, xs)) {
    return RIM_E_DATA;
  }
  open_gate(model, xs, &g);
  for (uint32_t o = 0; o < model->outputs; ++o) {
    predict_outcome(model, &g, xs, o, &mean[o], &sd[o]);
  }
  if (extrapolation != NULL) {
    *extrapolation = g.extrapolation;
  }
  return RIM_OK;
}

rim_status rimi_nominal_beyond(const rim_nominal *model, const double *x, const uint16_t *own,
                               bool *beyond) {
  double xs[RIM_NOMINAL_MAX_INPUTS];
  float nearest[RIM_NOMINAL_MAX_OUTPUTS]; /* squared distance */
  if (model == NULL || model->section == NULL || x == NULL || own == NULL || beyond == NULL)
    return RIM_E_ARGUMENT;
  if (!standardise(model, x, xs))
    return RIM_E_DATA;
  const size_t weight = inputs_at(model, 2u);
  for (uint32_t p = 0; p < model->prototypes; ++p) {
    const double all = squared_distance(model, p, xs);
    const size_t at = prototype_at(model, p);
    const double reach = RIM_NOMINAL_BELIEVED * value_at(model, at + P_REACH);
    for (uint32_t o = 0; o < model->outputs; ++o) {
      const uint32_t i = own[o] < model->inputs ? own[o] : 0u;
      const double of_own =
          value_at(model, weight + i) * (xs[i] - value_at(model, at + P_CENTRE + i));
      const float rest = (float)(all - of_own * of_own);
      if (p > 0u && !(rest < nearest[o]))
        continue;
      nearest[o] = rest;
      beyond[o] = (double)rest > reach * reach;
    }
  }
  return RIM_OK;
}
