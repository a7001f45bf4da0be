/* threads.h - runs the tasks of a filter on POSIX threads: the executor that envmap.h leaves to its
   user.

   What you will see: all cores busy. Tasks take the next number from a shared counter, so no thread
   waits for a slow one until the last task; results are the same bits for any number of threads.
   Include after envmap.h and link with -lpthread.

   SPDX-License-Identifier: MIT */

#ifndef THREADS_H
#define THREADS_H

#include <pthread.h>
#include <unistd.h>

#define THREADS_MOST 256

typedef struct threads_work {
    envmap_task *task;
    void *context;
    int next, count;
    pthread_mutex_t lock;
} threads_work;

/* The next task's number; count or more when none is left. */
static inline int threads_next(threads_work *work) {
    int i;
    pthread_mutex_lock(&work->lock);
    i = work->next++;
    pthread_mutex_unlock(&work->lock);
    return i;
}

static inline void *threads_worker(void *user) {
    threads_work *work = (threads_work *)user;
    int i;
    while ((i = threads_next(work)) < work->count) work->task(work->context, i);
    return NULL;
}

/* envmap_executor.run; user points to the number of threads. The calling thread is one of them, so
   the work is done even where no other can be started. */
static inline void threads_run(void *user, envmap_task *task, void *context, int count) {
    pthread_t others[THREADS_MOST];
    threads_work work;
    int wanted = *(const int *)user - 1, started = 0;
    work.task = task, work.context = context, work.next = 0, work.count = count;
    pthread_mutex_init(&work.lock, NULL);
    if (wanted > count - 1) wanted = count - 1;
    if (wanted > THREADS_MOST) wanted = THREADS_MOST;
    while (started < wanted && !pthread_create(&others[started], NULL, threads_worker, &work))
        started++;
    threads_worker(&work);
    while (started > 0) pthread_join(others[--started], NULL);
    pthread_mutex_destroy(&work.lock);
}

/* Processors of this machine. */
static inline int threads_here(void) {
#ifdef _WIN32
    long count = pthread_num_processors_np();
#else
    long count = sysconf(_SC_NPROCESSORS_ONLN);
#endif
    return count < 1 ? 1 : count > THREADS_MOST ? THREADS_MOST : (int)count;
}

#endif /* THREADS_H */
