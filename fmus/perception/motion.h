/* How one track follows the box of a cluster from scan to scan. */
#ifndef MOTION_H
#define MOTION_H
#include "tracks.h"

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
