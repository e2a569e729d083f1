/* Tracks: which cluster of a scan is which body of the scans before, and how fast it moves. */
#ifndef TRACKS_H
#define TRACKS_H
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
/* The time of the last scan that showed anything to `sensor`, or INT64_MIN. */
int64_t tracks_newest(const Tracks *, int64_t sensor);
/* Forget the tracks that were last seen longer than the timeout before `now`. */
void tracks_forget(Tracks *, const TrackSettings *, int64_t now);
void tracks_free(Tracks *);

#endif
