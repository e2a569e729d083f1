#include "arrivals.h"
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

int add_arrivals(Channel *c, AirFrame *f) {
    const Parameters *p = &c->parameters;
    double weakest = p->weak_receptions ? 0 : p->noticeable;
    const Link *link;
    size_t links;
    if (links_from(&c->links, &c->scene, f->transmitter,
                   weakest / (f->power * fading_bound(p)), &link, &links))
        return 1;
    for (size_t k = 0; k < links; k++) {
        Arrival a = arrival_of_link(c, f, &link[k]);
        if (a.power[CENTER] < weakest) continue;
        Arrival *added = frame_add_arrival(f);
        if (!added) return 1;
        *added = a;
    }
    sort_arrivals(f->arrival, f->arrivals);
    for (size_t k = 0; k < f->arrivals; k++) f->at[f->arrival[k].receiver] = (uint32_t)k + 1;
    f->noticed = f->arrivals;
    return 0;
}

Arrival *arrival_at(Channel *c, AirFrame *f, uint32_t radio, int *failed) {
    if (f->at[radio] > 0) return &f->arrival[f->at[radio] - 1];
    if (f->is_settled || f->transmitter == radio || !c->radios.item[radio].is_equipped) return NULL;
    const Parameters *p = &c->parameters;
    const Antenna *antenna = c->scene.antenna;
    if (distance_between(antenna[f->transmitter].at, antenna[radio].at) > p->maximum_range) return NULL;
    Link link;
    double negligible = p->negligible / (f->power * fading_bound(p));
    bool found = !link_between(&c->links, &c->scene, f->transmitter, radio, negligible, &link);
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
