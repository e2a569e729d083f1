#include "match.h"

#include "overlap.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- messages ------------------------------------------------------------------------------- */

/* The first remembered message of a vehicle that is not before `vehicle`. */
static size_t place_of(const Match *match, int64_t vehicle) {
    size_t i = 0;
    while (i < match->received_count && match->received[i].vehicle < vehicle) i++;
    return i;
}

static int is_remembered(const Match *match, size_t place, int64_t vehicle) {
    return place < match->received_count && match->received[place].vehicle == vehicle;
}

static int remember(Match *match, size_t place, const Apm *apm, const uint8_t *message,
                    size_t size, Problem *problem) {
    Received fresh = {apm->header.vehicle, apm->header.time, {0}};
    if (reserve(&fresh.message.data, &fresh.message.capacity, size, 1, problem)) return 1;
    memcpy(fresh.message.data, message, size);
    fresh.message.size = size;
    if (is_remembered(match, place, fresh.vehicle)) {
        free(match->received[place].message.data);
        match->received[place] = fresh;
        return 0;
    }
    if (reserve(&match->received, &match->received_capacity, match->received_count + 1,
                sizeof fresh, problem)) {
        free(fresh.message.data);
        return 1;
    }
    memmove(&match->received[place + 1], &match->received[place],
            (match->received_count - place) * sizeof fresh);
    match->received[place] = fresh;
    match->received_count++;
    return 0;
}

/* Whether the header contradicts itself: a sensor is not that far from what it sees. */
static int is_off_center(const ApmHeader *header, double maximum, Problem *problem) {
    double x = header->center[0] - header->position[0];
    double y = header->center[1] - header->position[1], distance = sqrt(x * x + y * y);
    if (distance <= maximum) return 0;
    return fail(problem, "the APM of vehicle %lld is centred %g m from its source, must be at most "
                "%g m (maximum_offset)", (long long)header->vehicle, distance, maximum);
}

/* Whether a message says something else than the remembered one of the same source and time. */
static int contradicts(const Received *known, const uint8_t *message, size_t size,
                       Problem *problem) {
    if (size == known->message.size && memcmp(message, known->message.data, size) == 0) return 0;
    return fail(problem, "vehicle %lld has sent two different APMs of %lld ns; the first one "
                "counts", (long long)known->vehicle, (long long)known->time);
}

/* The benefits of matrices that count points cannot be compared with those of seen area. */
static int is_other_index(const ApmHeader *header, Index wanted, Problem *problem) {
    static const char *const NAMES[] = {[POINTS] = "points", [SEEN_AREA] = "seen_area"};
    Index found = header->flags >> APM_LEVELS_SHIFT ? SEEN_AREA : POINTS;
    if (wanted == ANY_INDEX || found == wanted) return 0;
    return fail(problem, "the APM of vehicle %lld has the index `%s`, not `%s`",
                (long long)header->vehicle, NAMES[found], NAMES[wanted]);
}

Fate match_receive(Match *match, const MatchSettings *settings, int64_t now,
                   const uint8_t *message, size_t size, Problem *problem) {
    Apm apm;
    switch (apm_decode(&apm, &match->space, message, size, problem)) {
    case DECODED: break;
    case MALFORMED: return DROPPED;
    case OUT_OF_MEMORY: return NO_MEMORY;
    }
    if (apm.header.time > now) {
        fail(problem, "the APM of vehicle %lld is from the future: %lld ns, now is %lld ns",
             (long long)apm.header.vehicle, (long long)apm.header.time, (long long)now);
        return DROPPED;
    }
    if (is_other_index(&apm.header, settings->index, problem)) return DROPPED;
    if (is_off_center(&apm.header, settings->maximum_offset, problem)) return DROPPED;
    if (apm.header.time < now - settings->maximum_age) return TAKEN; /* and forgotten */
    size_t place = place_of(match, apm.header.vehicle);
    if (is_remembered(match, place, apm.header.vehicle)) {
        const Received *known = &match->received[place];
        if (known->time > apm.header.time) return TAKEN; /* overtaken by a newer one */
        if (known->time == apm.header.time)
            return contradicts(known, message, size, problem) ? DROPPED : TAKEN;
    }
    return remember(match, place, &apm, message, size, problem) ? NO_MEMORY : TAKEN;
}

void match_forget(Match *match, const MatchSettings *settings, int64_t now) {
    size_t kept = 0;
    for (size_t i = 0; i < match->received_count; i++) {
        if (match->received[i].time < now - settings->maximum_age)
            free(match->received[i].message.data);
        else match->received[kept++] = match->received[i];
    }
    match->received_count = kept;
}

/* ---- benefit -------------------------------------------------------------------------------- */

/* A pose in the frame of another one. */
typedef struct {
    double origin[2], cosine, sine;
} Transform;

/* matrix frame of the ego vehicle <- matrix frame of the message */
static Transform transform_of(const ApmHeader *header, const Pose *pose) {
    double sine, cosine;
    sine_cosine(header->heading, &sine, &cosine);
    double x = header->center[0] - pose->center[0], y = header->center[1] - pose->center[1];
    return (Transform){
        .origin = {pose->cosine * x + pose->sine * y, pose->cosine * y - pose->sine * x},
        .cosine = cosine * pose->cosine + sine * pose->sine,
        .sine = sine * pose->cosine - cosine * pose->sine,
    };
}

/* Rows or columns of the ego vehicle's matrix that reach into [low, high], which are coordinates in
 * units of its cells; the last is not among them. */
static void span(double low, double high, uint32_t count, uint32_t *first, uint32_t *last) {
    double from = floor(low), to = floor(high) + 1.0;
    *first = !(from > 0.0) ? 0 : from < count ? (uint32_t)from : count;
    *last = !(to > 0.0) ? 0 : to < count ? (uint32_t)to : count;
    if (*last < *first) *last = *first;
}

/* The area in demand [m^2] inside a square with half side `half` around `center`, turned like `t`.
 * A cell that is wanted in part counts as if the wanted part were spread evenly over it. */
static double wanted_area(const Demand *demand, const double center[2], double half,
                          const Transform *t) {
    double cell = demand->cell, reach = half * (fabs(t->cosine) + fabs(t->sine)), area = 0.0;
    double row = center[0] / cell + demand->rows / 2.0;
    double column = center[1] / cell + demand->columns / 2.0;
    uint32_t first[2], last[2];
    span(row - reach / cell, row + reach / cell, demand->rows, &first[0], &last[0]);
    span(column - reach / cell, column + reach / cell, demand->columns, &first[1], &last[1]);
    if (demand_over(demand, first, last) == 0) return 0.0;
    for (uint32_t i = first[0]; i < last[0]; i++)
        for (uint32_t k = first[1]; k < last[1]; k++) {
            uint64_t weight = demand->weights[(size_t)i * demand->columns + k];
            if (weight == 0) continue;
            double from_cell[2] = {center[0] - (i + 0.5 - demand->rows / 2.0) * cell,
                                   center[1] - (k + 0.5 - demand->columns / 2.0) * cell};
            area += (double)weight / demand->full
                    * overlap_area(cell / 2, from_cell, half, t->cosine, t->sine);
        }
    return area;
}

double match_benefit(const Apm *apm, const Pose *pose, const Demand *demand,
                     uint32_t index_limit) {
    const Transform t = transform_of(&apm->header, pose);
    const double cell = (double)apm->header.cell;
    const uint32_t levels = apm->header.flags >> APM_LEVELS_SHIFT;
    double benefit = 0.0;
    for (uint32_t row = 0; row < apm->header.rows; row++)
        for (uint32_t column = 0; column < apm->header.columns; column++) {
            uint32_t index = apm_index(apm, (size_t)row * apm->header.columns + column);
            if (index == 0) continue;
            if (index_limit > 0 && index > index_limit) index = index_limit;
            double u = (row + 0.5 - apm->header.rows / 2.0) * cell;
            double v = (column + 0.5 - apm->header.columns / 2.0) * cell;
            double center[2] = {t.origin[0] + u * t.cosine - v * t.sine,
                                t.origin[1] + u * t.sine + v * t.cosine};
            benefit += index * wanted_area(demand, center, cell / 2, &t);
        }
    return levels > 0 ? benefit / levels : benefit;
}

/* ---- ranking -------------------------------------------------------------------------------- */

/* Place of a vehicle among those chosen last time, or their number. */
static size_t seniority(const Match *match, int64_t vehicle) {
    size_t i = 0;
    while (i < match->chosen_count && match->chosen[i].vehicle != vehicle) i++;
    return i;
}

/* Those chosen last time first, in their order; then the others, best first. */
static int is_ahead(const Match *match, const Sharer *a, const Sharer *b) {
    size_t left = seniority(match, a->vehicle), right = seniority(match, b->vehicle);
    if (left != right) return left < right;
    if (a->benefit != b->benefit) return a->benefit > b->benefit;
    return a->vehicle < b->vehicle;
}

static void swap(Sharer *a, Sharer *b) {
    Sharer other = *a;
    *a = *b;
    *b = other;
}

/* Let a sharer overtake the one ahead of it if it is better; one chosen last time only if it is
 * better by the margin. Ends: each swap removes an inversion. */
static void overtake(Match *match, double margin) {
    for (size_t end = match->sharer_count; end > 1; end--)
        for (size_t i = 1; i < match->sharer_count; i++) {
            Sharer *ahead = &match->sharers[i - 1], *behind = &match->sharers[i];
            int is_chosen = seniority(match, ahead->vehicle) < match->chosen_count;
            double bar = ahead->benefit * (is_chosen ? 1.0 + margin : 1.0);
            if (behind->benefit > bar) swap(ahead, behind);
        }
}

static int add_sharer(Match *match, Sharer sharer, Problem *problem) {
    size_t count = match->sharer_count + 1;
    if (reserve(&match->sharers, &match->sharer_capacity, count, sizeof sharer, problem)) return 1;
    size_t i = match->sharer_count;
    for (; i > 0 && is_ahead(match, &sharer, &match->sharers[i - 1]); i--)
        match->sharers[i] = match->sharers[i - 1];
    match->sharers[i] = sharer;
    match->sharer_count = count;
    return 0;
}

/* When the benefit of a source last sufficed, now included; -1 if it never did, or too long ago. */
static int64_t last_passed(const Match *match, const MatchSettings *settings, int64_t now,
                           int64_t vehicle, double benefit) {
    size_t place = seniority(match, vehicle);
    int is_chosen = place < match->chosen_count;
    double bar = settings->benefit_threshold * (is_chosen ? settings->release_ratio : 1.0);
    if (benefit > 0.0 && benefit >= bar) return now;
    if (is_chosen && now - match->chosen[place].passed <= settings->hold)
        return match->chosen[place].passed;
    return -1;
}

static int is_sharer(const Match *match, int64_t vehicle) {
    size_t i = 0;
    while (i < match->sharer_count && match->sharers[i].vehicle != vehicle) i++;
    return i < match->sharer_count;
}

/* Those chosen last time of which no matrix is left stay sharers while they are held. */
static int keep_unheard(Match *match, const MatchSettings *settings, int64_t now,
                        Problem *problem) {
    for (size_t i = 0; i < match->chosen_count; i++) {
        Sharer sharer = {match->chosen[i].vehicle, 0.0, 0};
        if (is_sharer(match, sharer.vehicle)) continue;
        sharer.passed = last_passed(match, settings, now, sharer.vehicle, sharer.benefit);
        if (sharer.passed >= 0 && add_sharer(match, sharer, problem)) return 1;
    }
    return 0;
}

int match_rank(Match *match, const MatchSettings *settings, int64_t now, int64_t ego,
               const Pose *pose, const Demand *demand, size_t capacity, Problem *problem) {
    match->sharer_count = 0;
    for (size_t i = 0; i < match->received_count; i++) {
        const Received *received = &match->received[i];
        Apm apm;
        if (received->vehicle == ego) continue;
        if (apm_decode(&apm, &match->space, received->message.data, received->message.size,
                       problem))
            return 1;
        double benefit = match_benefit(&apm, pose, demand, settings->index_limit);
        int64_t passed = last_passed(match, settings, now, received->vehicle, benefit);
        Sharer sharer = {received->vehicle, benefit, passed};
        if (passed >= 0 && add_sharer(match, sharer, problem)) return 1;
    }
    if (keep_unheard(match, settings, now, problem)) return 1;
    overtake(match, settings->switch_margin);
    if (match->sharer_count > capacity) match->sharer_count = capacity;
    if (reserve(&match->chosen, &match->chosen_capacity, match->sharer_count, sizeof(Sharer),
                problem))
        return 1;
    match->chosen_count = match->sharer_count;
    for (size_t i = 0; i < match->sharer_count; i++) match->chosen[i] = match->sharers[i];
    return 0;
}

void match_release(Match *match) { match->sharer_count = match->chosen_count = 0; }

void match_free(Match *match) {
    for (size_t i = 0; i < match->received_count; i++) free(match->received[i].message.data);
    free(match->received);
    free(match->sharers);
    free(match->chosen);
    free(match->space.data);
}
