#include "raster.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "memory.h"
#include "portable_math.h"

/* Number of slopes above `limit`; slopes descend. */
static uint32_t above(const double *slope, uint32_t count, double limit) {
    const double *base = slope;
    while (count > 1) { /* without branches that depend on the data */
        uint32_t half = count / 2;
        base += base[half - 1] > limit ? half : 0;
        count -= half;
    }
    return (uint32_t)(base - slope) + (count == 1 && *base > limit);
}

/* Number of slopes at or above `limit`. */
static uint32_t at_or_above(const double *slope, uint32_t count, double limit) {
    const double *base = slope;
    while (count > 1) {
        uint32_t half = count / 2;
        base += base[half - 1] >= limit ? half : 0;
        count -= half;
    }
    return (uint32_t)(base - slope) + (count == 1 && *base >= limit);
}

/* The ground z = 0, seen from above, within the range. */
static void trace_ground(double height, const Column *column, double range, Hits *hits) {
    for (uint32_t k = 0; k < column->count; k++) {
        double limit = range * column->level[k];
        double r = -height * column->inverse_slope[k];
        int hit = column->slope[k] < 0.0 && height > 0.0 && r < limit;
        hits->distance[k] = hit ? r : limit;
        hits->cosine[k] = hit ? -column->rise[k] : 0.0;
        hits->surface[k] = hit ? &GROUND_SURFACE : NULL;
    }
}

/* The plane of the column meets a wall if the wall's ends are on different sides of it. A corner
 * counts to the same side for both its walls, so no ray passes between them. */
static void trace_wall(const Wall *wall, const Column *column, Hits *hits) {
    double side0 = column->x * wall->y0 - column->y * wall->x0;
    double side1 = column->x * wall->y1 - column->y * wall->x1;
    if (!(side0 >= 0.0 && side1 < 0.0))
        return;
    double width = side0 - side1; /* length of the edge as seen from the ray's direction */
    double r = -wall->area / width, low = wall->bottom / r;
    double normal = width * wall->inverse_length;
    uint32_t first = above(column->slope, column->count, wall->top / r);
    for (uint32_t k = first; k < column->count && column->slope[k] >= low; k++)
        if (r < hits->distance[k]) {
            hits->distance[k] = r;
            hits->cosine[k] = normal * column->level[k];
            hits->surface[k] = &wall->surface;
        }
}

/* Distances at which the column's plane crosses the edges of a cap, ahead of the sensor and
 * ascending; returns their number. */
static size_t crossings(const double *ring, size_t count, const Column *column, double *distance) {
    size_t found = 0;
    const double *a = ring + 2 * (count - 1);
    double side_a = column->x * a[1] - column->y * a[0];
    for (size_t i = 0; i < count; i++) {
        const double *b = ring + 2 * i;
        double side_b = column->x * b[1] - column->y * b[0];
        if ((side_a >= 0.0) != (side_b >= 0.0)) {
            double r = (a[0] * (b[1] - a[1]) - a[1] * (b[0] - a[0])) / (side_b - side_a);
            if (r > 0.0) {
                size_t j = found++;
                for (; j > 0 && distance[j - 1] > r; j--)
                    distance[j] = distance[j - 1];
                distance[j] = r;
            }
        }
        a = b;
        side_a = side_b;
    }
    return found;
}

/* The rays of a column that reach the cap's plane between two horizontal distances; the near end is
 * the wall's, the far end the cap's. Wall and cap divide equal numbers, so no ray slips between. */
static void trace_interval(const Cap *cap, double near, double far, const Column *column,
                           Hits *hits) {
    double at_far = cap->height / far;
    double at_near = near > 0.0 ? cap->height / near : copysign(HUGE_VAL, cap->height);
    uint32_t first, last;
    if (cap->height < 0.0) {
        first = above(column->slope, column->count, at_far);
        last = above(column->slope, column->count, at_near);
    } else {
        first = at_or_above(column->slope, column->count, at_near);
        last = at_or_above(column->slope, column->count, at_far);
    }
    for (uint32_t k = first; k < last; k++) {
        double r = cap->height * column->inverse_slope[k];
        if (r < hits->distance[k]) {
            hits->distance[k] = r;
            hits->cosine[k] = fabs(column->rise[k]);
            hits->surface[k] = &cap->surface;
        }
    }
}

static void trace_cap(const View *view, const Cap *cap, const Column *column, Hits *hits) {
    double *edge = view->crossing;
    size_t count = crossings(view->corner + 2 * cap->first, cap->count, column, edge);
    size_t i = count % 2; /* odd: the sensor is over (or under) the cap */
    if (i == 1)
        trace_interval(cap, 0.0, edge[0], column, hits);
    for (; i + 1 < count; i += 2)
        trace_interval(cap, edge[i], edge[i + 1], column, hits);
}

static void trace_column(const View *view, const Column *column, double range, Hits *hits) {
    trace_ground(view->height, column, range, hits);
    const Bins *walls = &view->wall_bins, *caps = &view->cap_bins;
    for (uint32_t i = walls->start[column->bin]; i < walls->start[column->bin + 1]; i++)
        trace_wall(view->wall + walls->item[i], column, hits);
    for (uint32_t i = caps->start[column->bin]; i < caps->start[column->bin + 1]; i++)
        trace_cap(view, view->cap + caps->item[i], column, hits);
}

void trace_azimuth(const View *view, const Pattern *pattern, uint32_t azimuth, Hits *hits) {
    Hits part = *hits;
    for (uint32_t c = 0; c < pattern->columns_per_azimuth; c++) {
        Column column = pattern_column(pattern, azimuth, c);
        trace_column(view, &column, pattern->parameters.range, &part);
        part.distance += column.count;
        part.cosine += column.count;
        part.surface += column.count;
    }
}

int hits_reserve(Hits *hits, uint32_t channels) {
    int failed = 0;
    hits->distance = with_room(hits->distance, &hits->distance_capacity, channels,
                               sizeof *hits->distance, &failed);
    hits->cosine
        = with_room(hits->cosine, &hits->cosine_capacity, channels, sizeof *hits->cosine, &failed);
    hits->surface = with_room(hits->surface, &hits->surface_capacity, channels,
                              sizeof *hits->surface, &failed);
    return failed;
}

void hits_clear(Hits *hits) {
    free(hits->distance);
    free(hits->cosine);
    free(hits->surface);
    memset(hits, 0, sizeof *hits);
}
