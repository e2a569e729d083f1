/* What else is on air at a receiver. */
#ifndef INTERFERENCE_H
#define INTERFERENCE_H
#include "state.h"

/* Power in a band of all noticeable frames on air at a radio, without the frame `but` [mW]. */
double power_on_air(Channel *, uint32_t radio, int64_t now, int band, const AirFrame *but);

/* Lowest SNIR of an arrival over bands and time, from the end of its preamble on; as if it was
 * `alone` on air, if wanted. Sets `failed` if memory is short. */
double lowest_snir(Channel *, const AirFrame *, const Arrival *, bool alone, int *failed);

#endif
