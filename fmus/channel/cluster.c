#include "cluster.h"
#include "buffer.h"
#include "sort.h"
#include <math.h>
#include <string.h>

/* A cluster is at most this wide and this long [m]: about a street, and part of its length. */
static const double WIDTH = 12, LENGTH = 60;

/* Traffic along x and along y forms clusters of its own, so that they follow the streets. */
static int axis_of(const Antenna *a) {
    double direction[2];
    unit_vector(a->heading, direction);
    return fabs(direction[1]) > fabs(direction[0]);
}

static double coordinate(const Antenna *a, int axis) { return axis ? a->at.y : a->at.x; }

static double coordinate_of(const Scene *scene, uint64_t key, int axis) {
    return coordinate(&scene->antenna[(uint32_t)key], axis);
}

/* The end of the radios from `first` on that span no more than `extent`; they are sorted. */
static size_t end_of_span(const Scene *scene, const uint64_t *key, size_t first, size_t count,
                          int axis, double extent) {
    double limit = coordinate_of(scene, key[first], axis) + extent;
    size_t end = first + 1;
    while (end < count && coordinate_of(scene, key[end], axis) <= limit) end++;
    return end;
}

static void sort_along(Clusters *s, const Scene *scene, uint64_t *key, size_t count, int axis) {
    for (size_t k = 0; k < count; k++)
        key[k] = sort_key((float)coordinate_of(scene, key[k], axis), (uint32_t)key[k]);
    sort_keys(key, s->key + s->key_capacity / 2, count);
}

static int add_cluster(Clusters *s, const Scene *scene, size_t count) {
    if (BUFFER_RESERVE(s->cluster, s->cluster_capacity, s->clusters + 1)) return 1;
    Cluster c = {.first = (uint32_t)s->members, .top = -INFINITY, .sight = NO_SIGHT};
    c.count = (uint32_t)count;
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (size_t i = 0; i < count; i++)
        for (int axis = 0; axis < 2; axis++) {
            double at = coordinate(&scene->antenna[s->member[s->members + i]], axis);
            low[axis] = smaller(low[axis], at);
            high[axis] = larger(high[axis], at);
        }
    c.area = area_between(low, high);
    for (size_t i = 0; i < count; i++) {
        uint32_t member = s->member[s->members + i];
        c.top = larger(c.top, scene->antenna[member].at.z);
        s->cluster_of[member] = (uint32_t)s->clusters;
    }
    s->members += count;
    s->cluster[s->clusters++] = c;
    return 0;
}

/* Cut a strip of radios, one street perhaps, into clusters. */
static int cut_strip(Clusters *s, const Scene *scene, uint64_t *key, size_t count, int axis) {
    sort_along(s, scene, key, count, axis);
    for (size_t first = 0, end; first < count; first = end) {
        end = end_of_span(scene, key, first, count, axis, LENGTH);
        for (size_t k = first; k < end; k++) s->member[s->members + k - first] = (uint32_t)key[k];
        if (add_cluster(s, scene, end - first)) return 1;
    }
    return 0;
}

/* Cut the radios that head along an axis into strips along it. */
static int cut_axis(Clusters *s, const Scene *scene, int axis) {
    size_t count = 0;
    for (size_t k = 0; k < scene->count; k++)
        if (scene->equipped[k] && axis_of(&scene->antenna[k]) == axis) s->key[count++] = k;
    sort_along(s, scene, s->key, count, !axis);
    for (size_t first = 0, end; first < count; first = end) {
        end = end_of_span(scene, s->key, first, count, !axis, WIDTH);
        if (cut_strip(s, scene, s->key + first, end - first, axis)) return 1;
    }
    return 0;
}

/* Places for what is remembered, a power of two. */
enum { HIDERS = 1 << 16 };

int clusters_build(Clusters *s, const Scene *scene) {
    s->clusters = s->members = s->sights = s->views = s->obstacles = s->known_count = 0;
    s->scene++;
    size_t n = scene->count;
    if (BUFFER_RESERVE(s->member, s->member_capacity, n)
        || BUFFER_RESERVE(s->cluster_of, s->cluster_of_capacity, n)
        || BUFFER_RESERVE(s->key, s->key_capacity, 2 * n))
        return 1;
    if (!s->hider) s->hider = calloc(HIDERS, sizeof *s->hider);
    if (!s->hider) return 1;
    return cut_axis(s, scene, 0) || cut_axis(s, scene, 1);
}

void clusters_free(Clusters *s) {
    free(s->cluster);
    free(s->member);
    free(s->cluster_of);
    free(s->hider);
    free(s->key);
    free(s->sight);
    free(s->view);
    free(s->obstacle);
    free(s->known);
    *s = (Clusters){0};
}

/* ---- views ---- */

/* Two clusters, and what their links are known to lose. */
typedef struct {
    const Area *a, *b;
    double top;         /* of all antennas [m] */
    double shortest;    /* no link is shorter, in the plane [m] */
    double loss, limit; /* a loss above the limit puts all links below the floor; factors */
} Gap;

static double shortest_between(const Area *a, const Area *b) {
    double square = 0;
    for (int k = 0; k < 2; k++) {
        double gap = fabs(a->center[k] - b->center[k]) - a->half[k] - b->half[k];
        if (gap > 0) square += gap * gap;
    }
    return sqrt(square) * (1 - 1e-9);
}

/* A little less than exp(x) for x >= 0, and without a call. */
static double lower_exponential(double x) { return 1 + x * (1 + x * (0.5 + x * (1 / 6.1 + x / 24.1))); }

/* Whether building k may be in the way of a link; what it takes from all of them is added. */
static bool may_matter(const Scene *s, const Propagation *m, uint32_t k, Gap *gap) {
    Cover cover = building_cover(&s->buildings, k, gap->a, gap->b);
    if (cover.is_clear) return false;
    if (m->parameters->finite_buildings && s->buildings.height[k] <= gap->top) return true;
    double nepers = cover.inside * gap->shortest * m->indoor_nepers;
    if (nepers > 0) gap->loss *= lower_exponential(nepers);
    if (cover.is_hidden) gap->loss *= m->two_walls;
    return true;
}

static bool is_hopeless(const Gap *gap) { return gap->loss > gap->limit; }

/* Whether a building that has hidden something before hides it again. */
static bool is_hidden(const Scene *s, const Propagation *m, uint32_t building, Gap *gap) {
    if (!m->parameters->building_shadowing || building >= s->buildings.count) return false;
    may_matter(s, m, building, gap);
    bool hopeless = is_hopeless(gap);
    gap->loss = 1;
    return hopeless;
}

static Position center_of(const Area *a) { return (Position){a->center[0], a->center[1], 0}; }

/* Add the buildings to the obstacles of the view; false if they hide the clusters from each other,
 * the last of them `*hider`. */
static bool look_past_buildings(Clusters *s, Scene *scene, const Propagation *m, Gap *gap,
                                const double margin[2], View *view, uint32_t *hider) {
    Nearby near = buildings_near(&scene->buildings, center_of(gap->a), center_of(gap->b), margin);
    for (size_t i = 0; i < near.count; i++) {
        if (!may_matter(scene, m, near.index[i], gap)) continue;
        s->obstacle[view->first + view->buildings++] = near.index[i];
        if (!is_hopeless(gap)) continue;
        *hider = near.index[i];
        return false;
    }
    return true;
}

static int add_sight(Clusters *s, size_t from, size_t to, uint32_t view) {
    if (BUFFER_RESERVE(s->sight, s->sight_capacity, s->sights + 1)) return 1;
    s->sight[s->sights] = (Sight){(uint32_t)to, view, s->cluster[from].sight};
    s->cluster[from].sight = (uint32_t)s->sights++;
    return 0;
}

/* The place of the building that hid these areas from each other last, or areas thereabouts. */
static uint32_t *hider_between(Clusters *s, const Area *a, const Area *b) {
    static const double CELL = 50; /* [m] */
    uint64_t hash = 0;
    for (int k = 0; k < 2; k++) {
        hash = hash * 0x9E3779B97F4A7C15u + (uint64_t)(int64_t)(a->center[k] / CELL);
        hash = hash * 0x9E3779B97F4A7C15u + (uint64_t)(int64_t)(b->center[k] / CELL);
    }
    return &s->hider[(hash ^ hash >> 32) * 0x9E3779B97F4A7C15u >> 48 & (HIDERS - 1)];
}

/* Look at what is between two areas; a building that hides them from each other is the `*hider`.
 * Nonzero if memory is short. */
static int look(Clusters *s, Scene *scene, const Propagation *m, Gap *gap, uint32_t *hider,
                uint32_t *found) {
    View view = {.first = s->obstacles};
    double margin[2];
    for (int k = 0; k < 2; k++) margin[k] = larger(gap->a->half[k], gap->b->half[k]);
    *found = NO_VIEW;
    if (BUFFER_RESERVE(s->obstacle, s->obstacle_capacity,
                       s->obstacles + scene->buildings.count + scene->bodies.count)
        || BUFFER_RESERVE(s->view, s->view_capacity, s->views + 1))
        return 1;
    if (m->parameters->building_shadowing
        && !look_past_buildings(s, scene, m, gap, margin, &view, hider))
        return 0;
    if (m->parameters->vehicle_shadowing) {
        Nearby near = bodies_near(&scene->bodies, center_of(gap->a), center_of(gap->b), margin);
        for (size_t i = 0; i < near.count; i++)
            s->obstacle[view.first + view.buildings + view.bodies++] = near.index[i];
    }
    s->obstacles += view.buildings + view.bodies;
    *found = (uint32_t)s->views++;
    s->view[*found] = view;
    return 0;
}

static Gap gap_between(const Clusters *s, const Propagation *m, double floor, size_t from, size_t to) {
    const Cluster *a = &s->cluster[from], *b = &s->cluster[to];
    Gap gap = {.a = &a->area, .b = &b->area, .top = larger(a->top, b->top), .loss = 1};
    gap.shortest = shortest_between(gap.a, gap.b);
    gap.limit = highest_gain(m, gap.shortest) / floor;
    return gap;
}

/* Room for one more known view; the table is at most half full. */
static int reserve_known(Clusters *s) {
    if (2 * (s->known_count + 1) <= s->known_size) return 0;
    size_t size = s->known_size ? 2 * s->known_size : 1024;
    KnownView *known = calloc(size, sizeof *known);
    if (!known) return 1;
    free(s->known); /* what was known is found out again */
    s->known = known;
    s->known_size = size;
    s->known_count = 0;
    return 0;
}

/* The place of a pair of clusters in the table, perhaps still free. */
static KnownView *place_of(Clusters *s, uint32_t a, uint32_t b) {
    uint64_t hash = ((uint64_t)a << 32 | b) * 0x9E3779B97F4A7C15u;
    for (size_t at = hash >> 32;; at++) {
        KnownView *place = &s->known[at & (s->known_size - 1)];
        if (place->scene != s->scene || (place->a == a && place->b == b)) return place;
    }
}

/* What a cluster sees at the floor of the rows serves a lower floor, too. */
static int remember(Clusters *s, uint32_t a, uint32_t b, uint32_t view) {
    if (reserve_known(s)) return 1;
    KnownView *place = a < b ? place_of(s, a, b) : place_of(s, b, a);
    s->known_count += place->scene != s->scene;
    *place = (KnownView){a < b ? a : b, a < b ? b : a, s->scene, view};
    return 0;
}

int clusters_look(Clusters *s, Scene *scene, const Propagation *m, double floor, size_t from) {
    Cluster *own = &s->cluster[from];
    uint32_t last = UINT32_MAX; /* the building that has hidden the cluster before */
    for (size_t to = 0; to < s->clusters; to++) {
        const Cluster *other = &s->cluster[to];
        if (other->has_looked) continue;
        Gap gap = gap_between(s, m, floor, from, to);
        if (gap.shortest > m->parameters->maximum_range) continue;
        if (is_hopeless(&gap) || is_hidden(scene, m, last, &gap)) continue;
        uint32_t *hider = hider_between(s, gap.a, gap.b);
        if (*hider == last || !is_hidden(scene, m, *hider, &gap)) {
            uint32_t view;
            if (look(s, scene, m, &gap, hider, &view)) return 1;
            if (view != NO_VIEW
                && (add_sight(s, from, to, view) || (to != from && add_sight(s, to, from, view))
                    || remember(s, (uint32_t)from, (uint32_t)to, view)))
                return 1;
        }
        last = *hider;
    }
    own->has_looked = true;
    return 0;
}

int clusters_view(Clusters *s, Scene *scene, const Propagation *m, double floor, size_t from,
                  size_t to, uint32_t *view) {
    if (s->known_floor != floor) {
        s->known_floor = floor;
        s->known_count = 0;
        if (s->known) memset(s->known, 0, s->known_size * sizeof *s->known);
    }
    if (reserve_known(s)) return 1;
    uint32_t a = s->cluster_of[from], b = s->cluster_of[to];
    KnownView *place = a < b ? place_of(s, a, b) : place_of(s, b, a);
    *view = place->view;
    if (place->scene == s->scene) return 0;
    *view = NO_VIEW;
    Gap gap = gap_between(s, m, floor, a, b);
    uint32_t hider;
    if (!is_hopeless(&gap) && look(s, scene, m, &gap, &hider, view)) return 1;
    return remember(s, a, b, *view);
}
