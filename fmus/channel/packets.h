/* Packets from the input and on relays that wait for their time on air. */
#ifndef PACKETS_H
#define PACKETS_H
#include "clock.h"
#include "fmi3_model.h"
#include "records.h"
#include "scene.h"

/* One frame to be sent. No padding: it is saved as it is. */
typedef struct {
    int64_t time; /* when it is handed to the medium access [ps] */
    int64_t transmitter;
    int64_t hop; /* 0: sent by the source */
    Packet packet;
} Transmission;
_Static_assert(sizeof(Transmission) == 96, "Transmission");

typedef struct {
    Transmission *item; /* by (time, packet, hop), the first one last */
    size_t count, capacity;
    int64_t *known; /* ids of the packets of the last input, ascending */
    size_t known_count, known_capacity;
    int64_t *incoming; /* scratch */
    size_t incoming_capacity;
    int64_t highest_vehicle; /* highest id seen so far, -1 before the first */
} Waiting;

/* Take over the packets of the input that were not in it before. A packet whose time lies before
 * `now` [ps] is sent at `now`. An error names the packet and what is wrong with it. */
ModelStatus packets_accept(Instance *, Waiting *, const Scene *, uint32_t mac_header, int64_t now);

/* Add a frame; nonzero if memory is short. */
int waiting_add(Waiting *, const Transmission *);

void waiting_free(Waiting *);

/* Number of relays on a packet's route, and the addressee of a hop (NO_VEHICLE: everyone). */
int64_t packet_relays(const Packet *);
int64_t packet_addressee(const Packet *, int64_t hop);

#endif
