/* Which event comes next, of a radio, a frame or a window. */
#ifndef SCHEDULE_H
#define SCHEDULE_H
#include "state.h"

/* All of these return nonzero if memory is short. */

/* Schedule all events anew from the state at the start of a step, so that the state alone decides
 * what happens. */
int schedule_all(Channel *);

/* Schedule the next event of a radio: the end of its contention if that has changed; whatever it
 * waits for. */
int schedule_contention(Channel *, uint32_t radio);
int schedule_radio(Channel *, uint32_t radio);
/* Schedule the first events of a new frame. */
int schedule_frame(Channel *, uint32_t frame);
/* Schedule the end of the window of the busy ratio. */
int schedule_window(Channel *);

#endif
