/* Uniform grid over the plane that finds the areas near a segment. */
#ifndef GRID_H
#define GRID_H
#include "geometry.h"
#include <stdint.h>

typedef struct {
    double low[2], cell; /* lower corner, side of a cell [m] */
    uint32_t columns, rows;
    uint32_t *start, *item;     /* areas of cell k: item[start[k]] to item[start[k + 1]] */
    uint32_t *seen, query;      /* query in which an area was found last, so that it counts once */
    const Area *area;           /* borrowed from the owner of the grid */
    size_t areas, start_capacity, item_capacity, seen_capacity;
} Grid;

/* Obstacles that may be in the way of a link. */
typedef struct { const uint32_t *index; size_t count; } Nearby;

/* Index `area`, which must stay in place; nonzero if memory is short. */
int grid_build(Grid *, const Area *area, size_t n);
void grid_free(Grid *);

/* The areas that the segment a-b comes nearer to than `margin` in x and in y, each once; `found` has
 * room for all. */
size_t grid_near_segment(Grid *, Position a, Position b, const double margin[2], uint32_t *found);

#endif
