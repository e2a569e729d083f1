/* Steps FMUs, and components in other processes, from communication point to communication point without Python in between.
 *
 * A plan is a table of units and of what is to be called for each of them at a step: values that are
 * set, the step, values that are got. `plan_run` works through it until the end of a stretch, and
 * stops before whatever needs Python: a call that failed, a value that is not finite, the end of the run. A step that
 * says more than OK is completed in Python (`attend`). Nothing here knows what is connected beyond addresses. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "bytes.h"
#include "grid.h"
#include "link.h"
#include "mixing.h"

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

/* ---- FMI: what is called ---- */
typedef int (*Set2)(void *, const uint32_t *, size_t, const void *);
typedef int (*Set3)(void *, const uint32_t *, size_t, const void *, size_t);
typedef int (*Get2)(void *, const uint32_t *, size_t, void *);
typedef int (*Get3)(void *, const uint32_t *, size_t, void *, size_t);
typedef int (*GetBinary)(void *, const uint32_t *, size_t, size_t *, const uint8_t **, size_t);
typedef int (*SetBinary)(void *, const uint32_t *, size_t, const size_t *, const uint8_t *const *, size_t);
typedef int (*Attend)(int status, int64_t from); /* makes the rest of a step that said more than OK */
typedef int (*Step2)(void *, double, double, int);
typedef int (*Step3)(void *, double, double, bool, bool *, bool *, bool *, double *);

enum { STATUS_OK = 0, STATUS_WARNING = 1 };

/* How elements lie in the memory of an FMU and in a signal, which has a byte for a Boolean. */
typedef enum { PLAIN, FLOAT32, FLOAT64, BOOLEAN8, BOOLEAN32, BINARY, TEXT } Kind;

/* ---- the plan; plan/layouts.py has the same layouts ---- */

/* Where the values of one call come from. */
typedef struct {
    Source from; /* a signal of `size` bytes, or a `Bytes` */
    void *to;    /* among the elements of the call; unused where these are the signals themselves */
    size_t size;
    uint64_t seen; /* the version that was set last */
} Copy;

typedef struct {
    void *function;
    const uint32_t *reference;
    size_t references;
    void *elements; /* NULL: the signals themselves, which lie one after the other */
    size_t count;   /* of elements */
    int32_t kind;
    int32_t is_binary;
    Copy *copy;
    size_t copies;
} Setting;

typedef struct {
    void *function;
    const uint32_t *reference;
    size_t references;
    void *elements; /* of the FMU; NULL: those are signals, and lie in the pending outputs */
    size_t count;
    int32_t kind;
    int32_t is_binary;
    size_t signal; /* where what they become begins in the pending outputs; of Binary, among the `Bytes` [byte] */
    size_t *sizes; /* scratch for Binary */
    const uint8_t **pointers;
} Getting;

/* One recorded signal: every value that is published. */
typedef struct {
    size_t from; /* where it begins in the published outputs; of Binary, among the `Bytes` [byte] */
    size_t size;
    uint8_t *row;      /* `rows` times `size` bytes; of Binary, the sizes as int64 */
    int32_t is_binary;
    Bytes bytes; /* of Binary, one after the other */
} Track;

/* A unit that another one reads. */
typedef struct {
    size_t unit;
    int64_t leads; /* its turn comes first */
} Read;

typedef struct {
    void *instance, *step;
    int32_t version; /* of FMI */
    int32_t keeps_state; /* no stored state will be asked back */
    Grid grid; /* of its communication points */
    Mix *mix; /* inputs that settings set */
    size_t mixes;
    Setting *setting;
    size_t settings;
    Getting *getting;
    size_t gettings;
    uint8_t *pending, *published; /* outputs without Binary; the same where steps are published at once */
    uint8_t *pending_bytes, *published_bytes; /* `Bytes` */
    Past **past; /* of its outputs */
    size_t pasts;
    Track *track;
    size_t tracks;
    uint8_t *shelf; /* of `SHELF` times `size` bytes: what was published lately; NULL: outputs are large */
    size_t size;    /* of `published` [byte], a multiple of 8 */
    size_t shelved; /* points that lie there, the last ones of `rows` */
    double step_size; /* [s] */
    int64_t records_apart; /* whether `record_apart` has something to do */
    int64_t number; /* of the point where its next step ends */
    int64_t from, due; /* where its next step starts and ends [ns] */
    size_t rows;   /* recorded in this stretch: at every step that ended */
    uint64_t publications;
    uint64_t calls;   /* steps that were begun; tells messages of one from those of another */
    double spent;     /* wall time of this stretch [ns], from samples */
    bool *flag[3];    /* results of a step, FMI 3.0: event, end, early return */
    double *last_time;
    Attend attend; int64_t ending; /* what the last step asks for, an `Ending` */
    Link *link; /* of one in another process; NULL: it is an FMU */
    const Read *read; /* by turns: what a unit in another process reads; none where that is made at the time of the step */
    size_t reads;
    size_t early;  /* by turns: all that it reads is published when the turn of this unit comes; `SIZE_MAX`: nobody knows */
    size_t onward; /* likewise: when this unit has published, as far as those are concerned that are due with it */
} Unit;

/* `attend`: the step was made; and the run ends behind it; it was not made, and the run ends before it; it failed. */
typedef enum { GOES_ON, ENDS_BEHIND, ENDS_WITHIN, HAS_FAILED } Ending;
typedef enum { ALL_DONE, SET_FAILED, STEP_FAILED, GET_FAILED, NOT_FINITE, NO_MEMORY, RUN_ENDS,
               MIX_NOT_FINITE, RUN_ENDED, HAS_PAUSED } Outcome;

typedef struct {
    Unit *unit; /* in the order of their turns */
    size_t units;
    int32_t is_parallel; /* Jacobi: steps start at a point and are published where they end */
    int32_t is_departed; /* steps that start at `now` have been begun */
    int64_t has_links;   /* some units are in other processes */
    int64_t start;          /* of the run [ns] */
    Source until;           /* a Boolean that ends the run; without base: none */
    /* of one stretch */
    int64_t now;      /* the last point that was completed [ns] */
    int64_t point;    /* the one that is being worked through [ns] */
    int64_t end;      /* no point lies beyond [ns] */
    size_t most;      /* points of the stretch, until a pause */
    size_t points;    /* that were completed */
    size_t failed, call; /* the unit, and which of its calls */
    int64_t failed_from; /* where its step starts [ns] */
    int32_t status, pad2;
} Plan;

static double clock_ns(void) {
    struct timespec t;
    timespec_get(&t, TIME_UTC);
    return (double)t.tv_sec * 1e9 + (double)t.tv_nsec;
}

/* ---- bytes ---- */
EXPORT int plan_assign(Bytes *b, const uint8_t *data, size_t size) { return bytes_assign(b, data, size); }

EXPORT void plan_release(Bytes *b) {
    free(b->data);
    *b = (Bytes){0};
}

/* ---- one step ---- */
static void bring(const Setting *s, const Copy *c) {
    if (s->is_binary || !s->elements) return;
    if (s->kind == BOOLEAN32) widen_truths(c->to, seen_at(&c->from), c->size);
    else copy(c->to, seen_at(&c->from), c->size);
}

/* Bring the elements of a call up to date; false if no source has published since. */
static bool gather(Setting *s) {
    if (s->copies == 1) {
        Copy *c = s->copy;
        uint64_t version = *c->from.version;
        if (c->seen == version) return false;
        c->seen = version;
        bring(s, c);
        return true;
    }
    bool is_new = false;
    for (size_t k = 0; k < s->copies; k++) is_new |= s->copy[k].seen != *s->copy[k].from.version;
    for (size_t k = 0; k < s->copies && is_new; k++) {
        Copy *c = &s->copy[k];
        c->seen = *c->from.version;
        bring(s, c);
    }
    return is_new;
}

/* The newest values of a call of bytes; several sources have several versions, all are set. */
APART static int set_binary(const Unit *u, Setting *s) {
    size_t *size = s->elements;
    const uint8_t **data = (const uint8_t **)(size + s->references);
    for (size_t k = 0; k < s->copies; k++) {
        const Bytes *b = seen_at(&s->copy[k].from);
        size[k] = b->size;
        data[k] = b->data || s->kind != TEXT ? b->data : (const uint8_t *)"";
    }
    if (s->kind == TEXT && u->version == 2)
        return ((Set2)s->function)(u->instance, s->reference, s->references, data);
    if (s->kind == TEXT)
        return ((Set3)s->function)(u->instance, s->reference, s->references, data, s->references);
    return ((SetBinary)s->function)(u->instance, s->reference, s->references, size, data, s->references);
}

static int set(const Unit *u, Setting *s) {
    if (u->link) return link_changed(u->link, s->reference, s->references);
    if (s->is_binary) return set_binary(u, s);
    const void *elements = s->elements ? s->elements : seen_at(&s->copy->from);
    if (u->version == 2) return ((Set2)s->function)(u->instance, s->reference, s->references, elements);
    return ((Set3)s->function)(u->instance, s->reference, s->references, elements, s->count);
}

static int step(Unit *u) {
    u->calls++;
    double from = seconds_of(&u->grid, u->number - 1), h = u->step_size;
    if (u->version == 2) return ((Step2)u->step)(u->instance, from, h, u->keeps_state);
    *u->last_time = from;
    int status = ((Step3)u->step)(u->instance, from, h, u->keeps_state, u->flag[0], u->flag[1], u->flag[2], u->last_time);
    return status <= STATUS_WARNING && (*u->flag[1] || *u->flag[2]) ? -1 : status;
}

static int get(const Unit *u, Getting *g) {
    if (g->kind == TEXT && u->version == 2)
        return ((Get2)g->function)(u->instance, g->reference, g->references, g->pointers);
    if (g->kind == TEXT)
        return ((Get3)g->function)(u->instance, g->reference, g->references, g->pointers, g->references);
    if (g->is_binary)
        return ((GetBinary)g->function)(u->instance, g->reference, g->references, g->sizes,
                                        g->pointers, g->references);
    void *elements = g->elements ? g->elements : u->pending + g->signal;
    if (u->version == 2) return ((Get2)g->function)(u->instance, g->reference, g->references, elements);
    return ((Get3)g->function)(u->instance, g->reference, g->references, elements, g->count);
}

/* Make signals of what was got. */
static Outcome adopt(const Unit *u, Getting *g) {
    if (g->is_binary) {
        Bytes *b = (Bytes *)(u->pending_bytes + g->signal);
        for (size_t k = 0; k < g->references; k++) {
            const uint8_t *data = g->pointers[k];
            size_t size = !data ? 0 : g->kind == TEXT ? strlen((const char *)data) : g->sizes[k];
            if (bytes_assign(&b[k], data, size)) return NO_MEMORY;
            if (g->kind == TEXT && !is_utf8(data, size)) return NOT_FINITE;
        }
        return ALL_DONE;
    }
    uint8_t *signal = u->pending + g->signal;
    switch ((Kind)g->kind) {
    case FLOAT64: return are_finite64((const double *)signal, g->count) ? ALL_DONE : NOT_FINITE;
    case FLOAT32: return are_finite32((const float *)signal, g->count) ? ALL_DONE : NOT_FINITE;
    case BOOLEAN8: truths8(signal, g->elements, g->count); return ALL_DONE;
    case BOOLEAN32: truths32(signal, g->elements, g->count); return ALL_DONE;
    case PLAIN:
    case BINARY:
    case TEXT: break;
    }
    return ALL_DONE;
}

/* Whether a call did not go well; messages of one that gave a warning are done with. */
static inline bool is_failure(Plan *p, Unit *u, int status) {
    if (status == STATUS_OK) return false;
    p->status = status;
    u->calls += status == STATUS_WARNING;
    return status != STATUS_WARNING;
}

static Outcome stopped(Plan *p, size_t call, Outcome outcome) {
    p->call = call;
    return outcome;
}

/* Let a unit have what it reads in a step. */
static Outcome show_inputs(Plan *p, Unit *u) {
    for (size_t k = 0; k < u->mixes; k++)
        if (!mix(&u->mix[k], p->point, p->start)) return stopped(p, k, MIX_NOT_FINITE);
    for (size_t k = 0; k < u->settings; k++) {
        Setting *s = &u->setting[k];
        if (gather(s) && is_failure(p, u, set(u, s))) return stopped(p, k, SET_FAILED);
    }
    return ALL_DONE;
}

static Outcome adopt_all(Plan *p, Unit *u) {
    for (size_t k = 0; k < u->gettings; k++) {
        if (u->getting[k].kind == PLAIN) continue;
        Outcome outcome = adopt(u, &u->getting[k]);
        if (outcome != ALL_DONE) return stopped(p, k, outcome);
    }
    return ALL_DONE;
}

/* Let a unit step from `from`; its outputs are pending then. */
static Outcome make_step(Plan *p, Unit *u, int64_t from) {
    Outcome outcome = show_inputs(p, u);
    if (outcome != ALL_DONE) return outcome;
    u->ending = is_failure(p, u, step(u)) ? u->attend(p->status, from) : GOES_ON;
    if (u->ending >= ENDS_WITHIN) return u->ending == HAS_FAILED ? STEP_FAILED : ALL_DONE; /* no outputs */
    for (size_t k = 0; k < u->gettings; k++)
        if (is_failure(p, u, get(u, &u->getting[k]))) return stopped(p, k, GET_FAILED);
    return adopt_all(p, u);
}

/* Let a unit in another process begin its step from `from`. */
static Outcome begin_step(Plan *p, Unit *u, int64_t from) {
    Outcome outcome = show_inputs(p, u);
    if (outcome == ALL_DONE) link_begin(u->link, from, u->due - from, u->published);
    return outcome;
}

static inline bool may_begin(const Unit *u) { return u->link && !u->link->is_begun; }

/* Wait for the end of the step that was begun at `from`; its outputs are pending then. */
static Outcome end_step(Plan *p, Unit *u, int64_t from) {
    uint8_t *outputs = link_end(u->link);
    if (outputs) u->pending = outputs;
    u->ending = outputs ? GOES_ON : u->attend(-1, from);
    if (u->ending >= ENDS_WITHIN) return u->ending == HAS_FAILED ? STEP_FAILED : ALL_DONE;
    return adopt_all(p, u);
}

typedef Outcome (*Work)(Plan *p, Unit *u, int64_t from);

static inline Outcome timed(Work work, Plan *p, Unit *u, int64_t from, bool is_sample, double weight) {
    if (!is_sample) return work(p, u, from);
    double before = clock_ns();
    Outcome outcome = work(p, u, from);
    u->spent += (clock_ns() - before) * weight;
    return outcome;
}

/* What was pending is published, without a copy. */
static void publish(Unit *u, int64_t t) {
    uint8_t *block = u->published, *bytes = u->published_bytes;
    u->published = u->pending, u->published_bytes = u->pending_bytes;
    u->pending = block, u->pending_bytes = bytes;
    u->publications++;
    for (size_t k = 0; k < u->pasts; k++) note(u->past[k], t);
}

/* ---- what is recorded ---- */
/* Small outputs are put on the shelf of their unit, in one piece, and go to their rows many at once: the rows of all
 * signals lie in more pages than a processor knows the places of. */
enum { SHELF = 32 };

#define DEFINE_TAKE(SIZE)                                                                          \
    static void take##SIZE(uint8_t *row, const uint8_t *from, size_t apart, size_t n) {            \
        for (size_t k = 0; k < n; k++) memcpy(row + SIZE * k, from + apart * k, SIZE);             \
    }
DEFINE_TAKE(1)
DEFINE_TAKE(4)
DEFINE_TAKE(8)

/* Let the rows have what lies on the shelf. */
static void clear_shelf(Unit *u) {
    size_t n = u->shelved, first = u->rows - n;
    for (size_t k = 0; k < u->tracks; k++) {
        const Track *r = &u->track[k];
        const uint8_t *from = u->shelf + r->from;
        if (r->is_binary) continue;
        uint8_t *row = r->row + r->size * first;
        switch (r->size) {
        case 1: take1(row, from, u->size, n); break;
        case 4: take4(row, from, u->size, n); break;
        case 8: take8(row, from, u->size, n); break;
        default:
            for (size_t i = 0; i < n; i++) memcpy(row + r->size * i, from + u->size * i, r->size);
        }
    }
    u->shelved = 0;
}

/* Everything but what the shelf is for. */
APART static Outcome record_apart(Unit *u) {
    for (size_t k = 0; k < u->tracks; k++) {
        Track *r = &u->track[k];
        if (r->is_binary) {
            const Bytes *b = (const Bytes *)(u->published_bytes + r->from);
            ((int64_t *)r->row)[u->rows] = (int64_t)b->size;
            if (bytes_append(&r->bytes, b->data, b->size)) return NO_MEMORY;
        } else if (!u->shelf) {
            memcpy(r->row + r->size * u->rows, u->published + r->from, r->size);
        }
    }
    return ALL_DONE;
}

static Outcome record(Unit *u) {
    if (u->records_apart && record_apart(u) != ALL_DONE) return NO_MEMORY;
    u->rows++;
    if (u->shelf) {
        uint8_t *place = u->shelf + u->size * u->shelved;
        for (size_t at = 0; at < u->size; at += 8) memcpy(place + at, u->published + at, 8);
        if (++u->shelved == SHELF) clear_shelf(u);
    }
    return ALL_DONE;
}

/* ---- many points ---- */
static int64_t next_point(const Plan *p) {
    int64_t next = INT64_MAX;
    for (size_t k = 0; k < p->units; k++)
        if (p->unit[k].due < next) next = p->unit[k].due;
    return next;
}

static void next_step(Unit *u, int64_t number) {
    u->number = number;
    u->from = point_of(&u->grid, number - 1);
    u->due = point_of(&u->grid, number);
}

/* Steps that start at `t`. */
static Outcome depart(Plan *p, int64_t t, bool is_sample, double weight) {
    p->point = t;
    for (p->failed = 0; p->failed < p->units; p->failed++) {
        Unit *u = &p->unit[p->failed];
        if (u->from != t) continue;
        p->failed_from = t;
        Outcome outcome = u->link ? timed(begin_step, p, u, t, is_sample, weight) : timed(make_step, p, u, t, is_sample, weight);
        if (outcome != ALL_DONE) return outcome;
    }
    return ALL_DONE;
}

/* Complete the steps that end at `t`, which all have begun; then publish. */
static Outcome arrive_together(Plan *p, int64_t t, bool is_sample, double weight) {
    for (p->failed = 0; p->failed < p->units; p->failed++) {
        Unit *u = &p->unit[p->failed];
        if (u->due != t) continue;
        p->failed_from = u->from;
        Outcome outcome = u->link && u->link->is_begun ? timed(end_step, p, u, u->from, is_sample, weight) : ALL_DONE;
        if (outcome == ALL_DONE && u->ending == ENDS_WITHIN) outcome = RUN_ENDED;
        if (outcome != ALL_DONE) return outcome;
    }
    for (size_t k = 0; k < p->units; k++)
        if (p->unit[k].due == t) publish(&p->unit[k], t);
    return ALL_DONE;
}

/* Whether all that a unit reads in its step to `due` is published at `t`. */
static bool sees_all(const Plan *p, const Unit *u, int64_t t, int64_t due) {
    for (size_t k = 0; k < u->reads; k++) {
        const Unit *source = &p->unit[u->read[k].unit];
        int64_t next = source->due > t ? source->due : point_of(&source->grid, source->number + 1);
        if (u->read[k].leads ? next <= due : next < due) return false;
    }
    return true;
}

/* Units in other processes need not wait for their turn to begin: when that of unit `turn` comes, and all they read is there, */
static Outcome begin_early(Plan *p, size_t turn, int64_t t, bool is_sample, double weight) {
    for (size_t k = turn; k < p->units; k++) {
        Unit *u = &p->unit[k];
        if (u->due != t || u->early > turn || !may_begin(u)) continue;
        Outcome outcome = timed(begin_step, p, u, u->from, is_sample, weight);
        if (outcome != ALL_DONE) return outcome;
    }
    return ALL_DONE;
}

/* and when it has published, with their next step. */
static Outcome begin_ahead(Plan *p, size_t turn, int64_t t) {
    for (size_t k = 0; k <= turn; k++) {
        Unit *u = &p->unit[k];
        if (u->due != t || u->onward != turn || !may_begin(u)) continue;
        int64_t due = point_of(&u->grid, u->number + 1);
        if (due > p->end || !sees_all(p, u, t, due)) continue;
        Outcome outcome = show_inputs(p, u);
        if (outcome != ALL_DONE) return outcome;
        link_begin(u->link, t, due - t, u->published);
    }
    return ALL_DONE;
}

/* Make and publish the steps that end at `t`, one after the other. */
static Outcome arrive_in_turn(Plan *p, int64_t t, bool is_sample, double weight) {
    for (p->failed = 0; p->failed < p->units; p->failed++) {
        Unit *u = &p->unit[p->failed];
        Outcome outcome = p->has_links ? begin_early(p, p->failed, t, is_sample, weight) : ALL_DONE;
        if (u->due != t) continue;
        p->failed_from = u->from;
        if (outcome == ALL_DONE && may_begin(u)) outcome = begin_step(p, u, u->from);
        if (outcome == ALL_DONE)
            outcome = u->link ? timed(end_step, p, u, u->from, is_sample, weight) : timed(make_step, p, u, u->from, is_sample, weight);
        if (outcome == ALL_DONE && u->ending == ENDS_WITHIN) outcome = RUN_ENDED;
        if (outcome != ALL_DONE) return outcome;
        publish(u, t);
        if (p->has_links && (outcome = begin_ahead(p, p->failed, t)) != ALL_DONE) return outcome;
    }
    return ALL_DONE;
}

static Outcome go_on(Plan *p) {
    enum { EVERY = 32 }; /* of so many points one is timed */
    for (size_t first = p->points;;) {
        bool is_sample = (p->points - first) % EVERY == 0;
        double rest = (double)(p->most - p->points), weight = rest < EVERY ? rest : EVERY;
        Outcome outcome = ALL_DONE;
        if (p->is_parallel && !p->is_departed) outcome = depart(p, p->now, is_sample, weight);
        p->is_departed = false;
        if (outcome != ALL_DONE) return outcome;
        int64_t t = next_point(p);
        p->point = t;
        outcome = (p->is_parallel ? arrive_together : arrive_in_turn)(p, t, is_sample, weight);
        if (outcome != ALL_DONE) return outcome;
        bool ends = false;
        for (size_t k = 0; k < p->units; k++) {
            Unit *u = &p->unit[k];
            if (u->due != t) continue;
            ends |= u->ending == ENDS_BEHIND;
            if ((outcome = record(u)) != ALL_DONE) return outcome;
            next_step(u, u->number + 1);
        }
        p->now = t;
        p->points++;
        if (ends || (p->until.base && *(const uint8_t *)seen_at(&p->until))) return RUN_ENDS;
        if (next_point(p) > p->end) return ALL_DONE;
        if (p->points == p->most) return HAS_PAUSED;
    }
}

/* Whether these are the sizes of the structures: the library may be of another release. */
EXPORT int plan_fits(const size_t *sizes) {
    static const size_t own[] = {sizeof(Plan),   sizeof(Unit),   sizeof(Setting), sizeof(Getting),
                                 sizeof(Track),  sizeof(Copy),   sizeof(Mix),     sizeof(Part),
                                 sizeof(Term),   sizeof(Past),   sizeof(Bytes),   sizeof(Link), sizeof(Read),   0};
    return memcmp(own, sizes, sizeof own) == 0;
}

static void begin_stretch(Plan *p) {
    for (size_t k = 0; k < p->units; k++) {
        Unit *u = &p->unit[k];
        next_step(u, last_of(&u->grid, p->now) + 1);
        u->step_size = step_seconds(&u->grid);
        u->rows = 0, u->spent = 0, u->records_apart = !u->shelf;
        for (size_t i = 0; i < u->tracks; i++) {
            u->track[i].bytes.size = 0;
            u->records_apart |= u->track[i].is_binary;
        }
    }
}

/* Work through the points behind `now` up to `end`, of which there is one at least, and pause when `most` of the stretch
 * are completed. Nothing departs from the last one. With 0 `points` a stretch begins; else the one that has paused goes
 * on. */
EXPORT int plan_run(Plan *p) {
    if (p->points == 0) begin_stretch(p);
    Outcome outcome = go_on(p);
    for (size_t k = 0; k < p->units; k++)
        if (p->unit[k].shelf) clear_shelf(&p->unit[k]);
    return outcome;
}
