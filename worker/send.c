#include "worker/worker.h"

#include <stdlib.h>
#include <string.h>

#include "common/bell.h"
#include "common/clock.h"
#include "common/message.h"
#include "worker/collective.h"

void send_to_master(struct worker *worker, enum message_tag tag, const void *bytes, size_t size,
                    MPI_Request *request)
{
    if (worker->arrivals) arrivals_send(worker->arrivals);
    MPI_Isend(bytes, (int)size, MPI_BYTE, 0, (int)tag, MPI_COMM_WORLD, request);
    worker->unsettled = true;
}

static bool is_sent(MPI_Request *request)
{
    int sent;
    MPI_Test(request, &sent, MPI_STATUS_IGNORE);
    return sent;
}

/* A free send buffer with room for this many bytes; waits for one if need be. */
static char *take_buffer(struct worker *worker, size_t bytes)
{
    double start = clock_wall();
    int buffer = 0;
    while (buffer < SENDS && !is_sent(&worker->sends[buffer]))
        buffer++;
    if (buffer == SENDS) {
        bell_ring(worker->bell); /* wakes the master, which receives them */
        wait_request(&worker->sends[buffer = 0]);
    }
    worker->buffer = buffer;
    worker->stats.send_s += clock_wall() - start;
    if (worker->capacities[buffer] < bytes) {
        free(worker->buffers[buffer]);
        worker->buffers[buffer] = allocate_zeroed(bytes, 1);
        worker->capacities[buffer] = bytes;
    }
    return worker->buffers[buffer];
}

void begin_result(struct worker *worker, size_t bytes)
{
    struct tray *tray = worker->tray;
    unsigned turn = worker->results_put;
    worker->in_tray = tray && bytes <= TRAY_RESULT_BYTES && slots_bytes(&tray->results, turn) == 0;
    worker->result = worker->in_tray ? tray->result[turn % TRAY_SLOTS] : take_buffer(worker, bytes);
    worker->done = worker->sent = 0;
}

/* Publishes the result in the tray. */
static void leave_in_tray(struct worker *worker, size_t bytes)
{
    slots_fill(&worker->tray->results, worker->results_put++, (uint32_t)bytes);
    arrivals_leave(worker->arrivals, worker->stats.rank);
}

void send_result(struct worker *worker)
{
    double start = clock_wall();
    size_t bytes = worker->done - worker->sent;
    const char *rest = worker->result + worker->sent;
    if (bytes == 0) return;
    if (worker->in_tray) {
        if (worker->sent > 0) memmove(worker->result, rest, bytes);
        leave_in_tray(worker, bytes);
    } else {
        send_to_master(worker, TAG_RENDERER_TO_MASTER_RESULT, rest, bytes,
                       &worker->sends[worker->buffer]);
    }
    worker->stats.send_s += clock_wall() - start;
    worker->stats.bytes += bytes;
}

bool all_is_sent(struct worker *worker)
{
    for (int i = 0; i < SENDS; i++)
        if (!is_sent(&worker->sends[i])) return false;
    return is_sent(&worker->pong) && is_sent(&worker->notice_send) && is_sent(&worker->early_send);
}

/* Sends the next `bytes` finished bytes of a result that is still being filled. */
static void send_finished(struct worker *worker, size_t bytes)
{
    if (worker->early_room < bytes) {
        worker->early_result = reallocate(worker->early_result, bytes, 1);
        worker->early_room = bytes;
    }
    memcpy(worker->early_result, worker->result + worker->sent, bytes);
    send_to_master(worker, TAG_RENDERER_TO_MASTER_RESULT, worker->early_result, bytes,
                   &worker->early_send);
    worker->sent += bytes;
    worker->stats.bytes += bytes;
}

void report_unfinished(struct worker *worker, double now)
{
    if (!is_sent(&worker->early_send) || !is_sent(&worker->notice_send)) return;
    if (worker->done > worker->sent) send_finished(worker, worker->done - worker->sent);
    worker->notice = (struct result_header){.tile_id = worker->current.tiles[worker->rendering].id,
                                            .pixels = RESULT_UNFINISHED,
                                            .busy_s = now - worker->time.begun};
    send_to_master(worker, TAG_RENDERER_TO_MASTER_RESULT, &worker->notice, sizeof worker->notice,
                   &worker->notice_send);
    bell_ring(worker->bell);
    worker->stats.bytes += sizeof worker->notice;
    worker->reported = true;
    worker->report_at = now + worker->notice.busy_s;
}
