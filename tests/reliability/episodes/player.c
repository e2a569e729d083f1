/* Plays episodes: each is a row of calls of FMI functions, in any order and with any values.
 *
 *     player [aloud] < calls > what_became_of_them
 *
 * Linked with a unit and the shell, under sanitizers. What the calls are is written by episode.py. Before an episode
 * its number is printed, after it what became of it:
 *
 *     begin 17
 *     end 17 calls 40 refused 3 advances 5 wrong 0 milliseconds 12
 *
 * A call is wrong if its status is none of the standard's, if it is refused without a message, if a step that was made
 * shows a number that is not finite, or if an instance leaves memory behind. */
#define _POSIX_C_SOURCE 200809L /* barriers */
#include <math.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fmi3_instance.h"

size_t __sanitizer_get_current_allocated_bytes(void) __attribute__((weak));

/* ---- what is read -------------------------------------------------------------------------- */

/* episode.py has the same numbers, in this order. */
enum { NEW, FREE, SET, SET_BINARY, GET, GET_BINARY, CHANGE_MODE, INITIALISE, ADVANCE, KEEP, DAMAGE, RETURN, FEED, UNKNOWN };

typedef struct {
    uint32_t what, instance, reference, type;
    double a, b;
    uint64_t size; /* of the bytes that follow */
} Call;

typedef struct {
    uint32_t number, calls;
} Episode;

/* A change of a state: at a share of its bytes, so many of them become others. */
typedef struct {
    double place;
    uint32_t kind, pad;
    uint64_t value;
} Change;

static void read_all(void *to, size_t size) {
    if (size > 0 && fread(to, size, 1, stdin) != 1) exit(7); /* cut short */
}

/* ---- what is noted ------------------------------------------------------------------------- */

enum { INSTANCES = 4, STATES = 4 };
static fmi3Instance instance[INSTANCES];
static double reached[INSTANCES];
static struct {
    uint8_t *bytes;
    size_t size;
} kept[STATES];

static bool is_told; /* every message is printed, too */
static uint32_t number, refused, advances, wrong, messages;

static void note_wrong(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    printf("wrong %u: ", number);
    vprintf(format, arguments);
    printf("\n");
    va_end(arguments);
    wrong++;
}

static void on_message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                       fmi3String message) {
    (void)environment;
    if (status >= fmi3Error) messages++;
    if (is_told) printf("%s\n", message);
    if (!category || !message || strlen(message) > 4096) note_wrong("a message that is none");
}

/* Whether a call did what it was to do. */
static bool settled(const char *function, fmi3Status status, uint32_t before) {
    if (status == fmi3OK || status == fmi3Warning) return true;
    refused++;
    if (status != fmi3Error && status != fmi3Discard && status != fmi3Fatal)
        note_wrong("%s returned %d", function, (int)status);
    else if (messages == before)
        note_wrong("%s was refused without a message", function);
    return false;
}

#define DO(FUNCTION, ...) settled(#FUNCTION, FUNCTION(__VA_ARGS__), before)

/* ---- numbers ------------------------------------------------------------------------------- */

#define EACH_TYPE(X)                                                                              \
    X(FLOAT32, Float32) X(FLOAT64, Float64) X(INT8, Int8) X(UINT8, UInt8) X(INT16, Int16)           \
    X(UINT16, UInt16) X(INT32, Int32) X(UINT32, UInt32) X(INT64, Int64) X(UINT64, UInt64)           \
    X(BOOLEAN, Boolean)

static const size_t SIZES[] = {4, 8, 1, 1, 2, 2, 4, 4, 8, 8, 1};

static void set(fmi3Instance c, const Call *call, const void *values) {
    const uint32_t before = messages;
    const fmi3ValueReference *vr = &call->reference;
    size_t count = call->size / SIZES[call->type];
#define CASE(TYPE, NAME) \
    case TYPE: DO(fmi3Set##NAME, c, vr, 1, values, count); break;
    switch (call->type) { EACH_TYPE(CASE) }
#undef CASE
}

static bool get(fmi3Instance c, uint32_t reference, uint32_t type, void *values, size_t count) {
    const uint32_t before = messages;
#define CASE(TYPE, NAME) \
    case TYPE: return DO(fmi3Get##NAME, c, &reference, 1, values, count);
    switch (type) { EACH_TYPE(CASE) }
#undef CASE
    return false;
}

/* ---- bytes --------------------------------------------------------------------------------- */

static void set_binary(fmi3Instance c, uint32_t reference, const uint8_t *bytes, size_t size) {
    const uint32_t before = messages;
    const fmi3Binary data = bytes;
    DO(fmi3SetBinary, c, &reference, 1, &size, &data, 1);
}

/* A copy of an output that can be read to its last byte; NULL if there is none. */
static uint8_t *get_binary(fmi3Instance c, uint32_t reference, size_t *size) {
    const uint32_t before = messages;
    fmi3Binary data = NULL;
    *size = 0;
    if (!DO(fmi3GetBinary, c, &reference, 1, size, &data, 1)) return NULL;
    uint8_t *bytes = malloc(*size ? *size : 1);
    if (bytes && *size) memcpy(bytes, data, *size);
    return bytes;
}

/* What a step shows can be read, and is finite. */
static void look(fmi3Instance c) {
    for (uint32_t vr = 0; vr < VARIABLE_COUNT; vr++) {
        const VariableInfo *info = &VARIABLES[vr];
        if (info->causality != OUTPUT) continue;
        if (info->type == BINARY) {
            size_t size;
            free(get_binary(c, vr, &size));
            continue;
        }
        size_t count = ((Instance *)c)->values[vr].count;
        double *values = malloc(count * sizeof *values + 1);
        if (values && get(c, vr, info->type, values, count) && info->type == FLOAT64)
            for (size_t k = 0; k < count; k++)
                if (!isfinite(values[k])) {
                    note_wrong("element %zu of %s is %g", k, info->name, values[k]);
                    break;
                }
        free(values);
    }
}

/* ---- states -------------------------------------------------------------------------------- */

static void keep(fmi3Instance c, uint32_t slot) {
    const uint32_t before = messages;
    fmi3FMUState state = NULL;
    size_t size = 0;
    if (!DO(fmi3GetFMUState, c, &state)) return;
    if (DO(fmi3SerializedFMUStateSize, c, state, &size)) {
        free(kept[slot].bytes);
        kept[slot].bytes = malloc(size);
        kept[slot].size = kept[slot].bytes && DO(fmi3SerializeFMUState, c, state, kept[slot].bytes, size) ? size : 0;
    }
    DO(fmi3FreeFMUState, c, &state);
}

/* The checksum behind the magic is right again (FNV-1a, draft-eastlake-fnv). */
static void seal(uint8_t *bytes, size_t size) {
    uint64_t sum = 14695981039346656037u;
    for (size_t k = 24; k < size; k++) sum = (sum ^ bytes[k]) * 1099511628211u;
    memcpy(bytes + 8, &sum, sizeof sum);
}

static void damage(uint32_t slot, const Change *change, size_t changes) {
    enum { HEAD = 24 };
    uint8_t *bytes = kept[slot].bytes;
    size_t size = kept[slot].size;
    if (size <= HEAD + 8) return;
    for (size_t k = 0; k < changes; k++) {
        size_t place = HEAD + (size_t)(change[k].place * (double)(size - HEAD)), word = place - place % 8;
        if (word + 8 > size) word = HEAD;
        switch (change[k].kind) {
        case 0: bytes[place] ^= (uint8_t)(1u << change[k].value % 8); break;
        case 1: bytes[place] = (uint8_t)change[k].value; break;
        case 2: memcpy(bytes + word, &change[k].value, 8); break;
        case 3: if (word >= HEAD + 8) memcpy(bytes + word, bytes + word - 8, 8); break;
        default: memcpy(bytes + place - place % 4, &change[k].value, place - place % 4 + 4 <= size ? 4 : 0);
        }
    }
    seal(bytes, size);
}

static void go_back(fmi3Instance c, uint32_t slot) {
    const uint32_t before = messages;
    fmi3FMUState state = NULL;
    if (!kept[slot].size || !DO(fmi3DeserializeFMUState, c, kept[slot].bytes, kept[slot].size, &state)) return;
    DO(fmi3SetFMUState, c, state);
    DO(fmi3FreeFMUState, c, &state);
}

/* ---- calls --------------------------------------------------------------------------------- */

static void make(uint32_t slot, bool with_events) {
    if (instance[slot]) return;
    instance[slot] = fmi3InstantiateCoSimulation("any", INSTANTIATION_TOKEN, NULL, false, slot % 2, with_events, false,
                                                 NULL, 0, NULL, on_message, NULL);
    reached[slot] = 0;
    if (!instance[slot]) note_wrong("there is no instance");
}

static void change_mode(fmi3Instance c, uint32_t which) {
    const uint32_t before = messages;
    fmi3Boolean flag[5];
    fmi3Float64 next;
    static const char *const CATEGORIES[] = {"logEvents", "nothing"};
    switch (which) {
    case 0: DO(fmi3EnterConfigurationMode, c); break;
    case 1: DO(fmi3ExitConfigurationMode, c); break;
    case 2: DO(fmi3ExitInitializationMode, c); break;
    case 3: DO(fmi3EnterEventMode, c); break;
    case 4: DO(fmi3UpdateDiscreteStates, c, flag, flag + 1, flag + 2, flag + 3, flag + 4, &next); break;
    case 5: DO(fmi3EnterStepMode, c); break;
    case 6: DO(fmi3Terminate, c); break;
    case 7: DO(fmi3Reset, c); break;
    case 8: DO(fmi3SetDebugLogging, c, true, 2, CATEGORIES); break;
    default: DO(fmi3ActivateModelPartition, c, 1, 0.0); break;
    }
}

static void advance(uint32_t slot, double beside, double h) {
    const uint32_t before = messages;
    fmi3Boolean event, end, early;
    double last = reached[slot];
    if (!DO(fmi3DoStep, instance[slot], ((Instance *)instance[slot])->time + beside, h, true, &event, &end, &early, &last)) return;
    reached[slot] = last;
    advances++;
    look(instance[slot]);
}

static void feed(const Call *call) {
    size_t size;
    const uint32_t to = (uint32_t)call->a;
    uint8_t *bytes = get_binary(instance[call->instance], call->reference, &size);
    if (bytes && instance[to]) set_binary(instance[to], call->type, bytes, size);
    free(bytes);
}

static void perform(const Call *call, uint8_t *bytes) {
    const uint32_t before = messages;
    const uint32_t slot = call->instance;
    fmi3Instance c = instance[slot];
    if (call->what == NEW) make(slot, call->a != 0);
    if (call->what == DAMAGE) damage(call->reference, (const Change *)(const void *)bytes, call->size / sizeof(Change));
    if (!c) return;
    switch (call->what) {
    case FREE: fmi3FreeInstance(c); instance[slot] = NULL; break;
    case SET: set(c, call, bytes); break;
    case SET_BINARY: set_binary(c, call->reference, bytes, call->size); break;
    case GET: {
        void *values = malloc((size_t)call->a * SIZES[call->type] + 1);
        if (values) get(c, call->reference, call->type, values, (size_t)call->a);
        free(values);
        break;
    }
    case CHANGE_MODE: change_mode(c, call->reference); break;
    case INITIALISE: DO(fmi3EnterInitializationMode, c, false, 0, call->a, !isnan(call->b), call->b); break;
    case ADVANCE: advance(slot, call->a, call->b); break;
    case KEEP: keep(c, call->reference); break;
    case RETURN: go_back(c, call->reference); break;
    case FEED: feed(call); break;
    case GET_BINARY: {
        size_t size;
        free(get_binary(c, call->reference, &size));
        break;
    }
    case UNKNOWN: { /* a reference that there is not */
        double value = 0;
        get(c, call->reference, call->type, &value, 1);
        break;
    }
    default: break;
    }
}

static void end_all(size_t memory) {
    for (size_t k = 0; k < INSTANCES; k++) {
        fmi3FreeInstance(instance[k]);
        instance[k] = NULL;
    }
    for (size_t k = 0; k < STATES; k++) {
        free(kept[k].bytes);
        kept[k].bytes = NULL, kept[k].size = 0;
    }
    if (!__sanitizer_get_current_allocated_bytes) return;
    size_t now = __sanitizer_get_current_allocated_bytes();
    if (now > memory) note_wrong("%zu bytes are left", now - memory);
}

static void *wait_for_others(void *all_there) {
    pthread_barrier_wait(all_there);
    return NULL;
}

/* The C library keeps what belongs to the stacks of threads that have ended; this is no leak of a unit. */
static void have_had_threads(void) {
    enum { MOST = 4 };
    pthread_t thread[MOST];
    pthread_barrier_t all_there;
    pthread_barrier_init(&all_there, NULL, MOST);
    for (int k = 0; k < MOST; k++)
        if (pthread_create(&thread[k], NULL, wait_for_others, &all_there)) exit(7);
    for (int k = 0; k < MOST; k++) pthread_join(thread[k], NULL);
    pthread_barrier_destroy(&all_there);
}

int main(int count, char **words) {
    static char line[1 << 16];
    is_told = count > 1 && strcmp(words[1], "aloud") == 0;
    setvbuf(stdout, line, _IOLBF, sizeof line);
    Episode episode;
    have_had_threads();
    while (fread(&episode, sizeof episode, 1, stdin) == 1) {
        number = episode.number;
        refused = advances = wrong = messages = 0;
        printf("begin %u\n", number);
        size_t memory = __sanitizer_get_current_allocated_bytes ? __sanitizer_get_current_allocated_bytes() : 0;
        struct timespec from, to;
        timespec_get(&from, TIME_UTC);
        for (uint32_t k = 0; k < episode.calls; k++) {
            Call call;
            read_all(&call, sizeof call);
            uint8_t *bytes = malloc(call.size ? call.size : 1); /* so that a byte too many is noticed */
            if (!bytes) return 7;
            read_all(bytes, call.size);
            perform(&call, bytes);
            free(bytes);
        }
        end_all(memory);
        timespec_get(&to, TIME_UTC);
        double spent = (double)(to.tv_sec - from.tv_sec) * 1e3 + (double)(to.tv_nsec - from.tv_nsec) * 1e-6;
        printf("end %u calls %u refused %u advances %u wrong %u milliseconds %.0f\n", number, episode.calls, refused,
               advances, wrong, spent);
    }
    return 0;
}
