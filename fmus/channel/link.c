#include "link.h"
#include "buffer.h"
#include "sort.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- rows ---- */

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

static int add(LinkRow *row, const Link *link) {
    if (BUFFER_RESERVE(row->link, row->capacity, row->count + 1)) return 1;
    row->link[row->count++] = *link;
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

/* ---- batches ---- */

static void find(void *context, size_t task, size_t worker) {
    Links *s = context;
    surroundings_find(&s->batch.found[task], &s->search, &s->scratch[worker], s->batch.radio[task]);
}

/* Complete the next row of the batch, whose links have been found. */
static int take(Links *s) {
    uint32_t from = s->batch.radio[s->batch.taken];
    const Surroundings *found = &s->batch.found[s->batch.taken];
    LinkRow *row = &s->known.row[from];
    if (found->is_short) return 1;
    if (BUFFER_RESERVE(row->link, row->capacity, row->count + found->there_count)) return 1;
    if (found->there_count > 0)
        memcpy(row->link + row->count, found->there, found->there_count * sizeof *row->link);
    row->count += found->there_count;
    for (size_t k = 0; k < found->back_count; k++)
        if (add(&s->known.row[found->back[k].radio], &found->back[k].link)) return 1;
    if (put_in_order(s, row)) return 1;
    row->is_complete = true;
    s->batch.taken++;
    return 0;
}

/* No thread finds links any more; what they have found is lost. */
static size_t drop_batch(Links *s) {
    size_t found = s->batch.count > 0 ? team_end(s->team) : 0;
    s->batch.count = 0;
    return found;
}

/* Take what threads have found; the other rows have to wait until they are asked for. */
static int end_batch(Links *s) {
    Batch *batch = &s->batch;
    size_t count = batch->count, found = drop_batch(s);
    while (batch->taken < found)
        if (take(s)) return 1;
    for (size_t k = 0; k < count; k++)
        s->turn[batch->radio[k]] = k < batch->taken ? DONE : LATER;
    return 0;
}

static int reserve_scratch(Links *s, size_t workers) {
    size_t before = s->scratch_capacity;
    if (BUFFER_RESERVE(s->scratch, s->scratch_capacity, workers)) return 1;
    if (s->scratch_capacity > before)
        memset(s->scratch + before, 0, (s->scratch_capacity - before) * sizeof *s->scratch);
    for (size_t k = 0; k < workers; k++)
        if (pair_scratch_reserve(&s->scratch[k], s->scene)) return 1;
    return 0;
}

static int reserve_batch(Batch *batch, size_t count) {
    size_t before = batch->found_capacity;
    if (BUFFER_RESERVE(batch->radio, batch->radio_capacity, count)
        || BUFFER_RESERVE(batch->found, batch->found_capacity, count))
        return 1;
    if (batch->found_capacity > before)
        memset(batch->found + before, 0, (batch->found_capacity - before) * sizeof *batch->found);
    return 0;
}

/* Give turns to those of the rows that are not known yet. */
static int plan_batch(Links *s, const uint32_t *radio, size_t count, size_t workers, size_t *wanted) {
    Batch *batch = &s->batch;
    if (end_batch(s) || reserve_batch(batch, count) || reserve_scratch(s, workers)) return 1;
    if (s->reach.floor != s->known.floor)
        street_cells_prepare(&s->cells, &s->reach, &s->models, s->known.floor,
                             s->models.parameters->maximum_range);
    *wanted = 0;
    for (size_t k = 0; k < count; k++) {
        if (s->turn[radio[k]] != LATER) continue;
        batch->radio[(*wanted)++] = radio[k];
        s->turn[radio[k]] = (Turn)*wanted;
    }
    batch->taken = 0;
    s->search = (Search){s->scene, &s->models, &s->cells, &s->reach, s->known.floor, s->turn};
    return 0;
}

/* Have threads begin to find those of the rows that are not known yet. */
static int begin_batch(Links *s, const uint32_t *radio, size_t count, size_t workers) {
    size_t wanted;
    if (plan_batch(s, radio, count, workers, &wanted)) return 1;
    if (wanted == 0) return 0;
    if (team_begin(s->team, workers, find, s, wanted)) return 1;
    s->batch.count = wanted;
    return 0;
}

/* Find a row that nobody has expected. */
static int find_alone(Links *s, uint32_t from) {
    size_t wanted;
    if (plan_batch(s, &from, 1, 1, &wanted)) return 1;
    find(s, 0, 0);
    s->turn[from] = DONE;
    return take(s);
}

/* Half a row is none: the next call forgets it. */
static int fail(Links *s) {
    drop_batch(s);
    s->known.floor = INFINITY;
    return 1;
}

/* ---- what links offer ---- */

int links_forget(Links *s, const Scene *scene, const Parameters *p) {
    if (!s->team && !(s->team = team_new())) return 1;
    drop_batch(s);
    s->batch.taken = 0;
    s->scene = scene;
    s->models = propagation_prepare(p);
    s->reach.floor = s->any_reach.floor = -1;
    if (BUFFER_RESERVE(s->turn, s->turn_capacity, scene->count)) return 1;
    for (size_t k = 0; k < scene->count; k++) s->turn[k] = LATER;
    return reserve_scratch(s, 1) || street_cells_follow(&s->cells, scene, &s->models)
        || rows_clear(&s->known, scene->count);
}

void links_free(Links *s) {
    team_free(s->team);
    street_cells_free(&s->cells);
    rows_free(&s->known);
    for (size_t k = 0; k < s->batch.found_capacity; k++) surroundings_free(&s->batch.found[k]);
    for (size_t k = 0; k < s->scratch_capacity; k++) pair_scratch_free(&s->scratch[k]);
    free(s->batch.radio);
    free(s->batch.found);
    free(s->scratch);
    free(s->turn);
    free(s->key);
    free(s->unsorted);
    *s = (Links){0};
}

/* Know rows of this floor or of a lower one. */
static int adopt_floor(Links *s, double floor) {
    if (s->known.floor > floor && links_forget(s, s->scene, s->models.parameters)) return 1;
    if (s->known.floor < 0) s->known.floor = floor;
    return 0;
}

static int adopt_negligible(Links *s, double negligible) {
    if (s->any_reach.floor == negligible) return 0;
    if (end_batch(s)) return fail(s); /* its threads read the cells */
    street_cells_prepare(&s->cells, &s->any_reach, &s->models, negligible, INFINITY);
    return 0;
}

/* Where fewer pairs of radios are expected, one worker is done before others are awake. */
static const size_t MANY_PAIRS = 4000;

/* Links that only interfere are found with the others where so many frames are on air at a time that
 * most of them will be asked for, or where helpers find them. */
static bool finds_all(size_t workers, double load) { return load >= (workers > 1 ? 1 : 3); }

/* More workers than this have to wait for the one that puts events in order. */
static const size_t WORKERS_THAT_PAY = 4;

static size_t workers_for(Links *s, size_t rows) {
    size_t wanted = s->models.parameters->workers;
    if (wanted == 0) {
        if (rows * s->scene->count < MANY_PAIRS) return 1;
        if (s->workers_allowed == 0) s->workers_allowed = workers_allowed();
        wanted = s->workers_allowed < WORKERS_THAT_PAY ? s->workers_allowed : WORKERS_THAT_PAY;
    }
    return wanted < rows ? wanted : rows;
}

static double floor_of(double wanted) { return wanted >= LEAST_GAIN ? wanted : 0; }

int links_expect(Links *s, const Expected *e) {
    size_t workers = workers_for(s, e->count);
    bool all = s->known.floor < 0 && finds_all(workers, e->load);
    if (adopt_floor(s, floor_of(all ? smaller(e->floor, e->negligible) : e->floor))) return 1;
    if (workers < 2) return 0;
    if (adopt_negligible(s, e->negligible)) return 1;
    return begin_batch(s, e->radio, e->count, workers) ? fail(s) : 0;
}

int links_rest(Links *s) { return end_batch(s) ? fail(s) : 0; }

static int complete(Links *s, uint32_t from) {
    if (s->turn[from] == LATER) return find_alone(s, from);
    while (!s->known.row[from].is_complete) {
        team_wait(s->team, s->batch.taken);
        if (take(s)) return 1;
    }
    return 0;
}

int links_from(Links *s, size_t from, double floor, LinksFrom *found) {
    if (adopt_floor(s, floor_of(floor))) return 1;
    const LinkRow *row = &s->known.row[from];
    if (!row->is_complete && complete(s, (uint32_t)from)) return fail(s);
    *found = (LinksFrom){row->link, row->count, s->known.floor};
    return 0;
}

int link_between(Links *s, size_t from, size_t to, double negligible, Link *link) {
    bool forth = goes_first(s->scene, from, to);
    const Antenna *antenna = s->scene->antenna;
    const Antenna *a = &antenna[forth ? from : to], *b = &antenna[forth ? to : from];
    *link = (Link){.distance = distance_between(a->at, b->at), .receiver = (uint32_t)to};
    if (adopt_negligible(s, negligible)) return 1;
    View view = links_view(s);
    if (is_out_of_reach(&s->cells, &view, &s->any_reach, from, to)) return 0;
    Pair pair;
    int way = forth ? 0 : 1;
    bool strong = pair_evaluate(&view, a, b, forth ? FORTH : BACK, negligible, &pair);
    if (strong && pair.gain[way][CENTER] >= negligible) *link = link_along(&pair, way, to);
    return 0;
}

View links_view(const Links *s) { return (View){s->scene, &s->models, s->scratch}; }
