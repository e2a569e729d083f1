#include "street_cells.h"
#include "buffer.h"
#include "decibel.h"
#include <math.h>
#include <string.h>

/* Of a cell [m]: smaller than most buildings. If there is no room for the cells, they get larger. */
static const double SMALLEST = 6, LARGEST = 64;

/* The losses between the most cells take 64 MiB. */
enum { FEWEST_CELLS = 256, MOST_CELLS = 8192 };

/* ---- cells ---- */

static void forget_cells(StreetCells *s) {
    s->count = 0;
    if (s->side > 0) memset(s->table, 0xff, 2 * s->side * sizeof *s->table);
}

void street_cells_free(StreetCells *s) {
    free(s->place);
    free(s->table);
    free(s->loss);
    free(s->cell_of);
    *s = (StreetCells){0};
}

/* The entry of the table for a place, perhaps still free. */
static uint32_t *entry_of(const StreetCells *s, CellPlace place) {
    uint64_t hash = ((uint64_t)(uint32_t)place.x << 32 | (uint32_t)place.y) * 0x9E3779B97F4A7C15u;
    for (size_t at = hash >> 32;; at++) {
        uint32_t *entry = &s->table[at & (2 * s->side - 1)];
        if (*entry == NO_CELL) return entry;
        const CellPlace *other = &s->place[*entry];
        if (other->x == place.x && other->y == place.y) return entry;
    }
}

/* Room for twice as many cells. */
static int grow(StreetCells *s) {
    StreetCells more = *s;
    size_t side = more.side = s->side ? 2 * s->side : FEWEST_CELLS;
    more.place = malloc(side * sizeof *more.place);
    more.table = malloc(2 * side * sizeof *more.table);
    more.loss = malloc(side * side * sizeof *more.loss);
    bool has_room = more.place && more.table && more.loss;
    StreetCells *spare = has_room ? s : &more;
    if (has_room) {
        memset(more.table, 0xff, 2 * side * sizeof *more.table);
        for (uint32_t k = 0; k < s->count; k++) {
            more.place[k] = s->place[k];
            *entry_of(&more, s->place[k]) = k;
            memcpy(more.loss + k * side, s->loss + k * s->side, s->count * sizeof *s->loss);
        }
    }
    free(spare->place);
    free(spare->table);
    free(spare->loss);
    if (has_room) *s = more;
    return !has_room;
}

static void add_cell(StreetCells *s, CellPlace place, uint32_t *entry) {
    size_t k = s->count++;
    s->place[k] = place;
    *entry = (uint32_t)k;
    for (size_t other = 0; other <= k; other++)
        s->loss[k * s->side + other] = s->loss[other * s->side + k] = UNKNOWN_LOSS;
}

/* Find the cells of all radios, as far as there is room for them. */
static int find_cells(StreetCells *s, const Scene *scene, bool *has_room) {
    *has_room = true;
    for (size_t k = 0; k < scene->count; k++) {
        s->cell_of[k] = NO_CELL;
        if (!scene->equipped[k]) continue;
        const Position *at = &scene->antenna[k].at;
        CellPlace place = {(int32_t)floor(at->x / s->size), (int32_t)floor(at->y / s->size)};
        if (s->count == s->side && s->side < MOST_CELLS && grow(s)) return 1;
        uint32_t *entry = entry_of(s, place);
        if (*entry == NO_CELL && s->count == s->side) *has_room = false;
        else if (*entry == NO_CELL) add_cell(s, place, entry);
        s->cell_of[k] = *entry;
    }
    return 0;
}

static bool is_same(const WallModel *a, const WallModel *b) {
    return a->wall_db == b->wall_db && a->indoor_db == b->indoor_db && a->finite == b->finite;
}

int street_cells_follow(StreetCells *s, const Scene *scene, const Propagation *m) {
    double top = s->side > 0 ? s->top : -INFINITY;
    for (size_t k = 0; k < scene->count; k++)
        if (scene->equipped[k]) top = larger(top, scene->antenna[k].at.z);
    if (BUFFER_RESERVE(s->cell_of, s->cell_of_capacity, scene->count)) return 1;
    if (s->side == 0) {
        s->size = SMALLEST;
        s->floor = INFINITY;
        if (grow(s)) return 1;
    }
    bool is_shadowed = m->parameters->building_shadowing;
    if (s->buildings != scene->buildings.version || top != s->top || is_shadowed != s->is_shadowed
        || !is_same(&s->walls, &m->walls))
        forget_cells(s);
    s->buildings = scene->buildings.version;
    s->is_shadowed = is_shadowed;
    s->top = top;
    s->walls = m->walls;
    for (;;) {
        bool has_room;
        if (find_cells(s, scene, &has_room)) return 1;
        if (has_room || s->size >= LARGEST) return 0;
        s->size *= 2;
        forget_cells(s);
    }
}

/* ---- pairs of cells ---- */

static Area area_of(const StreetCells *s, uint32_t cell) {
    const CellPlace *p = &s->place[cell];
    return area_between((double[]){p->x * s->size, p->y * s->size},
                        (double[]){(p->x + 1) * s->size, (p->y + 1) * s->size});
}

static Position center_of(const Area *a) { return (Position){a->center[0], a->center[1], 0}; }

/* Only a building on the line between the centres is in the way of all links. */
LossCode street_cells_find_loss(const StreetCells *s, const View *v, uint32_t a, uint32_t b) {
    static const double NO_MARGIN[2] = {0, 0};
    const Scene *scene = v->scene;
    const Propagation *m = v->models;
    Area from = area_of(s, a), to = area_of(s, b);
    Gap gap = gap_between(&from, &to, s->top);
    if (m->parameters->building_shadowing) {
        Nearby near = buildings_near(&scene->buildings, &v->scratch->buildings, center_of(&from),
                                     center_of(&to), NO_MARGIN);
        double enough = highest_gain(m, gap.shortest) / s->floor;
        for (size_t i = 0; i < near.count && gap.loss <= enough; i++)
            gap_meets(&gap, scene, m, near.index[i]);
    }
    LossCode code = (LossCode)smaller(to_db(gap.loss), LOSSES - 1);
    atomic_store_explicit(&s->loss[a * s->side + b], code, memory_order_relaxed);
    atomic_store_explicit(&s->loss[b * s->side + a], code, memory_order_relaxed);
    return code;
}

/* ---- reach ---- */

/* Of links with this loss, a factor; no more than that of `range` [m]. */
static double reach_square(const Propagation *m, double floor, double loss, double range) {
    double low = 0, high = range;
    if (highest_gain(m, high) >= floor * loss) return high * high;
    for (int k = 0; k < 40; k++) {
        double middle = (low + high) / 2;
        if (highest_gain(m, middle) >= floor * loss) low = middle;
        else high = middle;
    }
    return high * high;
}

void street_cells_prepare(StreetCells *s, Reach *reach, const Propagation *m, double floor,
                          double range) {
    static const double FARTHER = 4e8; /* than any two radios are apart [m] */
    static const double MORE = 1 + 1e-9; /* against rounding */
    if (floor > 0 && floor < s->floor) {
        s->floor = floor;
        for (size_t k = 0; k < s->count; k++)
            memset(s->loss + k * s->side, UNKNOWN_LOSS, s->count * sizeof *s->loss);
    }
    double longest = smaller(range, FARTHER) * MORE;
    reach->floor = floor;
    for (int k = 0; k < LOSSES; k++) {
        reach->square[k] = reach_square(m, floor, from_db(k) / MORE, longest);
        longest = sqrt(reach->square[k]) * MORE;
    }
}
