#include "schedule.h"

static int schedule(Channel *c, EventKind kind, int64_t time, int64_t key, int64_t hop,
                    uint32_t subject, uint32_t stamp) {
    Event event = {time, key, subject, stamp, (uint8_t)kind, (uint8_t)hop};
    return events_add(&c->events, &event);
}

int schedule_window(Channel *c) {
    return schedule(c, WINDOW_ENDS, c->window_ends, 0, 0, 0, 0);
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

int schedule_all(Channel *c) {
    c->events.count = 0;
    if (schedule_window(c)) return 1;
    for (size_t k = 0; k < c->frames.count; k++)
        if (schedule_frame(c, c->frames.live[k])) return 1;
    for (size_t k = 0; k < c->radios.count; k++) {
        c->radios.item[k].scheduled_stamp = c->radios.item[k].contention_stamp - 1;
        if (schedule_radio(c, (uint32_t)k)) return 1;
    }
    return 0;
}
