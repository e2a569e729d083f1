/* From the frame on air to its outcome at a receiver. */
#ifndef RECEPTION_H
#define RECEPTION_H
#include "state.h"

/* A frame begins at a receiver. */
void begin_arrival(Channel *, AirFrame *, Arrival *);
/* It ends there. Nonzero if memory is short. */
int end_arrival(Channel *, AirFrame *, Arrival *);

#endif
