#include "master/late_note.h"

#include <errno.h>

#include "common/clock.h"
#include "common/message.h"

static void *wait_and_tell(void *argument)
{
    struct late_note *note = argument;
    struct timespec then = clock_span(clock_wall() + note->seconds);
    int error = 0;
    pthread_mutex_lock(&note->lock);
    while (!note->is_over && error != ETIMEDOUT)
        error = pthread_cond_timedwait(&note->ended, &note->lock, &then);
    if (!note->is_over) user_note("%s", note->text);
    pthread_mutex_unlock(&note->lock);
    return NULL;
}

void late_note_start(struct late_note *note, const char *text, double seconds)
{
    pthread_condattr_t clock;
    *note = (struct late_note){.text = text, .seconds = seconds};
    pthread_mutex_init(&note->lock, NULL);
    pthread_condattr_init(&clock);
    pthread_condattr_setclock(&clock, CLOCK_MONOTONIC);
    pthread_cond_init(&note->ended, &clock);
    pthread_condattr_destroy(&clock);
    note->is_started = pthread_create(&note->thread, NULL, wait_and_tell, note) == 0;
}

void late_note_end(struct late_note *note)
{
    pthread_mutex_lock(&note->lock);
    note->is_over = true;
    pthread_cond_signal(&note->ended);
    pthread_mutex_unlock(&note->lock);
    if (note->is_started) pthread_join(note->thread, NULL);
    pthread_cond_destroy(&note->ended);
    pthread_mutex_destroy(&note->lock);
}
