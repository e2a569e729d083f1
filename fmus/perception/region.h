/* Where seeing matters: on the road, near the planned route, neither too close nor too far. */
#ifndef REGION_H
#define REGION_H
#include "scan.h"

/* Polygons of the drivable surface in the world frame, checked; none: the road is everywhere. */
typedef struct {
    const double *vertex; /* corners, ring by ring [m] */
    const int32_t *index; /* the polygon of each, ascending */
    size_t count;         /* of corners */
} Road;

/* Points of the planned route in the world frame, checked; fewer than two: no route. */
typedef struct {
    const double *vertex; /* [m] */
    size_t count;
} Route;

typedef struct {
    double resolution; /* largest side of a sub-cell [m]; there are 100 along a cell at most */
    double corridor, near_field, horizon; /* [m] */
} RegionSettings;

/* A piece of the route in the matrix frame. */
typedef struct {
    double start[2], end[2];
} Segment;

/* An edge of the road in the matrix frame, from lower to higher x. */
typedef struct {
    double start[2], end[2];
    int32_t polygon;
    int32_t turn; /* 1 if the ring runs to higher x along it, else -1 */
} Edge;

/* Where a line across the matrix enters (1) or leaves (-1) a polygon. */
typedef struct {
    double y;
    int32_t turn;
} Crossing;

typedef struct {
    uint32_t side;    /* sub-cells along a side of a cell */
    uint32_t *inside; /* rows x columns: sub-cells of each cell whose centre is in the region */
    uint8_t *line;    /* one line of sub-cells across the matrix */
    Segment *segments;
    Edge *edges;
    Crossing *crossings;
    size_t inside_capacity, line_capacity, segment_count, segment_capacity, edge_count,
        edge_capacity, crossing_count, crossing_capacity;
} Region;

/* Whether road and route may be given to region_make: fail, naming what is wrong, if not. */
int road_check(const Road *, Problem *);
int route_check(const Route *, Problem *);
/* Replace the contents of the region by that of a matrix seen from `pose`. */
int region_make(Region *, const RegionSettings *, const ScanSettings *, const Pose *, const Road *,
                const Route *, Problem *);
void region_free(Region *);

#endif
