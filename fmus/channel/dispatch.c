#include "dispatch.h"
#include "carrier_sense.h"
#include "reception.h"
#include "schedule.h"
#include "transmission.h"

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
        begin_arrival(c, f, &f->arrival[f->begun]);
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

/* Nothing happens before this time, or the end of the step: the event at hand has been taken out. */
static int64_t quiet_until(const Channel *c, int64_t end) {
    Event packet;
    int64_t time = end;
    if (c->events.count > 0 && c->events.item[0].time < time) time = c->events.item[0].time;
    return next_packet(c, &packet) && packet.time < time ? packet.time : time;
}

static int happen(Channel *c, const Event *event, int64_t end) {
    switch ((EventKind)event->kind) {
    case WINDOW_ENDS: return end_busy_window(c, quiet_until(c, end));
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
