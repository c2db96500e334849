#include "master/save.h"

#include <fcntl.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/clock.h"
#include "common/hash.h"
#include "common/message.h"
#include "common/whole.h"
#include "master/found.h"
#include "master/journal.h"
#include "master/path.h"

/* Seconds before anything is written: what may be lost without harm. */
#define LATE 1.0

/* The most tiles for which there is room from the start, 1 MB: page faults and copies to larger blocks would take the
 * master's time while renderers wait. */
#define FIRST_TILES 4096u

/* Seconds between two writes while tiles come in: waking up for each tile would cost more than writing it. */
#define GATHER 0.01

/* Seconds until writing is tried again after the disk was full or the folder gone. */
#define RETRY 1.0

/* The beginning of a tile's payload; the floats of canvas_get() follow. */
struct tile_head {
    double cpu_s; /* that it took to render */
    struct render_counts counts;
};

/* A finished tile that is not in the file yet. */
struct finished {
    struct tile tile;
    double seconds; /* wall seconds that it took to render */
    struct tile_head head;
    struct part_head *part; /* owned; NULL: its pixels are in the canvas */
    size_t bytes;           /* of the part */
};

/* The beginning of a part's payload, with adaptive sampling; the floats of adaptive_put() follow. */
struct part_head {
    struct tile_head tile;
    uint64_t plan; /* adaptive_plan_hash() before it came in */
    double limit;  /* adaptive_limit() */
};

_Static_assert(sizeof(struct tile_head) == 208 && sizeof(struct part_head) == 224,
               "with a record's 64 bytes, what master/README.md says of the room for a journal");

struct finished_list {
    struct finished *items;
    size_t count, room;
};

struct save {
    struct journal *journal;
    struct canvas *canvas;
    struct adaptive *adaptive; /* NULL: all samples of a pixel are taken at once */
    /* A pass that cannot be planned as its records in the journal say; 0: none. */
    uint32_t refused_pass;
    struct found found;

    /* Shared by all threads, under lock. */
    pthread_mutex_t lock;
    pthread_cond_t changed;
    struct finished_list come; /* finished tiles since the thread last looked */
    bool idle;                 /* the thread waits for a tile, not for the end of a pause */
    bool ending;

    /* Belong to the thread, and to the caller again when the thread has ended. */
    pthread_t thread;
    bool is_started;
    uint64_t reserve;             /* bytes to reserve before the first record; 0: done */
    struct finished_list waiting; /* to be written */
    char *payload;
    size_t room; /* of payload, bytes */
};

/* ---- what a record holds: struct tile_head, then 3 floats per pixel; or struct part_head, then
 * REFINED_FLOATS ---- */

static size_t payload_bytes(const struct tile *tile)
{
    return sizeof(struct tile_head) + (size_t)tile_pixels(tile) * 3 * sizeof(float);
}

static bool tile_head_valid(const struct tile_head *head)
{
    return isfinite(head->cpu_s) && head->cpu_s >= 0 && render_counts_valid(&head->counts);
}

static bool part_head_valid(const struct part_head *head)
{
    return tile_head_valid(&head->tile) && isfinite(head->limit);
}

static bool record_valid(const struct canvas *canvas, const struct journal_record *record,
                         struct tile_head *head)
{
    const struct tile *tile = &record->tile;
    if (tile->pass != 0 || !tile_message_valid(tile, canvas->width, canvas->height) ||
        record->bytes != payload_bytes(tile))
        return false;
    memcpy(head, record->payload, sizeof *head);
    return tile_head_valid(head);
}

/* Whether a record of this pass can be taken. Plans the pass when it is the next one and all records of those
 * before it are in; for pass 1 after a pass 0 that was cut off (limit < 0), whatever the journal has of that. */
static bool follow_pass(struct save *save, uint32_t pass, double limit)
{
    struct adaptive *adaptive = save->adaptive;
    bool is_there = adaptive_is_complete(adaptive) || (pass == 1 && limit < 0);
    if (pass != adaptive_passes(adaptive) || !is_there)
        return pass + 1 == adaptive_passes(adaptive);
    if (pass == save->refused_pass) return false;
    if (adaptive_replan(adaptive, limit)) return true;
    /* A plan scans all pixels: it is not repeated for each record of a forged journal. */
    save->refused_pass = pass;
    return false;
}

static size_t part_bytes(uint32_t pixels)
{
    return sizeof(struct part_head) + (size_t)pixels * REFINED_FLOATS * sizeof(float);
}

static bool part_valid(struct save *save, const struct journal_record *record,
                       struct part_head *head)
{
    const struct tile *tile = &record->tile;
    const struct canvas *canvas = save->canvas;
    if (!tile_message_valid(tile, canvas->width, canvas->height) || record->bytes < part_bytes(0))
        return false;
    memcpy(head, record->payload, sizeof *head);
    return part_head_valid(head) && follow_pass(save, tile->pass, head->limit) &&
           record->bytes == part_bytes(adaptive_pixels(save->adaptive, tile)) &&
           head->plan == adaptive_plan_hash(save->adaptive, tile);
}

/* Notes a record; returns what found_add() does. */
static uint32_t note(struct save *save, const struct journal_record *record,
                     const struct tile_head *head)
{
    struct found_tile tile = {record->tile, record->seconds, head->cpu_s, head->counts};
    return found_add(&save->found, &tile);
}

static bool take_part(struct save *save, const struct journal_record *record)
{
    struct part_head head;
    if (!part_valid(save, record, &head)) return false;
    uint32_t pixels = note(save, record, &head.tile);
    double part = record->tile.pass == 0 ? pixels / (double)tile_pixels(&record->tile) : 1;
    adaptive_put(save->adaptive, &record->tile,
                 (const void *)((const char *)record->payload + sizeof head),
                 part * head.tile.cpu_s);
    return true;
}

static bool take_record(void *state, const struct journal_record *record)
{
    struct save *save = state;
    struct tile_head head;
    if (save->adaptive) return take_part(save, record);
    if (!record_valid(save->canvas, record, &head)) return false;
    note(save, record, &head);
    const char *rgb = (const char *)record->payload + sizeof head;
    canvas_put(save->canvas, &record->tile, (const void *)rgb);
    return true;
}

static bool append(struct save *save, const struct finished *finished)
{
    const struct tile *tile = &finished->tile;
    if (finished->part) {
        struct journal_record part = {*tile, finished->seconds, finished->part, finished->bytes};
        return journal_append(save->journal, &part);
    }
    size_t bytes = payload_bytes(tile);
    if (bytes > save->room) {
        save->payload = reallocate(save->payload, bytes, 1);
        save->room = bytes;
    }
    memcpy(save->payload, &finished->head, sizeof finished->head);
    canvas_get(save->canvas, tile, (void *)(save->payload + sizeof finished->head));
    struct journal_record record = {*tile, finished->seconds, save->payload, bytes};
    return journal_append(save->journal, &record);
}

/* ---- lists ---- */

/* Room of a list that has none: about as many tiles come between two writes. */
#define ROOM_AT_FIRST 64

/* A new item at the end, whose content is left to the caller. */
static struct finished *list_add(struct finished_list *list)
{
    if (list->count == list->room) {
        list->room = list->room ? 2 * list->room : ROOM_AT_FIRST;
        list->items = reallocate(list->items, list->room, sizeof *list->items);
    }
    return &list->items[list->count++];
}

/* Removes the first items. */
static void list_drop(struct finished_list *list, size_t count)
{
    for (size_t i = 0; i < count; i++)
        free(list->items[i].part);
    list->count -= count;
    if (count) memmove(list->items, list->items + count, list->count * sizeof *list->items);
}

/* ---- the thread ---- */

/* Writes tiles until one of them cannot be written; returns whether all were. */
static bool write_waiting(struct save *save)
{
    size_t written = 0;
    if (save->reserve && save->waiting.count) {
        journal_reserve(save->journal, save->reserve);
        save->reserve = 0;
    }
    while (written < save->waiting.count && append(save, &save->waiting.items[written]))
        written++;
    list_drop(&save->waiting, written);
    return save->waiting.count == 0;
}

/* The lock is held. */
static void take_over(struct save *save)
{
    struct finished_list come = save->come;
    if (save->waiting.count == 0) {
        save->come = save->waiting;
        save->waiting = come;
        return;
    }
    for (size_t i = 0; i < come.count; i++)
        *list_add(&save->waiting) = come.items[i];
    save->come.count = 0;
}

/* Waits, with the lock held, for this time or until something happens. */
static void wait_for(struct save *save, double seconds)
{
    struct timespec until = clock_span(clock_wall() + seconds);
    pthread_cond_timedwait(&save->changed, &save->lock, &until);
}

/* As wait_for(), but only the end interrupts it; returns whether it has come. */
static bool pause_for(struct save *save, double seconds)
{
    double until = clock_wall() + seconds, now;
    while (!save->ending && (now = clock_wall()) < until)
        wait_for(save, until - now);
    return save->ending;
}

/* The writing thread: writes what comes, until the end; what is left then is up to the caller. */
static void *write_tiles(void *argument)
{
    struct save *save = argument;
    pthread_mutex_lock(&save->lock);
    double pause = LATE;
    while (!pause_for(save, pause)) {
        save->idle = !save->come.count && !save->waiting.count;
        if (save->idle) wait_for(save, RETRY);
        save->idle = false;
        take_over(save);
        pthread_mutex_unlock(&save->lock);
        pause = write_waiting(save) ? GATHER : RETRY;
        journal_tick(save->journal, clock_wall());
        pthread_mutex_lock(&save->lock);
    }
    pthread_mutex_unlock(&save->lock);
    return NULL;
}

static void come_in(struct save *save, const struct tile *tile, const struct result_header *header,
                    struct part_head *part, size_t bytes)
{
    pthread_mutex_lock(&save->lock);
    struct finished *finished = list_add(&save->come);
    finished->tile = *tile;
    finished->seconds = header->busy_s;
    finished->head.cpu_s = header->cpu_s;
    finished->head.counts = header->counts;
    finished->part = part;
    finished->bytes = bytes;
    if (save->idle) pthread_cond_signal(&save->changed);
    pthread_mutex_unlock(&save->lock);
}

void save_tile(struct save *save, const struct tile *tile, const struct result_header *header)
{
    if (save) come_in(save, tile, header, NULL, 0);
}

void save_part(struct save *save, const struct tile *tile, const struct result_header *header,
               const float *part)
{
    if (!save) return;
    size_t bytes = part_bytes(adaptive_pixels(save->adaptive, tile));
    struct part_head *copy = allocate(bytes, 1);
    *copy = (struct part_head){{header->cpu_s, header->counts},
                               adaptive_plan_hash(save->adaptive, tile),
                               adaptive_limit(save->adaptive)};
    memcpy(copy + 1, part, bytes - sizeof *copy);
    come_in(save, tile, header, copy, bytes);
}

/* ---- from open to end ---- */

/* A hash of the program's file: pictures of two builds may differ in their last bits. */
static uint64_t program_hash(void)
{
    uint64_t hash = hash64(FARM_VERSION, strlen(FARM_VERSION), 0);
    struct stat status;
    int file = open("/proc/self/exe", O_RDONLY | O_CLOEXEC);
    if (file < 0) return hash;
    if (fstat(file, &status) == 0 && status.st_size > 0) {
        size_t bytes = (size_t)status.st_size;
        void *program = mmap(NULL, bytes, PROT_READ, MAP_PRIVATE, file, 0);
        if (program != MAP_FAILED) {
            hash = hash64(program, bytes, hash);
            munmap(program, bytes);
        }
    }
    close(file);
    return hash;
}

/* With adaptive sampling the target, too, determines the passes. */
static uint64_t picture_hash(const struct scene *scene, const struct adaptive *adaptive)
{
    uint64_t program = program_hash();
    double target = adaptive ? adaptive_target(adaptive) : 0;
    if (adaptive) program = hash64(&target, sizeof target, program);
    return journal_picture_hash(scene, program);
}

/* Bytes that further tiles and pixels take. The queue may split tiles: four times as many are ample. How many
 * passes will follow the current one is not known. */
static uint64_t bytes_to_come(const struct save *save, uint64_t tiles, uint64_t pixels)
{
    return 4 * tiles * journal_record_bytes(sizeof(struct part_head)) +
           pixels * (save->adaptive ? REFINED_FLOATS : 3) * sizeof(float);
}

struct save *save_open(const char *path, const struct scene *scene, struct canvas *canvas,
                       struct adaptive *adaptive, uint32_t tiles)
{
    struct save *save = allocate_zeroed(1, sizeof *save);
    save->canvas = canvas;
    save->adaptive = adaptive;
    found_init(&save->found, canvas->width, canvas->height);
    struct journal_reader reader = {
        .take = take_record,
        .state = save,
        .largest = part_bytes(TILE_MAX_PIXELS),
        .room = bytes_to_come(save, tiles, canvas_pixels(canvas)),
    };
    save->journal = journal_open(path, picture_hash(scene, adaptive), &reader);
    if (save->journal) return save;
    found_free(&save->found);
    free(save);
    return NULL;
}

struct found *save_found(struct save *save)
{
    return &save->found;
}

bool save_was_empty(const struct save *save)
{
    return journal_was_empty(save->journal);
}

bool save_has_room(const struct save *save, uint32_t tiles, uint64_t pixels)
{
    return journal_has_room(save->journal, bytes_to_come(save, tiles, pixels));
}

void save_start(struct save *save, uint32_t tiles, uint64_t pixels)
{
    pthread_condattr_t monotonic;
    found_close(&save->found);
    save->come.room = smaller(tiles, FIRST_TILES);
    save->come.items = allocate_prefaulted(save->come.room, sizeof *save->come.items);
    save->reserve = tiles ? bytes_to_come(save, tiles, pixels) : 0;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    if (pthread_mutex_init(&save->lock, NULL) != 0 ||
        pthread_cond_init(&save->changed, &monotonic) != 0 ||
        pthread_create(&save->thread, NULL, write_tiles, save) != 0)
        fatal("cannot start the thread that writes the journal");
    pthread_condattr_destroy(&monotonic);
    pthread_setname_np(save->thread, "journal");
    save->is_started = true;
}

/* Ends the thread; all data belong to the caller afterwards. */
static void end_thread(struct save *save)
{
    if (!save->is_started) return;
    pthread_mutex_lock(&save->lock);
    save->ending = true;
    pthread_cond_signal(&save->changed);
    pthread_mutex_unlock(&save->lock);
    pthread_join(save->thread, NULL);
    take_over(save);
    pthread_cond_destroy(&save->changed);
    pthread_mutex_destroy(&save->lock);
    save->is_started = false;
}

void save_finish(struct save *save)
{
    if (!save) return;
    end_thread(save);
    if (save->reserve) return; /* a short run, which has written nothing */
    journal_hush(save->journal);
    if (write_waiting(save)) journal_give_back(save->journal);
}

static void destroy(struct save *save)
{
    found_free(&save->found);
    list_drop(&save->waiting, save->waiting.count);
    free(save->come.items);
    free(save->waiting.items);
    free(save->payload);
    free(save);
}

static bool is_safe(struct save *save)
{
    return write_waiting(save) && journal_exists(save->journal);
}

static uint64_t pixels_waiting(const struct save *save)
{
    uint64_t pixels = 0;
    for (size_t i = 0; i < save->waiting.count; i++)
        pixels += tile_pixels(&save->waiting.items[i].tile);
    return pixels;
}

/* Moves the journal to a copy in another folder, with room for all that is not written; where the journal's file
 * is gone, with as much as there is room for. */
static bool move_to(struct save *save, const char *folder, const char *name)
{
    uint64_t more = journal_exists(save->journal)
                        ? bytes_to_come(save, save->waiting.count, pixels_waiting(save))
                        : 0;
    char *path = format_text("%s/%s-%ld.journal", folder, name, (long)getpid());
    bool moved = journal_move(save->journal, path, more) && is_safe(save);
    free(path);
    return moved;
}

static void rescue(struct save *save)
{
    const char *temporary = getenv("TMPDIR");
    const char *folders[] = {".", temporary && *temporary ? temporary : "/tmp", "/var/tmp",
                             "/dev/shm"};
    char *name = path_stem(journal_path(save->journal));
    bool moved = false;
    for (size_t i = 0; i < sizeof folders / sizeof *folders && !moved; i++)
        moved = move_to(save, folders[i], name);
    /* Its disk is full: the picture may need the room. */
    if (moved) journal_remove_original(save->journal);
    free(name);
}

void save_kept_free(struct save_kept *kept)
{
    free(kept->path);
    free(kept->original);
}

struct save_kept save_keep(struct save *save)
{
    struct save_kept kept = {0};
    end_thread(save);
    char *asked = copy_text(journal_path(save->journal));
    bool nothing = save->waiting.count == 0 && journal_is_bare(save->journal);
    if (!nothing && !is_safe(save)) rescue(save);
    kept.is_gone = !nothing && !journal_exists(save->journal);
    kept.is_bare = kept.is_gone || journal_is_bare(save->journal);
    /* Even if not everything could be written there. */
    kept.moved = !kept.is_bare && strcmp(asked, journal_path(save->journal)) != 0;
    free(asked);
    for (size_t i = 0; i < save->waiting.count; i++)
        kept.lost_s += save->waiting.items[i].seconds;
    kept.lost = save->waiting.count;
    kept.lost_pixels = pixels_waiting(save);
    kept.path = copy_text(journal_path(save->journal));
    const char *original = journal_original(save->journal);
    if (original) kept.original = copy_text(original);
    if (kept.is_bare)
        journal_remove(save->journal);
    else
        journal_close(save->journal);
    destroy(save);
    return kept;
}

void save_drop(struct save *save)
{
    if (!save) return;
    end_thread(save);
    journal_remove(save->journal);
    destroy(save);
}
