#include "channel.h"
#include "error_rate.h"
#include "random.h"
#include <math.h>

/* Whether a frame is received. The radio does not notice frames under its sensitivity; of the
 * others it has to decode first the SIGNAL field, then the rest. */
static uint8_t outcome(const Parameters *p, double power, const Transmission *t, int64_t receiver) {
    if (power < p->sensitivity) return LOST_WEAK;
    double snir_db = power - p->noise_floor;
    if (snir_db >= p->certain_snir) return RECEIVED;
    double snir = pow(10, snir_db / 10);
    uint32_t size = t->packet.size + p->mac_header;
    Uniforms u = draw(p->seed, DRAW_RECEPTION, t->packet.id, (uint8_t)t->hop, receiver);
    bool received = u.first < header_success_probability(snir)
        && u.second < payload_success_probability(p->mode, snir, size);
    return received ? RECEIVED : LOST_NOISE;
}

/* The next hop of a frame that its relay received at `time`. */
static int relay(Channel *c, const Transmission *t, int64_t relay, int64_t time) {
    Transmission next = *t;
    next.time = time + c->parameters.relay_delay;
    next.transmitter = relay;
    next.hop++;
    return waiting_add(&c->waiting, &next);
}

int transmit(Channel *c, const Transmission *t) {
    const Parameters *p = &c->parameters;
    Scene *s = &c->scene;
    size_t from = scene_find(s, t->transmitter);
    if (from == NO_INDEX || !s->equipped[from]) return 1;
    if (receptions_reserve(&c->on_air, s->count)) return -1;
    int64_t end = t->time + frame_duration(p->mode, t->packet.size + p->mac_header);
    int64_t addressee = packet_addressee(&t->packet, t->hop);
    bool is_last_hop = t->hop >= packet_relays(&t->packet);
    for (size_t to = 0; to < s->count; to++) {
        if (to == from || !s->equipped[to]) continue;
        double distance = distance_between(s->antenna[from], s->antenna[to]);
        if (distance > p->maximum_range) continue;
        Link link = link_between(&c->links, s, p, from, to);
        double power = p->transmit_power - link.loss_db;
        Reception r = {
            .packet = t->packet.id,
            .time = end + llround(distance / LIGHT_SPEED * 1e9),
            .transmitter = t->transmitter,
            .receiver = s->id[to],
            .power_dbm = (float)power,
            .snir_db = (float)(power - p->noise_floor),
            .hop = (uint8_t)t->hop,
            .outcome = outcome(p, power, t, s->id[to]),
            .link = link.kind,
            .kind = t->packet.kind,
            .addressed = addressee == NO_VEHICLE || addressee == s->id[to],
        };
        c->on_air.item[c->on_air.count++] = r;
        if (r.outcome == RECEIVED && !is_last_hop && r.addressed && relay(c, t, r.receiver, r.time))
            return -1;
    }
    return 0;
}
