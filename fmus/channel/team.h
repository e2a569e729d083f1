/* Threads that help with tasks. The tasks of a batch are begun in order, each by whoever is free: by
 * a thread of the team, or by the caller while it waits for one. Between two batches the threads
 * sleep.
 *
 * A copy of the process (`fork`) has a team without threads, which gets new ones with its next batch;
 * it must not be made during a batch. Of one team one thread at a time is the caller. */
#ifndef TEAM_H
#define TEAM_H
#include <stddef.h>

enum { MOST_WORKERS = 64 };

/* Task number `task` of a batch; `worker` is 0 for the caller, 1 to `workers` - 1 for the threads. */
typedef void (*Task)(void *context, size_t task, size_t worker);

typedef struct Team Team;

/* A team without threads; NULL if memory is short. */
Team *team_new(void);

/* End the batch, if there is one, and all threads. */
void team_free(Team *);

/* How many workers this process may have: one for each core that it may use, but no more than the
 * environment variable NLOSIM_THREADS says. */
size_t workers_allowed(void);

/* Begin a batch of `count` tasks with up to `workers` workers; with fewer if threads are short. The one
 * before must have ended, and `context` must stay until this one ends. Nonzero if memory is short. */
int team_begin(Team *, size_t workers, Task, void *context, size_t count);

/* Wait until the task is done, and work meanwhile. */
void team_wait(Team *, size_t task);

/* End the batch: no more tasks are begun. Returns how many were done, the first ones; no thread looks
 * at the context any more. */
size_t team_end(Team *);

#endif
