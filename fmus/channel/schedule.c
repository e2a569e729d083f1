/* The events of a step, in order. They are made anew from the state at the start of each step, so
 * that the state alone decides what happens. */
#include "channel.h"
#include "medium_access.h"

static int schedule(Channel *c, EventKind kind, int64_t time, int64_t key, int64_t hop,
                    uint32_t subject, uint32_t stamp) {
    Event event = {time, key, subject, stamp, (uint8_t)kind, (uint8_t)hop};
    return events_add(&c->events, &event);
}

int schedule_contention(Channel *c, uint32_t radio) {
    Radio *r = &c->radios.item[radio];
    if (r->contention_ends == NEVER || r->contention_stamp == r->scheduled_stamp) return 0;
    r->scheduled_stamp = r->contention_stamp;
    return schedule(c, CONTENTION_ENDS, r->contention_ends, r->vehicle, 0, radio,
                    r->contention_stamp);
}

int schedule_radio(Channel *c, uint32_t radio) {
    Radio *r = &c->radios.item[radio];
    if (r->sending_until != NEVER)
        return schedule(c, SENDING_ENDS, r->sending_until, r->vehicle, 0, radio, 0);
    if (r->sending_from != NEVER)
        return schedule(c, SENDING_STARTS, r->sending_from, r->sending.packet.id, r->sending.hop,
                        radio, 0);
    return schedule_contention(c, radio);
}

static int schedule_next_begin(Channel *c, uint32_t frame) {
    const AirFrame *f = &c->frames.pool[frame];
    if (f->begun == f->noticed) return 0;
    return schedule(c, ARRIVAL_BEGINS, arrival_begins(f, &f->arrival[f->begun]), f->what.packet.id,
                    f->what.hop, frame, 0);
}

static int schedule_next_end(Channel *c, uint32_t frame) {
    const AirFrame *f = &c->frames.pool[frame];
    if (f->ended == f->noticed) return 0;
    return schedule(c, ARRIVAL_ENDS, arrival_ends(f, &f->arrival[f->ended]), f->what.packet.id,
                    f->what.hop, frame, 0);
}

int schedule_frame(Channel *c, uint32_t frame) {
    return schedule_next_begin(c, frame) || schedule_next_end(c, frame);
}

static int schedule_all(Channel *c) {
    c->events.count = 0;
    if (schedule(c, WINDOW_ENDS, c->window_ends, 0, 0, 0, 0)) return 1;
    for (size_t k = 0; k < c->frames.count; k++)
        if (schedule_frame(c, c->frames.live[k])) return 1;
    for (size_t k = 0; k < c->radios.count; k++) {
        c->radios.item[k].scheduled_stamp = c->radios.item[k].contention_stamp - 1;
        if (schedule_radio(c, (uint32_t)k)) return 1;
    }
    return 0;
}

/* The next packet to be handed over, as an event; NULL if there is none. */
static const Event *next_packet(const Channel *c, Event *event) {
    if (c->waiting.count == 0) return NULL;
    const Transmission *t = &c->waiting.item[c->waiting.count - 1];
    *event = (Event){t->time, t->packet.id, 0, 0, HANDOVER, (uint8_t)t->hop};
    return event;
}

static bool is_due(const Event *event, int64_t end) {
    return event->time < end || (event->time == end && event->kind < LAST_AT_THE_END);
}

/* Whether an event may happen now: nothing comes before it. */
static bool is_next(const Channel *c, const Event *event, int64_t end) {
    Event packet;
    if (!is_due(event, end)) return false;
    if (c->events.count > 0 && event_is_before(&c->events.item[0], event)) return false;
    return !next_packet(c, &packet) || event_is_before(event, &packet);
}

/* Arrivals of one frame follow each other closely: go on while nothing else comes between. */
static int run_begins(Channel *c, Event event, int64_t end) {
    AirFrame *f = &c->frames.pool[event.subject];
    do {
        if (begin_arrival(c, f, &f->arrival[f->begun])) return 1;
        if (++f->begun == f->noticed) return 0;
        event.time = arrival_begins(f, &f->arrival[f->begun]);
    } while (is_next(c, &event, end));
    return events_add(&c->events, &event);
}

static int run_ends(Channel *c, Event event, int64_t end) {
    AirFrame *f = &c->frames.pool[event.subject];
    do {
        if (end_arrival(c, f, &f->arrival[f->ended])) return 1;
        if (++f->ended == f->noticed) return 0;
        event.time = arrival_ends(f, &f->arrival[f->ended]);
    } while (is_next(c, &event, end));
    return events_add(&c->events, &event);
}

static int end_window(Channel *c) {
    int64_t now = c->window_ends, length = c->parameters.busy_window;
    for (size_t k = 0; k < c->radios.count; k++) {
        Radio *r = &c->radios.item[k];
        if (!r->is_idle) {
            r->busy_time += now - r->busy_since;
            r->busy_since = now;
        }
        int64_t begun = now - length > r->entered ? now - length : r->entered;
        r->busy_ratio = now > begun ? (double)r->busy_time / (double)(now - begun) : 0;
        r->busy_time = 0;
    }
    c->window_ends += length;
    return schedule(c, WINDOW_ENDS, c->window_ends, 0, 0, 0, 0);
}

static int happen(Channel *c, const Event *event, int64_t end) {
    switch ((EventKind)event->kind) {
    case WINDOW_ENDS: return end_window(c);
    case ARRIVAL_ENDS: return run_ends(c, *event, end);
    case SENDING_ENDS: return end_sending(c, event->subject, event->time);
    case CONTENTION_ENDS:
        if (event->stamp != c->radios.item[event->subject].contention_stamp) return 0;
        return end_contention(c, event->subject, event->time);
    case SENDING_STARTS: return start_sending(c, event->subject, event->time);
    default: return run_begins(c, *event, end);
    }
}

int run_until(Channel *c, int64_t end) {
    if (schedule_all(c)) return 1;
    for (;;) {
        Event packet, event = c->events.item[0]; /* the end of the window is always there */
        if (next_packet(c, &packet) && event_is_before(&packet, &event)) {
            if (!is_due(&packet, end)) return 0;
            Transmission taken = c->waiting.item[--c->waiting.count];
            if (hand_over(c, &taken)) return 1;
            continue;
        }
        if (!is_due(&event, end)) return 0;
        events_drop_first(&c->events);
        if (happen(c, &event, end)) return 1;
    }
}
