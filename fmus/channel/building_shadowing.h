/* Loss by buildings: per wall penetrated and per metre indoors.
 * C. Sommer, D. Eckhoff, R. German, F. Dressler, "A computationally inexpensive empirical model of
 * IEEE 802.11p radio shadowing in urban environments", WONS 2011, eq. (3): L = beta n + gamma d_m. */
#ifndef BUILDING_SHADOWING_H
#define BUILDING_SHADOWING_H
#include "geometry.h"
#include "area_index.h"
#include <stdint.h>

/* The line along a wall: a point p lies on its inner side if normal . p >= offset. All corners of
 * the ring have normal . p - offset >= lowest; 0 if the wall is part of the convex hull. */
typedef struct { double normal[2], offset, lowest; } Wall;

typedef struct {
    uint32_t version; /* counts the times that the buildings were replaced */
    size_t count;
    double (*corner)[2]; /* of all rings */
    Wall *wall;          /* from the corner before to this one */
    bool *is_opaque;     /* what lies on the inner side of all walls is inside the building */
    size_t *first;       /* ring k: corner[first[k]] to corner[first[k + 1]] */
    double *height;      /* above z = 0 [m] */
    Area *area;
    AreaIndex index;
    size_t corner_capacity, first_capacity, height_capacity, area_capacity, wall_capacity,
        opaque_capacity;
} Buildings;

/* What a query writes to; each thread has its own. */
typedef struct {
    double *crossing;
    uint32_t *near;
    size_t crossing_capacity, near_capacity;
} BuildingScratch;

typedef struct {
    double wall_db, indoor_db; /* per wall, per metre indoors */
    bool finite;
} WallModel;

/* What a link penetrates. A roof counts as a wall. */
typedef struct { double walls, indoors; } Penetration; /* number; length [m] */

static inline double penetration_db(const WallModel *m, const Penetration *p) {
    return p->walls * m->wall_db + p->indoors * m->indoor_db;
}

/* Replace all buildings. Corners must be finite, `index` ascending from 0 to count - 1 with every
 * building present (the caller checks). Nonzero if memory is short. */
int buildings_set(Buildings *, const double *corner, const int32_t *index, size_t corners,
                  const double *height, size_t count);
void buildings_free(Buildings *);

/* Make room for queries among these buildings; nonzero if memory is short. */
int building_scratch_reserve(BuildingScratch *, const Buildings *);
void building_scratch_free(BuildingScratch *);

/* All buildings whose areas the link from a to b comes nearer to than `margin` in x and y, ascending;
 * valid until the next query with the same scratch. */
Nearby buildings_near(const Buildings *, BuildingScratch *, Position a, Position b,
                      const double margin[2]);

/* What the link from a to b penetrates of the nearby buildings, given in ascending order. `finite`:
 * buildings end at their height, and a link that passes over the roof is free; otherwise they are
 * infinitely high. The result does not depend on buildings among them that are not in the way.
 * False, and `sum` is incomplete, as soon as the loss is above `limit_db`. */
bool buildings_penetrate(const Buildings *, BuildingScratch *, Position a, Position b, Nearby,
                         const WallModel *, double limit_db, Penetration *sum);

/* What all links between two areas have in common, seen in the plane. */
typedef struct {
    bool is_clear;  /* none of them touches the building */
    bool is_hidden; /* all of them penetrate it, with both ends outside */
    double inside;  /* the part of each link that runs inside, at least, as a fraction of its length */
} Cover;

/* Conservative: `is_clear` and `is_hidden` may be false, and `inside` too small, but never the
 * other way round. */
Cover building_cover(const Buildings *, uint32_t k, const Area *a, const Area *b);

#endif
