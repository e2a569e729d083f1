#include "transmission.h"
#include "arrivals.h"
#include "carrier_sense.h"
#include "decibel.h"
#include "medium_access.h"
#include "schedule.h"

static int tell(Channel *c, const Transmission *t, int64_t time, int64_t on_air, uint8_t fate) {
    TransmissionRecord *record = report_transmission(&c->reports);
    if (!record) return 1;
    *record = (TransmissionRecord){
        .packet = t->packet.id,
        .time = nanoseconds_down(time),
        .queued = nanoseconds_down(t->time),
        .transmitter = t->transmitter,
        .duration = (int32_t)(on_air / NANOSECOND),
        .hop = (uint8_t)t->hop,
        .fate = fate,
        .access_category = t->packet.access_category,
        .kind = t->packet.kind,
    };
    return 0;
}

int give_up(Channel *c, const Transmission *t, int64_t now, uint8_t fate) {
    return tell(c, t, now, 0, fate);
}

static int put_on_air(Channel *c, const Transmission *t, uint32_t from, int64_t now) {
    int64_t on_air = time_on_air(c, &t->packet);
    frames_let_go(&c->frames, now, c->longest_delay);
    AirFrame *f = frames_add(&c->frames, c->radios.count);
    if (!f) return 1;
    f->what = *t;
    f->start = now;
    f->end = now + on_air;
    f->power = c->parameters.transmit_power;
    if (t->packet.power_offset != 0) f->power *= from_db(t->packet.power_offset);
    f->transmitter = from;
    return add_arrivals(c, f) || schedule_frame(c, frame_index(&c->frames, f))
        || tell(c, t, now, on_air, SENT);
}

/* Forget frames that have waited too long at the head of a queue. */
static int drop_expired(Channel *c, Queue *queue, int64_t now) {
    int64_t lifetime = c->parameters.packet_lifetime;
    if (lifetime == 0) return 0;
    while (queue->count > 0 && now - queue_first(&c->radios.store, queue)->time > lifetime) {
        Transmission expired = queue_take(&c->radios.store, queue);
        if (give_up(c, &expired, now, EXPIRED)) return 1;
    }
    return 0;
}

static void set_contention(Radio *r, int64_t end) {
    r->contention_ends = end;
    r->contention_stamp++;
}

/* Without medium access all frames wait in one queue while the radio sends. */
static int send_next(Channel *c, uint32_t radio, int64_t now) {
    Radio *r = &c->radios.item[radio];
    Queue *queue = &r->category[VOICE].queue;
    if (radio_is_sending(r)) return 0;
    set_contention(r, NEVER);
    if (drop_expired(c, queue, now)) return 1;
    if (queue->count == 0) return 0;
    r->sending = queue_take(&c->radios.store, queue);
    r->sending_from = now;
    return start_sending(c, radio, now);
}

static int enqueue(Channel *c, const Transmission *t, uint32_t radio) {
    const Parameters *p = &c->parameters;
    Radio *r = &c->radios.item[radio];
    AccessCategory k = p->medium_access ? (AccessCategory)t->packet.access_category : VOICE;
    Queue *queue = &r->category[k].queue;
    if (drop_expired(c, queue, t->time)) return 1;
    if (p->queue_limit > 0 && queue->count >= p->queue_limit)
        return give_up(c, t, t->time, QUEUE_FULL);
    if (queue_add(&c->radios.store, queue, t)) return 1;
    if (!p->medium_access) return send_next(c, radio, t->time);
    access_enqueued(r, k, p->seed, t->time);
    return schedule_contention(c, radio);
}

int hand_over(Channel *c, const Transmission *t) {
    size_t radio = scene_find(&c->scene, t->transmitter);
    if (radio == NO_INDEX || !c->scene.equipped[radio]) return give_up(c, t, t->time, GONE);
    if (t->packet.kind == NOISE) return put_on_air(c, t, (uint32_t)radio, t->time);
    return enqueue(c, t, (uint32_t)radio);
}

int end_contention(Channel *c, uint32_t radio, int64_t now) {
    if (!c->parameters.medium_access) return send_next(c, radio, now);
    Radio *r = &c->radios.item[radio];
    for (int a = 0; a < CATEGORIES; a++)
        if (drop_expired(c, &r->category[a].queue, now)) return 1;
    int k = access_contention_ended(r, c->parameters.seed, now);
    if (k == CATEGORIES) return schedule_contention(c, radio);
    r->sending = queue_take(&c->radios.store, &r->category[k].queue);
    r->sending_from = now + TURNAROUND;
    r->is_idle = false; /* for the other categories, too */
    r->busy_since = now;
    return schedule_radio(c, radio);
}

int start_sending(Channel *c, uint32_t radio, int64_t now) {
    Radio *r = &c->radios.item[radio];
    if (r->locked != NO_FRAME) { /* a frame came in during the turnaround */
        AirFrame *f = &c->frames.pool[r->locked];
        f->arrival[f->at[radio] - 1].verdict = DEAFENED;
        r->locked = NO_FRAME;
    }
    r->sending_until = now + time_on_air(c, &r->sending.packet);
    if (r->is_idle) {
        r->is_idle = false;
        r->busy_since = now;
    }
    return put_on_air(c, &r->sending, radio, now) || schedule_radio(c, radio);
}

int end_sending(Channel *c, uint32_t radio, int64_t now) {
    Radio *r = &c->radios.item[radio];
    r->sending_from = r->sending_until = NEVER;
    if (c->parameters.medium_access)
        access_sent(r, (AccessCategory)r->sending.packet.access_category, c->parameters.seed);
    if (sense_idle(c, radio, now)) return 1;
    if (c->parameters.medium_access) return 0;
    set_contention(r, now); /* not at once: the next frame begins in the step that begins now */
    return schedule_contention(c, radio);
}
