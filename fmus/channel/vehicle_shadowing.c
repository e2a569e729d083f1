#include "vehicle_shadowing.h"
#include "buffer.h"
#include <math.h>
#include <stdlib.h>

/* Edges nearer to each other than this along the link act as one [m]. */
static const double SAME_EDGE = 1e-3;

/* Shorter distances count as zero, so that no quotient leaves the range of numbers [m]. */
static const double SHORTEST = 1e-9;

int bodies_resize(Bodies *s, size_t count) {
    s->count = 0;
    if (BUFFER_RESERVE(s->body, s->body_capacity, count)
        || BUFFER_RESERVE(s->area, s->area_capacity, count))
        return 1;
    s->count = count;
    return 0;
}

int body_scratch_reserve(BodyScratch *s, const Bodies *bodies) {
    size_t count = bodies->count;
    if (BUFFER_RESERVE(s->near, s->near_capacity, count)
        || BUFFER_RESERVE(s->major, s->major_capacity, count + 2))
        return 1;
    for (int way = 0; way < 2; way++) {
        EdgeRow *row = &s->row[way];
        if (BUFFER_RESERVE(row->owner, row->owner_capacity, count + 2)
            || BUFFER_RESERVE(row->v, row->v_capacity, 2 * (count + 2))
            || BUFFER_RESERVE(row->distance, row->distance_capacity, count + 2)
            || BUFFER_RESERVE(row->height, row->height_capacity, count + 2))
            return 1;
    }
    return 0;
}

void body_scratch_free(BodyScratch *s) {
    free(s->near);
    free(s->major);
    for (int way = 0; way < 2; way++) {
        free(s->row[way].owner);
        free(s->row[way].v);
        free(s->row[way].distance);
        free(s->row[way].height);
    }
    *s = (BodyScratch){0};
}

void bodies_put(Bodies *s, size_t k, Position center, double heading, const double size[3]) {
    Rectangle outline = {.center = {center.x, center.y}, .half = {size[0] / 2, size[1] / 2}};
    unit_vector(heading, outline.direction);
    double radius_square = outline.half[0] * outline.half[0] + outline.half[1] * outline.half[1];
    s->body[k] = (Body){outline, center.z, center.z + size[2], radius_square * (1 + 1e-9) + 1e-18};
    s->area[k] = area_around(&outline);
}

int bodies_index(Bodies *s) { return area_index_build(&s->index, s->area, s->count); }

void bodies_free(Bodies *s) {
    free(s->body);
    free(s->area);
    area_index_free(&s->index);
    *s = (Bodies){0};
}

EdgeModel edge_model(const Parameters *p) {
    return (EdgeModel){edge_scale(p), p->wavelength[CENTER], p->reciprocal};
}

Nearby bodies_near(const Bodies *s, BodyScratch *scratch, Position a, Position b,
                   const double margin[2]) {
    return (Nearby){scratch->near, area_index_near(&s->index, a, b, margin, scratch->near)};
}

/* A link, with what all its edges have in common. */
typedef struct {
    Position a, b;
    double step_x, step_y, plane_square; /* in the plane */
    double length, margin; /* edges stay this far from the antennas [m] */
} Way;

static Way way_of(Position a, Position b, const EdgeModel *model) {
    Way w = {.a = a, .b = b, .step_x = b.x - a.x, .step_y = b.y - a.y};
    w.plane_square = w.step_x * w.step_x + w.step_y * w.step_y;
    w.length = distance_between(a, b);
    /* The formula needs edges many wavelengths away from the antennas; nearer ones are moved. */
    w.margin = model->reciprocal ? smaller(model->wavelength, w.length / 4) : 0;
    return w;
}

/* Put an edge into the row, by distance and then by body, so that the order of arrival is
 * indifferent. */
static void insert(EdgeRow *row, double distance, double roof, uint32_t k) {
    size_t at = row->n++;
    for (; at > 1; at--) {
        double before = row->distance[at - 1];
        if (before < distance || (before == distance && row->owner[at - 1] < k)) break;
        row->distance[at] = before;
        row->height[at] = row->height[at - 1];
        row->owner[at] = row->owner[at - 1];
    }
    row->distance[at] = distance;
    row->height[at] = roof;
    row->owner[at] = k;
}

/* Let a body stand `t` of the way from one antenna to the other, in the row of that direction. */
static void stand(EdgeRow *row, const Way *w, double from, double to, double t, const Body *body,
                  uint32_t k, bool *blocked) {
    double line = from + (to - from) * t; /* height of the straight line between the antennas */
    if (body->base > line) return;        /* on a bridge above it */
    double distance = smaller(larger(t * w->length, w->margin), w->length - w->margin);
    if (distance < SHORTEST || distance > w->length - SHORTEST) return;
    *blocked |= body->roof > line;
    insert(row, distance, body->roof, k);
}

/* Reciprocal: the edge stands in the middle of the part of the link over the body, seen alike from
 * both ends. Otherwise: at the first face from the transmitter; a body above it does not count. */
static void place(EdgeRow row[2], const Way *w, const Body *body, uint32_t k, bool reciprocal,
                  unsigned ways, BodyShadow *shadow) {
    const double *center = body->outline.center;
    Span span;
    /* most links pass by: the distance of the centre from the line against the circle */
    double across = w->step_x * (center[1] - w->a.y) - w->step_y * (center[0] - w->a.x);
    if (across * across > body->radius_square * w->plane_square) return;
    if (!rectangle_span(&body->outline, w->a, w->b, &span)) return;
    double a = w->a.z, b = w->b.z;
    if (reciprocal) {
        double enter = larger(span.enter, 0), leave = smaller(span.leave, 1);
        if (enter <= leave)
            stand(&row[0], w, a, b, (enter + leave) / 2, body, k, &shadow->blocked[0]);
        return;
    }
    if (ways & FORTH && span.enter > 0 && span.enter < 1)
        stand(&row[0], w, a, b, span.enter, body, k, &shadow->blocked[0]);
    if (ways & BACK && span.leave > 0 && span.leave < 1)
        stand(&row[1], w, b, a, 1 - span.leave, body, k, &shadow->blocked[1]);
}

/* Of edges in one place one stays: the higher one; in the direction-dependent model the one of the
 * lower index. */
static void merge(EdgeRow *row, bool reciprocal) {
    double same = reciprocal ? SAME_EDGE : SHORTEST;
    size_t last = 0;
    for (size_t i = 1; i < row->n; i++) {
        bool is_same = last > 0 && row->distance[i] - row->distance[last] <= same;
        if (is_same) {
            bool replaces = reciprocal ? row->height[i] > row->height[last]
                                       : row->owner[i] < row->owner[last];
            if (!replaces) continue;
        } else {
            row->distance[++last] = row->distance[i];
        }
        row->height[last] = row->height[i];
        row->owner[last] = row->owner[i];
    }
    row->n = last + 1;
}

static Edges edges_of(BodyScratch *s, EdgeRow *row, const Way *w, double from, double to,
                      bool reciprocal) {
    Edges edges = {row->v, 0, {1, 0}};
    if (row->n == 1) return edges;
    merge(row, reciprocal);
    row->distance[0] = 0;
    row->height[0] = from;
    row->distance[row->n] = w->length;
    row->height[row->n] = to;
    Profile profile = {row->distance, row->height, row->n + 1};
    knife_edges(&profile, s->major, &edges);
    return edges;
}

BodyShadow bodies_shadow(const Bodies *bodies, BodyScratch *s, const Antenna *a, const Antenna *b,
                         Nearby nearby, const EdgeModel *model, unsigned ways) {
    BodyShadow shadow = {.blocked = {false, false}};
    Way w = way_of(a->at, b->at, model);
    s->row[0].n = s->row[1].n = 1;
    for (size_t i = 0; i < nearby.count && w.length >= 8 * SHORTEST; i++) {
        uint32_t k = nearby.index[i];
        if (k != a->body && k != b->body)
            place(s->row, &w, &bodies->body[k], k, model->reciprocal, ways, &shadow);
    }
    if (model->reciprocal) {
        shadow.edges[0] = shadow.edges[1] =
            edges_of(s, &s->row[0], &w, w.a.z, w.b.z, model->reciprocal);
        shadow.blocked[1] = shadow.blocked[0];
    } else {
        if (ways & FORTH) shadow.edges[0] = edges_of(s, &s->row[0], &w, w.a.z, w.b.z, false);
        if (ways & BACK) shadow.edges[1] = edges_of(s, &s->row[1], &w, w.b.z, w.a.z, false);
    }
    return shadow;
}
