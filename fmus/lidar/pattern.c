#include "pattern.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "portable_math.h"

/* Cells of the search for channels, at most, per channel. */
enum { CELLS_PER_CHANNEL = 32 };

static int equal(const PatternParameters *a, const PatternParameters *b) {
    return a->channels == b->channels && a->azimuths == b->azimuths
           && a->elevation_top == b->elevation_top && a->elevation_bottom == b->elevation_bottom
           && a->pitch == b->pitch && a->roll == b->roll && a->range == b->range;
}

static int allocate(Pattern *p) {
    size_t azimuths = p->parameters.azimuths, channels = p->parameters.channels;
    size_t doubles = 4 * azimuths + 4 * channels + 1, cells = CELLS_PER_CHANNEL * channels + 2;
    double *next = malloc(doubles * sizeof *next + cells * sizeof *p->before);
    if (next == NULL)
        return 1;
    p->memory = next;
    p->azimuth_x = next, next += 2 * azimuths;
    p->azimuth_y = next, next += 2 * azimuths;
    p->level = next, next += channels;
    p->rise = next, next += channels;
    p->farthest = next, next += channels;
    p->slope = next, next += channels + 1;
    p->before = (uint32_t *)next;
    return 0;
}

static void fill_directions(Pattern *p) {
    const PatternParameters *q = &p->parameters;
    for (uint32_t a = 0; a < q->azimuths; a++) {
        sine_cosine(2.0 * PI * a / q->azimuths, &p->azimuth_y[a], &p->azimuth_x[a]);
        p->azimuth_x[a + q->azimuths] = p->azimuth_x[a];
        p->azimuth_y[a + q->azimuths] = p->azimuth_y[a];
    }
    double span = q->elevation_bottom - q->elevation_top;
    for (uint32_t k = 0; k < q->channels; k++) {
        double part = q->channels > 1 ? (double)k / (q->channels - 1) : 0.0;
        sine_cosine(q->elevation_top + span * part, &p->rise[k], &p->level[k]);
        p->slope[k] = p->rise[k] / p->level[k];
        p->farthest[k] = 1.0 / (q->range * p->level[k]);
    }
    p->slope[q->channels] = NAN; /* not at or above anything */
}

/* The inverse of a turn about x by the roll, then about y by the pitch. */
static void fill_turn(Pattern *p) {
    double sp, cp, sr, cr;
    sine_cosine(p->parameters.pitch, &sp, &cp);
    sine_cosine(p->parameters.roll, &sr, &cr);
    const double turn[3][3] = {{cp, 0.0, -sp}, {sp * sr, cr, cp * sr}, {sp * cr, -sr, cp * cr}};
    memcpy(p->turn, turn, sizeof turn);
}

/* Cells half as wide as the closest channels are apart, unless that makes too many. */
static void fill_cells(Pattern *p) {
    uint32_t channels = p->parameters.channels, most = CELLS_PER_CHANNEL * channels;
    double span = p->slope[0] - p->slope[channels - 1], gap = span;
    for (uint32_t k = 1; k < channels; k++)
        gap = fmin(gap, p->slope[k - 1] - p->slope[k]);
    double wanted = 2.0 * span / gap; /* NaN if there is one channel */
    double count = wanted < most ? wanted : most;
    p->cell_scale = span > 0.0 ? count / span : 0.0;
    p->cells = (uint32_t)count + 2;
    memset(p->before, 0, p->cells * sizeof *p->before);
    for (uint32_t k = 0; k < channels; k++)
        p->before[pattern_cell(p, p->slope[k])]++;
    p->per_cell = 0;
    uint32_t sum = 0;
    for (uint32_t c = 0; c < p->cells; c++) {
        uint32_t here = p->before[c];
        p->per_cell = here > p->per_cell ? here : p->per_cell;
        p->before[c] = sum;
        sum += here;
    }
}

int pattern_prepare(Pattern *p, const PatternParameters *parameters) {
    if (p->memory != NULL && equal(&p->parameters, parameters))
        return 0;
    pattern_clear(p);
    p->parameters = *parameters;
    if (allocate(p))
        return 1;
    fill_directions(p);
    fill_turn(p);
    fill_cells(p);
    return 0;
}

void pattern_clear(Pattern *p) {
    free(p->memory);
    memset(p, 0, sizeof *p);
}

/* The direction of (x, y) in turns, 0..1, with an error below 1e-5 (Abramowitz and Stegun 1964,
 * formula 4.4.49). */
static double turns(double x, double y) {
    double a = fabs(x), b = fabs(y), q = (a < b ? a : b) / (a < b ? b : a), s = q * q;
    double tail = 0.1801410 + s * (-0.0851330 + s * 0.0208351);
    double part = q * (0.9998660 + s * (-0.3302995 + s * tail)) / (2.0 * PI);
    part = a < b ? 0.25 - part : part;
    part = x < 0.0 ? 0.5 - part : part;
    return y < 0.0 ? 1.0 - part : part;
}

/* Whether a direction is counter-clockwise of azimuth a, or at it, by less than half a turn. */
static int is_passed(const Pattern *p, uint32_t a, double x, double y) {
    return p->azimuth_x[a] * y - p->azimuth_y[a] * x >= 0.0;
}

uint32_t pattern_azimuth(const Pattern *p, double x, double y) {
    uint32_t azimuths = p->parameters.azimuths;
    uint32_t a = (uint32_t)(turns(x, y) * azimuths); /* right, or beside the right one */
    a = a < azimuths ? a : 0;
    if (!is_passed(p, a, x, y))
        return a > 0 ? a - 1 : azimuths - 1;
    if (is_passed(p, a + 1, x, y))
        return a + 1 < azimuths ? a + 1 : 0;
    return a;
}
