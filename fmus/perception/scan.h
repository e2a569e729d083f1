/* One pass over the points of one sensor: the abstract perception matrix, the clusters that may be
 * vehicles, and the nearest obstacle in each direction. */
#ifndef SCAN_H
#define SCAN_H
#include "cloud.h"
#include "map.h"
#include "segments.h"

/* Values of the parameter `segmentation`. */
enum { BY_GEOMETRY = 1, BY_LABELS };

typedef struct {
    uint32_t rows, columns;
    double cell;           /* side [m] */
    double offset;         /* of the matrix centre, ahead of the sensor [m] */
    double floor, ceiling; /* heights between which points are counted [m] */
    uint32_t levels;       /* a cell all of whose ground is seen; 0: cells count points */
    double ground_height;  /* points up to this height are no obstacle [m] */
    double blanking;       /* points nearer than this are the own body [m] */
    double map_margin;     /* points up to so far from a building on the map belong to it [m] */
    int segmentation;
    int has_spots;         /* whether `spots` are kept */
    SegmentSettings segment;
} ScanSettings;

/* Where the scan was taken from. */
typedef struct {
    double position[3];  /* of the sensor, world frame [m] */
    double cosine, sine; /* of the heading */
    double center[2];    /* of the matrix, world frame [m] */
} Pose;

/* Points above the ground that may be of one vehicle. */
typedef struct {
    int32_t label; /* of its points, if the scan is segmented by labels; else 0 */
    uint32_t points;
    double axis[2];           /* unit vector of the first side of the box around them, world frame */
    double side[SIDES];       /* of the box along that axis and across, from the world's origin [m] */
    double range2[SIDES];     /* squared horizontal distance of the patch on each side [m^2] */
    uint32_t direction[SIDES]; /* of the patch */
    uint32_t patch[SIDES];
    int is_open[SIDES];       /* the surface may go on beyond: it is seen along, in large steps */
    uint32_t face[SIDES];     /* the clearest Sight of a patch that lies on it; after scan_turn */
    double height;            /* of the highest point above the ground [m] */
} Cluster;

/* The nearest obstacle in one direction. */
typedef struct {
    double range2;    /* [m^2], infinite if there is none */
    double height;    /* of its highest point [m] */
    uint32_t cluster; /* or NO_CLUSTER */
} Nearest;
enum { BEARINGS = DIRECTIONS / 2 };

/* A point of a cluster that fell into the matrix. */
typedef struct {
    uint32_t cell, cluster;
} Hit;

/* A point of an obstacle. */
typedef struct {
    float place[2];   /* levelled frame [m] */
    uint32_t cluster; /* or NO_CLUSTER */
    uint32_t part;
} Spot;

/* What lies in front of a side: an obstacle as high as the body, a lower one, or none. */
typedef enum { HIDDEN, PARTLY_HIDDEN, CLEAR } Sight;

typedef struct {
    Pose pose;
    uint32_t *cells; /* rows x columns; points in each, the abstract perception index */
    Cluster *clusters;
    Hit *hits;
    Spot *spots;
    uint32_t *cluster_of; /* of each patch */
    uint8_t *is_static;   /* of each sorted patch: whether the map has a building there */
    uint32_t *of_sorted;  /* cluster of each sorted patch */
    const Patch *parts;   /* the patches that clusters are made of: sorted, or as they were met */
    const uint32_t *of_part; /* cluster of each part */
    size_t part_count;
    uint32_t *slots;      /* hash table of labels: index into clusters + 1, or 0 */
    size_t cell_capacity, cluster_count, cluster_capacity, hit_count, hit_capacity, spot_count,
        spot_capacity, cluster_of_capacity, is_static_capacity, of_sorted_capacity, slot_count,
        slot_capacity;
    Patches patches;
    Segments segments;
    Nearest nearest[BEARINGS];
} Scan;

/* Replace the contents of `scan` by what `sensor` sees. */
int scan_take(Scan *, const ScanSettings *, const Cloud *, const Sensor *, Map *, Problem *);
/* Let the sides of clusters be along axes that are unit vectors in the levelled frame. */
void scan_turn(Scan *, const double (*axes)[2]);
/* How much of a cluster's body an obstacle in front may hide beyond one of its sides; where the
 * sampling ends before the body does, all of it. */
Sight scan_sight(const Scan *, size_t cluster, int side);
void scan_free(Scan *);

#endif
