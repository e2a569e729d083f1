/* Laws of a team of threads, each tried many times. Linked with team.c alone.
 *
 *     teamwork         all of them
 *     teamwork apart   fewer times, without copies of the process, for checkers of threads: they
 *                      do not follow copies, are slow, and see a race whether or not it does harm
 *
 * Prints how many tasks were done, and each law that was broken. */
#include "threads.h"
#include "team.h"
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#ifndef _WIN32
#include <sys/wait.h>
#include <unistd.h>
#endif

enum { MOST = 700 };
static const size_t AMOUNTS[] = {0, 1, 2, 3, 17, MOST}, WORKERS[] = {1, 2, 3, 8};

static int rounds = 400, broken;
static atomic_long all;

static void must(int holds, const char *law) {
    if (holds) return;
    broken++;
    printf("broken: %s\n", law);
}

/* What a batch works on. */
typedef struct {
    size_t workers, count;
    atomic_int times[MOST];  /* that each task was done */
    unsigned long sum[MOST]; /* its result; written by whoever does it, read by the caller */
    atomic_int strange;      /* tasks or workers that there are not */
} Work;

static unsigned long result_of(size_t task) {
    unsigned long x = (unsigned long)task + 1;
    for (size_t k = 0; k < 50 + 900 * (task % 5 == 0); k++) x = x * 6364136223846793005u + 1442695040888963407u;
    return x;
}

static void do_task(void *context, size_t task, size_t worker) {
    Work *w = context;
    if (task >= w->count || worker >= w->workers) {
        atomic_fetch_add(&w->strange, 1);
        return;
    }
    w->sum[task] = result_of(task);
    atomic_fetch_add_explicit(&w->times[task], 1, memory_order_relaxed); /* the team must order it */
    atomic_fetch_add_explicit(&all, 1, memory_order_relaxed);
}

static void begin(Team *team, Work *w, size_t workers, size_t count) {
    memset(w, 0, sizeof *w);
    w->workers = workers;
    w->count = count;
    must(team_begin(team, workers, do_task, w, count) == 0, "there is memory");
}

static int is_done(Work *w, size_t task) {
    return atomic_load_explicit(&w->times[task], memory_order_relaxed) == 1 && w->sum[task] == result_of(task);
}

/* The first `wanted` tasks are waited for, the others are given up or happen to be done. */
static void work(Team *team, size_t workers, size_t count, size_t wanted) {
    static _Thread_local Work w;
    begin(team, &w, workers, count);
    for (size_t k = 0; k < wanted; k++) {
        team_wait(team, k);
        must(is_done(&w, k), "a task that was waited for is done, once");
    }
    size_t done = team_end(team);
    must(done >= wanted && done <= count, "at least what was waited for is done");
    for (size_t k = 0; k < count; k++)
        must(k < done ? is_done(&w, k) : atomic_load(&w.times[k]) == 0, "the first tasks are done, once, "
             "and no others");
    must(atomic_load(&w.strange) == 0, "there are no other tasks and workers");
    if (workers == 1) must(done == wanted, "alone, the caller does only what it waits for");
}

static void work_at_all_amounts(Team *team) {
    for (size_t a = 0; a < sizeof AMOUNTS / sizeof *AMOUNTS; a++)
        for (size_t w = 0; w < sizeof WORKERS / sizeof *WORKERS; w++) {
            work(team, WORKERS[w], AMOUNTS[a], AMOUNTS[a]);
            work(team, WORKERS[w], AMOUNTS[a], AMOUNTS[a] / 3);
            work(team, WORKERS[w], AMOUNTS[a], 0);
        }
}

/* ---- threads ---- */

static void nap(long nanoseconds) {
#ifndef _WIN32
    nanosleep(&(struct timespec){.tv_nsec = nanoseconds}, NULL);
#else
    Sleep((DWORD)(nanoseconds / 1000000));
#endif
}

/* The caller is done when it has met a thread. */
static void meet(void *context, size_t task, size_t worker) {
    atomic_int *threads = context;
    (void)task;
    if (worker > 0) atomic_store(threads, 1);
    for (int k = 0; k < 10000 && !atomic_load(threads); k++) nap(1000000);
}

static void meet_a_thread(Team *team) {
    atomic_int threads = 0;
    must(team_begin(team, 2, meet, &threads, 2) == 0, "there is memory");
    team_wait(team, 0);
    team_wait(team, 1);
    team_end(team);
    must(atomic_load(&threads), "there are threads");
}

/* ---- ends ---- */

static void free_with_work_pending(void) {
    static Work w;
    Team *team = team_new();
    begin(team, &w, 3, MOST);
    team_wait(team, 4);
    team_free(team);
    int done = 0;
    for (size_t k = 0; k < MOST; k++) done += atomic_load(&w.times[k]);
    work(team = team_new(), 3, 5, 5);
    team_free(team);
    for (size_t k = 0; k < MOST; k++) done -= atomic_load(&w.times[k]);
    must(done == 0, "nobody works for a team that has been freed");
}

/* Threads that have nothing to do sleep, also before their batch is ended. */
static void have_nothing_to_do(void) {
    static Work w;
    Team *team = team_new();
    meet_a_thread(team);
    for (int k = 0; k < 2; k++) {
        begin(team, &w, 8, 20);
        for (size_t task = 0; task < 20; task++) team_wait(team, task);
        if (k > 0) team_end(team);
        clock_t before = clock();
        nap(200000000);
        must(clock() - before < CLOCKS_PER_SEC / 20, "who has nothing to do sleeps");
        team_end(team);
    }
    team_free(team);
}

/* ---- two callers ---- */

static THREAD_RESULT work_elsewhere(void *team) {
    for (int k = 0; k < rounds; k++) work(team, 3, 60, 40);
    return 0;
}

static void two_at_a_time(void) {
    Team *one = team_new(), *two = team_new();
    Thread other;
    must(thread_start(&other, work_elsewhere, one), "there are threads");
    work_elsewhere(two);
    thread_join(other);
    team_free(one);
    team_free(two);
}

/* ---- copies of the process ---- */

#ifndef _WIN32
static void copy(Team *team, int works) {
    fflush(stdout);
    pid_t child = fork();
    if (child == 0) {
        if (works) meet_a_thread(team);
        if (works) work_at_all_amounts(team);
        team_free(team);
        _exit(broken != 0);
    }
    int status = 1;
    work(team, 3, 100, 100);
    waitpid(child, &status, 0);
    must(status == 0, "a copy of the process works, and ends its team");
}

static void copy_again_and_again(void) {
    Team *team = team_new();
    for (int k = 0; k < rounds; k++) {
        copy(team, k % 2);
        work(team, 3, (size_t)k, (size_t)k / 2); /* threads that fall asleep while the copy is made */
    }
    team_free(team);
}
#else
static void copy_again_and_again(void) {}
#endif

int main(int count, char **arguments) {
    int is_apart = count > 1 && strcmp(arguments[1], "apart") == 0;
    if (is_apart) rounds = 60;
    Team *team = team_new();
    for (int k = 0; k < rounds / 4; k++) work_at_all_amounts(team);
    team_free(team);
    team_free(NULL);
    for (int k = 0; k < rounds; k++) free_with_work_pending();
    have_nothing_to_do();
    two_at_a_time();
    if (!is_apart) copy_again_and_again();
    printf("%ld tasks, %d broken\n", atomic_load(&all), broken);
    return broken != 0;
}
