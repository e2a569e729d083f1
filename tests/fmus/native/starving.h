/* Lives the life of an instance again and again, each time with the next allocation failing. For one
 * program, linked with a unit whose malloc, calloc, realloc and free are these: see
 * tests/fmus/starving.py. */
#ifndef STARVING_H
#define STARVING_H
#include <stdio.h>
#include <stdlib.h>

#include "fmi3Functions.h"

extern const char INSTANTIATION_TOKEN[];

static long countdown, live;

static int is_refused(void) { return countdown-- == 0; }
void *test_malloc(size_t size) {
    void *memory = is_refused() ? NULL : malloc(size);
    live += memory != NULL;
    return memory;
}
void *test_calloc(size_t count, size_t size) {
    void *memory = is_refused() ? NULL : calloc(count, size);
    live += memory != NULL;
    return memory;
}
void *test_realloc(void *old, size_t size) {
    void *memory = is_refused() ? NULL : realloc(old, size);
    live += memory != NULL && old == NULL;
    return memory;
}
void test_free(void *memory) {
    live -= memory != NULL;
    free(memory);
}

static int failures, messages; /* calls that failed; messages of errors */
static void note(fmi3Status status) { failures += status > fmi3Warning; }

/* The state of one instance, by way of bytes, to the other. */
static inline void move_state(fmi3Instance from, fmi3Instance to) {
    fmi3FMUState saved = NULL, arrived = NULL;
    size_t size = 0;
    note(fmi3GetFMUState(from, &saved));
    if (!saved) return;
    note(fmi3SerializedFMUStateSize(from, saved, &size));
    uint8_t *bytes = malloc(size);
    note(fmi3SerializeFMUState(from, saved, bytes, size));
    note(fmi3DeserializeFMUState(to, bytes, size, &arrived));
    free(bytes);
    if (arrived) note(fmi3SetFMUState(to, arrived));
    note(fmi3FreeFMUState(from, &saved));
    note(fmi3FreeFMUState(to, &arrived));
}

/* Returns 0 if nothing crashes or leaks, every refusal is noticed and told of, and with enough
 * memory everything succeeds. */
static inline int starve(void (*live_once)(void)) {
    for (long n = 0;; n++) {
        countdown = n;
        failures = messages = 0;
        live_once();
        if (live != 0) {
            printf("allocation %ld: %ld blocks leak\n", n, live);
            return 1;
        }
        if (countdown >= 0) { /* nothing was refused */
            printf("%ld allocations, %d failures with all of them\n", n, failures);
            return failures != 0;
        }
        if (failures == 0 || messages == 0) {
            printf("allocation %ld: nobody noticed or nobody said so\n", n);
            return 1;
        }
    }
}

#endif
