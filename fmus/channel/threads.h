/* Threads, locks and signals of this operating system under one name. To be included before any other
 * header: it asks the C library for more than C. */
#ifndef THREADS_H
#define THREADS_H
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#ifndef _DARWIN_C_SOURCE
#define _DARWIN_C_SOURCE
#endif
#include <stdbool.h>
#include <stddef.h>

#ifdef _WIN32
#ifndef WIN32_LEAN_AND_MEAN
#define WIN32_LEAN_AND_MEAN
#endif
#include <windows.h>

typedef HANDLE Thread;
typedef SRWLOCK Lock;
typedef CONDITION_VARIABLE Signal;
typedef DWORD ThreadResult;
#define THREAD_RESULT ThreadResult WINAPI

static inline bool thread_start(Thread *thread, ThreadResult(WINAPI *run)(void *), void *argument) {
    *thread = CreateThread(NULL, 0, run, argument, 0, NULL);
    return *thread != NULL;
}
static inline void thread_join(Thread thread) {
    WaitForSingleObject(thread, INFINITE);
    CloseHandle(thread);
}
static inline void lock_open(Lock *lock) { InitializeSRWLock(lock); }
static inline void lock_close(Lock *lock) { (void)lock; }
static inline void lock_enter(Lock *lock) { AcquireSRWLockExclusive(lock); }
static inline void lock_leave(Lock *lock) { ReleaseSRWLockExclusive(lock); }
static inline void signal_open(Signal *signal) { InitializeConditionVariable(signal); }
static inline void signal_close(Signal *signal) { (void)signal; }
static inline void signal_wait(Signal *signal, Lock *lock) {
    SleepConditionVariableSRW(signal, lock, INFINITE, 0);
}
static inline void signal_all(Signal *signal) { WakeAllConditionVariable(signal); }

/* A process is never copied here. */
static inline long process_number(void) { return 0; }

/* Cores that this process may use; 1 if that is unknown. */
static inline size_t cores(void) {
    DWORD_PTR own, all;
    size_t count = 0;
    if (GetProcessAffinityMask(GetCurrentProcess(), &own, &all))
        for (; own != 0; own &= own - 1) count++;
    return count > 0 ? count : 1;
}
#else
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <unistd.h>

typedef pthread_t Thread;
typedef pthread_mutex_t Lock;
typedef pthread_cond_t Signal;
typedef void *ThreadResult;
#define THREAD_RESULT ThreadResult

/* Signals are for the threads of others: Ctrl-C must not end up in one of ours. */
static inline bool thread_start(Thread *thread, ThreadResult (*run)(void *), void *argument) {
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    bool started = pthread_create(thread, NULL, run, argument) == 0;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return started;
}
static inline void thread_join(Thread thread) { pthread_join(thread, NULL); }
static inline void lock_open(Lock *lock) { pthread_mutex_init(lock, NULL); }
static inline void lock_close(Lock *lock) { pthread_mutex_destroy(lock); }
static inline void lock_enter(Lock *lock) { pthread_mutex_lock(lock); }
static inline void lock_leave(Lock *lock) { pthread_mutex_unlock(lock); }
static inline void signal_open(Signal *signal) { pthread_cond_init(signal, NULL); }
static inline void signal_close(Signal *signal) { pthread_cond_destroy(signal); }
static inline void signal_wait(Signal *signal, Lock *lock) { pthread_cond_wait(signal, lock); }
static inline void signal_all(Signal *signal) { pthread_cond_broadcast(signal); }

/* A copy of a process (`fork`) has another number, and only the thread that copied it. */
static inline long process_number(void) { return (long)getpid(); }

static inline size_t cores(void) {
#ifdef __linux__
    cpu_set_t own;
    if (sched_getaffinity(0, sizeof own, &own) == 0) return (size_t)CPU_COUNT(&own);
#endif
    long count = sysconf(_SC_NPROCESSORS_ONLN);
    return count > 0 ? (size_t)count : 1;
}
#endif

#endif
