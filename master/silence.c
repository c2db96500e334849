/* Asks renderers from which nothing has come for a while for a sign of life, and gives up those that do not answer. */
#include <math.h>

#include "common/clock.h"
#include "master/server.h"

/* The most seconds without a message after which a sign of life is asked for. A renderer looks for messages
 * between waves of rays, every few milliseconds of its own time, with very many lights every tenth of a second. */
#define ASK_AFTER 1.0

/* A turn of the loop takes milliseconds. If one took longer, because the process was stopped or starved, only
 * this many seconds of it count. */
#define TURN_MOST 0.1

/* Seconds between two scans of all renderers: with a hundred thousand of them a scan takes longer than all else
 * of a turn. */
#define LOOK_EVERY 0.01

static void set_silent(struct server *server, uint32_t renderer, bool silent)
{
    server->contacts[renderer].is_silent = silent;
    pthread_mutex_lock(&server->lock);
    queue_set_silent(server->service->queue, renderer, silent);
    pthread_mutex_unlock(&server->lock);
}

void note_sign(struct server *server, uint32_t renderer)
{
    struct contact *contact = &server->contacts[renderer];
    contact->heard_at = server->awake_s;
    contact->is_asked = false;
    if (contact->is_silent) set_silent(server, renderer, false);
}

/* Asks the renderer for a sign of life or gives it up, if it is time. One that has not sent READY yet can only
 * be waited for. */
static void look_for(struct server *server, uint32_t renderer)
{
    struct contact *contact = &server->contacts[renderer];
    const struct service *service = server->service;
    double since = server->awake_s - contact->heard_at;
    double patience = contact->is_ready ? service->patience : service->start_patience;
    double ask = fmin(ASK_AFTER, patience / 2); /* leaves time for an answer */
    if (contact->is_gone || contact->is_told || contact->is_silent || since < ask) return;
    if (contact->is_ready && !contact->is_asked) {
        contact->is_asked = true;
        ask_for_sign(server, renderer);
    }
    if (since >= patience) set_silent(server, renderer, true);
}

void look_for_silence(struct server *server)
{
    double now = clock_wall();
    server->awake_s += fmin(now - server->woken_at, TURN_MOST);
    server->woken_at = now;
    if (now < server->next_look) return;
    server->next_look = now + LOOK_EVERY;
    for (uint32_t i = server->first_remote; i < server->renderers; i++)
        look_for(server, i);
}

bool is_deserted(const struct server *server)
{
    if (server->first_remote > 0) return false; /* rank 0 itself renders */
    for (uint32_t i = 0; i < server->renderers; i++)
        if (!server->contacts[i].is_silent) return false;
    return true;
}
