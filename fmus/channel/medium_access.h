/* Medium access by EDCA (IEEE 802.11-2020, 10.23.2) with the parameters of operation outside the
 * context of a BSS: all frames are sent once, without acknowledgement. */
#ifndef MEDIUM_ACCESS_H
#define MEDIUM_ACCESS_H
#include "radios.h"

/* From the decision to send to the start on air: as in Veins. */
#define TURNAROUND MICROSECOND

/* The times in these calls never decrease for one radio. After each of them, `contention_ends` and
 * its stamp tell when the radio wants to be asked next. */

/* Adopt a frame that has just been put into the queue of a category. */
void access_enqueued(Radio *, AccessCategory, uint64_t seed, int64_t now);

/* The medium has become busy or idle for the radio. */
void access_medium_busy(Radio *, int64_t now);
void access_medium_idle(Radio *, int64_t now);

/* The contention has ended: choose the category that sends. Categories of lower priority that lose
 * an internal collision draw a new backoff. Returns CATEGORIES, and the contention goes on, if the
 * frames that were to be sent have been dropped. */
int access_contention_ended(Radio *, uint64_t seed, int64_t now);

/* The category has sent its frame, or has nothing to send any more. */
void access_sent(Radio *, AccessCategory, uint64_t seed);

#endif
