#include "segments.h"

#include "plausible.h"

#include <math.h>
#include <stdlib.h>

/* ---- shapes --------------------------------------------------------------------------------- */

static void set_axes(Segments *segments) {
    for (int k = 0; k < QUADRANT; k++) {
        double *axis = segments->axes[k], *across = segments->axes[k + QUADRANT];
        sine_cosine(PI / 2 * k / QUADRANT, &axis[1], &axis[0]);
        across[0] = -axis[1];
        across[1] = axis[0];
    }
}

static void enlarge(Shape *shape, const double axes[EXTENTS][2], const Patch *patch) {
    for (int k = 0; k < EXTENTS; k++) {
        float at = (float)(axes[k][0] * patch->place[0] + axes[k][1] * patch->place[1]);
        shape->low[k] = at < shape->low[k] ? at : shape->low[k];
        shape->high[k] = at > shape->high[k] ? at : shape->high[k];
    }
    if (patch->height > shape->height) shape->height = patch->height;
}

static Shape hull(const Shape *a, const Shape *b) {
    Shape both = *a;
    for (int k = 0; k < EXTENTS; k++) {
        both.low[k] = b->low[k] < a->low[k] ? b->low[k] : a->low[k];
        both.high[k] = b->high[k] > a->high[k] ? b->high[k] : a->high[k];
    }
    if (b->height > a->height) both.height = b->height;
    return both;
}

/* Whether some vehicle contains a body: a box turned by one of the directions. A body may be turned
 * by half a step more, which makes it seem wider. */
static int is_vehicle(const SegmentSettings *settings, const Shape *shape) {
    const double half_step = PI / 4 / QUADRANT;
    if (shape->height > settings->height) return 0;
    int is_high = shape->height > settings->car_height;
    double longest = is_high ? settings->length : settings->car_length;
    double widest = is_high ? settings->width : settings->car_width;
    for (int k = 0; k < QUADRANT; k++) {
        double a = (double)shape->high[k] - (double)shape->low[k];
        double b = (double)shape->high[k + QUADRANT] - (double)shape->low[k + QUADRANT];
        double length = a > b ? a : b, width = a > b ? b : a;
        if (length <= longest && width <= widest + half_step * length) return 1;
    }
    return 0;
}

/* The shape of each surface. */
static int measure(Segments *segments, Problem *problem) {
    Search *search = &segments->search;
    const Patches *patches = search->patches;
    segments->shape_count = 0;
    for (uint32_t i = 0; i < patches->sorted_count; i++) {
        if (search->is_static[i]) continue;
        uint32_t root = root_of(search, i);
        if (root == i) { /* the lowest index of its tree: met first */
            if (reserve(&segments->shapes, &segments->shape_capacity, segments->shape_count + 1,
                        sizeof(Shape), problem))
                return 1;
            Shape *fresh = &segments->shapes[segments->shape_count];
            for (int k = 0; k < EXTENTS; k++) {
                fresh->low[k] = INFINITY;
                fresh->high[k] = -INFINITY;
            }
            fresh->height = -INFINITY;
            segments->shape_of[i] = (uint32_t)segments->shape_count++;
        }
        enlarge(&segments->shapes[segments->shape_of[root]],
                (const double(*)[2])segments->axes, &patches->sorted[i]);
    }
    return 0;
}

/* ---- bodies --------------------------------------------------------------------------------- */

/* The smallest gap first, then by the places in the scan: a total order. */
static int by_gap(const void *left, const void *right) {
    const Link *p = left, *q = right;
    if (p->gap2 != q->gap2) return p->gap2 < q->gap2 ? -1 : 1;
    if (p->near != q->near) return p->near < q->near ? -1 : 1;
    return (p->far > q->far) - (p->far < q->far);
}

/* Leave out links that join nothing: within one surface, or between what is no body. Most are, and
 * cost more to sort than to look at. */
static void drop_idle_links(Search *search) {
    size_t kept = 0;
    for (size_t i = 0; i < search->link_count; i++) {
        const Link *link = &search->links[i];
        if (root_of(search, link->near) != root_of(search, link->far) && is_plausible(search, link))
            search->links[kept++] = *link;
    }
    search->link_count = kept;
}

/* Join surfaces as long as they fit into one vehicle. */
static void assemble(Segments *segments) {
    Search *search = &segments->search;
    drop_idle_links(search);
    if (search->link_count > 1) qsort(search->links, search->link_count, sizeof(Link), by_gap);
    for (size_t i = 0; i < search->link_count; i++) {
        const Link *link = &search->links[i];
        uint32_t a = root_of(search, link->near), b = root_of(search, link->far);
        if (a == b) continue;
        Shape both = hull(&segments->shapes[segments->shape_of[a]],
                          &segments->shapes[segments->shape_of[b]]);
        if (!is_vehicle(search->settings, &both)) continue;
        segments->shapes[segments->shape_of[join_roots(search, a, b)]] = both;
    }
}

static size_t number(Segments *segments, uint32_t *cluster_of) {
    Search *search = &segments->search;
    size_t clusters = 0;
    for (uint32_t i = 0; i < search->patches->sorted_count; i++) {
        uint32_t root = search->is_static[i] ? i : root_of(search, i);
        if (search->is_static[i]) cluster_of[i] = NO_CLUSTER;
        else if (root != i) cluster_of[i] = cluster_of[root];
        else if (is_vehicle(search->settings, &segments->shapes[segments->shape_of[i]]))
            cluster_of[i] = (uint32_t)clusters++;
        else cluster_of[i] = NO_CLUSTER;
    }
    return clusters;
}

int segments_find(Segments *segments, const SegmentSettings *settings, const Patches *patches,
                  double sensor_height, const uint8_t *is_static, uint32_t *cluster_of,
                  size_t *clusters, Problem *problem) {
    Search *search = &segments->search;
    *clusters = 0;
    if (patches->sorted_count == 0) return 0;
    search->settings = settings;
    search->patches = patches;
    search->sensor_height = sensor_height;
    search->is_static = is_static;
    set_axes(segments);
    if (neighbours_find(search, problem)
        || reserve(&segments->shape_of, &segments->shape_of_capacity, patches->sorted_count,
                   sizeof(uint32_t), problem)
        || measure(segments, problem))
        return 1;
    assemble(segments);
    *clusters = number(segments, cluster_of);
    return 0;
}

void segments_free(Segments *segments) {
    neighbours_free(&segments->search);
    free(segments->shape_of);
    free(segments->shapes);
}
