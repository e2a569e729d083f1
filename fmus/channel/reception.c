#include "reception.h"
#include "carrier_sense.h"
#include "error_rate.h"
#include "interference.h"
#include "random.h"
#include <math.h>

/* Whether a frame is so strong that the receiver drops what it receives and turns to it. */
static bool captures(Channel *c, const AirFrame *f, const Arrival *a, int64_t now) {
    double ratio = c->parameters.capture_ratio;
    if (isinf(ratio)) return false;
    double others = power_on_air(c, a->receiver, now, CENTER, f);
    return a->power[CENTER] >= ratio * (others + c->parameters.noise);
}

static void lock(Channel *c, AirFrame *f, Arrival *a) {
    c->radios.item[a->receiver].locked = frame_index(&c->frames, f);
    a->verdict = LOCKED;
}

static void listen(Channel *c, AirFrame *f, Arrival *a, int64_t now) {
    Radio *r = &c->radios.item[a->receiver];
    if (r->sending_from <= now) {
        a->verdict = DEAFENED;
    } else if (r->locked == NO_FRAME) {
        lock(c, f, a);
    } else if (captures(c, f, a, now)) {
        AirFrame *before = &c->frames.pool[r->locked];
        before->arrival[before->at[a->receiver] - 1].verdict = ABANDONED;
        lock(c, f, a);
    } else {
        a->verdict = IGNORED;
    }
}

void begin_arrival(Channel *c, AirFrame *f, Arrival *a) {
    const Parameters *p = &c->parameters;
    if (a->receiver == NO_RADIO) return;
    int64_t now = arrival_begins(f, a);
    if (f->what.packet.kind != NOISE && a->power[CENTER] >= p->sensitivity) {
        listen(c, f, a, now);
        sense_busy(c, a->receiver, now);
        return;
    }
    a->verdict = UNNOTICED;
    if (a->power[CENTER] >= p->noticeable
        && power_on_air(c, a->receiver, now, LOWER_EDGE, NULL) >= p->cca_threshold)
        sense_busy(c, a->receiver, now);
}

/* A receiver decodes the SIGNAL field first, then the rest. A part that is lost, but would not have
 * been without the interference (by the same draw), is lost to interference. */
static uint8_t decode_parts(const Channel *c, const AirFrame *f, Uniforms u, double snir,
                            double alone) {
    uint32_t size = f->what.packet.size + c->parameters.mac_header;
    const Mode *mode = c->parameters.mode;
    if (u.first >= header_success_probability(snir))
        return u.first < header_success_probability(alone) ? LOST_COLLISION : LOST_NOISE;
    if (u.second >= payload_success_probability(mode, snir, size))
        return u.second < payload_success_probability(mode, alone, size) ? LOST_COLLISION : LOST_NOISE;
    return RECEIVED;
}

static uint8_t decode(Channel *c, const AirFrame *f, const Arrival *a, double *snir, int *failed) {
    int64_t receiver = c->radios.item[a->receiver].vehicle;
    *snir = lowest_snir(c, f, a, false, failed);
    if (*snir >= c->parameters.certain_snir) return RECEIVED;
    Uniforms u = draw(c->parameters.seed, DRAW_RECEPTION, f->what.packet.id, (uint16_t)f->what.hop,
                      receiver);
    return decode_parts(c, f, u, *snir, lowest_snir(c, f, a, true, failed));
}

static uint8_t outcome(Channel *c, const AirFrame *f, const Arrival *a, int64_t now, double *snir,
                       int *failed) {
    *snir = NAN;
    if (a->verdict == UNNOTICED) return LOST_WEAK;
    if (a->verdict == DEAFENED || c->radios.item[a->receiver].sending_from < now)
        return LOST_TRANSMITTING;
    switch ((Verdict)a->verdict) {
    case LOCKED: return decode(c, f, a, snir, failed);
    case ABANDONED: *snir = lowest_snir(c, f, a, false, failed); return LOST_COLLISION;
    default: return LOST_BUSY;
    }
}

/* The next hop of a frame that its relay has received. */
static int forward(Channel *c, const AirFrame *f, int64_t relay, int64_t now) {
    Transmission next = f->what;
    next.time = now + c->parameters.relay_delay;
    next.transmitter = relay;
    next.hop++;
    return waiting_add(&c->waiting, &next);
}

static int tell(Channel *c, const AirFrame *f, const Arrival *a, int64_t now, uint8_t result,
                double snir) {
    const Transmission *t = &f->what;
    int64_t receiver = c->radios.item[a->receiver].vehicle;
    int64_t addressee = packet_addressee(&t->packet, t->hop);
    bool is_addressed = addressee == NO_VEHICLE || addressee == receiver;
    Reception *record = report_reception(&c->reports);
    if (!record) return 1;
    *record = (Reception){
        .packet = t->packet.id,
        .time = nanoseconds_up(now),
        .transmitter = t->transmitter,
        .receiver = receiver,
        .power_dbm = a->power[CENTER], /* [mW]; the reports make decibels of both */
        .snir_db = snir,
        .hop = (uint8_t)t->hop,
        .outcome = result,
        .link = a->link,
        .kind = t->packet.kind,
        .addressed = is_addressed,
    };
    bool goes_on = result == RECEIVED && is_addressed && t->hop < packet_relays(&t->packet);
    return goes_on && forward(c, f, receiver, now);
}

int end_arrival(Channel *c, AirFrame *f, Arrival *a) {
    if (a->receiver == NO_RADIO) return 0;
    int64_t now = arrival_ends(f, a);
    int failed = 0;
    if (f->what.packet.kind != NOISE && (a->verdict != UNNOTICED || c->parameters.weak_receptions)) {
        double snir;
        uint8_t result = outcome(c, f, a, now, &snir, &failed);
        if (tell(c, f, a, now, result, snir)) return 1;
    }
    if (a->verdict == LOCKED) c->radios.item[a->receiver].locked = NO_FRAME;
    if (a->power[CENTER] >= c->parameters.noticeable && sense_idle(c, a->receiver, now)) return 1;
    return failed;
}
