/* How one track follows the box of a cluster from scan to scan. */
#ifndef MOTION_H
#define MOTION_H
#include "scan.h"

typedef struct {
    uint32_t memory;  /* scans that a velocity averages over, at least 2 */
    int64_t timeout;  /* age at which a track is forgotten [ns] */
    double gate;      /* distance from where a body was predicted up to which it is the same [m] */
    double fastest;   /* speed that a body seen for the first time may have [m/s] */
    int has_doubts;   /* whether a velocity is given up that nothing measures and places contradict */
} TrackSettings;

/* What is known of one obstacle to one sensor. Plain data: its bytes are the saved state. */
typedef struct {
    int64_t sensor, number;
    int64_t time;         /* of the last scan that showed it [ns] */
    double axis[2];       /* along which and across which its sides are: a unit vector, world frame */
    double side[SIDES];   /* filtered coordinates along the axes [m] */
    double velocity[2];   /* along the axes [m/s] */
    double travel[2];     /* since the velocity was measured, if that is right [m] */
    double strayed[SIDES]; /* from where that brings the sides [m] */
    uint32_t sight[SIDES]; /* of each side in the last scan, a Sight */
    uint32_t scans[2];    /* that the velocity along each axis is based on */
    uint32_t cluster;     /* of the last scan */
    uint32_t reserved;
} Track;

/* Components of a vector along an axis and across, and back in the world. */
void to_axes(const double axis[2], const double vector[2], double components[2]);
void to_world(const double axis[2], const double components[2], double vector[2]);

/* A new track; nothing is known of its velocity. */
Track motion_begin(const Cluster *, const Sight sight[SIDES], int64_t sensor, int64_t number,
                   int64_t time);
/* How far a cluster is from where the track is expected at `time` [m], and how much their boxes
 * differ. A side that does not coincide may have come into sight; the other one counts. */
double motion_distance(const Track *, const Cluster *, int64_t time, double *difference);
/* How far a place is outside the box of the track where it is expected at `time` [m]: the larger of
 * the distances along its axes, negative inside. */
double motion_outside(const Track *, const double place[2], int64_t time);
/* Bring a track to the scan at `time` of a sensor at `position`. */
void motion_follow(Track *, const TrackSettings *, const Cluster *, const Sight sight[SIDES],
                   const double position[2], int64_t time);

#endif
