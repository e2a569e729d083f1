#include "neighbours.h"

#include <math.h>
#include <stdlib.h>

/* ---- the forest ----------------------------------------------------------------------------- */

uint32_t root_of(Search *search, uint32_t i) {
    uint32_t *parent = search->parent;
    while (parent[i] != i) {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    return i;
}

uint32_t join_roots(Search *search, uint32_t a, uint32_t b) {
    uint32_t root = a < b ? a : b;
    search->parent[a < b ? b : a] = root;
    return root;
}

/* ---- which patches are near each other ------------------------------------------------------- */

static int is_adjacent(const Search *search, const Patch *a, const Patch *b) {
    double cross = a->place[0] * b->place[1] - a->place[1] * b->place[0];
    double dot = a->place[0] * b->place[0] + a->place[1] * b->place[1];
    return dot > 0.0 && cross * cross <= search->sine * search->sine * a->range2 * b->range2;
}

static void unite(Search *search, uint32_t a, uint32_t b) {
    uint32_t left = root_of(search, a), right = root_of(search, b);
    if (left != right) join_roots(search, left, right);
}

static int add_link(Search *search, uint32_t a, uint32_t b, uint32_t is_hidden,
                    Problem *problem) {
    const Patch *p = &search->patches->sorted[a], *q = &search->patches->sorted[b];
    double x = p->place[0] - q->place[0], y = p->place[1] - q->place[1];
    int is_farther = p->range2 > q->range2 || (p->range2 == q->range2 && a > b);
    if (reserve(&search->links, &search->link_capacity, search->link_count + 1, sizeof(Link),
                problem))
        return 1;
    search->links[search->link_count++] =
        (Link){x * x + y * y, is_farther ? b : a, is_farther ? a : b, is_hidden};
    return 0;
}

/* Remember a neighbour if it is the one of most similar range in the next direction. What is seen
 * over it only, as a cabin is over a bonnet, does not continue the surface. */
static void note(Search *search, uint32_t i, uint32_t neighbour, int side, uint32_t steps) {
    const double over = 0.5; /* [m] */
    const Patch *patches = search->patches->sorted;
    const Surroundings *around = search->around;
    Surroundings *own = &search->around[i];
    uint32_t known = own->beside[side];
    if (patches[neighbour].foot > patches[i].foot + over) return;
    if (known != NO_PATCH && own->steps[side] < steps) return;
    if (known != NO_PATCH && own->steps[side] == steps
        && fabs(around[known].range - own->range) <= fabs(around[neighbour].range - own->range))
        return;
    own->beside[side] = neighbour;
    own->steps[side] = steps;
}

/* Two patches in one direction that are one surface. */
static void see_column(Search *search, uint32_t i, uint32_t other) {
    Surroundings *around = &search->around[i];
    const Patch *patch = &search->patches->sorted[other];
    if (patch->height > around->top) around->top = patch->height;
    if (patch->foot < around->foot) around->foot = patch->foot;
}

/* Two patches that are one surface, the second one counter-clockwise of the first. */
static void meet_beside(Search *search, uint32_t i, uint32_t other, uint32_t steps) {
    Surroundings *around = search->around;
    around[i].is_joined[1] = around[other].is_joined[0] = 1;
    note(search, i, other, 1, steps);
    note(search, other, i, 0, steps);
}

/* The patches of one direction, as those of another are compared with them. */
typedef struct {
    uint32_t next, begin, end;
    uint32_t steps; /* from the direction of the patches compared */
    int may_link;   /* it is the next one in which anything is seen */
} Row;

/* Compare patch `i` with a row: patches within the depth gap are one surface, the nearest ones
 * before and behind are linked if they are within reach. `row->next` moves on with the range. */
static int meet(Search *search, uint32_t i, Row *row, Problem *problem) {
    const Patch *patches = search->patches->sorted, *patch = &patches[i];
    const Surroundings *around = search->around;
    const double gap = search->settings->depth_gap, reach = search->settings->reach;
    const double range = around[i].range;
    while (row->next < row->end && around[row->next].range < range - gap) ++row->next;
    uint32_t j = row->next;
    uint32_t before = j > row->begin ? j - 1 : NO_PATCH;
    for (; j < row->end && around[j].range <= range + gap; j++) {
        if (j == i || search->is_static[j] || !is_adjacent(search, patch, &patches[j])) continue;
        unite(search, i, j);
        if (row->steps) meet_beside(search, i, j, row->steps);
        else see_column(search, i, j);
    }
    const uint32_t beyond[2] = {before, j < row->end ? j : NO_PATCH};
    for (int k = 0; k < 2; k++) {
        uint32_t other = beyond[k];
        if (!row->may_link || other == NO_PATCH || search->is_static[other]
            || fabs(around[other].range - range) > reach
            || !is_adjacent(search, patch, &patches[other]))
            continue;
        if (row->steps) {
            note(search, i, other, 1, row->steps);
            note(search, other, i, 0, row->steps);
        }
        if (add_link(search, i, other, 0, problem)) return 1;
    }
    return 0;
}

/* Compare the patches of one direction with each other and with those of the next directions. */
static int compare(Search *search, uint32_t direction, Problem *problem) {
    const uint32_t *first = search->patches->first;
    int others = 0;
    for (uint32_t steps = 0; steps <= search->steps; steps++) {
        uint32_t other = (direction + steps) % DIRECTIONS;
        if (first[other] == first[other + 1]) continue;
        others += steps > 0;
        Row row = {first[other], first[other], first[other + 1], steps, others <= 1};
        for (uint32_t i = first[direction]; i < first[direction + 1]; i++)
            if (!search->is_static[i] && meet(search, i, &row, problem)) return 1;
    }
    return 0;
}

/* Look from the edge of a surface, clockwise or counter-clockwise: what is nearer than the depth
 * gap is the same surface, for a body near the sensor has parts below its field of view; what goes
 * on at about the same range behind something in front is linked to it. */
static int look_on(Search *search, uint32_t i, int side, Problem *problem) {
    const double hidden = 1.0; /* [m], less than there is between the flanks of cars in two lanes */
    const uint32_t *first = search->patches->first;
    const Patch *patches = search->patches->sorted, *patch = &patches[i];
    const Surroundings *around = search->around;
    const double range = around[i].range, gap = search->settings->depth_gap;
    uint32_t empty = 0;
    double end = hidden / (range > hidden ? range : hidden) * (PI / 2); /* asin x <= x pi / 2 */
    for (uint32_t steps = 1; steps * NARROWEST <= end; steps++) {
        uint32_t other = (patch->direction + (side ? steps : DIRECTIONS - steps)) % DIRECTIONS;
        empty++;
        for (uint32_t j = first[other]; j < first[other + 1]; j++) {
            if (around[j].range > range + gap) break;
            if (empty <= search->steps) empty = 0;
            if (around[j].range < range - gap || search->is_static[j]) continue;
            double x = patches[j].place[0] - patch->place[0];
            double y = patches[j].place[1] - patch->place[1];
            double distance2 = x * x + y * y;
            if (distance2 <= gap * gap) {
                unite(search, i, j);
                return 0;
            }
            if (empty == 0 && distance2 <= hidden * hidden)
                return add_link(search, i, j, 1, problem);
        }
    }
    return 0;
}

static int connect(Search *search, Problem *problem) {
    for (uint32_t direction = 0; direction < DIRECTIONS; direction++)
        if (search->patches->first[direction] != search->patches->first[direction + 1]
            && compare(search, direction, problem))
            return 1;
    for (uint32_t i = 0; i < search->patches->sorted_count; i++)
        for (int side = 0; !search->is_static[i] && side < 2; side++)
            if (!search->around[i].is_joined[side] && look_on(search, i, side, problem))
                return 1;
    return 0;
}

int neighbours_find(Search *search, Problem *problem) {
    const Patches *patches = search->patches;
    size_t count = patches->sorted_count;
    if (reserve(&search->parent, &search->parent_capacity, count, sizeof(uint32_t), problem)
        || reserve(&search->around, &search->around_capacity, count, sizeof(Surroundings), problem))
        return 1;
    for (size_t i = 0; i < count; i++) {
        const Patch *patch = &patches->sorted[i];
        search->parent[i] = (uint32_t)i;
        search->around[i] = (Surroundings){.range = sqrt(patch->range2), .top = patch->height,
                                           .foot = patch->foot, .beside = {NO_PATCH, NO_PATCH}};
    }
    double cosine;
    sine_cosine(search->settings->adjacent, &search->sine, &cosine);
    search->steps = (uint32_t)(search->settings->adjacent / NARROWEST) + 1;
    search->link_count = 0;
    return connect(search, problem);
}

void neighbours_free(Search *search) {
    free(search->parent);
    free(search->around);
    free(search->links);
}
