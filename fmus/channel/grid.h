/* Uniform grid over the plane that finds the boxes near a segment. */
#ifndef GRID_H
#define GRID_H
#include "geometry.h"
#include <stdint.h>

typedef struct {
    double low[2], cell; /* lower corner, side of a cell [m] */
    uint32_t columns, rows;
    uint32_t *start, *item;     /* boxes of cell k: item[start[k]] to item[start[k + 1]] */
    uint32_t *seen, query;      /* query in which a box was found last, so that it counts once */
    const Box *box;             /* borrowed from the owner of the grid */
    size_t boxes, start_capacity, item_capacity, seen_capacity;
} Grid;

/* Index `boxes`, which must stay in place; nonzero if memory is short. */
int grid_build(Grid *, const Box *boxes, size_t n);
void grid_free(Grid *);

/* The boxes that the segment a-b meets, each once; `found` has room for all boxes. */
size_t grid_near_segment(Grid *, Position a, Position b, uint32_t *found);

#endif
