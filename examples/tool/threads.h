/* threads.h - runs the tasks of a filter on POSIX threads: the executor that envmap.h leaves to its
   user.

   What you will see: all cores busy. Threads live from threads_begin to threads_end, as a filter
   hands over tasks some dozen times and to start threads each time would take longer than many of
   its stages. Tasks take the next number from a shared counter, so no thread waits for a slow one
   until the last task; results are the same bits for any number of threads.
   Include after envmap.h and link with -lpthread; gcc or clang, for their atomic numbers.

   SPDX-License-Identifier: MIT */

#ifndef THREADS_H
#define THREADS_H

#include <pthread.h>
#include <sched.h>
#include <string.h>
#include <unistd.h>

#define THREADS_MOST  256
#define THREADS_LOOKS 20000 /* for work before a thread sleeps: 0.4 ms, as a filter's stages that
                               no thread shares are shorter, and to be woken takes 15 us */
#if defined(__x86_64__) || defined(__i386__)
#define THREADS_PAUSE() __builtin_ia32_pause()
#else
#define THREADS_PAUSE() (void)0
#endif

typedef struct threads_pool {
    int threads; /* that work, the caller of threads_run among them */
    pthread_t others[THREADS_MOST];
    pthread_mutex_t lock, running;
    pthread_cond_t work;
    envmap_task *task;
    void *context;
    int count, left, done, asleep, stop; /* atomic but for count; left: tasks that nobody took */
} threads_pool;

static inline int threads_get(const int *number) {
    return __atomic_load_n(number, __ATOMIC_SEQ_CST);
}
static inline int threads_add(int *number, int n) {
    return __atomic_fetch_add(number, n, __ATOMIC_SEQ_CST);
}
static inline void threads_set(int *number, int n) {
    __atomic_store_n(number, n, __ATOMIC_SEQ_CST);
}

/* Takes tasks until none is left. task, context and count stay until all of them are done. */
static inline void threads_take(threads_pool *pool) {
    int ticket;
    while (threads_get(&pool->left) > 0 && (ticket = threads_add(&pool->left, -1)) > 0) {
        pool->task(pool->context, pool->count - ticket);
        threads_add(&pool->done, 1);
    }
}

static inline void *threads_worker(void *user) {
    threads_pool *pool = (threads_pool *)user;
    while (!threads_get(&pool->stop)) {
        int looks = THREADS_LOOKS;
        while (looks > 0 && threads_get(&pool->left) <= 0) {
            THREADS_PAUSE();
            --looks;
        }
        if (!looks) {
            pthread_mutex_lock(&pool->lock);
            threads_add(&pool->asleep, 1);
            while (threads_get(&pool->left) <= 0 && !threads_get(&pool->stop))
                pthread_cond_wait(&pool->work, &pool->lock);
            threads_add(&pool->asleep, -1);
            pthread_mutex_unlock(&pool->lock);
        }
        threads_take(pool);
    }
    return NULL;
}

static inline void threads_wake(threads_pool *pool) {
    if (!threads_get(&pool->asleep)) return;
    pthread_mutex_lock(&pool->lock);
    pthread_cond_broadcast(&pool->work);
    pthread_mutex_unlock(&pool->lock);
}

/* envmap_executor.run; user points to a pool. The calling thread does tasks, too, so the work is
   done even where no thread can be started; and all of them where the pool is at work already, for
   another caller or for one of whose tasks this is a part. */
static inline void threads_run(void *user, envmap_task *task, void *context, int count) {
    threads_pool *pool = (threads_pool *)user;
    int i;
    if (count < 2 || pool->threads < 2 || pthread_mutex_trylock(&pool->running)) {
        for (i = 0; i < count; i++) task(context, i);
        return;
    }
    pool->task = task, pool->context = context, pool->count = count;
    threads_set(&pool->done, 0);
    threads_set(&pool->left, count);
    threads_wake(pool);
    threads_take(pool);
    for (i = 1; threads_get(&pool->done) < count; i++) {
        THREADS_PAUSE();
        if (i >= THREADS_LOOKS) sched_yield();
    }
    pthread_mutex_unlock(&pool->running);
}

/* Starts so many threads less the caller's, or as many as can be started. */
static inline void threads_begin(threads_pool *pool, int threads) {
    memset(pool, 0, sizeof *pool);
    pthread_mutex_init(&pool->lock, NULL);
    pthread_mutex_init(&pool->running, NULL);
    pthread_cond_init(&pool->work, NULL);
    for (pool->threads = 1; pool->threads < threads && pool->threads < THREADS_MOST;)
        if (pthread_create(&pool->others[pool->threads - 1], NULL, threads_worker, pool)) break;
        else pool->threads++;
}

/* Ends them, when no run is under way. */
static inline void threads_end(threads_pool *pool) {
    threads_set(&pool->stop, 1);
    threads_wake(pool);
    while (pool->threads > 1) pthread_join(pool->others[--pool->threads - 1], NULL);
    pthread_cond_destroy(&pool->work);
    pthread_mutex_destroy(&pool->running);
    pthread_mutex_destroy(&pool->lock);
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
