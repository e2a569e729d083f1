#include "raster.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "memory.h"
#include "portable_math.h"

static int reserve(Hits *hits, const View *view, const Pattern *pattern) {
    int failed = 0;
    size_t azimuths = pattern->parameters.azimuths, rays = azimuths * pattern->parameters.channels;
    uint32_t longest = 1;
    for (size_t i = 0; i < view->face_count; i++)
        longest = view->face[i].count > longest ? view->face[i].count : longest;
    hits->nearness = with_room(hits->nearness, &hits->nearness_capacity, rays,
                               sizeof *hits->nearness, &failed);
    hits->face = with_room(hits->face, &hits->face_capacity, rays, sizeof *hits->face, &failed);
    hits->edge = with_room(hits->edge, &hits->edge_capacity, longest, sizeof *hits->edge, &failed);
    hits->lower
        = with_room(hits->lower, &hits->lower_capacity, azimuths, sizeof *hits->lower, &failed);
    hits->upper
        = with_room(hits->upper, &hits->upper_capacity, azimuths, sizeof *hits->upper, &failed);
    hits->crossing = with_room(hits->crossing, &hits->crossing_capacity, longest + 1,
                               sizeof *hits->crossing, &failed);
    return failed;
}

/* Every ray to the ground, or to its range. */
static void trace_ground(const Face *ground, const Pattern *pattern, Hits *hits) {
    const double *plane = ground->plane, *slope = pattern->slope, *farthest = pattern->farthest;
    uint32_t channels = pattern->parameters.channels;
    for (uint32_t a = 0; a < pattern->parameters.azimuths; a++) {
        double level = plane[0] * pattern->azimuth_x[a] + plane[1] * pattern->azimuth_y[a];
        double *nearness = hits->nearness + (size_t)a * channels;
        uint32_t *face = hits->face + (size_t)a * channels;
        for (uint32_t k = 0; k < channels; k++) {
            double near = level + plane[2] * slope[k];
            int is_hit = near > farthest[k];
            nearness[k] = is_hit ? near : farthest[k];
            face[k] = is_hit ? 0 : NOTHING;
        }
    }
}

/* The rays of one azimuth with slopes from `lower` up to, not including, `upper`. */
static void fill(const Pattern *pattern, uint32_t azimuth, const double *plane, uint32_t number,
                 double lower, double upper, Hits *hits) {
    uint32_t first = pattern_channels_from(pattern, upper);
    uint32_t end = pattern_channels_from(pattern, lower);
    double level = plane[0] * pattern->azimuth_x[azimuth] + plane[1] * pattern->azimuth_y[azimuth];
    uint32_t turn = pattern->parameters.azimuths;
    size_t row = (size_t)(azimuth < turn ? azimuth : azimuth - turn) * pattern->parameters.channels;
    double *nearness = hits->nearness + row;
    uint32_t *face = hits->face + row;
    for (uint32_t k = first; k < end; k++) {
        double near = level + plane[2] * pattern->slope[k];
        int is_nearer = near > nearness[k];
        nearness[k] = is_nearer ? near : nearness[k];
        face[k] = is_nearer ? number : face[k];
    }
}

/* The slope at which a half-plane crosses an edge. */
static double slope_at(const Edge *edge, const Pattern *pattern, uint32_t azimuth) {
    return edge->slope[0] * pattern->azimuth_x[azimuth]
           + edge->slope[1] * pattern->azimuth_y[azimuth] + edge->slope[2];
}

/* A convex face has one edge below and one above at each azimuth, except where the sensor's z axis
 * goes through it: there it has one of them all around. Seen counter-clockwise, edges below go
 * clockwise about the sensor and edges above counter-clockwise. */
static void trace_convex(const Outline *outline, const Face *face, uint32_t number,
                         const Pattern *pattern, Hits *hits) {
    uint32_t count = (uint32_t)(outline->high - outline->low);
    for (uint32_t i = 0; i < count; i++) {
        hits->lower[i] = -HUGE_VAL;
        hits->upper[i] = HUGE_VAL;
    }
    for (uint32_t e = 0; e < outline->count; e++) {
        const Edge *edge = outline->edge + e;
        int is_above = edge->to > edge->from;
        double *bound = is_above ? hits->upper : hits->lower;
        uint32_t begin = (uint32_t)((is_above ? edge->from : edge->to) - outline->low);
        uint32_t end = (uint32_t)((is_above ? edge->to : edge->from) - outline->low);
        for (uint32_t i = begin; i < end; i++)
            bound[i] = slope_at(edge, pattern, outline->first + i);
    }
    for (uint32_t i = 0; i < count; i++)
        fill(pattern, outline->first + i, face->plane, number, hits->lower[i], hits->upper[i],
             hits);
}

/* Where the half-plane number `offset` of an outline crosses its edges, ascending; returns the
 * number of crossings. */
static uint32_t crossings(const Outline *outline, uint32_t offset, const Pattern *pattern,
                          double *slope) {
    int64_t azimuths = pattern->parameters.azimuths;
    uint32_t found = 0;
    for (uint32_t e = 0; e < outline->count; e++) {
        const Edge *edge = outline->edge + e;
        int64_t low = edge->from < edge->to ? edge->from : edge->to;
        int64_t count = llabs(edge->to - edge->from);
        int64_t after = (offset + outline->low - low) % azimuths;
        if ((after < 0 ? after + azimuths : after) >= count)
            continue;
        double at = slope_at(edge, pattern, outline->first + offset);
        uint32_t j = found++;
        for (; j > 0 && slope[j - 1] > at; j--)
            slope[j] = slope[j - 1];
        slope[j] = at;
    }
    return found;
}

/* Any polygon: between the first and the second crossing, the third and the fourth, and so on. The
 * sensor's z axis goes through it where the number is odd; above the sensor, if above it. */
static void trace_any(const Outline *outline, const Face *face, uint32_t number,
                      const Pattern *pattern, Hits *hits) {
    uint32_t azimuths = pattern->parameters.azimuths;
    uint64_t span = (uint64_t)(outline->high - outline->low);
    uint32_t count = span < azimuths ? (uint32_t)span : azimuths;
    double *slope = hits->crossing;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t found = crossings(outline, i, pattern, slope), first = 0;
        if (found % 2 == 1 && face->plane[2] > 0.0)
            slope[found++] = HUGE_VAL;
        else if (found % 2 == 1)
            fill(pattern, outline->first + i, face->plane, number, -HUGE_VAL, slope[first++], hits);
        for (; first + 1 < found; first += 2)
            fill(pattern, outline->first + i, face->plane, number, slope[first], slope[first + 1],
                 hits);
    }
}

int trace(const View *view, const Pattern *pattern, Hits *hits) {
    if (reserve(hits, view, pattern))
        return 1;
    trace_ground(view->face, pattern, hits);
    for (uint32_t i = 1; i < view->face_count; i++) {
        const Face *face = view->face + i;
        Outline outline = outline_of(view, face, pattern, hits->edge);
        if (face->convex && outline.high - outline.low <= pattern->parameters.azimuths)
            trace_convex(&outline, face, i, pattern, hits);
        else
            trace_any(&outline, face, i, pattern, hits);
    }
    return 0;
}

void hits_clear(Hits *hits) {
    free(hits->nearness);
    free(hits->face);
    free(hits->edge);
    free(hits->lower);
    free(hits->upper);
    free(hits->crossing);
    memset(hits, 0, sizeof *hits);
}
