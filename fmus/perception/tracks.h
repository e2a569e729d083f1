/* Velocities of obstacles from the displacement of their sides between scans. */
#ifndef TRACKS_H
#define TRACKS_H
#include "scan.h"

typedef struct {
    uint32_t memory;  /* scans that a velocity averages over, at least 2 */
    int64_t timeout;  /* age at which a track is forgotten [ns] */
} TrackSettings;

/* What is known of one obstacle to one sensor. Plain data: its bytes are the saved state. */
typedef struct {
    int64_t sensor, instance;
    int64_t time;         /* of the last scan that showed it [ns] */
    double side[SIDES];   /* filtered coordinates, world frame [m] */
    double velocity[2];   /* world frame [m/s] */
    uint32_t sight[SIDES]; /* of each side in the last scan, a Sight */
    uint32_t scans[2];    /* that the velocity along each axis is based on */
} Track;

/* Sorted by sensor and instance. */
typedef struct {
    Track *tracks;
    size_t count, capacity;
} Tracks;

/* Bring the track of one cluster to the scan at `time`, starting it if it is new. On success
 * `*index` is its place, valid until the next call. */
int tracks_update(Tracks *, const TrackSettings *, int64_t sensor, int64_t time, const Scan *,
                  size_t cluster, size_t *index, Problem *);
/* The time of the last scan that showed anything to `sensor`, or INT64_MIN. */
int64_t tracks_newest(const Tracks *, int64_t sensor);
/* Forget the tracks that were last seen longer than the timeout before `now`. */
void tracks_forget(Tracks *, const TrackSettings *, int64_t now);

#endif
