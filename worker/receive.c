#include "worker/worker.h"

#include <math.h>
#include <string.h>

#include "common/clock.h"
#include "common/message.h"

void post_receive(struct worker *worker)
{
    MPI_Irecv(worker->incoming, (int)sizeof *worker->incoming, MPI_BYTE, 0, MPI_ANY_TAG,
              MPI_COMM_WORLD, &worker->receive);
}

static void take_start(struct worker *worker, size_t bytes)
{
    const struct start *start = &worker->incoming->start;
    if (!start_message_valid(start, bytes) || worker->started)
        fatal("the master sent a start that makes no sense");
    worker->start = clock_wall() - start->elapsed_s;
    worker->patience = start->patience;
    worker->started = true;
}

/*
 * Copies the next tile of a TILES message, of which `bytes` bytes are left, and its refinements to
 * refinements[*refined]. Returns the length of the tile's part, 0 if it is not valid.
 */
static size_t take_tile(const struct worker *worker, struct lot *lot, const char *part,
                        size_t bytes, size_t *refined)
{
    if (lot->count == LOT_TILES || bytes < sizeof(struct tile)) return 0;
    struct tile *tile = &lot->tiles[lot->count++];
    memcpy(tile, part, sizeof *tile);
    const struct view *view = worker->view;
    if (!tile_message_valid(tile, view->region_w, view->region_h)) return 0;
    if (!tile_is_refined(tile)) return sizeof *tile;
    uint32_t pixels = tile_pixels(tile);
    if (!worker->adaptive || tile_part_bytes(tile) > bytes) return 0;
    struct refinement *refinements = lot->refinements + *refined;
    memcpy(refinements, part + sizeof *tile, pixels * sizeof *refinements);
    *refined += pixels;
    return refinements_valid(refinements, pixels, level_last(view)) ? tile_part_bytes(tile) : 0;
}

/* Copies a lot's header and its *reports floats; returns their length in the message. */
static size_t take_lot_header(struct lot *lot, const char *message, size_t bytes, uint32_t *reports)
{
    struct lot_header header;
    if (bytes < sizeof header) fatal("the master sent a lot without tiles");
    memcpy(&header, message, sizeof header);
    size_t length = sizeof header + lot_report_bytes(header.reports);
    if (!lot_header_valid(&header)) fatal("the master sent a lot that makes no sense");
    if (bytes <= length) fatal("the master sent a lot without tiles");
    *lot = (struct lot){.answer_s = header.answer_s, .wakes_master = header.wakes_master};
    for (uint32_t i = header.reports; i < LOT_TILES; i++)
        lot->report_s[i] = HUGE_VALF;
    memcpy(lot->report_s, message + sizeof header, header.reports * sizeof *lot->report_s);
    if (!lot_report_valid(lot->report_s, header.reports))
        fatal("the master sent a lot that makes no sense");
    *reports = header.reports;
    return length;
}

/* Pixels of all tiles of a lot. */
static uint64_t lot_pixels(const struct lot *lot)
{
    uint64_t pixels = 0;
    for (uint32_t i = 0; i < lot->count; i++)
        pixels += tile_pixels(&lot->tiles[i]);
    return pixels;
}

/*
 * Takes a lot of this size from a message or from the tray. Every part is copied before it is checked, so
 * that what is checked is what is used.
 */
static void take_lot(struct worker *worker, const char *message, size_t bytes)
{
    if (worker->waiting == LOTS_UNDER_WAY) fatal("the master sent more lots than it may");
    struct lot *lot = &worker->lots[worker->waiting++];
    uint32_t reports;
    size_t done = take_lot_header(lot, message, bytes, &reports), length = worker->started ? 1 : 0,
           refined = 0;
    /* Room enough: the refinements are a part of the message. */
    if (worker->adaptive) lot->refinements = allocate(bytes, 1);
    while (length > 0 && done < bytes) {
        length = take_tile(worker, lot, message + done, bytes - done, &refined);
        done += length;
    }
    if (done < bytes) fatal("the master sent a tile that is not part of the picture");
    if (lot_pixels(lot) > TILE_MAX_PIXELS) fatal("the master sent a lot of too many pixels");
    if (reports > 0 && reports != lot->count) fatal("the master sent a lot that makes no sense");
}

/* Takes the next lot from the tray if no message of the master precedes it; returns whether it did. */
static bool take_tray(struct worker *worker)
{
    struct tray *tray = worker->tray;
    unsigned turn = worker->lots_taken;
    uint32_t bytes = tray ? slots_bytes(&tray->lots, turn) : 0;
    if (bytes == 0) return false;
    int32_t messages_before = (int32_t)(tray->sent_before[turn % TRAY_SLOTS] - worker->received);
    if (messages_before > 0) return false;
    if (messages_before < 0 || bytes > TRAY_LOT_BYTES)
        fatal("the master left a lot where it makes no sense");
    take_lot(worker, tray->lot[turn % TRAY_SLOTS], bytes);
    slots_empty(&tray->lots, turn);
    worker->lots_taken++;
    worker->received++;
    return true;
}

static void drop_from(struct lot *lot, uint32_t id)
{
    for (uint32_t i = 0; i < lot->count; i++)
        if (lot->tiles[i].id == id) lot->dropped[i] = true;
}

static void take_drop(struct worker *worker, const struct drop *drop)
{
    struct lot *current = &worker->current;
    if (drop->finished && current->tiles[worker->rendering].id == drop->tile_id)
        worker->given_up = true;
    drop_from(current, drop->tile_id);
    for (int i = 0; i < worker->waiting; i++)
        drop_from(&worker->lots[i], drop->tile_id);
}

static void take_drops(struct worker *worker, size_t bytes)
{
    const struct drop *drops = worker->incoming->drops;
    if (!drop_message_valid(drops, bytes))
        fatal("the master asked to drop a tile in a way that makes no sense");
    for (size_t i = 0; i < bytes / sizeof *drops; i++)
        take_drop(worker, &drops[i]);
}

/* The master asks again only after it has received something, so the last answer has been sent. */
static void take_ping(struct worker *worker, size_t bytes)
{
    int done;
    MPI_Test(&worker->pong, &done, MPI_STATUS_IGNORE);
    if (bytes != 0) fatal("the master asked for a sign of life in a way that makes no sense");
    /* The last PONG is still being sent: one is enough. */
    if (!done) return;
    send_to_master(worker, TAG_RENDERER_TO_MASTER_PONG, NULL, 0, &worker->pong);
}

bool may_need_poll(const struct worker *worker)
{
    return !worker->tray || worker->unsettled || tray_has_news(worker->tray, worker->received);
}

bool receive_next(struct worker *worker)
{
    int done, bytes;
    MPI_Status status;
    if (worker->stopped || worker->waiting == LOTS_UNDER_WAY || !may_need_poll(worker))
        return false;
    if (take_tray(worker)) return true;
    MPI_Test(&worker->receive, &done, &status);
    worker->unsettled = worker->unsettled && !all_is_sent(worker);
    if (!done) return false;
    /* Lots that precede the message and have appeared since take_tray() was called above. */
    while (take_tray(worker)) {
    }
    worker->received++;
    MPI_Get_count(&status, MPI_BYTE, &bytes);
    if (status.MPI_TAG == TAG_MASTER_TO_RENDERER_STOP) {
        if (bytes != 0) fatal("the master said stop in a way that makes no sense");
        worker->stopped = true;
        return true;
    }
    if (status.MPI_TAG == TAG_MASTER_TO_RENDERER_DROP)
        take_drops(worker, (size_t)bytes);
    else if (status.MPI_TAG == TAG_MASTER_TO_RENDERER_START)
        take_start(worker, (size_t)bytes);
    else if (status.MPI_TAG == TAG_MASTER_TO_RENDERER_PING)
        take_ping(worker, (size_t)bytes);
    else if (status.MPI_TAG == TAG_MASTER_TO_RENDERER_TILES)
        take_lot(worker, worker->incoming->tiles, (size_t)bytes);
    else
        fatal("the master sent a message of unknown kind %d", status.MPI_TAG);
    post_receive(worker);
    return true;
}

void receive_all(struct worker *worker)
{
    while (receive_next(worker)) {
    }
}
