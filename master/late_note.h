/* A note for whoever waits: printed when something takes longer than expected, while it still goes on. */
#ifndef FARM_MASTER_LATE_NOTE_H
#define FARM_MASTER_LATE_NOTE_H

#include <pthread.h>
#include <stdbool.h>

struct late_note {
    const char *text;
    double seconds;
    pthread_t thread; /* sleeps until it is time or all is over */
    pthread_mutex_t lock;
    pthread_cond_t ended;
    bool is_over;    /* under lock */
    bool is_started; /* false: there is no thread, and nothing will be printed */
};

/* From now on counts the seconds; text: stays the caller's, and valid until late_note_end(). The two are called by one
 * thread, and *note must not be moved in between. */
void late_note_start(struct late_note *note, const char *text, double seconds);

/* It is done: the text is not printed any more if it has not been. */
void late_note_end(struct late_note *note);

#endif
