/* Finds the areas near a segment, among thousands.
 *
 * Areas that lie together form blocks, and a block is looked into if its own area is near. The tests
 * go over arrays of single precision without branches, so that compilers make vector instructions
 * of them; a slack makes up for the rounding. */
#ifndef AREA_INDEX_H
#define AREA_INDEX_H
#include "geometry.h"
#include <stdint.h>

/* Areas as columns, filled up to whole blocks with areas that nothing meets. */
typedef struct {
    float *x, *y, *half_x, *half_y; /* relative to the origin [m] */
    size_t x_capacity, y_capacity, half_x_capacity, half_y_capacity;
} AreaColumns;

typedef struct {
    double origin[2], extent; /* of all areas together [m] */
    size_t blocks;
    AreaColumns area, block;
    uint32_t *item; /* the area in each place */
    uint64_t *key;  /* scratch */
    size_t item_capacity, key_capacity;
} AreaIndex;

/* Obstacles that may be in the way of a link. */
typedef struct { const uint32_t *index; size_t count; } Nearby;

/* Index the areas; nonzero if memory is short. */
int area_index_build(AreaIndex *, const Area *area, size_t n);
void area_index_free(AreaIndex *);

/* At least all areas that the segment a-b comes nearer to than `margin` in x and in y, each once;
 * `found` has room for all areas. */
size_t area_index_near(const AreaIndex *, Position a, Position b, const double margin[2],
                       uint32_t *found);

#endif
