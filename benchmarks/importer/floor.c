/* What is left of an importer when everything is left out: values are set, the FMU steps, values are got and stored. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef int (*Set2)(void *, const uint32_t *, size_t, const void *);
typedef int (*Set3)(void *, const uint32_t *, size_t, const void *, size_t);
typedef int (*Get2)(void *, const uint32_t *, size_t, void *);
typedef int (*Get3)(void *, const uint32_t *, size_t, void *, size_t);
typedef int (*Step2)(void *, double, double, int);
typedef int (*Step3)(void *, double, double, bool, bool *, bool *, bool *, double *);

/* The variables of one type; what one FMU gets, the next one sets. */
typedef struct {
    void *set, *get; /* without get: nobody reads it */
    const uint32_t *input, *output;
    const void *from; /* NULL: there is nobody before */
    void *to;
    size_t references, count, size; /* variables; elements; bytes of them */
    uint8_t *record;                /* `size` bytes for each step, or NULL */
} Group;

typedef struct {
    void *instance, *step;
    Group *group;
    size_t groups;
} Member;

static int run_member(const Member *m, int version, int64_t n, double t, double h) {
    int failed = 0;
    bool flag[3];
    double last;
    for (size_t k = 0; k < m->groups; k++) {
        const Group *g = &m->group[k];
        if (!g->from) continue;
        failed |= version == 2 ? ((Set2)g->set)(m->instance, g->input, g->references, g->from)
                               : ((Set3)g->set)(m->instance, g->input, g->references, g->from, g->count);
    }
    failed |= version == 2 ? ((Step2)m->step)(m->instance, t, h, 1)
                           : ((Step3)m->step)(m->instance, t, h, true, &flag[0], &flag[1], &flag[2], &last);
    for (size_t k = 0; k < m->groups; k++) {
        const Group *g = &m->group[k];
        if (!g->get) continue;
        failed |= version == 2 ? ((Get2)g->get)(m->instance, g->output, g->references, g->to)
                               : ((Get3)g->get)(m->instance, g->output, g->references, g->to, g->count);
        if (g->record) memcpy(g->record + (size_t)n * g->size, g->to, g->size);
    }
    return failed;
}

/* Let all members take `steps` steps of `h` seconds; 0 if no call failed. */
EXPORT int floor_run(const Member *member, size_t members, int version, int64_t steps, double h) {
    int failed = 0;
    for (int64_t n = 0; n < steps; n++)
        for (size_t k = 0; k < members; k++) failed |= run_member(&member[k], version, n, (double)n * h, h);
    return failed;
}

/* Copy `size` bytes, so many times. */
EXPORT void floor_copy(void *to, const void *from, size_t size, int64_t times) {
    for (int64_t n = 0; n < times; n++) {
        memcpy(to, from, size);
        __asm__ volatile("" : : "r"(to) : "memory");
    }
}
