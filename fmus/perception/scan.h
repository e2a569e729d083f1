/* One pass over the points of one sensor: the abstract perception matrix, the points of each
 * obstacle, and the nearest obstacle in each direction. */
#ifndef SCAN_H
#define SCAN_H
#include "cloud.h"

typedef struct {
    uint32_t rows, columns;
    double cell;           /* side [m] */
    double offset;         /* of the matrix centre, ahead of the sensor [m] */
    double floor, ceiling; /* heights between which points are counted [m] */
    double ground_height;  /* points up to this height are no obstacle [m] */
} ScanSettings;

/* Where the scan was taken from. */
typedef struct {
    double position[3];  /* of the sensor, world frame [m] */
    double cosine, sine; /* of the heading */
    double center[2];    /* of the matrix, world frame [m] */
} Pose;

/* The sides of a box around points, world frame. */
enum { X_MINIMUM, X_MAXIMUM, Y_MINIMUM, Y_MAXIMUM, SIDES };

/* The points above the ground with one instance label. */
typedef struct {
    int32_t instance;
    uint32_t points;
    double side[SIDES];     /* coordinate of each side [m] */
    double range2[SIDES];   /* squared horizontal distance of the point on each side [m^2] */
    uint32_t bearing[SIDES]; /* its direction, an index into Scan.nearest */
    double height;          /* of the highest point above the ground [m] */
} Cluster;

/* The nearest obstacle in one direction. */
typedef struct {
    double range2; /* [m^2], infinite if there is none */
    uint32_t cluster;
} Nearest;
enum { BEARINGS = 1024 };

/* A point above the ground that fell into the matrix. */
typedef struct {
    uint32_t cell, cluster;
} Hit;

/* What lies in front of a side: an obstacle as high as the body, a lower one, or none. */
typedef enum { HIDDEN, PARTLY_HIDDEN, CLEAR } Sight;

typedef struct {
    Pose pose;
    uint32_t *cells; /* rows x columns; points in each, the abstract perception index */
    Cluster *clusters;
    Hit *hits;
    uint32_t *slots; /* hash table: index into clusters + 1, or 0 */
    size_t cell_capacity, cluster_count, cluster_capacity, hit_count, hit_capacity, slot_count,
        slot_capacity;
    Nearest nearest[BEARINGS];
} Scan;

/* Replace the contents of `scan` by what `sensor` sees. */
int scan_take(Scan *, const ScanSettings *, const Cloud *, const Sensor *, Problem *);
/* How much of a cluster's body an obstacle in front may hide beyond one of its sides. */
Sight scan_sight(const Scan *, size_t cluster, int side);
void scan_free(Scan *);

#endif
