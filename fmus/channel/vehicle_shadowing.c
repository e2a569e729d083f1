#include "vehicle_shadowing.h"
#include "buffer.h"
#include "knife_edge.h"
#include <math.h>
#include <stdlib.h>

/* Edges nearer to each other than this along the link act as one [m]. */
static const double SAME_EDGE = 1e-3;

/* Shorter distances count as zero, so that no quotient leaves the range of numbers [m]. */
static const double SHORTEST = 1e-9;

int bodies_resize(Bodies *s, size_t count) {
    s->count = 0;
    if (BUFFER_RESERVE(s->body, s->body_capacity, count)
        || BUFFER_RESERVE(s->base, s->base_capacity, count)
        || BUFFER_RESERVE(s->roof, s->roof_capacity, count)
        || BUFFER_RESERVE(s->box, s->box_capacity, count)
        || BUFFER_RESERVE(s->near, s->near_capacity, count)
        || BUFFER_RESERVE(s->owner, s->owner_capacity, count + 2)
        || BUFFER_RESERVE(s->major, s->major_capacity, count + 2)
        || BUFFER_RESERVE(s->distance, s->distance_capacity, count + 2)
        || BUFFER_RESERVE(s->height, s->height_capacity, count + 2))
        return 1;
    s->count = count;
    return 0;
}

void bodies_put(Bodies *s, size_t k, Position center, double heading, const double size[3]) {
    s->body[k] = (Rectangle){{center.x, center.y},
                             {cos(heading), sin(heading)},
                             {size[0] / 2, size[1] / 2}};
    s->base[k] = center.z;
    s->roof[k] = center.z + size[2];
    s->box[k] = box_of_rectangle(&s->body[k]);
}

int bodies_index(Bodies *s) { return grid_build(&s->grid, s->box, s->count); }

void bodies_free(Bodies *s) {
    free(s->body);
    free(s->base);
    free(s->roof);
    free(s->box);
    free(s->near);
    free(s->owner);
    free(s->major);
    free(s->distance);
    free(s->height);
    grid_free(&s->grid);
    *s = (Bodies){0};
}

/* Where along the link the edge of a body stands, as a fraction of its length; negative: nowhere.
 * Reciprocal: in the middle of the part of the link over the body, seen alike from both ends.
 * Otherwise: at the first face from a; a body above a itself does not count. */
static double edge_position(const Rectangle *body, Position a, Position b, bool reciprocal) {
    Span span;
    if (!rectangle_span(body, a, b, &span)) return -1;
    if (!reciprocal) return span.enter > 0 && span.enter < 1 ? span.enter : -1;
    double enter = fmax(span.enter, 0), leave = fmin(span.leave, 1);
    return enter <= leave ? (enter + leave) / 2 : -1;
}

/* Insert an edge into the ascending profile of `n` points (the first is antenna a; antenna b is not
 * yet in); returns the new n. Of two edges in one place one stays: the higher one; in the
 * direction-dependent model the one of the lower index. */
static size_t insert(Bodies *s, size_t n, double distance, uint32_t k, bool reciprocal) {
    size_t at = n;
    while (at > 1 && s->distance[at - 1] > distance) at--;
    double same = reciprocal ? SAME_EDGE : SHORTEST;
    for (size_t i = at > 1 ? at - 1 : 1; i < n && i <= at; i++) {
        if (fabs(s->distance[i] - distance) > same) continue;
        bool replaces = reciprocal ? s->roof[k] > s->height[i] : k < s->owner[i];
        if (replaces) s->height[i] = s->roof[k], s->owner[i] = k;
        return n;
    }
    for (size_t i = n; i > at; i--) {
        s->distance[i] = s->distance[i - 1];
        s->height[i] = s->height[i - 1];
        s->owner[i] = s->owner[i - 1];
    }
    s->distance[at] = distance;
    s->height[at] = s->roof[k];
    s->owner[at] = k;
    return n + 1;
}

BodyShadow bodies_shadow(Bodies *s, Position a, Position b, size_t own_a, size_t own_b, EdgeModel model) {
    BodyShadow shadow = {0, false};
    double length = distance_between(a, b);
    if (length < 8 * SHORTEST) return shadow;
    /* The formula needs edges many wavelengths away from the antennas; nearer ones are moved. */
    double margin = model.reciprocal ? fmin(model.wavelength, length / 4) : 0;
    size_t near = grid_near_segment(&s->grid, a, b, s->near), n = 1;
    s->distance[0] = 0;
    s->height[0] = a.z;
    for (size_t i = 0; i < near; i++) {
        uint32_t k = s->near[i];
        if (k == own_a || k == own_b) continue;
        double t = edge_position(&s->body[k], a, b, model.reciprocal);
        double line = a.z + (b.z - a.z) * t; /* height of the straight line between the antennas */
        if (t < 0 || s->base[k] > line) continue; /* beside the link, or on a bridge above it */
        double distance = fmin(fmax(t * length, margin), length - margin);
        if (distance < SHORTEST || distance > length - SHORTEST) continue;
        shadow.blocked |= s->roof[k] > line;
        n = insert(s, n, distance, k, model.reciprocal);
    }
    if (n == 1) return shadow;
    s->distance[n] = length;
    s->height[n] = b.z;
    Profile profile = {s->distance, s->height, n + 1};
    shadow.loss_db = knife_edges_db(&profile, model.wavelength, model.factor, s->major);
    return shadow;
}
