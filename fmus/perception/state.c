#include "state.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    char magic[4];
    uint32_t version;
    int64_t next_track;
    uint64_t tracks, chosen, received;
} StateHeader;

/* ---- writing -------------------------------------------------------------------------------- */

/* Writes at `bytes + size`; only counts while `bytes` is NULL. */
static void put(Bytes *out, const void *source, size_t size) {
    if (out->data && size) memcpy(out->data + out->size, source, size);
    out->size += size;
}

size_t state_save(const Perception *state, uint8_t *bytes) {
    const Tracks *tracks = &state->tracks;
    const Match *match = &state->match;
    Bytes out = {.data = bytes};
    StateHeader header = {{'P', 'R', 'C', 'P'}, 5, tracks->next, tracks->count,
                          match->chosen_count, match->received_count};
    put(&out, &header, sizeof header);
    put(&out, tracks->tracks, tracks->count * sizeof(Track));
    put(&out, match->chosen, match->chosen_count * sizeof(Sharer));
    for (size_t i = 0; i < match->received_count; i++) {
        uint64_t size = match->received[i].message.size;
        put(&out, &size, sizeof size);
        put(&out, match->received[i].message.data, size);
    }
    return out.size;
}

/* ---- reading -------------------------------------------------------------------------------- */

typedef struct {
    const uint8_t *next;
    size_t rest;
} Reader;

/* The next `count` elements of `size` bytes, or NULL. */
static const uint8_t *take(Reader *reader, uint64_t count, size_t size) {
    if (count > reader->rest / size) return NULL;
    const uint8_t *start = reader->next;
    reader->next += count * size;
    reader->rest -= (size_t)count * size;
    return start;
}

static int is_sound(const Track *track, const Track *before) {
    int is_sound = track->time >= 0 && track->time <= TIME_LIMIT && isfinite(track->velocity[0])
                   && isfinite(track->velocity[1]) && isfinite(track->travel[0])
                   && isfinite(track->travel[1]) && track->scans[0] && track->scans[1]
                   && track->number >= 0 && track->number < INT64_MAX
                   && fabs(hypot(track->axis[0], track->axis[1]) - 1.0) < 1e-9;
    for (int side = 0; side < SIDES; side++)
        is_sound = is_sound && isfinite(track->side[side]) && isfinite(track->strayed[side])
                   && track->sight[side] <= CLEAR;
    if (before)
        is_sound = is_sound
                   && (before->sensor < track->sensor
                       || (before->sensor == track->sensor && before->number < track->number));
    return is_sound;
}

static int read_tracks(Tracks *tracks, Reader *reader, uint64_t count, Problem *problem) {
    const uint8_t *bytes = take(reader, count, sizeof(Track));
    if (!bytes) return fail(problem, "the saved state is cut short in its tracks");
    if (count == 0) return 0;
    if (reserve(&tracks->tracks, &tracks->capacity, (size_t)count, sizeof(Track), problem))
        return 1;
    memcpy(tracks->tracks, bytes, (size_t)count * sizeof(Track));
    tracks->count = (size_t)count;
    for (size_t i = 0; i < count; i++)
        if (!is_sound(&tracks->tracks[i], i ? &tracks->tracks[i - 1] : NULL))
            return fail(problem, "track %zu of the saved state makes no sense", i);
    for (size_t i = 0; i < count; i++)
        if (tracks->tracks[i].number >= tracks->next)
            return fail(problem, "the saved state has track %lld, but %lld is the next new one",
                        (long long)tracks->tracks[i].number, (long long)tracks->next);
    return 0;
}

static int is_sound_sharer(const Sharer *sharer) {
    return isfinite(sharer->benefit) && sharer->passed >= 0 && sharer->passed <= TIME_LIMIT;
}

static int read_chosen(Match *match, Reader *reader, uint64_t count, Problem *problem) {
    const uint8_t *bytes = take(reader, count, sizeof(Sharer));
    if (!bytes) return fail(problem, "the saved state is cut short in its sharers");
    if (count == 0) return 0;
    if (reserve(&match->chosen, &match->chosen_capacity, (size_t)count, sizeof(Sharer), problem))
        return 1;
    memcpy(match->chosen, bytes, (size_t)count * sizeof(Sharer));
    match->chosen_count = (size_t)count;
    for (size_t i = 0; i < count; i++)
        if (!is_sound_sharer(&match->chosen[i]))
            return fail(problem, "sharer %zu of the saved state makes no sense", i);
    return 0;
}

static int read_received(Match *match, Reader *reader, uint64_t count, Problem *problem) {
    const MatchSettings forever = {.maximum_age = INT64_MAX, .maximum_offset = INFINITY};
    for (uint64_t i = 0; i < count; i++) {
        uint64_t size;
        const uint8_t *bytes = take(reader, 1, sizeof size);
        if (bytes) memcpy(&size, bytes, sizeof size);
        if (!bytes || !(bytes = take(reader, size, 1)))
            return fail(problem, "the saved state is cut short in message %llu",
                        (unsigned long long)i);
        if (match_receive(match, &forever, INT64_MAX, bytes, (size_t)size, problem) != TAKEN
            || match->received_count != i + 1)
            return fail(problem, "message %llu of the saved state makes no sense",
                        (unsigned long long)i);
    }
    return 0;
}

static int read_state(Perception *state, Reader *reader, Problem *problem) {
    StateHeader header;
    const uint8_t *bytes = take(reader, 1, sizeof header);
    if (bytes) memcpy(&header, bytes, sizeof header);
    if (!bytes || memcmp(header.magic, "PRCP", 4) != 0 || header.version != 5)
        return fail(problem, "these bytes are no saved state of the perception unit");
    state->tracks.next = header.next_track;
    if (read_tracks(&state->tracks, reader, header.tracks, problem)
        || read_chosen(&state->match, reader, header.chosen, problem)
        || read_received(&state->match, reader, header.received, problem))
        return 1;
    if (reader->rest)
        return fail(problem, "the saved state has %zu bytes too many", reader->rest);
    return 0;
}

/* Exchange what survives from step to step. */
static void exchange(Perception *a, Perception *b) {
    Tracks tracks = a->tracks;
    Match match = a->match;
    a->tracks = b->tracks;
    a->match = b->match;
    b->tracks = tracks;
    b->match = match;
}

int state_load(Perception *state, const uint8_t *bytes, size_t size, Problem *problem) {
    Reader reader = {bytes, size};
    Perception *loaded = calloc(1, sizeof *loaded);
    if (!loaded) return fail(problem, "out of memory for a saved state");
    int failed = read_state(loaded, &reader, problem);
    if (!failed) exchange(state, loaded);
    tracks_free(&loaded->tracks);
    match_free(&loaded->match);
    free(loaded);
    return failed;
}
