/* At which radios a frame arrives, and how. */
#ifndef ARRIVALS_H
#define ARRIVALS_H
#include "state.h"

/* How long a packet is on air [ps]. */
int64_t time_on_air(const Channel *, const Packet *);

/* Have threads look for the links of the frames that will probably go on air from `now` to `end`.
 * Nonzero if memory is short. */
int expect_arrivals(Channel *, int64_t now, int64_t end);

/* Add the arrivals of a new frame at the radios that notice it, or are told of it at least. Nonzero if
 * memory is short. */
int add_arrivals(Channel *, AirFrame *);

/* The arrival of a frame at a radio, also where it is too weak to be noticed; NULL if there is none.
 * Sets `failed` if memory is short. */
Arrival *arrival_at(Channel *, AirFrame *, uint32_t radio, int *failed);

/* Complete the arrivals of all frames on air, so that the scene may change. Nonzero if memory is
 * short. */
int complete_arrivals(Channel *, int64_t now);

#endif
