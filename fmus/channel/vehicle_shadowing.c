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
        || BUFFER_RESERVE(s->area, s->area_capacity, count)
        || BUFFER_RESERVE(s->near, s->near_capacity, count)
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
    s->count = count;
    return 0;
}

void bodies_put(Bodies *s, size_t k, Position center, double heading, const double size[3]) {
    Rectangle outline = {.center = {center.x, center.y}, .half = {size[0] / 2, size[1] / 2}};
    unit_vector(heading, outline.direction);
    s->body[k] = (Body){outline, center.z, center.z + size[2]};
    s->area[k] = area_around(&outline);
}

int bodies_index(Bodies *s) { return area_index_build(&s->index, s->area, s->count); }

void bodies_free(Bodies *s) {
    free(s->body);
    free(s->area);
    free(s->near);
    free(s->major);
    for (int way = 0; way < 2; way++) {
        free(s->row[way].owner);
        free(s->row[way].v);
        free(s->row[way].distance);
        free(s->row[way].height);
    }
    area_index_free(&s->index);
    *s = (Bodies){0};
}

EdgeModel edge_model(const Parameters *p) {
    return (EdgeModel){edge_scale(p), p->wavelength[CENTER], p->reciprocal};
}

Nearby bodies_near(Bodies *s, Position a, Position b, const double margin[2]) {
    return (Nearby){s->near, area_index_near(&s->index, a, b, margin, s->near)};
}

/* A link, with what all its edges have in common. */
typedef struct {
    Position a, b;
    double length, margin; /* edges stay this far from the antennas [m] */
} Way;

static Way way_of(Position a, Position b, const EdgeModel *model) {
    Way w = {.a = a, .b = b, .length = distance_between(a, b)};
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
static void place(Bodies *s, const Way *w, uint32_t k, bool reciprocal, BodyShadow *shadow) {
    const Body *body = &s->body[k];
    Span span;
    if (!rectangle_span(&body->outline, w->a, w->b, &span)) return;
    double a = w->a.z, b = w->b.z;
    if (reciprocal) {
        double enter = larger(span.enter, 0), leave = smaller(span.leave, 1);
        if (enter <= leave)
            stand(&s->row[0], w, a, b, (enter + leave) / 2, body, k, &shadow->blocked[0]);
        return;
    }
    if (span.enter > 0 && span.enter < 1)
        stand(&s->row[0], w, a, b, span.enter, body, k, &shadow->blocked[0]);
    if (span.leave > 0 && span.leave < 1)
        stand(&s->row[1], w, b, a, 1 - span.leave, body, k, &shadow->blocked[1]);
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

static Edges edges_of(Bodies *s, EdgeRow *row, const Way *w, double from, double to, bool reciprocal) {
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

BodyShadow bodies_shadow(Bodies *s, const Antenna *a, const Antenna *b, Nearby nearby,
                         const EdgeModel *model) {
    BodyShadow shadow = {.blocked = {false, false}};
    Way w = way_of(a->at, b->at, model);
    s->row[0].n = s->row[1].n = 1;
    for (size_t i = 0; i < nearby.count && w.length >= 8 * SHORTEST; i++) {
        uint32_t k = nearby.index[i];
        if (k != a->body && k != b->body) place(s, &w, k, model->reciprocal, &shadow);
    }
    shadow.edges[0] = edges_of(s, &s->row[0], &w, w.a.z, w.b.z, model->reciprocal);
    if (model->reciprocal) {
        shadow.edges[1] = shadow.edges[0];
        shadow.blocked[1] = shadow.blocked[0];
    } else {
        shadow.edges[1] = edges_of(s, &s->row[1], &w, w.b.z, w.a.z, false);
    }
    return shadow;
}
