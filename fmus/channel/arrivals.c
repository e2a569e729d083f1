#include "arrivals.h"
#include "buffer.h"
#include "decibel.h"
#include "fading.h"
#include "sort.h"
#include <math.h>

/* How a frame arrives over a link, fading included. */
static Arrival arrival_of_link(const Channel *c, const AirFrame *f, const Link *link) {
    const Parameters *p = &c->parameters;
    Arrival a = {.receiver = link->receiver, .link = link->kind};
    double power = f->power;
    if (p->fading != FADING_NONE) {
        Position from = c->scene.antenna[f->transmitter].at;
        Position to = c->scene.antenna[link->receiver].at;
        double x = to.x - from.x, y = to.y - from.y;
        power *= fading_factor(p, sqrt(x * x + y * y), f->what.packet.id,
                               (uint8_t)f->what.hop, c->scene.id[link->receiver]);
    }
    for (int band = 0; band < BANDS; band++) a.power[band] = power * link->gain[band];
    a.delay = (int64_t)(link->distance * (1e12 / LIGHT_SPEED) + 0.5);
    return a;
}

static bool comes_before(const Arrival *a, const Arrival *b) {
    return a->delay != b->delay ? a->delay < b->delay : a->receiver < b->receiver;
}

/* They come by distance, so that next to nothing moves. */
DEFINE_INSERTION_SORT(sort_arrivals, Arrival, comes_before)

/* Arrivals that are weaker are no events [mW]. */
static double weakest_event(const Parameters *p) { return p->weak_receptions ? 0 : p->noticeable; }

/* The gain with which a frame may arrive with the power `least`. */
static double gain_for(const Parameters *p, double least, double transmitted) {
    return least / (transmitted * fading_bound(p));
}

static int add(AirFrame *f, const Arrival *a) {
    Arrival *added = frame_add_arrival(f);
    if (!added) return 1;
    *added = *a;
    return 0;
}

/* Those that are events. */
static int add_noticed(const Channel *c, AirFrame *f, const LinksFrom *links, double weakest) {
    double floor = gain_for(&c->parameters, weakest, f->power);
    for (size_t k = 0; k < links->count; k++) {
        const Link *link = &links->link[k];
        if (link->gain[CENTER] < floor) continue;
        Arrival a = arrival_of_link(c, f, link);
        if (a.power[CENTER] >= weakest && add(f, &a)) return 1;
    }
    sort_arrivals(f->arrival, f->arrivals);
    for (size_t k = 0; k < f->arrivals; k++) f->at[f->arrival[k].receiver] = (uint32_t)k + 1;
    f->noticed = f->arrivals;
    return 0;
}

/* Those that only interfere; see arrival_at. */
static int add_others(const Channel *c, AirFrame *f, const LinksFrom *links, double negligible) {
    for (size_t k = 0; k < links->count; k++) {
        const Link *link = &links->link[k];
        if (link->gain[CENTER] < negligible || f->at[link->receiver] > 0) continue;
        Arrival a = arrival_of_link(c, f, link);
        if (add(f, &a)) return 1;
        f->at[link->receiver] = (uint32_t)f->arrivals;
    }
    f->is_settled = true;
    return 0;
}

int add_arrivals(Channel *c, AirFrame *f) {
    const Parameters *p = &c->parameters;
    double weakest = weakest_event(p), negligible = gain_for(p, p->negligible, f->power);
    LinksFrom links;
    if (links_from(&c->links, f->transmitter, gain_for(p, weakest, f->power), &links)) return 1;
    if (add_noticed(c, f, &links, weakest)) return 1;
    return links.floor <= negligible && add_others(c, f, &links, negligible);
}

Arrival *arrival_at(Channel *c, AirFrame *f, uint32_t radio, int *failed) {
    if (f->at[radio] > 0) return &f->arrival[f->at[radio] - 1];
    if (f->is_settled || f->transmitter == radio || !c->radios.item[radio].is_equipped) return NULL;
    const Parameters *p = &c->parameters;
    const Antenna *antenna = c->scene.antenna;
    if (distance_between(antenna[f->transmitter].at, antenna[radio].at) > p->maximum_range) return NULL;
    Link link;
    double negligible = gain_for(p, p->negligible, f->power);
    bool found = !link_between(&c->links, f->transmitter, radio, negligible, &link);
    Arrival *added = found ? frame_add_arrival(f) : NULL;
    if (!added) {
        *failed = 1;
        return NULL;
    }
    *added = arrival_of_link(c, f, &link);
    f->at[radio] = (uint32_t)f->arrivals;
    return added;
}

/* Complete the arrivals of one frame; those without power are not worth keeping. */
static void settle(Channel *c, AirFrame *f, int *failed) {
    for (size_t radio = 0; radio < c->radios.count; radio++) {
        if (f->at[radio] > 0) continue;
        const Arrival *last = arrival_at(c, f, (uint32_t)radio, failed);
        if (!last || last->power[CENTER] > 0) continue;
        f->arrivals--;
        f->at[radio] = 0;
    }
    f->is_settled = !*failed;
}

int complete_arrivals(Channel *c, int64_t now) {
    int failed = 0;
    frames_let_go(&c->frames, now, c->longest_delay);
    for (size_t k = 0; k < c->frames.count; k++) {
        AirFrame *f = &c->frames.pool[c->frames.live[k]];
        if (!f->is_settled) settle(c, f, &failed);
    }
    return failed;
}

static bool will_send(const Radio *r) {
    uint32_t queued = 0;
    for (int k = 0; k < CATEGORIES; k++) queued += r->category[k].queue.count;
    return queued > 0 || (radio_is_sending(r) && r->sending_until == NEVER);
}

int64_t time_on_air(const Channel *c, const Packet *packet) {
    if (packet->duration > 0) return packet->duration * NANOSECOND;
    return frame_duration(c->parameters.mode, packet->size + c->parameters.mac_header);
}

int expect_arrivals(Channel *c, int64_t now, int64_t end) {
    const Waiting *w = &c->waiting;
    const Parameters *p = &c->parameters;
    if (BUFFER_RESERVE(c->sender, c->sender_capacity, c->radios.count + w->count)) return 1;
    size_t count = 0;
    for (size_t k = 0; k < c->radios.count; k++)
        if (will_send(&c->radios.item[k])) c->sender[count++] = (uint32_t)k;
    double offset = 0; /* of the most powerful one */
    double on_air = 0; /* all of them together [ps] */
    for (size_t k = w->count; k-- > 0 && w->item[k].time <= end;) {
        size_t radio = scene_find(&c->scene, w->item[k].transmitter);
        if (radio == NO_INDEX) continue;
        c->sender[count++] = (uint32_t)radio;
        offset = larger(offset, w->item[k].packet.power_offset);
        on_air += (double)time_on_air(c, &w->item[k].packet);
    }
    double power = offset > 0 ? p->transmit_power * from_db(offset) : p->transmit_power;
    Expected expected = {
        .radio = c->sender,
        .count = count,
        .floor = gain_for(p, weakest_event(p), power),
        .negligible = gain_for(p, p->negligible, power),
        .load = end > now ? on_air / (double)(end - now) : 0,
    };
    return links_expect(&c->links, &expected);
}
