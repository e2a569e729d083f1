#include "interference.h"
#include "arrivals.h"
#include "buffer.h"
#include "modulation.h"
#include <math.h>

/* Power of a frame in a band of the radios' channel. Noise may lie beside it: both channels have
 * what lies within 5 MHz of both carriers in common. */
static double power_in_band(const AirFrame *f, const Arrival *a, int band) {
    int apart = band - CENTER - f->what.packet.channel_offset;
    return apart >= -1 && apart <= 1 ? a->power[band] : 0;
}

double power_on_air(Channel *c, uint32_t radio, int64_t now, int band, const AirFrame *but) {
    double sum = 0;
    for (size_t k = 0; k < c->frames.count; k++) {
        const AirFrame *f = &c->frames.pool[c->frames.live[k]];
        if (f == but || f->at[radio] == 0) continue;
        const Arrival *a = &f->arrival[f->at[radio] - 1];
        if (a->power[CENTER] < c->parameters.noticeable) continue;
        if (arrival_begins(f, a) <= now && now < arrival_ends(f, a)) sum += power_in_band(f, a, band);
    }
    return sum;
}

/* The other frames on air at the receiver of `a` between `from` and `until`, in `c->interferer`. */
static size_t find_interferers(Channel *c, const AirFrame *own, const Arrival *a, int64_t from,
                               int64_t until, int *failed) {
    size_t count = 0;
    for (size_t k = 0; k < c->frames.count; k++) {
        AirFrame *f = &c->frames.pool[c->frames.live[k]];
        if (f == own || f->start >= until || f->end + c->longest_delay <= from) continue;
        const Arrival *other = arrival_at(c, f, a->receiver, failed);
        if (!other || other->power[CENTER] == 0) continue;
        int64_t begin = arrival_begins(f, other), end = arrival_ends(f, other);
        if (begin >= until || end <= from) continue;
        Interferer *i = &c->interferer[count++];
        i->begin = begin > from ? begin : from;
        i->end = end;
        for (int band = 0; band < BANDS; band++) i->power[band] = power_in_band(f, other, band);
    }
    return count;
}

/* Most power of the interferers in a band at any time: it is reached where one of them begins. */
static double most_power(const Interferer *item, size_t count, int band) {
    double most = 0;
    for (size_t k = 0; k < count; k++) {
        double sum = 0;
        for (size_t i = 0; i < count; i++)
            if (item[i].begin <= item[k].begin && item[k].begin < item[i].end)
                sum += item[i].power[band];
        most = fmax(most, sum);
    }
    return most;
}

double lowest_snir(Channel *c, const AirFrame *f, const Arrival *a, bool alone, int *failed) {
    size_t count = 0;
    if (!alone && c->frames.count > 1) {
        if (BUFFER_RESERVE(c->interferer, c->interferer_capacity, c->frames.count)) {
            *failed = 1;
            return 0;
        }
        count = find_interferers(c, f, a, arrival_begins(f, a) + PREAMBLE, arrival_ends(f, a), failed);
    }
    double lowest = INFINITY;
    for (int band = 0; band < BANDS; band++) {
        double interference = count > 0 ? most_power(c->interferer, count, band) : 0;
        lowest = fmin(lowest, a->power[band] / (interference + c->parameters.noise));
    }
    return lowest;
}
