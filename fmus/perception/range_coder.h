/* A binary range coder that learns how probable each decision is; docs/formats.md describes it,
 * fmus/messages/apm/range_coder.py is the same code in Python.
 *
 * A writer is told each decision, a reader finds it out; `decide` returns it in both cases, so that
 * what describes a matrix by decisions is written once. */
#ifndef RANGE_CODER_H
#define RANGE_CODER_H
#include "kernel.h"

/* What is known about one kind of decision. */
typedef struct {
    uint16_t share;   /* of the answer yes so far, in 1/65536, never 0 */
    uint16_t inertia; /* 2 at first; one more after each decision, up to 32 */
} Decision;

/* About each bit of a byte, which depends on all bits before it. */
typedef struct {
    Decision bits[256];
} ByteDecisions;

typedef struct {
    uint32_t low, high; /* the code goes on with a number between these, both included; */
    uint32_t value;     /* if it is read, with this one */
    size_t done, size;  /* bytes before that; bytes of the code or, if it is written, of room */
    uint8_t *out;       /* nothing is written beyond the room, but it is counted */
    const uint8_t *in;  /* NULL if the code is written */
} Coder;

/* Nothing is known about `count` kinds of decisions. */
void decisions_reset(Decision *, size_t count);

Coder coder_for_writing(uint8_t *out, size_t capacity);
Coder coder_for_reading(const uint8_t *in, size_t size);

/* The answer to a decision: `yes` when writing, what the code says when reading. */
int decide(Coder *, Decision *, int yes);
/* A byte from 0 to `most`, bit by bit from the highest one: `byte` when writing. A bit that cannot
 * be set because the byte would pass `most` is no decision. */
uint32_t decide_byte(Coder *, ByteDecisions *, uint32_t byte, uint32_t most);

/* Whether a code that is read has ended before its decisions, or one that is written has no room. */
int coder_is_exhausted(const Coder *);
/* Write the last bytes. Returns the size of the code; 0 if there was not enough room. */
size_t coder_finish_writing(Coder *);
/* Check that the code ends with these decisions. */
int coder_finish_reading(const Coder *, Problem *);

#endif
