/* Saved state: a header, then the arrays that it counts. The byte order is the host's (all targets
 * are little-endian). */
#include "state.h"
#include "buffer.h"
#include <math.h>
#include <string.h>

typedef struct {
    char magic[4];
    uint32_t version;
    int64_t highest_vehicle, window_ends;
    /* numbers of elements */
    uint64_t waiting, known, radios, queued, frames, arrivals, transmissions;
} Header;

/* A frame on air without its arrivals. */
typedef struct {
    Transmission what;
    int64_t start, end;
    double power;
    uint64_t arrivals, noticed, begun, ended;
    uint64_t transmitter;
} SavedFrame;

/* ---- saving ---- */

static Header count(const Channel *c) {
    Header head = {
        .magic = {'C', 'H', 'N', 'L'},
        .version = 2,
        .highest_vehicle = c->waiting.highest_vehicle,
        .window_ends = c->window_ends,
        .waiting = c->waiting.count,
        .known = c->waiting.known_count,
        .radios = c->radios.count,
        .frames = c->frames.count,
    };
    size_t transmissions;
    reported_transmissions(&c->reports, &transmissions);
    head.transmissions = transmissions;
    for (size_t k = 0; k < c->radios.count; k++)
        for (int a = 0; a < CATEGORIES; a++) head.queued += c->radios.item[k].category[a].queue.count;
    for (size_t k = 0; k < c->frames.count; k++)
        head.arrivals += c->frames.pool[c->frames.live[k]].arrivals;
    return head;
}

static size_t size_of(const Header *h) {
    return sizeof *h + h->waiting * sizeof(Transmission) + h->known * sizeof(int64_t)
        + h->radios * sizeof(Radio) + h->queued * sizeof(Transmission)
        + h->frames * sizeof(SavedFrame) + h->arrivals * sizeof(Arrival)
        + h->transmissions * sizeof(TransmissionRecord);
}

static uint8_t *put(uint8_t *to, const void *from, size_t size) {
    if (size > 0) memcpy(to, from, size);
    return to + size;
}

/* Number of a frame among those on air. */
static uint32_t live_number(const Channel *c, uint32_t frame) {
    for (size_t k = 0; k < c->frames.count; k++)
        if (c->frames.live[k] == frame) return (uint32_t)k;
    return NO_FRAME;
}

static uint8_t *put_radios(uint8_t *bytes, const Channel *c) {
    for (size_t k = 0; k < c->radios.count; k++) {
        Radio r = c->radios.item[k]; /* without what depends on how the memory is laid out */
        for (int a = 0; a < CATEGORIES; a++) r.category[a].queue.first = r.category[a].queue.last = 0;
        r.scheduled_stamp = 0;
        if (r.locked != NO_FRAME) r.locked = live_number(c, r.locked);
        bytes = put(bytes, &r, sizeof r);
    }
    for (size_t k = 0; k < c->radios.count; k++)
        for (int a = 0; a < CATEGORIES; a++) {
            Queue queue = c->radios.item[k].category[a].queue;
            for (uint32_t at = queue.first; queue.count > 0 && at != NO_FRAME;
                 at = c->radios.store.item[at].next)
                bytes = put(bytes, &c->radios.store.item[at].frame, sizeof(Transmission));
        }
    return bytes;
}

static uint8_t *put_frames(uint8_t *bytes, const Channel *c) {
    for (size_t k = 0; k < c->frames.count; k++) {
        const AirFrame *f = &c->frames.pool[c->frames.live[k]];
        SavedFrame saved = {f->what,  f->start, f->end,          f->power, f->arrivals, f->noticed,
                            f->begun, f->ended, f->transmitter};
        bytes = put(bytes, &saved, sizeof saved);
    }
    for (size_t k = 0; k < c->frames.count; k++) {
        const AirFrame *f = &c->frames.pool[c->frames.live[k]];
        bytes = put(bytes, f->arrival, f->arrivals * sizeof *f->arrival);
    }
    return bytes;
}

size_t state_save(const Channel *c, uint8_t *bytes) {
    Header head = count(c);
    if (!bytes) return size_of(&head);
    bytes = put(bytes, &head, sizeof head);
    bytes = put(bytes, c->waiting.item, head.waiting * sizeof(Transmission));
    bytes = put(bytes, c->waiting.known, head.known * sizeof(int64_t));
    bytes = put_radios(bytes, c);
    bytes = put_frames(bytes, c);
    size_t transmissions;
    const TransmissionRecord *record = reported_transmissions(&c->reports, &transmissions);
    put(bytes, record, transmissions * sizeof *record);
    return size_of(&head);
}

/* ---- loading: nothing is believed, the bytes may come from a file ---- */

typedef struct { const uint8_t *at; } Source;

static void get(void *to, Source *from, size_t size) {
    if (size > 0) memcpy(to, from->at, size);
    from->at += size;
}

static bool is_time(int64_t t) { return t > -(INT64_C(1) << 62) && t < INT64_C(1) << 62; }

static bool is_sound_transmission(const Transmission *t) {
    const Packet *p = &t->packet;
    return t->hop >= 0 && t->hop <= packet_relays(p) && is_time(t->time)
        && p->size <= FRAME_SIZE_MAX && p->access_category < CATEGORIES && p->kind <= NOISE
        && p->duration >= 0 && p->duration <= INT32_MAX && fabs(p->power_offset) <= 300;
}

static bool is_sound_radio(const Radio *r, const Channel *c) {
    for (int a = 0; a < CATEGORIES; a++)
        if (r->category[a].window > 1023 || r->category[a].backoff > 1023) return false;
    bool is_listening = r->sending_from == NEVER;
    return is_time(r->idle_since) && is_time(r->busy_since) && is_time(r->entered)
        && r->busy_time >= 0 && r->busy_time <= c->parameters.busy_window
        && (r->contention_ends == NEVER || is_time(r->contention_ends))
        && (is_listening ? r->sending_until == NEVER : is_time(r->sending_from))
        && (r->sending_until == NEVER || is_time(r->sending_until))
        && (is_listening || is_sound_transmission(&r->sending))
        && (r->locked == NO_FRAME || r->locked < c->frames.count);
}

static bool is_sound_frame(const SavedFrame *f, const Header *h) {
    return is_sound_transmission(&f->what) && is_time(f->start) && is_time(f->end)
        && f->end > f->start && f->noticed <= f->arrivals && f->begun <= f->noticed
        && f->ended <= f->begun
        && (f->transmitter < h->radios || f->transmitter == NO_RADIO);
}

static bool is_sound_arrival(const Arrival *a, const Header *h) {
    for (int band = 0; band < BANDS; band++)
        if (!(a->power[band] >= 0 && isfinite(a->power[band]))) return false;
    return (a->receiver < h->radios || a->receiver == NO_RADIO) && a->link <= NLOSB
        && a->verdict < VERDICTS && a->delay >= 0 && a->delay < INT64_C(1) << 40;
}

/* What a radio is locked to has begun there and not ended, so that its end will unlock the radio. */
static bool are_locks_sound(const Channel *c) {
    for (size_t k = 0; k < c->radios.count; k++) {
        uint32_t locked = c->radios.item[k].locked;
        if (locked == NO_FRAME) continue;
        const AirFrame *f = &c->frames.pool[locked];
        if (f->at[k] <= f->ended || f->at[k] > f->begun) return false;
        if (f->arrival[f->at[k] - 1].verdict != LOCKED) return false;
    }
    return true;
}

static bool is_in_order(const Waiting *w) {
    for (size_t k = 0; k < w->count; k++)
        if (!is_sound_transmission(&w->item[k]) || (k > 0 && w->item[k].time > w->item[k - 1].time))
            return false;
    return true;
}

/* What can go wrong: memory, or the bytes. */
typedef enum { LOADED, NO_MEMORY, NO_STATE } Result;

static Result load_waiting(Channel *c, Source *from, const Header *h) {
    Waiting *w = &c->waiting;
    if (BUFFER_RESERVE(w->item, w->capacity, h->waiting)
        || BUFFER_RESERVE(w->known, w->known_capacity, h->known))
        return NO_MEMORY;
    get(w->item, from, h->waiting * sizeof *w->item);
    get(w->known, from, h->known * sizeof *w->known);
    w->count = h->waiting;
    w->known_count = h->known;
    w->highest_vehicle = h->highest_vehicle;
    return is_in_order(w) ? LOADED : NO_STATE;
}

static Result load_queues(Channel *c, Source *from, uint64_t left) {
    for (size_t k = 0; k < c->radios.count; k++)
        for (int a = 0; a < CATEGORIES; a++) {
            Queue *queue = &c->radios.item[k].category[a].queue;
            uint32_t wanted = queue->count;
            *queue = EMPTY_QUEUE;
            if (wanted > left) return NO_STATE;
            left -= wanted;
            for (; wanted > 0; wanted--) {
                Transmission t;
                get(&t, from, sizeof t);
                if (!is_sound_transmission(&t)) return NO_STATE;
                if (queue_add(&c->radios.store, queue, &t)) return NO_MEMORY;
            }
        }
    return left == 0 ? LOADED : NO_STATE;
}

static Result load_radios(Channel *c, Source *from, const Header *h) {
    Radios *s = &c->radios;
    queues_clear(&s->store);
    if (BUFFER_RESERVE(s->item, s->capacity, h->radios)) return NO_MEMORY;
    get(s->item, from, h->radios * sizeof *s->item);
    s->count = h->radios;
    for (size_t k = 0; k < s->count; k++)
        if (!is_sound_radio(&s->item[k], c)
            || (k > 0 && s->item[k].vehicle <= s->item[k - 1].vehicle)) {
            s->count = 0;
            return NO_STATE;
        }
    return load_queues(c, from, h->queued);
}

static Result load_frame(Channel *c, Source *from, const Header *h, uint64_t *left) {
    SavedFrame saved;
    get(&saved, from, sizeof saved);
    if (!is_sound_frame(&saved, h) || saved.arrivals > *left) return NO_STATE;
    *left -= saved.arrivals;
    AirFrame *f = frames_add(&c->frames, h->radios);
    if (!f) return NO_MEMORY;
    f->what = saved.what;
    f->start = saved.start, f->end = saved.end;
    f->power = saved.power;
    f->transmitter = (uint32_t)saved.transmitter;
    f->is_settled = true;
    f->arrivals = saved.arrivals, f->noticed = saved.noticed;
    f->begun = saved.begun, f->ended = saved.ended;
    return BUFFER_RESERVE(f->arrival, f->capacity, f->arrivals) ? NO_MEMORY : LOADED;
}

static Result load_arrivals(AirFrame *f, Source *from, const Header *h) {
    get(f->arrival, from, f->arrivals * sizeof *f->arrival);
    for (size_t k = 0; k < f->arrivals; k++) {
        const Arrival *a = &f->arrival[k];
        if (!is_sound_arrival(a, h)) return NO_STATE;
        if (a->receiver == NO_RADIO) continue;
        if (f->at[a->receiver] > 0) return NO_STATE; /* twice */
        f->at[a->receiver] = (uint32_t)k + 1;
    }
    return LOADED;
}

static Result load_frames(Channel *c, Source *from, const Header *h) {
    frames_free(&c->frames); /* so that they are numbered from 0 */
    uint64_t left = h->arrivals;
    for (uint64_t k = 0; k < h->frames; k++) {
        Result result = load_frame(c, from, h, &left);
        if (result != LOADED) return result;
    }
    if (left > 0) return NO_STATE;
    for (uint64_t k = 0; k < h->frames; k++) {
        Result result = load_arrivals(&c->frames.pool[c->frames.live[k]], from, h);
        if (result != LOADED) return result;
    }
    return LOADED;
}

static Result load_all(Channel *c, Source *from, const Header *h) {
    c->frames.count = h->frames; /* for the check of the radios */
    Result result = load_waiting(c, from, h);
    if (result == LOADED) result = load_radios(c, from, h);
    c->frames.count = 0;
    if (result == LOADED) result = load_frames(c, from, h);
    if (result != LOADED) return result;
    reports_clear(&c->reports);
    for (uint64_t k = 0; k < h->transmissions; k++) {
        TransmissionRecord *record = report_transmission(&c->reports);
        if (!record) return NO_MEMORY;
        get(record, from, sizeof *record);
    }
    return are_locks_sound(c) ? LOADED : NO_STATE;
}

/* Nothing waits, nothing is on air. */
static void forget(Channel *c) {
    c->waiting.count = c->waiting.known_count = 0;
    c->radios.count = 0;
    queues_clear(&c->radios.store);
    frames_free(&c->frames);
    reports_clear(&c->reports);
}

static bool is_header(const Header *h, size_t size) {
    uint64_t most = size; /* so that no product overflows */
    return memcmp(h->magic, "CHNL", 4) == 0 && h->version == 2 && is_time(h->window_ends)
        && h->waiting <= most && h->known <= most && h->radios <= most && h->queued <= most
        && h->frames <= most && h->arrivals <= most && h->transmissions <= most
        && size_of(h) == size;
}

ModelStatus state_load(Instance *i, Channel *c, const uint8_t *bytes, size_t size) {
    Header head;
    Source from = {bytes};
    Result result = NO_STATE;
    c->scene.is_stale = true;
    if (size >= sizeof head) {
        get(&head, &from, sizeof head);
        if (is_header(&head, size)) result = load_all(c, &from, &head);
    }
    if (result == LOADED) {
        c->window_ends = head.window_ends;
        return MODEL_OK;
    }
    forget(c);
    if (result == NO_MEMORY) return model_log(i, MODEL_ERROR, "memory is short for the saved state");
    return model_log(i, MODEL_ERROR, "these bytes are no saved state of a channel");
}
