/* What happens in a step, in order of time: each event is handed to the part that deals with it. */
#ifndef DISPATCH_H
#define DISPATCH_H
#include "state.h"

/* Everything that happens in a step to `end` [ps]. Nonzero if memory is short. */
int run_until(Channel *, int64_t end);

#endif
