#include "tracks.h"

#include <math.h>
#include <string.h>

/* ---- the table ------------------------------------------------------------------------------ */

static int is_before(const Track *track, int64_t sensor, int64_t instance) {
    return track->sensor != sensor ? track->sensor < sensor : track->instance < instance;
}

/* The first track that is not before (sensor, instance). */
static size_t lower_bound(const Tracks *tracks, int64_t sensor, int64_t instance) {
    size_t low = 0, high = tracks->count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (is_before(&tracks->tracks[middle], sensor, instance)) low = middle + 1;
        else high = middle;
    }
    return low;
}

static int insert(Tracks *tracks, size_t place, const Track *track, Problem *problem) {
    if (reserve(&tracks->tracks, &tracks->capacity, tracks->count + 1, sizeof *track, problem))
        return 1;
    memmove(&tracks->tracks[place + 1], &tracks->tracks[place],
            (tracks->count - place) * sizeof *track);
    tracks->tracks[place] = *track;
    tracks->count++;
    return 0;
}

int64_t tracks_newest(const Tracks *tracks, int64_t sensor) {
    int64_t newest = INT64_MIN;
    for (size_t i = lower_bound(tracks, sensor, INT64_MIN);
         i < tracks->count && tracks->tracks[i].sensor == sensor; i++)
        if (tracks->tracks[i].time > newest) newest = tracks->tracks[i].time;
    return newest;
}

void tracks_forget(Tracks *tracks, const TrackSettings *settings, int64_t now) {
    size_t kept = 0;
    for (size_t i = 0; i < tracks->count; i++)
        if (now - tracks->tracks[i].time <= settings->timeout)
            tracks->tracks[kept++] = tracks->tracks[i];
    tracks->count = kept;
}

/* ---- the filter ----------------------------------------------------------------------------- */

/* Gains of the expanding-memory polynomial filter of degree 1, the recursive least-squares line
 * through the last n samples (E. Brookner, Tracking and Kalman Filtering Made Easy, 1998, section
 * 1.2.10); held when n reaches the memory, it becomes a g-h (alpha-beta) filter. */
typedef struct {
    double g, h;
} Gains;

static Gains gains_of(uint32_t scans) {
    double n = scans;
    return (Gains){2.0 * (2.0 * n - 1.0) / (n * (n + 1.0)), 6.0 / (n * (n + 1.0))};
}

static double smaller(double a, double b) { return fabs(a) < fabs(b) ? a : b; }

/* How far the body was from where it was predicted along one axis, as far as its sides tell;
 * returns 0 if they tell nothing.
 *
 * A side in clear sight is that of the body. Of two, the one that faces the sensor is a face; the
 * one behind is where the sampling ends on the roof, and moves with the sensor's rings. To the left
 * and right of the line of sight both are outlines: their mean is taken. Where a lower obstacle
 * stands in front of either, that side may be the border of its shadow: the smaller displacement is
 * taken, for both sides of a moving body move. */
static int innovation(const double miss[2], const Sight sight[2], const double side[2],
                      double sensor, double *result) {
    int facing = sensor < side[0] ? 0 : sensor > side[1] ? 1 : -1;
    if (sight[0] == HIDDEN && sight[1] == HIDDEN) return 0;
    if (sight[0] == HIDDEN) *result = miss[1];
    else if (sight[1] == HIDDEN) *result = miss[0];
    else if (sight[0] == PARTLY_HIDDEN || sight[1] == PARTLY_HIDDEN)
        *result = smaller(miss[0], miss[1]);
    else *result = facing < 0 ? 0.5 * (miss[0] + miss[1]) : miss[facing];
    return 1;
}

static void filter_axis(Track *track, const TrackSettings *settings, int axis, double dt,
                        const double measured[2], const Sight sight[2], double sensor) {
    double miss[2], *side = &track->side[2 * axis];
    Sight in_both[2]; /* scans, the last one and this one */
    for (int i = 0; i < 2; i++) {
        Sight last = (Sight)track->sight[2 * axis + i];
        in_both[i] = last < sight[i] ? last : sight[i];
        side[i] += track->velocity[axis] * dt;
        miss[i] = measured[i] - side[i];
    }
    double result;
    int is_measured = innovation(miss, in_both, measured, sensor, &result);
    if (is_measured && track->scans[axis] < settings->memory) track->scans[axis]++;
    Gains gains = gains_of(track->scans[axis]);
    if (is_measured) track->velocity[axis] += gains.h * result / dt;
    for (int i = 0; i < 2; i++) {
        side[i] = in_both[i] == CLEAR ? side[i] + gains.g * miss[i] : measured[i];
        track->sight[2 * axis + i] = (uint32_t)sight[i];
    }
}

static Track begin_track(const Cluster *seen, const Sight sight[SIDES], int64_t sensor,
                         int64_t time) {
    Track track = {.sensor = sensor, .instance = seen->instance, .time = time, .scans = {1, 1}};
    for (int side = 0; side < SIDES; side++) {
        track.side[side] = seen->side[side];
        track.sight[side] = (uint32_t)sight[side];
    }
    return track;
}

static int is_at(const Tracks *tracks, size_t index, int64_t sensor, int64_t instance) {
    return index < tracks->count && tracks->tracks[index].sensor == sensor
           && tracks->tracks[index].instance == instance;
}

int tracks_update(Tracks *tracks, const TrackSettings *settings, int64_t sensor, int64_t time,
                  const Scan *scan, size_t cluster, size_t *index, Problem *problem) {
    const Cluster *seen = &scan->clusters[cluster];
    *index = lower_bound(tracks, sensor, seen->instance);
    int is_new = !is_at(tracks, *index, sensor, seen->instance);
    if (!is_new && tracks->tracks[*index].time == time) return 0; /* this scan again */
    Sight sight[SIDES];
    for (int side = 0; side < SIDES; side++) sight[side] = scan_sight(scan, cluster, side);
    if (is_new) {
        Track fresh = begin_track(seen, sight, sensor, time);
        return insert(tracks, *index, &fresh, problem);
    }
    Track *track = &tracks->tracks[*index];
    if (time - track->time > settings->timeout) {
        *track = begin_track(seen, sight, sensor, time);
        return 0;
    }
    double dt = (double)(time - track->time) * 1e-9;
    for (int axis = 0; axis < 2; axis++)
        filter_axis(track, settings, axis, dt, &seen->side[2 * axis], &sight[2 * axis],
                    scan->pose.position[axis]);
    track->time = time;
    return 0;
}
