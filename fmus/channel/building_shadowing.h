/* Loss by buildings: per wall penetrated and per metre indoors.
 * C. Sommer, D. Eckhoff, R. German, F. Dressler, "A computationally inexpensive empirical model of
 * IEEE 802.11p radio shadowing in urban environments", WONS 2011, eq. (3): L = beta n + gamma d_m. */
#ifndef BUILDING_SHADOWING_H
#define BUILDING_SHADOWING_H
#include "geometry.h"
#include "grid.h"
#include <stdint.h>

typedef struct {
    size_t count;
    double (*corner)[2]; /* of all rings */
    size_t *first;       /* ring k: corner[first[k]] to corner[first[k + 1]] */
    double *height;      /* above z = 0 [m] */
    Box *box;
    Grid grid;
    double *crossing; /* scratch of one query */
    uint32_t *near;
    size_t corner_capacity, first_capacity, height_capacity, box_capacity, crossing_capacity,
        near_capacity;
} Buildings;

/* What a link penetrates. A roof counts as a wall. */
typedef struct { double walls, indoors; } Penetration; /* number; length [m] */

/* Replace all buildings. Corners must be finite, `index` ascending from 0 to count - 1 with every
 * building present (the caller checks). Nonzero if memory is short. */
int buildings_set(Buildings *, const double *corner, const int32_t *index, size_t corners,
                  const double *height, size_t count);
void buildings_free(Buildings *);

/* What the link from a to b penetrates. `finite`: buildings end at their height, and a link that
 * passes over the roof is free; otherwise they are infinitely high. */
Penetration buildings_penetration(Buildings *, Position a, Position b, bool finite);

#endif
