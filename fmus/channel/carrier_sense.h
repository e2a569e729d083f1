/* Whether the medium is busy at a radio, and for how long it has been. */
#ifndef CARRIER_SENSE_H
#define CARRIER_SENSE_H
#include "state.h"

void become_busy(Channel *, Radio *, int64_t now);
int sense_silence(Channel *, uint32_t radio, int64_t now);

/* A frame has begun at a radio. Most radios have heard another one before: that must cost nothing. */
static inline void sense_busy(Channel *c, uint32_t radio, int64_t now) {
    Radio *r = &c->radios.item[radio];
    if (r->is_idle) become_busy(c, r, now);
}

/* A frame has ended at a radio, or the radio has ended its own one: is the medium idle now? Nonzero
 * if memory is short. */
static inline int sense_idle(Channel *c, uint32_t radio, int64_t now) {
    const Radio *r = &c->radios.item[radio];
    if (r->is_idle || r->locked != NO_FRAME || radio_is_sending(r)) return 0;
    return sense_silence(c, radio, now);
}

/* A window of the busy ratio has ended: tell the ratios, and begin the next one; up to `quiet_until` [ps]
 * nothing else will happen. Nonzero if memory is short. */
int end_busy_window(Channel *, int64_t quiet_until);

#endif
