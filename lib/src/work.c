#include "rim/work.h"

#include "rim/alarm.h"
#include "rim/correct.h"
#include "rim/image.h"
#include "rim/interference.h"
#include "rim/monitor.h"
#include "rim/nominal.h"
#include "rim/real.h"
#include "select_private.h"

/* Instructions of one turn of a loop, at most: read from the listing of gcc 12 -O2 for the
 * Cortex-M7, the longest way through, calls included. */
enum {
  VALUE = 30,        /* a feature looked at, summed, copied */
  OUTCOME = 120,     /* a residual gathered, clipped, squared */
  STANDARDISE = 24,  /* of a model's input */
  DISTANCE = 16,     /* one input of one prototype */
  KEEP = 24,         /* a prototype against those kept, each */
  PRODUCT = 16,      /* one input of one local map */
  EXPONENTIAL = 180, /* rim_exp, rim_log, and what is done with them */
  ROOT = 260,        /* rim_sqrt likewise */
  CORRECTED = 2000,  /* 8 regions of 3 features */
  PREFIX = 40,       /* a bin's prefix sums */
  END = 36,          /* a bin as an end of intervals, of either sign */
  INTERVAL = 24,     /* a hypothesis */
  BOUND = 30,        /* a bin's share in what intervals can reach at most */
  SPREAD = 70,       /* one with an envelope */
  LOOK = 40,         /* a comparison of scores */
  MASK = 20,         /* a point of the ring against the base */
  POINT = 36,        /* a point into a conditional bin */
  EVIDENCE = 45,     /* ln anom of an ellipse, and compared */
  SCATTER = 1000,    /* a new ellipse near an offer: two roots, five random numbers */
  GRID_ROW = 125,    /* of an ellipse: its span, its sums */
  ELLIPSE = 300,     /* beside its rows */
  PROPOSAL = 700,    /* four random numbers, five coordinates */
  CELL = 12,         /* of a grid, cleared or passed over */
  PUT = 50,          /* a point of the ring into a grid or a list */
  ADD = 24,          /* a cell's sums */
  INSIDE = 60,       /* a point against an ellipse or region */
  JUDGE = 260,       /* a new point against an ellipse on the grid */
  PLACE = 130,       /* a feature into its units and its cell */
  SCORE = 120,       /* a channel's score against its threshold */
  CALLS = 3000       /* everything outside of loops */
};

/* Sums in double: exact, and no target needs its compiler's help for a product of 64 bits. */
static double chains(const rim_work_counts *n) {
  return n->edges < FEW_EDGES ? FEW_CHAINS : RIM_SELECT_CHAINS;
}

static double intervals(double bins) { return bins * (bins + 1.0) / 2.0; }

static double prediction(const rim_work_counts *n, const rim_work_model *m) {
  if (m->prototypes == 0)
    return 0;
  const double d = n->features;
  return d * STANDARDISE + m->prototypes * (d * DISTANCE + m->top * (double)KEEP) +
         m->top * (double)EXPONENTIAL +
         n->outcomes * (m->top * d * PRODUCT + m->top * (double)PRODUCT + ROOT) +
         (n->corrected ? CORRECTED + n->outcomes * (double)ADD : 0.0);
}

static double row_work(const rim_work_counts *n) {
  const double watch = n->watched ? 25u * PRODUCT + 16u * EXPONENTIAL + CALLS : 0.0;
  return CALLS + n->features * (double)VALUE + n->outcomes * (double)OUTCOME +
         prediction(n, &n->step) + watch;
}

/* The most anomalous interval of a feature and channel. */
static double interval_work(const rim_work_counts *n) {
  const double hypotheses = n->envelope
                                ? 2u * intervals(n->bins) * SPREAD
                                : intervals(n->bins) * INTERVAL +
                                      2u * n->bins * (double)(END + BOUND);
  return n->bins * (double)PREFIX + hypotheses;
}

static double ellipse_work(const rim_work_counts *n) {
  return ELLIPSE + n->grid * (double)GRID_ROW;
}

static bool is_corrected_by_ring(const rim_work_counts *n) { return n->edges >= FEW_EDGES; }

/* What an ellipse of the leader costs beyond the grid: rim_select_pool's stage 2. */
static double ring_work(const rim_work_counts *n) {
  return is_corrected_by_ring(n) ? n->ring * (double)INSIDE + n->grid * (double)n->grid * CELL +
                                       n->grid * (double)GRID_ROW
                                 : 0.0;
}

static double evidences(const rim_work_counts *n) {
  return chains(n) * n->pairs * EVIDENCE + n->channels * (double)LOOK;
}

static double sweep_work(const rim_work_counts *n) {
  const double conditional =
      n->ring * (double)POINT + EDGE_BINS * (PREFIX + 2u * END + 3u * BOUND) +
      intervals(EDGE_BINS) * INTERVAL;
  const double base = n->region_features * (double)n->channels * LOOK + n->ring * (double)MASK;
  const double offers = (n->edges + SHEARS) / (1u + SHEARS) + 1u;
  const double offer =
      SCATTER + ellipse_work(n) + ring_work(n) + 2u * chains(n) * EVIDENCE +
      n->pairs * (double)LOOK;
  return BASES_A_UNIT * base + n->edges * (double)n->pairs * LOOK +
         (n->edges + SHEARS) * conditional + offers * offer;
}

static double enter_work(const rim_work_counts *n) {
  const double cells = n->grid * (n->grid + 1.0);
  const double once =
      cells * (CELL + ADD) + n->ring * (double)PUT + chains(n) * (SCATTER + ellipse_work(n));
  return (is_corrected_by_ring(n) ? ENTRIES_A_UNIT : 1u) * once;
}

static double move_work(const rim_work_counts *n) {
  const double move = PROPOSAL + ellipse_work(n) + 2u * EXPONENTIAL + 4u * EVIDENCE + ring_work(n);
  const double looks = (n->moves / 12u + 2u) * 3u + 2u * n->pairs + 1u;
  double work = n->moves * move + looks * chains(n) * EVIDENCE;
  if (is_corrected_by_ring(n)) /* another pair leads: the old one goes back to the grid */
    work += 2u * chains(n) * ellipse_work(n) + chains(n) * ring_work(n) + n->ring * (double)PUT +
            n->grid * (double)n->grid * CELL;
  return work;
}

/* With few edges no ellipse moves in the unit in which a pair enters. */
static double enter_and_move_work(const rim_work_counts *n) {
  const double enter = enter_work(n);
  const double move = move_work(n);
  return is_corrected_by_ring(n) ? enter + move : rim_max(enter, move);
}

static double search_work(const rim_work_counts *n) {
  const double slices = n->region_features * (double)n->channels;
  const double scans = n->scans < slices ? n->scans : slices;
  double unit =
      CALLS + scans * (interval_work(n) + n->region_features * (double)LOOK) + evidences(n);
  if (n->pairs > 0)
    unit += sweep_work(n) + evidences(n) + enter_and_move_work(n);
  return n->budget * unit;
}

static double block_work(const rim_work_counts *n) {
  const double models = prediction(n, &n->level) + prediction(n, &n->increment);
  const double channels = n->channels * (double)(OUTCOME + EXPONENTIAL);
  const double tables = n->region_features * (PLACE + n->channels * (double)ADD);
  const double grids = n->pairs * (n->grid * (double)ADD + chains(n) * JUDGE);
  const double leader = is_corrected_by_ring(n) && n->pairs > 0
                            ? 2u * chains(n) * (ellipse_work(n) + INSIDE) + n->ring * (double)CELL
                            : 0.0;
  return CALLS + models + channels + tables + grids + leader + evidences(n);
}

static double judge_work(const rim_work_counts *n) {
  const double best = interval_work(n) + evidences(n) + 4u * ROOT;
  return CALLS + n->channels * (double)SCORE + 4u * EXPONENTIAL +
         n->ring * (double)(INSIDE + VALUE) +
         RIM_ALARM_MAX_CHANNELS * (best + n->channels * (double)(SCORE + EXPONENTIAL));
}

static double halving_work(const rim_work_counts *n) {
  const double cells = n->grid * (n->grid + 1.0);
  return n->region_features * (double)n->bins * (n->channels + 1.0) * ADD +
         n->pairs * (cells * ADD + chains(n) * (ellipse_work(n) + ring_work(n)));
}

static uint32_t saturated(double work) { return work < UINT32_MAX ? (uint32_t)work : UINT32_MAX; }

void rim_work_bound(const rim_work_counts *counts, rim_work *work) {
  if (counts == NULL || work == NULL)
    return;
  const double row = row_work(counts);
  const double search = search_work(counts);
  const double block = block_work(counts);
  const double judge = judge_work(counts);
  work->row = saturated(row);
  work->search = saturated(search);
  work->block = saturated(block);
  work->judge = saturated(judge);
  work->step = saturated(row + search + block + judge);
  work->halving = saturated(halving_work(counts));
}

static bool section_of(const rim_image *image, uint32_t id, const uint8_t **section,
                       size_t *bytes) {
  return rim_image_section(image, id, section, bytes) == RIM_OK;
}

static rim_work_model model_of(const rim_image *image, uint32_t id) {
  const uint8_t *section;
  size_t bytes;
  rim_nominal model;
  rim_work_model counts = {0, 0};
  if (section_of(image, id, &section, &bytes) && rim_nominal_open(&model, section, bytes) == RIM_OK)
    counts = (rim_work_model){model.prototypes, model.top};
  return counts;
}

static uint32_t or_default(uint32_t value, uint32_t fallback) {
  return value != 0 ? value : fallback;
}

static uint32_t kinds_in(uint32_t mask) {
  uint32_t n = 0;
  for (; mask != 0; mask &= mask - 1u)
    ++n;
  return n;
}

rim_status rim_work_counts_of(const void *image, size_t image_bytes, rim_work_counts *counts) {
  size_t size, bytes;
  const uint8_t *word, *other;
  rim_image view;
  if (counts == NULL)
    return RIM_E_ARGUMENT;
  rim_status status = rim_monitor_size(image, image_bytes, &size); /* validates all of it */
  if (status == RIM_OK)
    status = rim_image_open(&view, image, image_bytes);
  if (status == RIM_OK)
    status = rim_image_section(&view, RIM_SECTION_CONFIG, &word, &bytes);
  if (status != RIM_OK)
    return status;
  rim_work_counts n = {
      .features = rim_image_u32(word, RIM_CONFIG_FEATURES),
      .outcomes = rim_image_u32(word, RIM_CONFIG_OUTCOMES),
      .region_features = rim_image_u32(word, RIM_CONFIG_REGION_FEATURES),
      .ring = or_default(rim_image_u32(word, RIM_CONFIG_RING), RIM_SELECT_DEFAULT_RING),
      .bins = or_default(rim_image_u32(word, RIM_CONFIG_BINS), RIM_SELECT_DEFAULT_BINS),
      .grid = or_default(rim_image_u32(word, RIM_CONFIG_GRID), RIM_SELECT_DEFAULT_GRID),
      .pairs = or_default(rim_image_u32(word, RIM_CONFIG_PAIRS), RIM_SELECT_DEFAULT_PAIRS),
      .scans = or_default(rim_image_u32(word, RIM_CONFIG_SCANS), RIM_SELECT_DEFAULT_SCANS),
      .edges = or_default(rim_image_u32(word, RIM_CONFIG_EDGES), RIM_SELECT_DEFAULT_EDGES),
      .moves = or_default(rim_image_u32(word, RIM_CONFIG_MOVES), RIM_SELECT_DEFAULT_MOVES),
      .budget = or_default(rim_image_u32(word, RIM_CONFIG_BUDGET), 1),
      .block_rows = rim_image_u32(word, RIM_CONFIG_BLOCK_ROWS),
      .external = rim_image_u32(word, RIM_CONFIG_EXTERNAL) != 0,
  };
  n.channels = n.outcomes * kinds_in(rim_image_u32(word, RIM_CONFIG_KINDS));
  n.envelope = section_of(&view, RIM_SECTION_ENVELOPE, &other, &bytes);
  n.corrected = section_of(&view, RIM_SECTION_CORRECT, &other, &bytes);
  n.watched = section_of(&view, RIM_SECTION_INTERFERENCE, &other, &bytes);
  if (n.envelope || n.region_features < 2)
    n.pairs = 0;
  n.step = model_of(&view, RIM_SECTION_STEP);
  n.level = model_of(&view, RIM_SECTION_LEVEL);
  n.increment = model_of(&view, RIM_SECTION_INCREMENT);
  *counts = n;
  return RIM_OK;
}
