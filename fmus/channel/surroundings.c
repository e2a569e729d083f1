#include "surroundings.h"
#include "buffer.h"
#include <stdlib.h>

bool goes_first(const Scene *s, size_t from, size_t to) {
    const Antenna *a = &s->antenna[from], *b = &s->antenna[to];
    return is_before(a, b) || (!is_before(b, a) && from < to);
}

Link link_along(const Pair *pair, int way, size_t to) {
    const double *gain = pair->gain[way];
    return (Link){{gain[0], gain[1], gain[2]}, pair->distance, (uint32_t)to, pair->kind[way]};
}

/* Keep both directions as far as they reach the floor; nonzero if memory is short. */
static int keep(Surroundings *s, const Pair *pair, int way, double floor, size_t from, size_t to) {
    if (BUFFER_RESERVE(s->there, s->there_capacity, s->there_count + 1)
        || BUFFER_RESERVE(s->back, s->back_capacity, s->back_count + 1))
        return 1;
    if (pair->gain[way][CENTER] >= floor) s->there[s->there_count++] = link_along(pair, way, to);
    if (pair->gain[!way][CENTER] >= floor)
        s->back[s->back_count++] = (BackLink){link_along(pair, !way, from), (uint32_t)to};
    return 0;
}

void surroundings_find(Surroundings *s, const Search *search, PairScratch *scratch, size_t from) {
    const Scene *scene = search->scene;
    const View view = {scene, search->models, scratch};
    double range = search->models->parameters->maximum_range;
    s->there_count = s->back_count = s->is_short = 0;
    if (!scene->equipped[from]) return;
    for (size_t to = 0; to < scene->count && !s->is_short; to++) {
        if (search->turn[to] <= search->turn[from] || !scene->equipped[to]) continue;
        if (is_out_of_reach(search->cells, &view, search->reach, from, to)) continue;
        bool forth = goes_first(scene, from, to);
        const Antenna *a = &scene->antenna[forth ? from : to], *b = &scene->antenna[forth ? to : from];
        Pair pair;
        if (!pair_evaluate(&view, a, b, BOTH, search->floor, &pair)) continue;
        if (pair.distance > range) continue;
        s->is_short = keep(s, &pair, forth ? 0 : 1, search->floor, from, to);
    }
}

void surroundings_free(Surroundings *s) {
    free(s->there);
    free(s->back);
    *s = (Surroundings){0};
}
