/* The search for neighbours among the patches of a scan: what it works on and what it finds. */
#ifndef SEARCH_H
#define SEARCH_H
#include "patches.h"

typedef struct {
    double adjacent;    /* largest angle between adjacent directions [rad] */
    double depth_gap;   /* difference of ranges up to which adjacent patches are one surface, and
                           distance up to which any are [m] */
    double reach;       /* step along a body that is seen from its end [m] */
    double roof_gap;    /* step from a surface to one that is seen over it [m] */
    double length, width, height;             /* of the largest vehicle [m] */
    double car_length, car_width, car_height; /* of the largest vehicle up to this height [m] */
} SegmentSettings;

/* Two patches whose surfaces may be of one body. */
typedef struct {
    double gap2; /* squared distance [m^2] */
    uint32_t near, far;
    uint32_t is_hidden; /* whether what lies between is hidden by something in front */
} Link;

/* What is around one patch. */
typedef struct {
    double range;       /* of the patch [m] */
    double top, foot;   /* heights of the surface in the direction of the patch [m] */
    uint32_t beside[2]; /* the patch of most similar range within reach in the next direction,
                           clockwise and counter-clockwise, or NO_PATCH */
    uint32_t steps[2];  /* to that direction */
    uint32_t is_joined[2]; /* whether the surface goes on there */
} Surroundings;
#define NO_PATCH UINT32_MAX

typedef struct {
    const SegmentSettings *settings;
    const Patches *patches;
    const uint8_t *is_static; /* of each sorted patch: whether it belongs to a building */
    double sensor_height;     /* [m] */
    double sine;              /* of the largest angle between adjacent directions */
    uint32_t steps;           /* of direction that it may be */
    uint32_t *parent;         /* of each patch, in the forest of surfaces, then of bodies */
    Surroundings *around;     /* of each patch */
    Link *links;
    size_t parent_capacity, around_capacity, link_count, link_capacity;
} Search;

#endif
