/* Cells of the plane in which radios have been, and what buildings take from every link between two of
 * them. Buildings stay while vehicles pass, so that after a while it is known of most pairs of radios,
 * without a look at what is between them, that they hear nothing of each other. Only spares work: no
 * result depends on it. */
#ifndef STREET_CELLS_H
#define STREET_CELLS_H
#include "gap.h"
#include <stdatomic.h>

/* A loss in whole decibels, rounded down: 0 to LOSSES - 1. */
typedef uint8_t LossCode;

/* Several threads may look for the same loss at the same time; they find the same one. */
typedef _Atomic(LossCode) SharedLoss;
enum { LOSSES = 128, UNKNOWN_LOSS = 255 };

/* How far links reach. */
typedef struct {
    double floor;          /* of their gain at the centre; negative: nothing is prepared */
    double square[LOSSES]; /* no link that loses k dB to buildings and whose distance in the plane has a
                              larger square gains the floor [m2] */
} Reach;

typedef struct { int32_t x, y; } CellPlace;

typedef struct {
    /* what the cells hold for */
    uint32_t buildings; /* version of them */
    bool is_shadowed;   /* by buildings */
    WallModel walls;
    double top;   /* of all antennas [m] */
    double floor; /* losses are told as far as they matter above it */
    double size;  /* of a cell [m] */
    size_t count, side;
    CellPlace *place;
    uint32_t *table; /* cells by place: a hash table of 2 * side entries, NO_CELL if free */
    SharedLoss *loss; /* between cell a and cell b: at a * side + b */
    /* the cell of each vehicle of the scene, NO_CELL without a radio or without room */
    uint32_t *cell_of;
    size_t cell_of_capacity;
} StreetCells;
#define NO_CELL UINT32_MAX

/* Find the cells of the radios of the scene. What is known stays so while buildings, walls and the
 * highest antenna stay. Nonzero if memory is short. */
int street_cells_follow(StreetCells *, const Scene *, const Propagation *);
void street_cells_free(StreetCells *);

/* Prepare for links of a gain of `floor` that are at most `range` long [m]. */
void street_cells_prepare(StreetCells *, Reach *, const Propagation *, double floor, double range);

/* What buildings take at least from all links between two cells, as far as it matters. */
LossCode street_cells_find_loss(const StreetCells *, const View *, uint32_t a, uint32_t b);

/* Whether the link between two radios is too weak for `reach` at any rate. */
static inline bool is_out_of_reach(const StreetCells *s, const View *v, const Reach *reach,
                                   size_t from, size_t to) {
    const Position *p = &v->scene->antenna[from].at, *q = &v->scene->antenna[to].at;
    double x = q->x - p->x, y = q->y - p->y, square = x * x + y * y;
    if (square > reach->square[0]) return true;
    uint32_t a = s->cell_of[from], b = s->cell_of[to];
    if (reach->floor == 0 || a == NO_CELL || b == NO_CELL) return false;
    LossCode loss = atomic_load_explicit(&s->loss[a * s->side + b], memory_order_relaxed);
    if (loss == UNKNOWN_LOSS) loss = street_cells_find_loss(s, v, a, b);
    return square > reach->square[loss];
}

#endif
