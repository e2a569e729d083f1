/* The unit's private state in the life of an instance. */
#ifndef FMI3_UNIT_H
#define FMI3_UNIT_H
#include "fmi3_instance.h"

/* Run a callback's status through the state machine: an error makes the instance FAILED. */
fmi3Status settle(Instance *, ModelStatus);

void destroy_model(Instance *);
/* The private state as it is in a new instance. */
ModelStatus recreate_model(Instance *);
/* Let the unit begin with the parameters as they are, unless it has. */
ModelStatus begin_model(Instance *);
/* Compute the outputs, unless nothing has changed since they were. */
fmi3Status refresh_outputs(Instance *);

#endif
