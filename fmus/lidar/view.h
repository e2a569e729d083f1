/* The faces that one sensor may see: within its range, turned towards it, in its heading frame
 * (origin at the sensor, x along the vehicle's heading, z up), and sorted by azimuth. */
#ifndef VIEW_H
#define VIEW_H
#include <stddef.h>
#include <stdint.h>

#include "bins.h"
#include "scene.h"

typedef struct {
    double position[3]; /* world frame [m] */
    double heading;     /* [rad] */
    double range;       /* [m] */
    size_t vehicle;     /* that carries it; its own body is not seen */
} Viewpoint;

/* An upright rectangle over the edge (x0, y0) - (x1, y1), which the sensor sees clockwise. */
typedef struct {
    double x0, y0, x1, y1, bottom, top; /* [m] */
    double area;                        /* x0 y1 - y0 x1, negative [m^2] */
    double inverse_length;              /* [1/m] */
    Surface surface;
} Wall;

/* A level polygon: the top of a prism seen from above, or its bottom seen from below. */
typedef struct {
    size_t first, count; /* its corners in View.corner */
    double height;       /* above (positive) or below the sensor [m] */
    Surface surface;
} Cap;

typedef struct {
    Wall *wall;
    Cap *cap;
    Window *wall_window, *cap_window;
    size_t wall_count, cap_count;
    size_t wall_capacity, cap_capacity, wall_window_capacity, cap_window_capacity;
    Bins wall_bins, cap_bins;
    double *corner, *angle, *crossing; /* crossing: room for the distances of one cap's edges */
    size_t corner_count, corner_capacity, angle_capacity, crossing_capacity;
    double height; /* of the sensor above the ground z = 0 [m] */
} View;

/* Collect the faces seen from a viewpoint. An all-zero View is valid and empty. Returns nonzero if
 * memory is short. */
int view_build(View *, const Scene *, const Viewpoint *, uint32_t bins);
void view_clear(View *);

#endif
