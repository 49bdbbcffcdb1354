/* The blocks of a job on several threads, each the next one that nobody has begun. Needs `work` and `block`. */
#ifndef THREADS_H
#define THREADS_H
#include <pthread.h>

static void *worker(void *given)
{
    work *job = (work *)given;
    for (int first; (first = __atomic_fetch_add(&job->next, LANES, __ATOMIC_RELAXED)) < job->rollouts;)
        block(job, first);
    return 0;
}

extern "C" void run(work *job, int threads)
{
    pthread_t others[threads];
    job->next = 0;
    for (int i = 1; i < threads; i++) pthread_create(&others[i], 0, worker, job);
    worker(job);
    for (int i = 1; i < threads; i++) pthread_join(others[i], 0);
}
#endif
