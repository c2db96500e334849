#include "worker/worker.h"

#include <stdlib.h>
#include <string.h>

#include "common/bell.h"
#include "common/clock.h"
#include "common/message.h"
#include "worker/collective.h"

static bool is_sent(MPI_Request *request)
{
    int sent;
    MPI_Test(request, &sent, MPI_STATUS_IGNORE);
    return sent;
}

/* The next send buffer, or slot of the tray, free and large enough. */
static char *take_buffer(struct worker *worker, size_t bytes)
{
    double start = clock_wall();
    int buffer = 0;
    while (buffer < SENDS && !is_sent(&worker->sends[buffer]))
        buffer++;
    if (buffer == SENDS) {
        bell_ring(worker->bell); /* the master takes them, then there is room */
        wait_request(&worker->sends[buffer = 0]);
    }
    worker->buffer = buffer;
    worker->stats.send_s += clock_wall() - start;
    struct tray *tray = worker->tray;
    worker->slot = tray && bytes <= TRAY_RESULT_BYTES ? slots_find(&tray->results) : -1;
    if (worker->slot >= 0) return tray->result[worker->slot];
    if (worker->capacities[buffer] < bytes) {
        free(worker->buffers[buffer]);
        worker->buffers[buffer] = allocate_zeroed(bytes, 1);
        worker->capacities[buffer] = bytes;
    }
    return worker->buffers[buffer];
}

void begin_result(struct worker *worker, size_t bytes)
{
    worker->result = take_buffer(worker, bytes);
    worker->done = worker->sent = 0;
}

/* In place of the result in the slot: the note about it. */
static void send_note(struct worker *worker, size_t bytes)
{
    struct tray_note *note = &worker->notes[worker->buffer];
    *note = (struct tray_note){.slot = (uint32_t)worker->slot, .bytes = (uint32_t)bytes};
    slots_fill(&worker->tray->results, worker->slot);
    MPI_Isend(note, sizeof *note, MPI_BYTE, 0, TAG_RENDERER_TO_MASTER_TRAY, worker->comm,
              &worker->sends[worker->buffer]);
}

void send_result(struct worker *worker)
{
    double start = clock_wall();
    size_t bytes = worker->done - worker->sent;
    const char *rest = worker->result + worker->sent;
    if (bytes == 0) return;
    if (worker->slot >= 0) {
        if (worker->sent > 0) memmove(worker->result, rest, bytes);
        send_note(worker, bytes);
    } else {
        MPI_Isend(rest, (int)bytes, MPI_BYTE, 0, TAG_RENDERER_TO_MASTER_RESULT, worker->comm,
                  &worker->sends[worker->buffer]);
    }
    worker->unsettled = true;
    worker->stats.send_s += clock_wall() - start;
    worker->stats.bytes += bytes;
}

bool all_is_sent(struct worker *worker)
{
    for (int i = 0; i < SENDS; i++)
        if (!is_sent(&worker->sends[i])) return false;
    return is_sent(&worker->pong) && is_sent(&worker->telling) && is_sent(&worker->finished);
}

/* Sends so many finished bytes of the result, which goes on to be filled. */
static void send_finished(struct worker *worker, size_t bytes)
{
    if (worker->told_room < bytes) {
        worker->told_bytes = reallocate(worker->told_bytes, bytes, 1);
        worker->told_room = bytes;
    }
    memcpy(worker->told_bytes, worker->result + worker->sent, bytes);
    MPI_Isend(worker->told_bytes, (int)bytes, MPI_BYTE, 0, TAG_RENDERER_TO_MASTER_RESULT,
              worker->comm, &worker->finished);
    worker->unsettled = true;
    worker->sent += bytes;
    worker->stats.bytes += bytes;
}

void tell(struct worker *worker, double now)
{
    if (!is_sent(&worker->finished) || !is_sent(&worker->telling)) return;
    if (worker->done > worker->sent) send_finished(worker, worker->done - worker->sent);
    worker->notice = (struct result_header){.tile_id = worker->current.tiles[worker->rendering].id,
                                            .pixels = RESULT_UNFINISHED,
                                            .start_s = worker->time.begun - worker->start,
                                            .busy_s = now - worker->time.begun};
    MPI_Isend(&worker->notice, (int)sizeof worker->notice, MPI_BYTE, 0,
              TAG_RENDERER_TO_MASTER_RESULT, worker->comm, &worker->telling);
    worker->unsettled = true;
    bell_ring(worker->bell);
    worker->stats.bytes += sizeof worker->notice;
    worker->told = true;
    worker->tell_at = now + worker->notice.busy_s;
}
