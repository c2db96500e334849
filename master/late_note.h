/* A message that is printed if an operation takes longer than expected, while it is still running. */
#ifndef FARM_MASTER_LATE_NOTE_H
#define FARM_MASTER_LATE_NOTE_H

#include <pthread.h>
#include <stdbool.h>

struct late_note {
    const char *text;
    double seconds;
    pthread_t thread; /* sleeps until the note is due or the operation is over */
    pthread_mutex_t lock;
    pthread_cond_t ended;
    bool is_over;    /* protected by lock */
    bool is_started; /* false: there is no thread, and nothing will be printed */
};

/* If the operation has not ended after this many seconds, the text is printed. It stays the caller's, and valid
 * until late_note_end(). Both are called by one thread, and *note must not be moved in between. */
void late_note_start(struct late_note *note, const char *text, double seconds);

/* Ends the operation: the text is not printed from here on. */
void late_note_end(struct late_note *note);

#endif
