#include "match.h"

#include "overlap.h"

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

Fate match_receive(Match *match, const MatchSettings *settings, int64_t now,
                   const uint8_t *message, size_t size, Problem *problem) {
    Apm apm;
    if (apm_decode(&apm, message, size, problem)) return DROPPED;
    if (apm.header.time > now) {
        fail(problem, "the APM of vehicle %lld is from the future: %lld ns, now is %lld ns",
             (long long)apm.header.vehicle, (long long)apm.header.time, (long long)now);
        return DROPPED;
    }
    if (apm.header.time < now - settings->maximum_age) return TAKEN; /* and forgotten */
    size_t place = place_of(match, apm.header.vehicle);
    if (is_remembered(match, place, apm.header.vehicle)
        && match->received[place].time > apm.header.time)
        return TAKEN; /* overtaken by a newer one */
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

double match_benefit(const Apm *apm, const Pose *pose, const Zone *zones, size_t count) {
    const Transform t = transform_of(&apm->header, pose);
    const double cell = (double)apm->header.cell;
    double benefit = 0.0;
    for (uint32_t row = 0; row < apm->header.rows; row++)
        for (uint32_t column = 0; column < apm->header.columns; column++) {
            uint32_t index = apm_index(apm, (size_t)row * apm->header.columns + column);
            if (index == 0) continue;
            double u = (row + 0.5 - apm->header.rows / 2.0) * cell;
            double v = (column + 0.5 - apm->header.columns / 2.0) * cell;
            double center[2] = {t.origin[0] + u * t.cosine - v * t.sine,
                                t.origin[1] + u * t.sine + v * t.cosine};
            double area = 0.0;
            for (size_t i = 0; i < count; i++) {
                double from_zone[2] = {center[0] - zones[i].center[0],
                                       center[1] - zones[i].center[1]};
                area += overlap_area(zones[i].range, from_zone, cell / 2, t.cosine, t.sine);
            }
            benefit += index * area;
        }
    return benefit;
}

/* ---- ranking -------------------------------------------------------------------------------- */

/* Place of a vehicle among those chosen last time, or their number. */
static size_t seniority(const Match *match, int64_t vehicle) {
    size_t i = 0;
    while (i < match->chosen_count && match->chosen[i] != vehicle) i++;
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

int match_rank(Match *match, const MatchSettings *settings, int64_t ego, const Pose *pose,
               const Zone *zones, size_t count, size_t capacity, Problem *problem) {
    match->sharer_count = 0;
    for (size_t i = 0; i < match->received_count; i++) {
        const Received *received = &match->received[i];
        Apm apm;
        if (received->vehicle == ego
            || apm_decode(&apm, received->message.data, received->message.size, problem))
            continue;
        Sharer sharer = {received->vehicle, match_benefit(&apm, pose, zones, count)};
        int is_chosen = seniority(match, sharer.vehicle) < match->chosen_count;
        double bar = settings->benefit_threshold * (is_chosen ? settings->release_ratio : 1.0);
        if (!(sharer.benefit > 0.0 && sharer.benefit >= bar)) continue;
        if (add_sharer(match, sharer, problem)) return 1;
    }
    overtake(match, settings->switch_margin);
    if (match->sharer_count > capacity) match->sharer_count = capacity;
    if (reserve(&match->chosen, &match->chosen_capacity, match->sharer_count, sizeof(int64_t),
                problem))
        return 1;
    match->chosen_count = match->sharer_count;
    for (size_t i = 0; i < match->sharer_count; i++)
        match->chosen[i] = match->sharers[i].vehicle;
    return 0;
}

void match_release(Match *match) { match->sharer_count = match->chosen_count = 0; }

void match_free(Match *match) {
    for (size_t i = 0; i < match->received_count; i++) free(match->received[i].message.data);
    free(match->received);
    free(match->sharers);
    free(match->chosen);
}
