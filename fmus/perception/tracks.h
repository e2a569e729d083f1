/* Tracks: which cluster of a scan is which body of the scans before, and how fast it moves. */
#ifndef TRACKS_H
#define TRACKS_H
#include "motion.h"

/* A track and a cluster that may be the same body. */
typedef struct {
    double cost;
    uint32_t track, cluster;
} Pair;

/* What one scan says of one cluster. */
typedef struct {
    Sight sight[SIDES];
    int64_t number; /* of its track, or NO_TRACK */
    int is_object;
} Detection;
#define NO_TRACK (-1)

/* Sorted by sensor and number. */
typedef struct {
    Track *tracks;
    int64_t next; /* number of the next new track: none is used twice in a run */
    Detection *detections; /* of one scan; kept for their memory, as the pairs are */
    Pair *pairs;
    size_t count, capacity, detection_capacity, pair_count, pair_capacity;
} Tracks;

/* Bring the tracks of a sensor to its scan. `detections` (an element per cluster) say which
 * clusters are objects; their tracks are filled in. */
int tracks_update(Tracks *, const TrackSettings *, const Sensor *, const Scan *, int has_labels,
                  uint32_t minimum_points, Problem *);
/* The track with a number that tracks_update gave. */
const Track *tracks_find(const Tracks *, int64_t sensor, int64_t number);
/* The track of a sensor that is nearest to a place where it is expected at the time of the scan, up to
 * `gate` [m] outside its box; NULL if there is none. */
const Track *tracks_near(const Tracks *, const Sensor *, const double place[2], double gate);
/* The time of the last scan that showed anything to `sensor`, or INT64_MIN. */
int64_t tracks_newest(const Tracks *, int64_t sensor);
/* Forget the tracks that were last seen longer than the timeout before `now`. */
void tracks_forget(Tracks *, const TrackSettings *, int64_t now);
void tracks_free(Tracks *);

#endif
