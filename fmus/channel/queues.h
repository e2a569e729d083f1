/* Frames that wait in radios, first come first served. All queues share one store, so that ten
 * thousand empty ones cost nothing. */
#ifndef QUEUES_H
#define QUEUES_H
#include "packets.h"

#define NO_FRAME UINT32_MAX

typedef struct { Transmission frame; uint32_t next; } Queued;
typedef struct { Queued *item; size_t count, capacity; uint32_t free; } QueueStore;
typedef struct { uint32_t first, last, count; } Queue;

#define EMPTY_QUEUE ((Queue){NO_FRAME, NO_FRAME, 0})

/* Nonzero if memory is short. */
int queue_add(QueueStore *, Queue *, const Transmission *);
/* The first frame of a queue that is not empty. */
Transmission queue_take(QueueStore *, Queue *);
const Transmission *queue_first(const QueueStore *, const Queue *);
/* Empty the store and so all queues. */
void queues_clear(QueueStore *);
void queues_free(QueueStore *);

#endif
