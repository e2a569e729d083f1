/* What the author of a native unit sees: the shell (fmi3_shell.c) implements FMI 3.0 Co-Simulation
 * around one ModelOps and the variable table that fmus/native/build.py generates (variables.c, and
 * variables.h with `VR_<name>` for each variable, dots replaced by underscores). */
#ifndef FMI3_MODEL_H
#define FMI3_MODEL_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct Instance Instance;

/* Same numbers as fmi3Status. */
typedef enum { MODEL_OK, MODEL_WARNING, MODEL_DISCARD, MODEL_ERROR, MODEL_FATAL } ModelStatus;

/* The bytes of a Binary variable. Inputs are read-only to the model; outputs are grown with
 * binary_reserve, filled, and `size` set. */
typedef struct {
    uint8_t *data;
    size_t size, capacity;
} Binary;

/* Element buffer of a numeric variable (double*, float*, int64_t*, ..., bool* for Boolean), row
 * by row; aligned for its type; NULL only if it has no elements. */
void *variable_data(Instance *, uint32_t value_reference);
/* Its number of elements now. */
size_t variable_length(Instance *, uint32_t value_reference);
Binary *variable_binary(Instance *, uint32_t value_reference);

/* The value of a variable of this type that is no array; an item of an Enumeration is an int64. */
static inline double real(Instance *i, uint32_t reference) {
    return *(const double *)variable_data(i, reference);
}
static inline bool boolean(Instance *i, uint32_t reference) {
    return *(const bool *)variable_data(i, reference);
}
static inline uint32_t uint32(Instance *i, uint32_t reference) {
    return *(const uint32_t *)variable_data(i, reference);
}
static inline int64_t int64(Instance *i, uint32_t reference) {
    return *(const int64_t *)variable_data(i, reference);
}
static inline uint64_t uint64(Instance *i, uint32_t reference) {
    return *(const uint64_t *)variable_data(i, reference);
}
/* Of an Int32 whose minimum is not negative. */
static inline uint32_t natural(Instance *i, uint32_t reference) {
    return (uint32_t)*(const int32_t *)variable_data(i, reference);
}

/* Make room for `size` bytes, keeping the contents; returns nonzero if memory is short. */
int binary_reserve(Binary *, size_t size);

/* Log through the importer; MODEL_ERROR and above are always passed on. Returns `status`, so that
 * a failing model can `return model_log(i, MODEL_ERROR, "...", ...)`. */
ModelStatus model_log(Instance *, ModelStatus status, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 3, 4)))
#endif
    ;

/* What a unit provides. `state` is its private state: everything that must survive from step to
 * step and is no FMI variable. Optional members may be NULL. */
typedef struct {
    /* Create the private state with defaults; parameters do not have their values yet. */
    ModelStatus (*create)(Instance *, void **state);
    void (*destroy)(Instance *, void *state);
    /* Optional. Parameters have their values now; called once, when the importer leaves initialisation
     * mode or first reads an output in it, before the first `output`. When a state arrives from an
     * instance with other fixed parameters, the shell creates the private state anew, begins it
     * with those parameters and then loads it: what `begin` derives need not be saved. */
    ModelStatus (*begin)(Instance *, void *state, double t);
    /* Compute the outputs from the inputs at time t; no time passes. Called after inputs changed in
     * initialisation or event mode, when an output is read. */
    ModelStatus (*output)(Instance *, void *state, double t);
    /* Advance from t to t + h with the inputs held, and compute the outputs at t + h. */
    ModelStatus (*step)(Instance *, void *state, double t, double h);
    /* Private state as bytes: save with `bytes` NULL returns the size. load replaces the state and
     * returns MODEL_ERROR on bytes that are no state (they may come from a file). Required for
     * units with private state: a restored state must continue bit for bit. */
    size_t (*save)(Instance *, void *state, uint8_t *bytes);
    ModelStatus (*load)(Instance *, void *state, const uint8_t *bytes, size_t size);
} ModelOps;
extern const ModelOps MODEL;

#endif
