#include "threads.h" /* first, see there */
#include "buffer.h"
#include "team.h"
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

typedef atomic_bool Flag;

typedef struct { Team *team; size_t number; Thread thread; } Worker;

struct Team {
    long process;    /* that the threads belong to */
    size_t threads;  /* the first of `worker` */
    Worker worker[MOST_WORKERS - 1];
    Lock lock;       /* of all but the flags and `next` */
    Signal begun, left; /* a batch begins, a thread has left one */
    bool is_over;    /* the threads shall end */
    /* the batch */
    bool is_open;    /* threads may still come in */
    size_t number, workers, inside; /* of the batch; wanted; threads that have come in and not left */
    Task run;
    void *context;
    size_t count, capacity;
    atomic_size_t next; /* task */
    Flag *is_done;      /* each task */
};

static void open_signals(Team *t) {
    memset(&t->lock, 0, sizeof t->lock);
    lock_open(&t->lock);
    signal_open(&t->begun);
    signal_open(&t->left);
}

Team *team_new(void) {
    Team *t = calloc(1, sizeof *t);
    if (!t) return NULL;
    t->process = process_number();
    open_signals(t);
    return t;
}

size_t workers_allowed(void) {
    const char *text = getenv("NLOSIM_THREADS");
    size_t count = cores();
    unsigned long limit = text ? strtoul(text, NULL, 10) : 0;
    return limit > 0 && limit < count ? limit : count;
}

/* ---- tasks ---- */

/* Do the next task that nobody has begun; false if there is none. */
static bool do_next(Team *t, size_t worker) {
    size_t task = atomic_fetch_add(&t->next, 1);
    if (task >= t->count) return false;
    t->run(t->context, task, worker);
    atomic_store(&t->is_done[task], true);
    return true;
}

static THREAD_RESULT help(void *argument) {
    const Worker *self = argument;
    Team *t = self->team;
    size_t seen = 0; /* number of the last batch */
    lock_enter(&t->lock);
    for (;;) {
        while (!t->is_over && !(t->is_open && t->number != seen && self->number < t->workers))
            signal_wait(&t->begun, &t->lock);
        if (t->is_over) break;
        seen = t->number;
        t->inside++;
        lock_leave(&t->lock);
        while (do_next(t, self->number)) continue;
        lock_enter(&t->lock);
        t->inside--; /* whoever waits for its last task, or for its end, holds the lock or sleeps */
        signal_all(&t->left);
    }
    lock_leave(&t->lock);
    return 0;
}

/* ---- the caller ---- */

/* Have threads for so many workers if possible. */
static void hire(Team *t, size_t workers) {
    while (t->threads + 1 < workers && t->threads + 1 < MOST_WORKERS) {
        Worker *worker = &t->worker[t->threads];
        *worker = (Worker){.team = t, .number = t->threads + 1};
        if (!thread_start(&worker->thread, help, worker)) return;
        t->threads++;
    }
}

int team_begin(Team *t, size_t workers, Task run, void *context, size_t count) {
    if (BUFFER_RESERVE(t->is_done, t->capacity, count)) return 1;
    if (t->process != process_number()) { /* the threads, and who held the lock, stayed behind */
        t->process = process_number();
        t->threads = t->inside = 0;
        open_signals(t);
    }
    for (size_t k = 0; k < count; k++) atomic_store_explicit(&t->is_done[k], false, memory_order_relaxed);
    if (workers > 1) hire(t, workers);
    lock_enter(&t->lock);
    t->run = run;
    t->context = context;
    t->count = count;
    t->workers = workers;
    t->number++;
    atomic_store(&t->next, 0);
    t->is_open = workers > 1;
    if (t->is_open) signal_all(&t->begun);
    lock_leave(&t->lock);
    return 0;
}

void team_wait(Team *t, size_t task) {
    while (!atomic_load(&t->is_done[task]) && do_next(t, 0)) continue;
    if (atomic_load(&t->is_done[task])) return;
    lock_enter(&t->lock); /* all have been begun: the thread that is at this one leaves soon */
    while (!atomic_load(&t->is_done[task])) signal_wait(&t->left, &t->lock);
    lock_leave(&t->lock);
}

size_t team_end(Team *t) {
    size_t begun = atomic_exchange(&t->next, t->count);
    lock_enter(&t->lock);
    t->is_open = false;
    while (t->inside > 0) signal_wait(&t->left, &t->lock);
    lock_leave(&t->lock);
    return begun < t->count ? begun : t->count;
}

void team_free(Team *t) {
    if (!t) return;
    if (t->process == process_number()) {
        team_end(t);
        lock_enter(&t->lock);
        t->is_over = true;
        signal_all(&t->begun);
        lock_leave(&t->lock);
        for (size_t k = 0; k < t->threads; k++) thread_join(t->worker[k].thread);
        lock_close(&t->lock);
        signal_close(&t->begun);
        signal_close(&t->left);
    }
    free(t->is_done);
    free(t);
}
