/* A ball on the ground, behind Model Exchange of FMI 2.0 and 3.0; written for the tests.
 *
 *   h' = v,  v' = u - g - drag v,  bounce where h falls to 0: v = -e v.
 *
 * It counts what happens, and returns Error where an importer does what its mode does not allow. */
#pragma once
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { OK, WARNING, DISCARD, ERROR };
enum { INSTANTIATED, INITIALISING, EVENT, CONTINUOUS, OVER };
enum { TIME, H, DER_H, V, DER_V, G, E, DRAG, U, Y, PERIOD, STEP_EVENT_AT, STOP_AT, FAIL_AT, NARROW, ENERGY, TOLERANCE, STOP, REALS };
enum { BOUNCES, TICKS, KICKS, STEP_EVENTS, FAIL_AS, STEPS, EVENTS, COLUMNS, LATE, KEEPS, INTEGERS };

typedef struct Ball {
    double real[REALS];
    int32_t integer[INTEGERS];
    bool kick, was_kicked, is_resting, has_stepped, is_done;
    double completed, start;
    int mode, pending;
    void (*say)(struct Ball *, int status, const char *);
    void *log, *environment;
} Ball;

static int refuse(Ball *b, const char *why) {
    b->say(b, ERROR, why);
    return ERROR;
}

static void ball_start(Ball *b) {
    double *r = b->real;
    r[H] = 1, r[G] = 9.81, r[E] = 0.7, r[STEP_EVENT_AT] = r[STOP_AT] = r[FAIL_AT] = 1e9, b->integer[FAIL_AS] = ERROR;
}

static void ball_compute(Ball *b) {
    double *r = b->real;
    r[DER_H] = b->is_resting ? 0 : r[V];
    r[DER_V] = b->is_resting ? 0 : r[U] - r[G] - r[DRAG] * r[V];
    r[Y] = r[H] + r[U] / 2;
    r[ENERGY] = r[G] * r[H] + r[V] * r[V] / 2;
}

static int ball_set_real(Ball *b, uint32_t i, double value) {
    if (i >= REALS) return refuse(b, "no such real");
    bool is_input = i == U, is_state = i == H || i == V;
    if (!is_input && b->mode != INSTANTIATED && !(is_state && b->mode == INITIALISING))
        return refuse(b, "only inputs can be set now");
    b->real[i] = value;
    return OK;
}
static int ball_set_kick(Ball *b, bool value) {
    if (b->mode == CONTINUOUS) return refuse(b, "a discrete input was set in continuous-time mode");
    b->kick = value;
    return OK;
}

static int ball_set_time(Ball *b, double t) {
    if (b->mode != CONTINUOUS) return refuse(b, "the time was set outside of continuous-time mode");
    if (t < b->completed) return refuse(b, "the time went back behind a completed step");
    if (b->real[STOP] > 0 && t > b->real[STOP] * (1 + 1e-15)) return refuse(b, "the time went beyond the stop time");
    b->real[TIME] = t;
    return OK;
}
static int ball_set_states(Ball *b, const double x[]) {
    if (b->mode != CONTINUOUS) return refuse(b, "states were set outside of continuous-time mode");
    b->real[H] = x[0], b->real[V] = x[1];
    return OK;
}
static int ball_rates(Ball *b, double dx[]) {
    double t = b->real[TIME];
    if (t > b->real[FAIL_AT]) {
        b->say(b, b->integer[FAIL_AS], "told to fail");
        return b->integer[FAIL_AS];
    }
    if (b->real[NARROW] > 0 && t > b->completed + b->real[NARROW]) return DISCARD;
    ball_compute(b);
    dx[0] = b->real[DER_H], dx[1] = b->real[DER_V];
    return OK;
}

static double next_tick(const Ball *b) { return b->start + (b->integer[TICKS] + 1) * b->real[PERIOD]; }

/* One update of the discrete states; whether another one is needed. */
static bool ball_update(Ball *b) {
    double *r = b->real;
    if (b->pending > 0) return --b->pending > 0;
    b->integer[EVENTS]++;
    if (r[H] <= 0 && r[V] < 0 && !b->is_resting) {
        r[H] = 0, r[V] *= -r[E];
        b->integer[BOUNCES]++;
        if (r[V] < 1e-3) r[V] = 0, b->is_resting = true;
    }
    if (b->kick && !b->was_kicked) r[V] += 2, b->is_resting = false, b->integer[KICKS]++;
    b->was_kicked = b->kick;
    if (r[PERIOD] > 0 && r[TIME] >= next_tick(b)) {
        if (r[TIME] > next_tick(b)) b->integer[LATE]++;
        b->integer[TICKS]++;
    }
    if (b->has_stepped) b->has_stepped = false, b->integer[STEP_EVENTS]++;
    if (r[TIME] >= r[STOP_AT]) b->is_done = true;
    b->pending = 1;
    return true;
}
static bool ball_has_next(const Ball *b) { return b->real[PERIOD] > 0 || b->real[STOP_AT] < 1e9; }
static double ball_next(const Ball *b) {
    double tick = b->real[PERIOD] > 0 ? next_tick(b) : 1e9;
    return tick < b->real[STOP_AT] ? tick : b->real[STOP_AT];
}

/* A step is complete; whether there is a step event. */
static bool ball_complete(Ball *b, bool keeps) {
    b->integer[STEPS]++, b->integer[KEEPS] = keeps;
    b->completed = b->real[TIME];
    if (b->real[TIME] < b->real[STEP_EVENT_AT]) return false;
    b->real[STEP_EVENT_AT] = 1e9;
    return b->has_stepped = true;
}

static int ball_enter(Ball *b, int mode, int from) {
    bool is_end = mode == OVER && b->mode == EVENT;
    if (b->mode != from && !is_end) return refuse(b, "the mode cannot be entered from here");
    if (mode == CONTINUOUS && b->pending > 0) return refuse(b, "the event is not over");
    b->mode = mode;
    return OK;
}
static int ball_initialise(Ball *b, double start, double tolerance, double stop) {
    b->real[TIME] = b->completed = b->start = start;
    b->real[TOLERANCE] = tolerance, b->real[STOP] = stop;
    return ball_enter(b, INITIALISING, INSTANTIATED);
}

/* d unknown / d known times `seed`; states, their derivatives, the input and y. */
static int ball_derivative(Ball *b, uint32_t unknown, uint32_t known, double seed, double *found) {
    bool is_state = known == H || known == V, moves = !b->is_resting;
    double slope = unknown == known ? 1 : 0;
    if (!is_state && known != U) return refuse(b, "derivatives by states and the input only");
    if (unknown == Y) slope = known == H ? 1 : known == U ? 0.5 : 0;
    if (unknown == DER_H) slope = moves && known == V ? 1 : 0;
    if (unknown == DER_V) slope = !moves ? 0 : known == V ? -b->real[DRAG] : known == U ? 1 : 0;
    b->integer[COLUMNS] += is_state;
    *found = slope * seed;
    return OK;
}
