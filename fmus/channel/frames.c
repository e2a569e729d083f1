#include "frames.h"
#include "buffer.h"
#include <string.h>

AirFrame *frames_add(Frames *s, size_t radios) {
    if (BUFFER_RESERVE(s->live, s->live_capacity, s->count + 1)) return NULL;
    if (s->free_count == 0) {
        if (BUFFER_RESERVE(s->pool, s->pool_capacity, s->pool_count + 1)
            || BUFFER_RESERVE(s->free, s->free_capacity, s->pool_count + 1))
            return NULL;
        s->pool[s->pool_count] = (AirFrame){.arrivals = 0};
        s->free[s->free_count++] = (uint32_t)s->pool_count++;
    }
    uint32_t index = s->free[s->free_count - 1];
    AirFrame *f = &s->pool[index];
    if (BUFFER_RESERVE(f->at, f->at_capacity, radios)) return NULL;
    if (radios > 0) memset(f->at, 0, radios * sizeof *f->at);
    f->radios = radios;
    f->arrivals = f->noticed = f->begun = f->ended = 0;
    f->is_settled = false;
    s->free_count--;
    s->live[s->count++] = index;
    return f;
}

Arrival *frame_add_arrival(AirFrame *f) {
    if (BUFFER_RESERVE(f->arrival, f->capacity, f->arrivals + 1)) return NULL;
    return &f->arrival[f->arrivals++];
}

void frames_let_go(Frames *s, int64_t now, int64_t longest_delay) {
    int64_t earliest = now; /* what ended before this interferes with nothing any more */
    for (size_t k = 0; k < s->count; k++) {
        const AirFrame *f = &s->pool[s->live[k]];
        if (f->what.packet.kind == NOISE || frame_has_ended(f)) continue;
        if (f->start < earliest) earliest = f->start;
    }
    size_t kept = 0;
    for (size_t k = 0; k < s->count; k++) {
        const AirFrame *f = &s->pool[s->live[k]];
        if (frame_has_ended(f) && f->end + longest_delay < earliest)
            s->free[s->free_count++] = s->live[k];
        else
            s->live[kept++] = s->live[k];
    }
    s->count = kept;
}

static uint32_t moved(const Radios *radios, uint32_t before) {
    return before == NO_RADIO ? NO_RADIO : radios->moved[before];
}

int frames_follow(Frames *s, const Radios *radios) {
    for (size_t k = 0; k < s->count; k++) {
        AirFrame *f = &s->pool[s->live[k]];
        if (BUFFER_RESERVE(f->at, f->at_capacity, radios->count)) return 1;
        if (radios->count > 0) memset(f->at, 0, radios->count * sizeof *f->at);
        f->radios = radios->count;
        f->transmitter = moved(radios, f->transmitter);
        for (size_t i = 0; i < f->arrivals; i++) {
            Arrival *a = &f->arrival[i];
            a->receiver = moved(radios, a->receiver);
            if (a->receiver != NO_RADIO) f->at[a->receiver] = (uint32_t)i + 1;
        }
    }
    return 0;
}

void frames_free(Frames *s) {
    for (size_t k = 0; k < s->pool_count; k++) {
        free(s->pool[k].arrival);
        free(s->pool[k].at);
    }
    free(s->pool);
    free(s->live);
    free(s->free);
    *s = (Frames){0};
}
