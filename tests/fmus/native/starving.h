/* Lives the life of an instance again and again, each time with the next allocation failing. For one
 * program, linked with a unit whose malloc, calloc, realloc and free are these: see
 * tests/fmus/starving.py. */
#ifndef STARVING_H
#define STARVING_H
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

extern const char INSTANTIATION_TOKEN[];

/* Units may have threads. */
static atomic_long countdown, live;

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

static long stride = 1; /* every so manyth allocation fails once */

/* Whether the program is to be starved; then nothing is refused yet. `starved 7`: at every seventh
 * allocation only, for what watches closely and is slow. */
static inline int shall_starve(int count, char **arguments) {
    countdown = -1;
    if (count > 2) stride = atol(arguments[2]);
    return count > 1 && strcmp(arguments[1], "starved") == 0;
}

static int is_starved;         /* whether allocations are refused, so that errors are no surprise */
static atomic_int failures, messages; /* calls that failed; messages of errors */
static void note(fmi3Status status) { failures += status > fmi3Warning; }

static inline void on_message(fmi3InstanceEnvironment environment, fmi3Status status,
                              fmi3String category, fmi3String message) {
    (void)environment, (void)category;
    if (status >= fmi3Error && messages++ == 0 && !is_starved) printf("%s\n", message);
}

/* ---- the life of an instance ---- */

static inline fmi3Instance instantiate(const char *name) {
    fmi3Instance c = fmi3InstantiateCoSimulation(name, INSTANTIATION_TOKEN, NULL, false, true, false,
                                                 false, NULL, 0, NULL, on_message, NULL);
    failures += c == NULL;
    return c;
}

/* Let two instances of a unit live, if there is the memory for both. */
static inline void live_as_two(const char *name, void (*live_once)(fmi3Instance, fmi3Instance)) {
    fmi3Instance one = instantiate(name), two = instantiate(name);
    if (one && two) live_once(one, two);
    fmi3FreeInstance(one);
    fmi3FreeInstance(two);
}

static inline void initialise(fmi3Instance c) {
    note(fmi3EnterInitializationMode(c, false, 0, 0, false, 0));
    note(fmi3ExitInitializationMode(c));
}

static inline void step(fmi3Instance c, double t, double h) {
    bool event, terminate, early;
    double last;
    note(fmi3DoStep(c, t, h, true, &event, &terminate, &early, &last));
}

static inline void set_floats(fmi3Instance c, fmi3ValueReference vr, const double *x, size_t n) {
    note(fmi3SetFloat64(c, &vr, 1, x, n));
}

static inline void set_float(fmi3Instance c, fmi3ValueReference vr, double x) {
    set_floats(c, vr, &x, 1);
}

/* In Configuration Mode. */
static inline void set_length(fmi3Instance c, fmi3ValueReference vr, uint64_t length) {
    note(fmi3SetUInt64(c, &vr, 1, &length, 1));
}

static inline void set_binary(fmi3Instance c, fmi3ValueReference vr, const void *data, size_t size) {
    const fmi3Binary bytes = data;
    note(fmi3SetBinary(c, &vr, 1, &size, &bytes, 1));
}

static inline size_t get_binary(fmi3Instance c, fmi3ValueReference vr, fmi3Binary *bytes) {
    size_t size = 0;
    *bytes = NULL;
    note(fmi3GetBinary(c, &vr, 1, &size, bytes, 1));
    return size;
}

/* Whether an output of two instances differs; `size` grows by its bytes. */
static inline int differ(fmi3Instance one, fmi3Instance two, fmi3ValueReference vr, size_t *size) {
    fmi3Binary a, b;
    size_t n = get_binary(one, vr, &a), m = get_binary(two, vr, &b);
    *size += n;
    return n != m || (n > 0 && memcmp(a, b, n) != 0);
}

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
    is_starved = 1;
    for (long n = 0;; n += stride) {
        countdown = n;
        failures = messages = 0;
        live_once();
        if (live != 0) {
            printf("allocation %ld: %ld blocks leak\n", n, atomic_load(&live));
            return 1;
        }
        if (countdown >= 0) { /* nothing was refused */
            printf("%ld allocations, %d failures with all of them\n", n, atomic_load(&failures));
            return failures != 0;
        }
        if (failures == 0 || messages == 0) {
            printf("allocation %ld: nobody noticed or nobody said so\n", n);
            return 1;
        }
    }
}

#endif
