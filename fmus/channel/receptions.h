/* Receptions whose frames are still on air, or that the output is to tell of. */
#ifndef RECEPTIONS_H
#define RECEPTIONS_H
#include "fmi3_model.h"
#include "records.h"

typedef struct {
    Reception *item, *scratch;
    size_t count, capacity, scratch_capacity;
} Receptions;

/* Make room for `more` receptions beyond those there are; nonzero if memory is short. */
int receptions_reserve(Receptions *, size_t more);

/* Move all receptions up to `end` [ns], by (time, packet, hop, receiver), to the Binary output as a
 * frame "RCPT"; nonzero if memory is short. */
int receptions_release(Receptions *, int64_t end, Binary *output);
void receptions_free(Receptions *);

#endif
