/* How one track follows the box of a cluster from scan to scan. */
#ifndef MOTION_H
#define MOTION_H
#include "scan.h"

typedef struct {
    uint32_t memory;  /* scans that a velocity averages over, at least 2 */
    int64_t timeout;  /* age at which a track is forgotten [ns] */
    double gate;      /* distance from where a body was predicted up to which it is the same [m] */
    double fastest;   /* speed that a body seen for the first time may have [m/s] */
} TrackSettings;

/* What is known of one obstacle to one sensor. Plain data: its bytes are the saved state. */
typedef struct {
    int64_t sensor, number;
    int64_t time;         /* of the last scan that showed it [ns] */
    double side[SIDES];   /* filtered coordinates, world frame [m] */
    double velocity[2];   /* world frame [m/s] */
    uint32_t sight[SIDES]; /* of each side in the last scan, a Sight */
    uint32_t scans[2];    /* that the velocity along each axis is based on */
    uint32_t cluster;     /* of the last scan */
    uint32_t reserved;
} Track;

/* A new track; nothing is known of its velocity. */
Track motion_begin(const Cluster *, const Sight sight[SIDES], int64_t sensor, int64_t number,
                   int64_t time);
/* How far a cluster is from where the track is expected at `time` [m], and how much their boxes
 * differ. A side that does not coincide may have come into sight; the other one counts. */
double motion_distance(const Track *, const Cluster *, int64_t time, double *difference);
/* Bring a track to the scan at `time` of a sensor at `position`. */
void motion_follow(Track *, const TrackSettings *, const Cluster *, const Sight sight[SIDES],
                   const double position[2], int64_t time);

#endif
