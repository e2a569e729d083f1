#include "tracks.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- the table ------------------------------------------------------------------------------ */

static int is_before(const Track *track, int64_t sensor, int64_t number) {
    return track->sensor != sensor ? track->sensor < sensor : track->number < number;
}

/* The first track that is not before (sensor, number). */
static size_t lower_bound(const Tracks *tracks, int64_t sensor, int64_t number) {
    size_t low = 0, high = tracks->count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (is_before(&tracks->tracks[middle], sensor, number)) low = middle + 1;
        else high = middle;
    }
    return low;
}

/* The track, or NULL. */
static Track *find(const Tracks *tracks, int64_t sensor, int64_t number) {
    size_t place = lower_bound(tracks, sensor, number);
    if (place == tracks->count) return NULL;
    Track *track = &tracks->tracks[place];
    return track->sensor == sensor && track->number == number ? track : NULL;
}

const Track *tracks_find(const Tracks *tracks, int64_t sensor, int64_t number) {
    return find(tracks, sensor, number);
}

static int insert(Tracks *tracks, const Track *track, Problem *problem) {
    size_t place = lower_bound(tracks, track->sensor, track->number);
    if (reserve(&tracks->tracks, &tracks->capacity, tracks->count + 1, sizeof *track, problem))
        return 1;
    memmove(&tracks->tracks[place + 1], &tracks->tracks[place],
            (tracks->count - place) * sizeof *track);
    tracks->tracks[place] = *track;
    tracks->count++;
    if (track->number >= tracks->next) tracks->next = track->number + 1;
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

/* ---- association ---------------------------------------------------------------------------- */

/* One scan and the tracks of its sensor. */
typedef struct {
    Tracks *tracks;
    const TrackSettings *settings;
    const Scan *scan;
    int64_t sensor, time, last; /* `last`: time of the scan before */
    size_t first, end;          /* the sensor's tracks */
} Update;

static int is_free(const Detection *detection) {
    return detection->is_object && detection->number == NO_TRACK;
}

/* Tracks that have this scan already: it came again. */
static void keep_known(Update *update) {
    for (size_t i = update->first; i < update->end; i++) {
        const Track *track = &update->tracks->tracks[i];
        if (track->time == update->time && track->cluster < update->scan->cluster_count
            && is_free(&update->tracks->detections[track->cluster]))
            update->tracks->detections[track->cluster].number = track->number;
    }
}

/* How far a body may be from where it is expected: as far as it may move while its velocity is not
 * known. */
static double gate_of(const Update *update, const Track *track) {
    double gate = update->settings->gate;
    if (track->scans[0] > 2 && track->scans[1] > 2) return gate;
    double travel = update->settings->fastest * (double)(update->time - track->time) * 1e-9;
    return travel > gate ? travel : gate;
}

const Track *tracks_near(const Tracks *tracks, const Sensor *sensor, const double place[2],
                         double gate) {
    const Track *found = NULL;
    double nearest = INFINITY;
    for (size_t i = lower_bound(tracks, sensor->vehicle, INT64_MIN);
         i < tracks->count && tracks->tracks[i].sensor == sensor->vehicle; i++) {
        double distance = motion_outside(&tracks->tracks[i], place, sensor->time);
        if (!(distance <= gate && distance < nearest)) continue;
        nearest = distance;
        found = &tracks->tracks[i];
    }
    return found;
}

/* Every track and cluster that may be the same body. Tracks that the last scan missed and boxes of
 * another size come after others. */
static int find_pairs(Update *update, Problem *problem) {
    const double handicap = 0.5;  /* [m] of tracks that the last scan missed */
    const double size_share = 0.1; /* of the difference in size */
    Tracks *tracks = update->tracks;
    tracks->pair_count = 0;
    for (size_t i = update->first; i < update->end; i++) {
        const Track *track = &tracks->tracks[i];
        if (track->time == update->time || update->time - track->time > update->settings->timeout)
            continue;
        double gate = gate_of(update, track);
        for (size_t k = 0; k < update->scan->cluster_count; k++) {
            if (!is_free(&tracks->detections[k])) continue;
            double difference;
            double distance = motion_distance(track, &update->scan->clusters[k], update->time,
                                              &difference);
            if (!(distance <= gate)) continue;
            if (reserve(&tracks->pairs, &tracks->pair_capacity, tracks->pair_count + 1,
                        sizeof(Pair), problem))
                return 1;
            double cost = distance + size_share * difference;
            if (track->time != update->last) cost += handicap;
            tracks->pairs[tracks->pair_count++] = (Pair){cost, (uint32_t)i, (uint32_t)k};
        }
    }
    return 0;
}

/* By cost, then by age, then by cluster: a total order. */
static int by_cost(const void *left, const void *right) {
    const Pair *a = left, *b = right;
    if (a->cost != b->cost) return a->cost < b->cost ? -1 : 1;
    if (a->track != b->track) return a->track < b->track ? -1 : 1;
    return (a->cluster > b->cluster) - (a->cluster < b->cluster);
}

static void follow(Update *update, Track *track, size_t cluster) {
    Detection *detection = &update->tracks->detections[cluster];
    detection->number = track->number;
    motion_follow(track, update->settings, &update->scan->clusters[cluster], detection->sight,
                  update->scan->pose.position, update->time);
    track->cluster = (uint32_t)cluster;
}

/* The pairs of least cost, each track and each cluster once. */
static int associate(Update *update, Problem *problem) {
    Tracks *tracks = update->tracks;
    keep_known(update);
    if (find_pairs(update, problem)) return 1;
    if (tracks->pair_count > 1)
        qsort(tracks->pairs, tracks->pair_count, sizeof(Pair), by_cost);
    for (size_t i = 0; i < tracks->pair_count; i++) {
        Pair pair = tracks->pairs[i];
        Track *track = &tracks->tracks[pair.track];
        if (track->time != update->time && is_free(&tracks->detections[pair.cluster]))
            follow(update, track, pair.cluster);
    }
    return 0;
}

/* ---- births --------------------------------------------------------------------------------- */

/* A track with a reliable velocity in whose box the middle of a cluster lies: the cluster is a part
 * of its body that has come apart. */
static const Track *body_of(const Update *update, const Cluster *cluster) {
    const double *side = cluster->side;
    const double center[2] = {0.5 * (side[0] + side[1]), 0.5 * (side[2] + side[3])};
    double place[2];
    to_world(cluster->axis, center, place);
    for (size_t i = update->first; i < update->end; i++) {
        const Track *track = &update->tracks->tracks[i];
        int is_inside = track->time == update->time && track->scans[0] > 2 && track->scans[1] > 2;
        double middle[2];
        to_axes(track->axis, place, middle);
        for (int axis = 0; axis < 2; axis++)
            is_inside = is_inside && middle[axis] >= track->side[2 * axis]
                        && middle[axis] <= track->side[2 * axis + 1];
        if (is_inside) return track;
    }
    return NULL;
}

static int begin(Update *update, size_t cluster, int64_t number, Problem *problem) {
    Tracks *tracks = update->tracks;
    Detection *detection = &tracks->detections[cluster];
    const Cluster *seen = &update->scan->clusters[cluster];
    Track fresh = motion_begin(seen, detection->sight, update->sensor, number, update->time);
    const Track *body = body_of(update, seen);
    fresh.cluster = (uint32_t)cluster;
    if (body) {
        double velocity[2];
        to_world(body->axis, body->velocity, velocity);
        to_axes(fresh.axis, velocity, fresh.velocity);
        fresh.scans[0] = fresh.scans[1] = 2;
    }
    detection->number = number;
    return insert(tracks, &fresh, problem);
}

static int begin_rest(Update *update, Problem *problem) {
    for (size_t k = 0; k < update->scan->cluster_count; k++)
        if (is_free(&update->tracks->detections[k])
            && begin(update, k, update->tracks->next, problem))
            return 1;
    return 0;
}

/* ---- labels --------------------------------------------------------------------------------- */

/* Every cluster goes to the track with its label as number. */
static int associate_by_label(Update *update, Problem *problem) {
    for (size_t k = 0; k < update->scan->cluster_count; k++) {
        Detection *detection = &update->tracks->detections[k];
        if (!detection->is_object) continue;
        int64_t label = update->scan->clusters[k].label;
        Track *track = find(update->tracks, update->sensor, label);
        if (!track) {
            if (begin(update, k, label, problem)) return 1;
        } else if (track->time == update->time)
            detection->number = label;
        else if (update->time - track->time <= update->settings->timeout)
            follow(update, track, k);
        else {
            *track = motion_begin(&update->scan->clusters[k], detection->sight, update->sensor,
                                  label, update->time);
            detection->number = label;
        }
    }
    return 0;
}

/* ---- all of it ------------------------------------------------------------------------------ */

static int detect(Tracks *tracks, const Scan *scan, uint32_t minimum_points, Problem *problem) {
    if (reserve(&tracks->detections, &tracks->detection_capacity, scan->cluster_count,
                sizeof(Detection), problem))
        return 1;
    for (size_t k = 0; k < scan->cluster_count; k++) {
        Detection *detection = &tracks->detections[k];
        *detection = (Detection){.number = NO_TRACK,
                                 .is_object = scan->clusters[k].points >= minimum_points};
        for (int side = 0; detection->is_object && side < SIDES; side++)
            detection->sight[side] = scan_sight(scan, k, side);
    }
    return 0;
}

int tracks_update(Tracks *tracks, const TrackSettings *settings, const Sensor *sensor,
                  const Scan *scan, int has_labels, uint32_t minimum_points, Problem *problem) {
    if (detect(tracks, scan, minimum_points, problem)) return 1;
    Update update = {
        .tracks = tracks, .settings = settings, .scan = scan,
        .sensor = sensor->vehicle, .time = sensor->time,
        .last = tracks_newest(tracks, sensor->vehicle),
        .first = lower_bound(tracks, sensor->vehicle, INT64_MIN),
        .end = lower_bound(tracks, sensor->vehicle, INT64_MAX),
    };
    if (has_labels) return associate_by_label(&update, problem);
    return associate(&update, problem) || begin_rest(&update, problem);
}

void tracks_free(Tracks *tracks) {
    free(tracks->tracks);
    free(tracks->detections);
    free(tracks->pairs);
}
