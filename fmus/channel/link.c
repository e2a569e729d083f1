#include "link.h"
#include "buffer.h"
#include "pair.h"
#include "sort.h"
#include <stdlib.h>
#include <string.h>

static int rows_clear(LinkRows *s, size_t count) {
    size_t before = s->capacity;
    if (BUFFER_RESERVE(s->row, s->capacity, count)) return 1;
    if (s->capacity > before) memset(s->row + before, 0, (s->capacity - before) * sizeof *s->row);
    for (size_t k = 0; k < s->capacity; k++) s->row[k].count = s->row[k].is_complete = 0;
    s->count = count;
    s->floor = -1;
    return 0;
}

static void rows_free(LinkRows *s) {
    for (size_t k = 0; k < s->capacity; k++) free(s->row[k].link);
    free(s->row);
}

int links_forget(Links *s, const Scene *scene, const Parameters *p) {
    s->models = propagation_prepare(p);
    s->reach.floor = s->any_reach.floor = -1;
    return street_cells_follow(&s->cells, scene, &s->models) || rows_clear(&s->known, scene->count)
        || rows_clear(&s->strong, scene->count);
}

void links_free(Links *s) {
    street_cells_free(&s->cells);
    rows_free(&s->known);
    rows_free(&s->strong);
    free(s->key);
    free(s->unsorted);
    *s = (Links){0};
}

static bool goes_first(const Scene *s, size_t from, size_t to) {
    const Antenna *a = &s->antenna[from], *b = &s->antenna[to];
    return is_before(a, b) || (!is_before(b, a) && from < to);
}

static Link direction(const Pair *pair, int way, size_t to) {
    const double *gain = pair->gain[way];
    return (Link){{gain[0], gain[1], gain[2]}, pair->distance, (uint32_t)to, pair->kind[way]};
}

static int add(LinkRow *row, Link link) {
    if (BUFFER_RESERVE(row->link, row->capacity, row->count + 1)) return 1;
    row->link[row->count++] = link;
    return 0;
}

static bool is_nearer(const Link *a, const Link *b) {
    return a->distance != b->distance ? a->distance < b->distance : a->receiver < b->receiver;
}

/* Put the links of a complete row in order; nonzero if memory is short. */
static int put_in_order(Links *s, LinkRow *row) {
    size_t n = row->count;
    Link *link = row->link;
    if (BUFFER_RESERVE(s->key, s->key_capacity, 2 * n)
        || BUFFER_RESERVE(s->unsorted, s->unsorted_capacity, n))
        return 1;
    for (size_t k = 0; k < n; k++) s->key[k] = sort_key((float)link[k].distance, (uint32_t)k);
    sort_keys(s->key, s->key + n, n);
    if (n > 0) memcpy(s->unsorted, link, n * sizeof *link);
    for (size_t k = 0; k < n; k++) link[k] = s->unsorted[(uint32_t)s->key[k]];
    for (size_t i = 1; i < n; i++) { /* what single precision could not tell apart */
        if (!is_nearer(&link[i], &link[i - 1])) continue;
        Link moved = link[i];
        size_t k = i;
        for (; k > 0 && is_nearer(&moved, &link[k - 1]); k--) link[k] = link[k - 1];
        link[k] = moved;
    }
    return 0;
}

/* Evaluate the pairs of `from` that nobody has looked at yet. */
static int look_around(Links *s, Scene *scene, size_t from) {
    const Propagation *models = &s->models;
    LinkRows *rows = &s->known;
    for (size_t to = 0; to < scene->count; to++) {
        if (to == from || rows->row[to].is_complete || !scene->equipped[to]) continue;
        if (is_out_of_reach(&s->cells, scene, models, &s->reach, from, to)) continue;
        bool forth = goes_first(scene, from, to);
        const Antenna *a = &scene->antenna[forth ? from : to], *b = &scene->antenna[forth ? to : from];
        Pair pair;
        if (!pair_evaluate(scene, models, a, b, BOTH, rows->floor, &pair)) continue;
        if (pair.distance > models->parameters->maximum_range) continue;
        int way = forth ? 0 : 1;
        if (pair.gain[way][CENTER] >= rows->floor && add(&rows->row[from], direction(&pair, way, to)))
            return 1;
        way = !way;
        if (pair.gain[way][CENTER] >= rows->floor && add(&rows->row[to], direction(&pair, way, from)))
            return 1;
    }
    return 0;
}

static int complete(Links *s, Scene *scene, size_t from) {
    LinkRow *row = &s->known.row[from];
    double range = s->models.parameters->maximum_range;
    if (s->reach.floor != s->known.floor)
        street_cells_prepare(&s->cells, &s->reach, &s->models, s->known.floor, range);
    if (scene->equipped[from] && look_around(s, scene, from)) return 1;
    if (put_in_order(s, row)) return 1;
    row->is_complete = true;
    return 0;
}

static int select_strong(LinkRow *strong, const LinkRow *row, double floor) {
    strong->count = 0;
    if (BUFFER_RESERVE(strong->link, strong->capacity, row->count)) return 1;
    for (size_t k = 0; k < row->count; k++)
        if (row->link[k].gain[CENTER] >= floor) strong->link[strong->count++] = row->link[k];
    strong->is_complete = true;
    return 0;
}

int links_from(Links *s, Scene *scene, size_t from, double floor, const Link **links,
               size_t *count) {
    if (!(floor >= LEAST_GAIN)) floor = 0;
    if (s->known.floor > floor && links_forget(s, scene, s->models.parameters)) return 1;
    if (s->known.floor < 0) s->known.floor = floor;
    const LinkRow *row = &s->known.row[from];
    if (!row->is_complete && complete(s, scene, from)) {
        s->known.floor = INFINITY; /* half a row is none: the next call forgets it */
        return 1;
    }
    if (floor > s->known.floor) {
        if (s->strong.floor != floor && rows_clear(&s->strong, scene->count)) return 1;
        s->strong.floor = floor;
        LinkRow *strong = &s->strong.row[from];
        if (!strong->is_complete && select_strong(strong, row, floor)) return 1;
        row = strong;
    }
    *links = row->link;
    *count = row->count;
    return 0;
}

int link_between(Links *s, Scene *scene, size_t from, size_t to, double negligible, Link *link) {
    bool forth = goes_first(scene, from, to);
    const Antenna *a = &scene->antenna[forth ? from : to], *b = &scene->antenna[forth ? to : from];
    *link = (Link){.distance = distance_between(a->at, b->at), .receiver = (uint32_t)to};
    if (s->any_reach.floor != negligible)
        street_cells_prepare(&s->cells, &s->any_reach, &s->models, negligible, INFINITY);
    if (is_out_of_reach(&s->cells, scene, &s->models, &s->any_reach, from, to)) return 0;
    Pair pair;
    int way = forth ? 0 : 1;
    bool strong =
        pair_evaluate(scene, &s->models, a, b, forth ? FORTH : BACK, negligible, &pair);
    if (strong && pair.gain[way][CENTER] >= negligible) *link = direction(&pair, way, to);
    return 0;
}
