/* From the packet to the frame on air. */
#ifndef TRANSMISSION_H
#define TRANSMISSION_H
#include "state.h"

/* All of these return nonzero if memory is short. */

/* A packet, or the next hop of one, reaches its radio. */
int hand_over(Channel *, const Transmission *);
/* A radio may send what it has waited to send; it starts; it has ended. */
int end_contention(Channel *, uint32_t radio, int64_t now);
int start_sending(Channel *, uint32_t radio, int64_t now);
int end_sending(Channel *, uint32_t radio, int64_t now);
/* A frame will not be sent; see FATES in fmus/messages/records.py. */
int give_up(Channel *, const Transmission *, int64_t now, uint8_t fate);

#endif
