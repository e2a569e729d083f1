#include "seen.h"

#include "tilt.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Highest return from flat ground [m]: several standard deviations of what the noise of a lidar's
 * range does to it. Returns from the foot of a body must not count as ground, as those below the
 * `ground_height` of objects do: they would let the sensor see what is behind it. */
static const double FLATNESS = 0.05;

/* ---- the scan pattern ----------------------------------------------------------------------- */

static int is_same(const PatternSettings *a, const PatternSettings *b) {
    return a->azimuths == b->azimuths && a->channels == b->channels
           && a->elevation_top == b->elevation_top && a->elevation_bottom == b->elevation_bottom
           && a->range == b->range;
}

static Direction direction_of(double angle) {
    Direction direction;
    sine_cosine(angle, &direction.sine, &direction.cosine);
    return direction;
}

static void fill_tables(Seen *seen, const PatternSettings *pattern) {
    double top = pattern->elevation_top, bottom = pattern->elevation_bottom;
    double step = pattern->channels > 1 ? (top - bottom) / (pattern->channels - 1) : 0.0;
    for (uint32_t a = 0; a < pattern->azimuths; a++)
        seen->azimuth[a] = direction_of(2.0 * PI * a / pattern->azimuths);
    for (uint32_t k = 0; k <= pattern->channels; k++) {
        seen->border[k] = direction_of(top - (k - 0.5) * step);
        seen->slope[k] = seen->border[k].sine / seen->border[k].cosine;
    }
    seen->pattern = *pattern;
}

static int prepare(Seen *seen, const PatternSettings *pattern, const ScanSettings *matrix,
                   Problem *problem) {
    size_t azimuths = pattern->azimuths, borders = (size_t)pattern->channels + 1;
    size_t directions = azimuths * pattern->channels;
    size_t cells = (size_t)matrix->rows * matrix->columns;
    if (reserve(&seen->azimuth, &seen->azimuth_capacity, azimuths, sizeof(Direction), problem)
        || reserve(&seen->border, &seen->border_capacity, borders, sizeof(Direction), problem)
        || reserve(&seen->slope, &seen->slope_capacity, borders, sizeof(double), problem)
        || reserve(&seen->limit, &seen->limit_capacity, borders, sizeof(Limit), problem)
        || reserve(&seen->returns, &seen->return_capacity, directions, 1, problem)
        || reserve(&seen->distance, &seen->distance_capacity, directions, sizeof(double), problem)
        || reserve(&seen->area, &seen->area_capacity, cells, sizeof(double), problem))
        return 1;
    if (!is_same(pattern, &seen->pattern)) fill_tables(seen, pattern);
    memset(seen->returns, NO_ECHO, directions);
    memset(seen->area, 0, cells * sizeof(double));
    return 0;
}

/* ---- returns by direction ------------------------------------------------------------------- */

/* Whether (x, y) is not farther from azimuth `a` than from its neighbours; `half` is the tangent of
 * half a step. */
static int is_at_azimuth(const Seen *seen, uint32_t a, double x, double y, double half) {
    const Direction *d = &seen->azimuth[a];
    return fabs(d->cosine * y - d->sine * x) <= half * (d->cosine * x + d->sine * y);
}

static uint32_t azimuth_of(const Seen *seen, uint32_t guess, double x, double y, double half) {
    if (is_at_azimuth(seen, guess, x, y, half)) return guess;
    uint32_t azimuths = seen->pattern.azimuths;
    double step = floor(direction_angle(y, x) / (2.0 * PI) * azimuths + 0.5);
    return (uint32_t)(step < 0.0 ? step + azimuths : step) % azimuths;
}

/* The channel whose borders enclose `slope`; outside of the pattern the first or last. */
static uint32_t channel_of(const Seen *seen, uint32_t guess, double slope) {
    uint32_t channels = seen->pattern.channels;
    if (guess < channels && seen->slope[guess] > slope && slope >= seen->slope[guess + 1])
        return guess;
    uint32_t low = 0, high = channels - 1;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (slope >= seen->slope[middle + 1]) high = middle;
        else low = middle + 1;
    }
    return low;
}

/* Points come azimuth by azimuth and channel by channel; another order takes more time. */
static void sort_returns(Seen *seen, const ScanSettings *matrix, const Cloud *cloud,
                         const Sensor *sensor, const Tilt *tilt) {
    const uint32_t channels = seen->pattern.channels;
    const Direction half_step = direction_of(PI / seen->pattern.azimuths);
    const double half = half_step.sine / half_step.cosine;
    const uint8_t *bytes = cloud->points + (size_t)sensor->first * sizeof(Point);
    uint32_t a = 0, k = 0;
    for (uint32_t i = 0; i < sensor->count; i++, bytes += sizeof(Point)) {
        Point point;
        memcpy(&point, bytes, sizeof point);
        double p[3] = {point.position[0], point.position[1], point.position[2]}, level[3];
        tilt_apply(tilt, p, level);
        double height = sensor->position[2] + level[2];
        if (height < matrix->floor || height > matrix->ceiling) continue;
        double distance = sqrt(level[0] * level[0] + level[1] * level[1]);
        if (distance < matrix->blanking) continue; /* the own body */
        a = azimuth_of(seen, a, p[0], p[1], half);
        k = channel_of(seen, k + 1, p[2] / sqrt(p[0] * p[0] + p[1] * p[1]));
        size_t at = (size_t)a * channels + k;
        if (seen->returns[at] != NO_ECHO && seen->distance[at] <= distance) continue;
        seen->returns[at] = height > FLATNESS ? OBSTACLE_ECHO : GROUND_ECHO;
        seen->distance[at] = distance;
    }
}

/* ---- the ground along one azimuth ----------------------------------------------------------- */

static void fill_limits(Seen *seen, const Tilt *tilt, uint32_t azimuth, double height,
                        double farthest) {
    const Direction *a = &seen->azimuth[azimuth];
    for (uint32_t k = 0; k <= seen->pattern.channels; k++) {
        const Direction *e = &seen->border[k];
        double ray[3], aside[3]; /* and its derivative by the azimuth */
        tilt_apply(tilt, (double[]){e->cosine * a->cosine, e->cosine * a->sine, e->sine}, ray);
        tilt_apply(tilt, (double[]){-e->cosine * a->sine, e->cosine * a->cosine, 0.0}, aside);
        double level2 = ray[0] * ray[0] + ray[1] * ray[1], level = sqrt(level2);
        double distance = ray[2] < 0.0 ? height * level / -ray[2] : farthest;
        seen->limit[k] = (Limit){
            .direction = level > 0.0 ? (Direction){ray[0] / level, ray[1] / level} : *a,
            .distance = distance < farthest ? distance : farthest,
            .turn = level > 0.0 ? fabs(ray[0] * aside[1] - ray[1] * aside[0]) / level2 : 0.0,
        };
    }
}

/* For a level sensor only the direction differs between the azimuths. */
static void turn_limits(Seen *seen, uint32_t azimuth) {
    for (uint32_t k = 0; k <= seen->pattern.channels; k++)
        seen->limit[k].direction = seen->azimuth[azimuth];
}

/* Distance from `x` along a ray that goes `along` in this coordinate to the next of the lines at
 * whole numbers, and from there to the one after; infinite for a ray beside them. */
static double to_line(double x, double along, double *spacing) {
    *spacing = along != 0.0 ? 1.0 / fabs(along) : INFINITY;
    if (along > 0.0) return (floor(x) + 1.0 - x) * *spacing;
    return along < 0.0 ? (x - (ceil(x) - 1.0)) * *spacing : INFINITY;
}

/* Give the cells along a ray the area of the sector between two distances. */
static void spread(Seen *seen, const ScanSettings *matrix, Direction direction, double near,
                   double far, double angle) {
    const double unit = 1.0 / matrix->cell;
    double row = (near * direction.cosine - matrix->offset) * unit + matrix->rows / 2.0;
    double column = near * direction.sine * unit + matrix->columns / 2.0;
    double row_spacing, column_spacing; /* in units of a cell */
    double next_row = to_line(row, direction.cosine, &row_spacing);
    double next_column = to_line(column, direction.sine, &column_spacing);
    double i = direction.cosine < 0.0 ? ceil(row) - 1.0 : floor(row);
    double j = direction.sine < 0.0 ? ceil(column) - 1.0 : floor(column);
    for (double from = near; from < far;) {
        int is_row = next_row < next_column;
        double line = near + (is_row ? next_row : next_column) * matrix->cell;
        double to = line < far ? line : far;
        if (i >= 0.0 && i < matrix->rows && j >= 0.0 && j < matrix->columns)
            seen->area[(size_t)i * matrix->columns + (size_t)j]
                += 0.5 * angle * (to * to - from * from);
        if (is_row) {
            next_row += row_spacing;
            i += direction.cosine < 0.0 ? -1.0 : 1.0;
        } else {
            next_column += column_spacing;
            j += direction.sine < 0.0 ? -1.0 : 1.0;
        }
        from = to;
    }
}

/* A direction without a return between two that show the ground was lost. */
static int shows_ground(const uint8_t *returns, uint32_t k, uint32_t channels) {
    if (returns[k] != NO_ECHO) return returns[k] == GROUND_ECHO;
    return k > 0 && k + 1 < channels && returns[k - 1] == GROUND_ECHO && returns[k + 1] == GROUND_ECHO;
}

/* How far the ground is seen above the channel k, which shows it: to the obstacle that the next one
 * meets; to the end if that would meet the ground beyond it and meets nothing; else half-way. */
static double reach(const Seen *seen, const uint8_t *returns, const double *distance, uint32_t k) {
    const double farthest = seen->limit[0].distance;
    const double near = seen->limit[k + 1].distance, far = seen->limit[k].distance;
    if (k == 0) return far;
    if (returns[k - 1] == OBSTACLE_ECHO) return distance[k - 1] > near ? distance[k - 1] : far;
    return returns[k - 1] == NO_ECHO && far + (far - near) > farthest ? farthest : far;
}

/* Follow one azimuth outwards. A level sensor's ray is straight: what is adjacent is joined. */
static void follow(Seen *seen, const ScanSettings *matrix, uint32_t azimuth, int is_level) {
    const uint32_t channels = seen->pattern.channels;
    const uint8_t *returns = seen->returns + (size_t)azimuth * channels;
    const double *distance = seen->distance + (size_t)azimuth * channels;
    const double step = 2.0 * PI / seen->pattern.azimuths;
    double near = 0.0;
    int is_open = 0;
    for (uint32_t k = channels; k-- > 0;) {
        if (!shows_ground(returns, k, channels)) continue;
        const Limit *above = &seen->limit[k], *below = &seen->limit[k + 1];
        if (!is_open) near = below->distance;
        is_open = is_level && k > 0 && shows_ground(returns, k - 1, channels);
        if (!is_open)
            spread(seen, matrix, above->direction, near, reach(seen, returns, distance, k),
                   0.5 * step * (above->turn + below->turn));
    }
}

/* ---- all of it ------------------------------------------------------------------------------ */

static void quantise(const Seen *seen, const ScanSettings *matrix, uint32_t levels,
                     uint32_t *cells) {
    double per_area = levels / (matrix->cell * matrix->cell);
    for (size_t i = 0; i < (size_t)matrix->rows * matrix->columns; i++) {
        double level = floor(seen->area[i] * per_area + 0.5);
        cells[i] = level < levels ? (uint32_t)level : levels;
    }
}

int seen_take(Seen *seen, const PatternSettings *pattern, const ScanSettings *matrix,
              const Cloud *cloud, const Sensor *sensor, uint32_t levels, uint32_t *cells,
              Problem *problem) {
    if (prepare(seen, pattern, matrix, problem)) return 1;
    const double height = sensor->position[2], range = pattern->range;
    const int is_level = sensor->pitch == 0.0 && sensor->roll == 0.0;
    const Tilt tilt = tilt_of(sensor);
    if (height > 0.0 && height < range) {
        double farthest = sqrt(range * range - height * height);
        sort_returns(seen, matrix, cloud, sensor, &tilt);
        if (is_level) fill_limits(seen, &tilt, 0, height, farthest);
        for (uint32_t azimuth = 0; azimuth < pattern->azimuths; azimuth++) {
            if (is_level) turn_limits(seen, azimuth);
            else fill_limits(seen, &tilt, azimuth, height, farthest);
            follow(seen, matrix, azimuth, is_level);
        }
    }
    quantise(seen, matrix, levels, cells);
    return 0;
}

void seen_free(Seen *seen) {
    free(seen->azimuth);
    free(seen->border);
    free(seen->slope);
    free(seen->returns);
    free(seen->distance);
    free(seen->area);
    free(seen->limit);
}
