/* SPDX-License-Identifier: MIT */
#include "monitor/work.h"

#include "base/bytes.h"
#include "base/real.h"
#include "image/basis.h"
#include "image/correct.h"
#include "image/nominal.h"
#include "image/quadratic.h"
#include "image/rolled.h"
#include "monitor/cause.h"
#include "rim/alarm.h"
#include "rim/image.h"
#include "rim/interference.h"
#include "rim/monitor.h"
#include "search/search.h"
#include "search/select_private.h"

/* Instructions of one turn of a loop, at most: read from the listing of gcc 12 -O2 for the
 * Cortex-M7, the longest way through, calls included. */
enum {
  VALUE = 60,        /* a feature looked at, limited, unwrapped, summed */
  OUTCOME = 160,     /* an outcome gathered, clipped, squared */
  INTEGRAND = 300,   /* a product, with the cosine of an angle, summed */
  FILTER = 24,       /* a command into an exponential mean */
  TERM = 90,         /* of a model, standardised */
  RATE = 220,        /* of a rolled state: three products, a sum, twice */
  STANDARDISE = 24,  /* of a model's input */
  DISTANCE = 16,     /* one input of one prototype */
  KEEP = 24,         /* a prototype against those kept, each */
  PRODUCT = 16,      /* a multiply-add of numbers in memory */
  EXPONENTIAL = 180, /* rimi_exp, rimi_log, and what is done with them */
  ROOT = 260,        /* rimi_sqrt likewise */
  CORRECTED = 2000,  /* 8 regions of 3 features */
  PREFIX = 40,       /* a bin's prefix sums */
  END = 36,          /* a bin as an end of intervals, of either sign */
  INTERVAL = 24,     /* a hypothesis */
  LOOK = 40,         /* a comparison of scores */
  MASK = 40,         /* a point of the ring against a region */
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
  GATHER = 50,       /* a block of the ring into sums, beside its fields */
  JUDGED = 520,      /* a hypothesis: a root, three quotients, noted */
  CALLS = 3000       /* everything outside of loops */
};

/* Sums in double: exact, and no target needs its compiler's help for a product of 64 bits. */
#define CHAINS ((double)RIM_SELECT_CHAINS)

static double intervals(double bins) { return bins * (bins + 1.0) / 2.0; }

static double products(const rim_work_counts *n) { /* inputs, and a multiply-add per term */
  const double inputs = n->quadratic_inputs;
  return inputs * (LOOK + (double)EXPONENTIAL + STANDARDISE) + n->quadratic_terms * (double)PRODUCT;
}

static double prediction(const rim_work_counts *n) {
  if (n->prototypes == 0)
    return 0;
  const double d = (double)n->features + n->angles;
  const double inputs = n->features * (double)LOOK + 2.0 * n->angles * (double)EXPONENTIAL;
  return 2.0 * inputs + d * STANDARDISE + n->prototypes * (d * DISTANCE + n->top * (double)KEEP) +
         n->top * (double)EXPONENTIAL +
         n->outcomes * (n->top * d * PRODUCT + n->top * (double)PRODUCT + ROOT) +
         d * STANDARDISE + /* rimi_nominal_beyond() */
         n->prototypes * (d * DISTANCE + n->outcomes * (double)(DISTANCE + LOOK));
}

static double correction(const rim_work_counts *n) {
  return n->corrected ? CORRECTED + n->outcomes * (double)ADD : 0.0;
}

/* After a gap: the integrands and inputs of the row before it, and what the states lose by it. */
static double gap(const rim_work_counts *n) {
  const double lost = n->inputs > 0 ? n->inputs * (double)INTEGRAND + n->rates * RATE + ROOT : 0.0;
  return n->integrands * (double)INTEGRAND + lost;
}

static double row_work(const rim_work_counts *n) {
  const double watch = n->watched ? 25u * PRODUCT + 16u * EXPONENTIAL + CALLS : 0.0;
  return CALLS + n->features * (double)VALUE + n->outcomes * (double)OUTCOME +
         n->integrands * (double)INTEGRAND + n->inputs * (INTEGRAND + n->times * (double)FILTER) +
         n->times * (double)FILTER + gap(n) + (n->external ? correction(n) : 0.0) + watch;
}

/* ---- section NOISE: src/search ---- */

static double raw_fields(const rim_work_counts *n) { /* and the channel's combinations of them */
  return 2u * EXPONENTIAL + n->means * (double)PRODUCT +
         n->fields * (4.0 + n->means) * (double)PRODUCT;
}
static double triangle(const rim_work_counts *n) { return n->fields * (n->fields + 1.0) / 2.0; }

static double pass(const rim_work_counts *n, double each) {
  return n->ring * (MASK + GATHER + n->fields * (double)PRODUCT + each);
}
static double binned(const rim_work_counts *n) {
  const double bins = SEARCH_BINS, all = bins * (bins + 1.0) / 2.0;
  return CALLS + 256u * CELL + pass(n, ADD) + all * (INTERVAL + n->fields * (double)PRODUCT) +
         all * CELL + pass(n, 0.0) + JUDGED;
}
static double ready_work(const rim_work_counts *n) {
  const double white = 2u * EXPONENTIAL + raw_fields(n) + triangle(n) * PRODUCT + 2u * GATHER;
  const double times = 3u * (JUDGED + n->fields * 2.0 * PRODUCT);
  const double taken_out = pass(n, white + triangle(n) * PRODUCT); /* rimi_search_exclude() */
  return CALLS + taken_out + triangle(n) * (n->fields + 2.0) * PRODUCT + pass(n, white) +
         pass(n, GATHER) + pass(n, times) + pass(n, raw_fields(n));
}
static double renew_work(const rim_work_counts *n) {
  return pass(n, 0.0) + 2u * binned(n) + pass(n, JUDGED);
}
static double pair_work(const rim_work_counts *n) {
  const double cells = SEARCH_CELLS, strips = cells * (cells + 1.0) / 2.0;
  const double sums = 4u * ADD + n->fields * (double)PRODUCT;
  return 512u * CELL + pass(n, ADD) + strips * (cells + strips) * sums + renew_work(n);
}
static double trained_search(const rim_work_counts *n) {
  const double since = binned(n) + 2u * (pass(n, JUDGED) + binned(n));
  const double during = binned(n) + 3u * pass(n, JUDGED);
  const double renewed = 3u * pass(n, JUDGED) + renew_work(n); /* a time, and a region beside it */
  const double most = rimi_max(rimi_max(ready_work(n), since), rimi_max(renewed, pair_work(n)));
  return n->budget * (CALLS + n->channels * (double)LOOK + rimi_max(most, during));
}
static double trained_block(const rim_work_counts *n) {
  const double o = n->outcomes;
  const double unknown =
      n->external ? 0.0 /* what commands are not known, of every channel */
                  : 2.0 * o * (n->terms * (double)PRODUCT + ROOT) +
                        o * (o * (2.0 + n->means) * PRODUCT + ROOT) + n->terms * (double)TERM +
                        /* After a gap, and in a run that is longer than the healthy ones. */
                        2u * o * (n->terms + 3.0 * BASIS_MAX_STATES * n->rates) * LOOK +
                        3u * n->times * (double)EXPONENTIAL +
                        n->features * n->outcomes * (double)CELL + n->channels * (double)GATHER +
                        /* A run's first block against later ones, feature by feature. */
                        n->features * (2.0 * n->features * ADD + 2.0 * EXPONENTIAL + 2.0 * LOOK);
  const double models = 2.0 * o * (n->external ? 1.0 : n->terms) * PRODUCT +
                        o * o * (2.0 + n->means) * PRODUCT + prediction(n) + products(n) + unknown +
                        (n->external ? 0.0 : correction(n));
  const double taken = 2u * (raw_fields(n) + EXPONENTIAL) + triangle(n) * PRODUCT;
  const double channel = 4u * EXPONENTIAL + 2u * taken + 2u * OUTCOME; /* let go, limited */
  return models + n->rates * (double)(ROLLED_PARTS * RATE) + n->terms * (double)TERM +
         n->channels * channel + n->region_features * (double)PLACE;
}
/* rimi_search_date(): five shapes summed, five models judged per block; then three families. */
static double date_work(const rim_work_counts *n) {
  const double summed = 5u * (n->fields + 6.0) * PRODUCT;
  const double judged = (6.0 * n->fields + 24.0) * PRODUCT + 2u * EXPONENTIAL + JUDGED;
  return pass(n, summed + 5u * judged) + 3u * (pass(n, summed) + judged);
}
static double trained_judge(const rim_work_counts *n) {
  /* Of the channel, and of its agreement; rimi_search_place(). */
  const double place = 4u * binned(n);
  const double explain = 2u * ready_work(n) + 7u * renew_work(n) + 2u * place +
                         8u * pass(n, JUDGED + EXPONENTIAL) + 2u * date_work(n);
  /* Of both, a shift and a gain: four features since an onset, and a round of edges and onset of
   * the best; and on which side of 0 the outcome is inside. */
  const double since = 4u * (4u * binned(n) + renew_work(n)) + 4u * pass(n, GATHER);
  /* Which of two signs is meant: what lies beside, three times; what came and went, twice; the
   * baselines of five. */
  const double beside = ready_work(n) + 4u * pass(n, JUDGED) + 2u * binned(n);
  const double passed = ready_work(n) + binned(n) + 4u * pass(n, JUDGED) + place;
  const double contrary = 3u * beside + 2u * passed + 5u * pass(n, JUDGED);
  /* A rate: an eighth of the features since an onset, each block with all bins; the best refined,
   * and at any time. What it was, and its mean. */
  const double each = binned(n) + pass(n, SEARCH_BINS * (double)PRODUCT);
  const double rate =
      2u * ((n->region_features / 8.0 + 4.0) * each + 2u * ready_work(n)) + 3u * pass(n, JUDGED);
  const double causes = rimi_min(2u * (double)n->integrands, 2u * (double)AGREEMENT_INTEGRANDS);
  const double twins = n->integrands > 0 ? 2.0 * CAUSE_SUMS + 1.0 : 0.0;
  return explain + since + contrary + rate +
         (2.0 * causes + CAUSE_TOGETHER + CAUSE_READINGS + CAUSE_COMPARED + 1.0 + twins) *
             (ready_work(n) + pass(n, 0.0)) +
         (2u + RIM_ALARM_MAX_CHANNELS) * (double)n->channels * SCORE;
}

/* ---- without it: src/select ---- */

/* The most anomalous interval of a feature and channel. */
static double interval_work(const rim_work_counts *n) {
  return n->bins * (double)PREFIX + intervals(n->bins) * INTERVAL + 2u * n->bins * (double)END;
}

static double ellipse_work(const rim_work_counts *n) {
  return ELLIPSE + n->grid * (double)GRID_ROW;
}

static bool is_corrected_by_ring(const rim_work_counts *n) { return !n->small; }

/* What an ellipse of the leader costs beyond the grid: rim_select_pool's stage 2. */
static double ring_work(const rim_work_counts *n) {
  return is_corrected_by_ring(n) ? n->ring * (double)INSIDE + n->grid * (double)n->grid * CELL +
                                       n->grid * (double)GRID_ROW
                                 : 0.0;
}

static double evidences(const rim_work_counts *n) {
  return CHAINS * n->pairs * EVIDENCE + n->channels * (double)LOOK;
}

/* At most; select_unit_work. */
static uint32_t unit_work(const rim_work_counts *n, uint32_t configured) {
  return n->small ? SMALL_FIRST_WORK * configured : configured;
}

static double sweep_work(const rim_work_counts *n) {
  const double conditional =
      n->ring * (double)POINT + EDGE_BINS * (PREFIX + 2u * END) + intervals(EDGE_BINS) * INTERVAL;
  const double base = n->region_features * (double)n->channels * LOOK + n->ring * (double)MASK;
  const uint32_t each = SELECT_EDGE_INTERVALS;
  const uint32_t edges = unit_work(n, n->edges);
  /* Read with the others of a word: when a base begins, and where the budget ends. */
  const uint32_t unused = (BASES_A_UNIT + 1u) * (SELECT_AT_ONCE - 1u);
  const double offers = (edges + each - 1u) / each + 1u;
  const double offer =
      SCATTER + ellipse_work(n) + ring_work(n) + 2u * CHAINS * EVIDENCE + n->pairs * (double)LOOK;
  return BASES_A_UNIT * base + edges * (double)n->pairs * LOOK +
         (edges + each - 1u + unused) * conditional + offers * offer;
}

static double enter_work(const rim_work_counts *n) {
  const double cells = n->grid * (n->grid + 1.0);
  const double once =
      cells * (CELL + ADD) + 2u * n->ring * (double)PUT + CHAINS * (SCATTER + ellipse_work(n));
  return (is_corrected_by_ring(n) ? ENTRIES_A_UNIT : 1u) * once;
}

static double move_work(const rim_work_counts *n) {
  const double move = PROPOSAL + ellipse_work(n) + 2u * EXPONENTIAL + 4u * EVIDENCE + ring_work(n);
  const uint32_t moves = unit_work(n, n->moves);
  const double looks = (moves / 12u + 2u) * 3u + 2u * n->pairs + 1u;
  double work = moves * move + looks * CHAINS * EVIDENCE;
  if (is_corrected_by_ring(n)) /* another pair leads: the old one goes back to the grid */
    work += 2u * CHAINS * ellipse_work(n) + CHAINS * ring_work(n) + n->ring * (double)PUT +
            n->grid * (double)n->grid * CELL;
  return work;
}

/* In the small profile no ellipse moves in the unit in which a pair enters. */
static double enter_and_move_work(const rim_work_counts *n) {
  const double enter = enter_work(n);
  const double move = move_work(n);
  return is_corrected_by_ring(n) ? enter + move : rimi_max(enter, move);
}

static double rows_search(const rim_work_counts *n) {
  const double slices = n->region_features * (double)n->channels;
  const double scans = n->scans < slices ? n->scans : slices;
  double unit =
      CALLS + scans * (interval_work(n) + n->region_features * (double)LOOK) + evidences(n);
  if (n->pairs > 0)
    unit += sweep_work(n) + evidences(n) + enter_and_move_work(n);
  return n->budget * unit;
}

/* Every grid's units grow, or its sums are halved, and every ellipse is evaluated again. */
static double grids_anew(const rim_work_counts *n) {
  const double cells = n->grid * (n->grid + 1.0);
  return n->pairs * (cells * ADD + CHAINS * ellipse_work(n)) + CHAINS * ring_work(n);
}

static double rows_block(const rim_work_counts *n) {
  const double tables = n->region_features * (PLACE + n->channels * (double)ADD);
  const double grids = n->pairs * (n->grid * (double)ADD + CHAINS * JUDGE);
  const double leader = is_corrected_by_ring(n) && n->pairs > 0
                            ? 2u * CHAINS * (ellipse_work(n) + INSIDE) + n->ring * (double)CELL
                            : 0.0;
  return tables + grids + leader + grids_anew(n) + evidences(n);
}

static double rows_judge(const rim_work_counts *n) {
  const double best = interval_work(n) + evidences(n) + 4u * ROOT;
  return n->ring * (double)(INSIDE + VALUE) +
         RIM_ALARM_MAX_CHANNELS * (best + n->channels * (double)(SCORE + EXPONENTIAL));
}

static double block_work(const rim_work_counts *n) {
  return CALLS + n->features * (double)VALUE + n->outcomes * (double)(OUTCOME + EXPONENTIAL) +
         (n->trained ? trained_block(n) : rows_block(n));
}

static double judge_work(const rim_work_counts *n) {
  return CALLS + n->channels * (double)SCORE + 4u * EXPONENTIAL +
         (n->trained ? trained_judge(n) : rows_judge(n));
}

static double halving_work(const rim_work_counts *n) {
  return n->region_features * (double)n->bins * (n->channels + 1.0) * ADD + grids_anew(n);
}

#define SUM_WORD 4.0 /* of a check sum */

/* monitor/guard.h: whatever is summed at both ends of a call, and all of it before an alarm. */
static double guard_work(const rim_work_counts *n) {
  return SUM_WORD * (2.0 * n->memory_bytes + n->image_bytes) / 4.0;
}

static uint32_t saturated(double work) { return work < UINT32_MAX ? (uint32_t)work : UINT32_MAX; }

void rimi_work_bound(const rim_work_counts *counts, rim_work *work) {
  if (counts == NULL || work == NULL)
    return;
  const double row = row_work(counts);
  const double search = counts->trained ? trained_search(counts) : rows_search(counts);
  const double block = block_work(counts);
  const double judge = judge_work(counts);
  work->row = saturated(row);
  work->search = saturated(search);
  work->block = saturated(block);
  const double guard = guard_work(counts);
  work->judge = saturated(judge);
  work->guard = saturated(guard);
  work->step = saturated(row + search + block + judge + guard);
  work->halving = counts->trained ? 0 : saturated(halving_work(counts));
}

static bool section_of(const rim_image *image, uint32_t id, const uint8_t **section,
                       size_t *bytes) {
  return rim_image_section(image, id, section, bytes) == RIM_OK;
}

/* Integrands of all outcomes: no outcome integrates more others than twice as many. */
static uint32_t integrands_of(const rim_image *image, const rim_work_counts *n) {
  const uint8_t *section;
  size_t bytes;
  rim_agreement view = {.integrands = 0};
  if (section_of(image, RIM_SECTION_AGREEMENT, &section, &bytes))
    (void)rimi_agreement_open(&view, section, bytes, n->features, n->outcomes, n->means);
  return view.integrands;
}

static void count_models(const rim_image *image, rim_work_counts *n) {
  const uint8_t *section;
  size_t bytes;
  rim_nominal level;
  if (section_of(image, RIM_SECTION_LEVEL, &section, &bytes) &&
      rimi_nominal_open(&level, section, bytes) == RIM_OK) {
    n->angles = level.inputs > n->features ? level.inputs - n->features : 0;
    n->prototypes = level.prototypes;
    n->top = level.top;
  }
  if (section_of(image, RIM_SECTION_QUADRATIC, &section, &bytes)) {
    n->quadratic_inputs = rimi_le_u32(section, 1);
    n->quadratic_terms =
        rimi_le_u32(section, 2) * RIM_QUADRATIC_TERMS(n->quadratic_inputs, rimi_le_u32(section, 3));
  }
  if (section_of(image, RIM_SECTION_BASIS, &section, &bytes)) {
    n->inputs = rimi_le_u32(section, 1);
    n->times = rimi_le_u32(section, 2);
    n->terms = rimi_le_u32(section, 3);
    n->means = rimi_le_u32(section, 4);
    n->rates = rimi_le_u32(section, 7);
  }
  if (section_of(image, RIM_SECTION_NOISE, &section, &bytes)) {
    n->fields = rimi_le_u32(section, 3);
    n->channels = rimi_le_u32(section, 1);
  }
  n->integrands = integrands_of(image, n);
}

rim_status rimi_work_counts_of(const void *image, size_t image_bytes, rim_work_counts *counts) {
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
  const rim_select_config given = {
      .ring = (uint16_t)rimi_le_u32(word, RIM_CONFIG_RING),
      .bins = (uint16_t)rimi_le_u32(word, RIM_CONFIG_BINS),
      .grid = (uint16_t)rimi_le_u32(word, RIM_CONFIG_GRID),
      .pairs = (uint16_t)rimi_le_u32(word, RIM_CONFIG_PAIRS),
      .scans = (uint16_t)rimi_le_u32(word, RIM_CONFIG_SCANS),
      .edges = (uint16_t)rimi_le_u32(word, RIM_CONFIG_EDGES),
      .moves = (uint16_t)rimi_le_u32(word, RIM_CONFIG_MOVES),
  };
  const rim_select_config search = rimi_select_filled(&given);
  rim_work_counts n = {
      .features = rimi_le_u32(word, RIM_CONFIG_FEATURES),
      .outcomes = rimi_le_u32(word, RIM_CONFIG_OUTCOMES),
      .region_features = rimi_le_u32(word, RIM_CONFIG_REGION_FEATURES),
      .ring = search.ring,
      .bins = search.bins,
      .grid = search.grid,
      .pairs = search.pairs,
      .scans = search.scans,
      .edges = search.edges,
      .moves = search.moves,
      .budget = rimi_le_u32(word, RIM_CONFIG_BUDGET),
      .block_rows = rimi_le_u32(word, RIM_CONFIG_BLOCK_ROWS),
      .external = rimi_le_u32(word, RIM_CONFIG_EXTERNAL) != 0,
      .small = rimi_le_u32(word, RIM_CONFIG_SMALL) != 0,
      .memory_bytes = (uint32_t)size,
      .image_bytes = (uint32_t)view.bytes,
  };
  if (n.budget == 0)
    n.budget = 1;
  n.trained = section_of(&view, RIM_SECTION_NOISE, &other, &bytes);
  n.channels = n.outcomes;
  n.corrected = section_of(&view, RIM_SECTION_CORRECT, &other, &bytes);
  n.watched = section_of(&view, RIM_SECTION_INTERFERENCE, &other, &bytes);
  if (n.trained)
    count_models(&view, &n);
  if (n.region_features < 2)
    n.pairs = 0;
  *counts = n;
  return RIM_OK;
}
