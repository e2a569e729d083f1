#include "pattern.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "portable_math.h"

/* Shortest horizontal part of a ray; a vertical ray has no azimuth. It shifts the hit on a roof
 * under the sensor by 1e-12 of its distance. */
static const double LEVEL_MINIMUM = 1e-12;

static int equal(const PatternParameters *a, const PatternParameters *b) {
    return a->channels == b->channels && a->azimuths == b->azimuths
           && a->elevation_top == b->elevation_top && a->elevation_bottom == b->elevation_bottom
           && a->pitch == b->pitch && a->roll == b->roll && a->range == b->range;
}

static int allocate(Pattern *p) {
    size_t azimuths = p->parameters.azimuths, channels = p->parameters.channels;
    size_t columns = azimuths * p->columns_per_azimuth;
    size_t rays = p->tilted ? columns : channels;
    size_t doubles = 2 * azimuths + 2 * channels + 2 * columns + 5 * rays;
    double *next = malloc(doubles * sizeof *next + columns * sizeof *p->column_bin);
    if (next == NULL)
        return 1;
    p->memory = next;
    p->azimuth_x = next, next += azimuths;
    p->azimuth_y = next, next += azimuths;
    p->level = next, next += channels;
    p->rise = next, next += channels;
    p->column_x = next, next += columns;
    p->column_y = next, next += columns;
    p->column_slope = next, next += rays;
    p->column_inverse_slope = next, next += rays;
    p->column_level = next, next += rays;
    p->column_inverse_level = next, next += rays;
    p->column_rise = next, next += rays;
    p->column_bin = (uint32_t *)next;
    return 0;
}

static void fill_sensor_frame(Pattern *p) {
    const PatternParameters *q = &p->parameters;
    for (uint32_t a = 0; a < q->azimuths; a++)
        sine_cosine(2.0 * PI * a / q->azimuths, &p->azimuth_y[a], &p->azimuth_x[a]);
    double span = q->elevation_bottom - q->elevation_top;
    for (uint32_t k = 0; k < q->channels; k++) {
        double part = q->channels > 1 ? (double)k / (q->channels - 1) : 0.0;
        sine_cosine(q->elevation_top + span * part, &p->rise[k], &p->level[k]);
    }
}

static void set_ray(Pattern *p, size_t i, double level, double rise) {
    p->column_level[i] = level;
    p->column_inverse_level[i] = 1.0 / level;
    p->column_rise[i] = rise;
    p->column_slope[i] = rise / level;
    p->column_inverse_slope[i] = rise != 0.0 ? level / rise : 0.0;
}

static void fill_level_columns(Pattern *p) {
    for (uint32_t a = 0; a < p->parameters.azimuths; a++) {
        p->column_x[a] = p->azimuth_x[a];
        p->column_y[a] = p->azimuth_y[a];
        p->column_bin[a] = a;
    }
    for (uint32_t k = 0; k < p->parameters.channels; k++)
        set_ray(p, k, p->level[k], p->rise[k]);
}

/* heading frame <- sensor frame: turn about x by the roll, then about y by the pitch. */
static void fill_tilted_columns(Pattern *p) {
    const PatternParameters *q = &p->parameters;
    double sin_pitch, cos_pitch, sin_roll, cos_roll;
    sine_cosine(q->pitch, &sin_pitch, &cos_pitch);
    sine_cosine(q->roll, &sin_roll, &cos_roll);
    for (uint32_t a = 0; a < q->azimuths; a++)
        for (uint32_t k = 0; k < q->channels; k++) {
            size_t i = (size_t)a * q->channels + k;
            double x = p->level[k] * p->azimuth_x[a], left = p->level[k] * p->azimuth_y[a];
            double y = left * cos_roll - p->rise[k] * sin_roll;
            double z = left * sin_roll + p->rise[k] * cos_roll;
            double ahead = x * cos_pitch + z * sin_pitch, up = z * cos_pitch - x * sin_pitch;
            double level = sqrt(ahead * ahead + y * y);
            int vertical = level < LEVEL_MINIMUM;
            p->column_x[i] = vertical ? 1.0 : ahead / level;
            p->column_y[i] = vertical ? 0.0 : y / level;
            set_ray(p, i, vertical ? LEVEL_MINIMUM : level, up);
            /* the bins of faces are a little wider than the faces: atan2 need not be exact */
            double turn = atan2(p->column_y[i], p->column_x[i]) / (2.0 * PI);
            double bin = floor((turn < 0.0 ? turn + 1.0 : turn) * q->azimuths);
            p->column_bin[i] = bin < q->azimuths ? (uint32_t)bin : 0;
        }
}

int pattern_prepare(Pattern *p, const PatternParameters *parameters) {
    if (p->memory != NULL && equal(&p->parameters, parameters))
        return 0;
    pattern_clear(p);
    p->parameters = *parameters;
    p->tilted = parameters->pitch != 0.0 || parameters->roll != 0.0;
    p->columns_per_azimuth = p->tilted ? parameters->channels : 1;
    p->rays_per_column = p->tilted ? 1 : parameters->channels;
    if (allocate(p))
        return 1;
    fill_sensor_frame(p);
    if (p->tilted)
        fill_tilted_columns(p);
    else
        fill_level_columns(p);
    return 0;
}

void pattern_clear(Pattern *p) {
    free(p->memory);
    memset(p, 0, sizeof *p);
}

Column pattern_column(const Pattern *p, uint32_t azimuth, uint32_t column) {
    size_t i = (size_t)azimuth * p->columns_per_azimuth + column;
    size_t ray = pattern_ray(p, azimuth, column * p->rays_per_column);
    return (Column){
        .x = p->column_x[i],
        .y = p->column_y[i],
        .bin = p->column_bin[i],
        .count = p->rays_per_column,
        .slope = p->column_slope + ray,
        .inverse_slope = p->column_inverse_slope + ray,
        .level = p->column_level + ray,
        .rise = p->column_rise + ray,
    };
}
