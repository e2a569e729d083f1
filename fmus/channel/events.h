/* What is to happen in a step, in order of time. */
#ifndef EVENTS_H
#define EVENTS_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Of events at the same time, those come first that stand first here: a radio first learns what
 * ends, then it is told of new packets, then it decides, then it hears what begins. */
typedef enum {
    WINDOW_ENDS,     /* of the busy ratio */
    ARRIVAL_ENDS,    /* a frame ends at a receiver; subject: the frame */
    SENDING_ENDS,    /* a frame ends at its transmitter; subject: the radio */
    LAST_AT_THE_END, /* events up to here belong to the step that ends at their time */
    HANDOVER,        /* a packet reaches the medium access */
    CONTENTION_ENDS, /* a radio that waited for the medium may send; subject: the radio */
    SENDING_STARTS,  /* subject: the radio */
    ARRIVAL_BEGINS,  /* subject: the frame */
} EventKind;

typedef struct {
    int64_t time;     /* [ps] */
    int64_t key;      /* order among events of equal time and kind: packet or vehicle */
    uint32_t subject; /* index of a frame or radio */
    uint32_t stamp;   /* of a CONTENTION_ENDS: out of date if the radio has another one now */
    uint8_t kind, hop;
} Event;

typedef struct { Event *item; size_t count, capacity; } Events; /* a binary heap */

bool event_is_before(const Event *a, const Event *b);
/* Nonzero if memory is short. */
int events_add(Events *, const Event *);
void events_drop_first(Events *);
/* Put `event`, which is not before the first one, in the place of the first one. */
void events_replace_first(Events *, const Event *event);
void events_free(Events *);

#endif
