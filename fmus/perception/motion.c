#include "motion.h"

#include <math.h>
#include <string.h>

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

/* ---- axes ----------------------------------------------------------------------------------- */

void to_axes(const double axis[2], const double vector[2], double components[2]) {
    components[0] = axis[0] * vector[0] + axis[1] * vector[1];
    components[1] = axis[0] * vector[1] - axis[1] * vector[0];
}

void to_world(const double axis[2], const double components[2], double vector[2]) {
    vector[0] = axis[0] * components[0] - axis[1] * components[1];
    vector[1] = axis[1] * components[0] + axis[0] * components[1];
}

/* The track along other axes. A body keeps its middle and its extents, which are along those axes
 * that are nearest to the former ones. */
static Track turned(const Track *old, const double axis[2]) {
    Track track = *old;
    const double dot = old->axis[0] * axis[0] + old->axis[1] * axis[1];
    const double cross = old->axis[0] * axis[1] - old->axis[1] * axis[0];
    const int quarters = fabs(cross) <= fabs(dot) ? (dot > 0 ? 0 : 2) : cross > 0 ? 1 : 3;
    double middle[2], half[2], vector[2];
    memcpy(track.axis, axis, sizeof track.axis);
    if (cross == 0.0 && quarters == 0) return track;
    for (int k = 0; k < 2; k++) {
        middle[k] = 0.5 * (old->side[2 * k] + old->side[2 * k + 1]);
        half[k] = 0.5 * (old->side[2 * k + 1] - old->side[2 * k]);
    }
    to_world(old->axis, middle, vector);
    to_axes(axis, vector, middle);
    to_world(old->axis, old->velocity, vector);
    to_axes(axis, vector, track.velocity);
    for (int k = 0; k < 2; k++) {
        const int from = quarters % 2 ? 1 - k : k;
        const int is_mirrored = quarters == 2 || quarters == (k ? 1 : 3);
        for (int end = 0; end < 2; end++) {
            track.side[2 * k + end] = end ? middle[k] + half[from] : middle[k] - half[from];
            const int place = 2 * from + (end ^ is_mirrored);
            track.sight[2 * k + end] = old->sight[place];
            track.strayed[2 * k + end] = is_mirrored ? -old->strayed[place] : old->strayed[place];
        }
        track.scans[k] = old->scans[from];
        track.travel[k] = is_mirrored ? -old->travel[from] : old->travel[from];
    }
    return track;
}

/* ---- the filter ----------------------------------------------------------------------------- */

static double smaller(double a, double b) { return fabs(a) < fabs(b) ? a : b; }

/* How far the body was from where it was predicted along one axis, as far as its sides tell;
 * returns 0 if they tell nothing.
 *
 * A side in clear sight is that of the body. Of two, the one that faces the sensor is a face; the
 * one behind is where the sampling ends on the roof, and moves with the sensor's rings. To the left
 * and right of the line of sight both are outlines: their mean is taken, unless the body has grown
 * or shrunk by more than the sampling makes it, because a part came into sight or was taken for
 * another body. Then, and where a lower obstacle stands in front of either, so that the side may be
 * the border of its shadow, the smaller displacement is taken, for both sides of a moving body
 * move. */
static int innovation(const double miss[2], const Sight sight[2], const double side[2],
                      double sensor, double *result) {
    const double sampling = 0.6; /* [m], a step between two columns at 50 m on either side */
    int facing = sensor < side[0] ? 0 : sensor > side[1] ? 1 : -1;
    if (sight[0] == HIDDEN && sight[1] == HIDDEN) return 0;
    if (sight[0] == HIDDEN) *result = miss[1];
    else if (sight[1] == HIDDEN) *result = miss[0];
    else if (sight[0] == PARTLY_HIDDEN || sight[1] == PARTLY_HIDDEN)
        *result = smaller(miss[0], miss[1]);
    else if (facing >= 0) *result = miss[facing];
    else if (fabs(miss[0] - miss[1]) > sampling) *result = smaller(miss[0], miss[1]);
    else *result = 0.5 * (miss[0] + miss[1]);
    return 1;
}

/* Whether no vehicle moves so: a body in motion is behind the filter by its acceleration times
 * dt^2 / h. A part that was lost or a body that was joined moves a side farther. */
static int is_jump(double miss, uint32_t scans, double dt) {
    enum { ENOUGH = 3 };              /* scans that make a velocity to rely on */
    const double acceleration = 10.0; /* [m/s^2], more than tyres transmit on dry roads */
    const double sampling = 0.4;      /* [m] */
    return scans >= ENOUGH && fabs(miss) > sampling + acceleration * dt * dt / gains_of(scans).h;
}

/* What is not where its track expects it makes the track unsure, scan by scan; what stays where it is
 * meanwhile comes to stand. Not at once, for its sides may be the borders of shadows. */
static void doubt(Track *track, int axis, double travel, const double miss[2]) {
    const double sampling = 0.4; /* [m] */
    double *strayed = &track->strayed[2 * axis];
    for (int i = 0; i < 2; i++) strayed[i] += miss[i];
    track->travel[axis] += travel;
    double least = smaller(strayed[0], strayed[1]);
    if (!(fabs(least) > sampling)) return;
    if (track->scans[axis] > 1)
        track->scans[axis]--;
    else if (fabs(track->travel[axis] + least) < fabs(least))
        track->velocity[axis] = 0.0;
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
        track->sight[2 * axis + i] = (uint32_t)sight[i];
    }
    double result = 0.0;
    int is_measured = innovation(miss, in_both, measured, sensor, &result);
    if (is_measured)
        track->strayed[2 * axis] = track->strayed[2 * axis + 1] = track->travel[axis] = 0.0;
    else if (settings->has_doubts) doubt(track, axis, track->velocity[axis] * dt, miss);
    if (is_measured && is_jump(result, track->scans[axis], dt)) {
        track->scans[axis]--; /* several in a row are believed */
        memcpy(side, measured, 2 * sizeof *side);
        return;
    }
    if (is_measured && track->scans[axis] < settings->memory) track->scans[axis]++;
    Gains gains = gains_of(track->scans[axis]);
    double velocity = track->velocity[axis] + gains.h * result / dt;
    if (is_measured && fabs(velocity) > settings->fastest) { /* this was another body: begin anew */
        track->velocity[axis] = 0.0;
        track->scans[axis] = 1;
        memcpy(side, measured, 2 * sizeof *side);
        return;
    }
    if (is_measured) track->velocity[axis] = velocity;
    for (int i = 0; i < 2; i++)
        side[i] = in_both[i] == CLEAR ? side[i] + gains.g * miss[i] : measured[i];
}

Track motion_begin(const Cluster *seen, const Sight sight[SIDES], int64_t sensor, int64_t number,
                   int64_t time) {
    Track track = {.sensor = sensor, .number = number, .time = time, .scans = {1, 1},
                   .axis = {seen->axis[0], seen->axis[1]}};
    for (int side = 0; side < SIDES; side++) {
        track.side[side] = seen->side[side];
        track.sight[side] = (uint32_t)sight[side];
    }
    return track;
}

static double seconds(int64_t nanoseconds) { return (double)nanoseconds * 1e-9; }

double motion_distance(const Track *old, const Cluster *seen, int64_t time, double *difference) {
    const Track turned_track = turned(old, seen->axis), *track = &turned_track;
    double dt = seconds(time - track->time), distance = 0.0;
    *difference = 0.0;
    for (int axis = 0; axis < 2; axis++) {
        const double *side = &track->side[2 * axis], *measured = &seen->side[2 * axis];
        double moved = track->velocity[axis] * dt;
        double low = fabs(measured[0] - side[0] - moved);
        double high = fabs(measured[1] - side[1] - moved);
        distance += low < high ? low : high;
        *difference += low < high ? high : low;
    }
    return distance;
}

double motion_outside(const Track *track, const double place[2], int64_t time) {
    double dt = seconds(time - track->time), at[2], distance = -INFINITY;
    to_axes(track->axis, place, at);
    for (int axis = 0; axis < 2; axis++) {
        const double *side = &track->side[2 * axis], moved = track->velocity[axis] * dt;
        double low = side[0] + moved - at[axis], high = at[axis] - side[1] - moved;
        double outside = low > high ? low : high;
        distance = outside > distance ? outside : distance;
    }
    return distance;
}

/* Whether axes are other ones than before, not the same ones a little turned. */
static int is_turned(const double former[2], const double axis[2]) {
    const double sharp = 0.05; /* sine, 3 degrees: more than vehicles turn from scan to scan */
    double dot = fabs(former[0] * axis[0] + former[1] * axis[1]);
    double cross = fabs(former[0] * axis[1] - former[1] * axis[0]);
    return dot > sharp && cross > sharp;
}

void motion_follow(Track *track, const TrackSettings *settings, const Cluster *seen,
                   const Sight sight[SIDES], const double position[2], int64_t time) {
    double dt = seconds(time - track->time), sensor[2];
    const int has_turned = is_turned(track->axis, seen->axis);
    *track = turned(track, seen->axis);
    to_axes(seen->axis, position, sensor);
    for (int side = 0; has_turned && side < SIDES; side++) {
        track->side[side] = seen->side[side];
        track->sight[side] = (uint32_t)sight[side];
    }
    for (int axis = 0; !has_turned && axis < 2; axis++)
        filter_axis(track, settings, axis, dt, &seen->side[2 * axis], &sight[2 * axis],
                    sensor[axis]);
    track->time = time;
}
