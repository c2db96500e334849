#include "master/journal.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/magic.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/vfs.h>
#include <unistd.h>

#include "common/clock.h"
#include "common/hash.h"
#include "common/message.h"
#include "master/journal_aside.h"
#include "master/journal_file.h"
#include "master/journal_scan.h"
#include "master/output_file.h"

#define JOURNAL_MAGIC UINT64_C(0x314e4a204d524146) /* "FARM JN1" */

struct file_header {
    uint64_t magic;
    uint64_t picture;
    uint64_t checksum; /* of the above */
};

_Static_assert(sizeof(struct file_header) == 24, "it is stored in files");

struct journal {
    char *path; /* owned */
    int file;
    uint64_t picture;
    /* End of the good bytes. torn: other bytes may follow them. */
    uint64_t end;
    bool torn;
    char *buffer; /* a record in one piece, so that one call writes it; owned */
    size_t room;
    bool told_failure;
    bool unsynced;
    bool folder_synced; /* since the file came into it */
    double next_sync;   /* on clock_wall() */
    struct journal_found found;
    /* Where it was before it was moved; stays open, and so locked. NULL: it was not moved. */
    char *original; /* owned */
    int original_file;
};

/* The least seconds between two syncs: at least as much may be lost by the death of the machine. */
#define SYNC_EVERY 5.0

uint64_t journal_picture_hash(const struct scene *scene, uint64_t program)
{
    struct scene head;
    memcpy(&head, scene, sizeof head);
    head.view.processor = 0;
    head.view.variant = 0;
    uint64_t hash = hash64(&head, sizeof head, program);
    return hash64(scene + 1, scene->bytes - sizeof head, hash);
}

static struct file_header make_header(uint64_t picture)
{
    struct file_header header = {.magic = JOURNAL_MAGIC, .picture = picture};
    header.checksum = hash64(&header, offsetof(struct file_header, checksum), 0);
    return header;
}

/* ---- the file and its lock ---- */

static void refuse_kind(const char *path)
{
    user_error(path, 0,
               "is no regular file, choose another place for the journal with "
               "output.journal=FILE");
}

bool journal_writable(const char *path)
{
    struct stat old;
    if (lstat(path, &old) != 0) return output_writable(path, "output.journal");
    if (S_ISREG(old.st_mode))
        return access(path, R_OK | W_OK) == 0 || journal_refuse(path, "opened", errno);
    refuse_kind(path);
    return false;
}

/* Opens a regular file. Symbolic links are not followed: what they point at would be renamed or truncated. */
static int open_regular(const char *path)
{
    struct stat status;
    int file = open(path, O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0666);
    if (file >= 0 && fstat(file, &status) == 0 && S_ISREG(status.st_mode)) return file;
    if (file >= 0 || errno == EISDIR || errno == ELOOP)
        refuse_kind(path);
    else
        journal_refuse(path, "opened", errno);
    if (file >= 0) close(file);
    return -1;
}

static bool lock(const char *path, int file)
{
    if (journal_lock(file)) return true;
    user_error(path, 0,
               "another run is at work on this journal, wait for its end or choose another picture "
               "with output.image=FILE (and, where it is set, another output.journal)");
    return false;
}

/* Opens the file at path, creating it if need be, and locks it; -1 after saying why not. */
static int open_locked(const char *path)
{
    for (;;) {
        int file = open_regular(path);
        if (file < 0) return -1;
        if (!lock(path, file)) {
            close(file);
            return -1;
        }
        if (journal_is_at(path, file)) return file;
        close(file);
    }
}

/* ---- writing ---- */

/* Writes all bytes, or returns false with errno set; on a full disk a part may be written. */
static bool write_at(int file, const void *bytes, size_t count, uint64_t offset)
{
    while (count) {
        ssize_t put = pwrite(file, bytes, count, (off_t)offset);
        if (put < 0 && errno == EINTR) continue;
        if (put == 0) errno = ENOSPC;
        if (put <= 0) return false;
        bytes = (const char *)bytes + put;
        count -= (size_t)put;
        offset += (uint64_t)put;
    }
    return true;
}

/* Cuts off what follows the good bytes. */
static bool cut(struct journal *journal)
{
    if (!journal->torn) return true;
    if (ftruncate(journal->file, (off_t)journal->end) != 0) return false;
    journal->torn = false;
    return true;
}

/* Writes the header; what follows it stays. */
static bool write_header(struct journal *journal)
{
    struct file_header header = make_header(journal->picture);
    if (!write_at(journal->file, &header, sizeof header, 0))
        return journal_refuse(journal->path, "written", errno);
    journal->end = sizeof header;
    return true;
}

/* Reports the first failure only: later ones have the same cause. */
static void tell_failure(struct journal *journal, int error)
{
    if (!journal->told_failure)
        user_warning(journal->path, 0,
                     "the journal cannot be written (%s): rendering goes on, but what is finished "
                     "from now on is not saved until there is room",
                     strerror(error));
    journal->told_failure = true;
}

/* Assembles the record in the buffer; returns its bytes. */
static size_t pack(struct journal *journal, const struct journal_record *record)
{
    struct record_header header = {.magic = RECORD_MAGIC,
                                   .tile = record->tile,
                                   .seconds = record->seconds,
                                   .bytes = record->bytes};
    size_t bytes = sizeof header + record->bytes;
    if (bytes > journal->room) {
        journal->buffer = reallocate(journal->buffer, bytes, 1);
        journal->room = bytes;
    }
    header.checksum = record_checksum(journal->picture, journal->end, &header, record->payload);
    memcpy(journal->buffer, &header, sizeof header);
    memcpy(journal->buffer + sizeof header, record->payload, record->bytes);
    return bytes;
}

bool journal_append(struct journal *journal, const struct journal_record *record)
{
    size_t bytes = pack(journal, record);
    if (cut(journal) && write_at(journal->file, journal->buffer, bytes, journal->end)) {
        journal->end += bytes;
        journal->unsynced = true;
        return true;
    }
    int error = errno;
    journal->torn = true;
    cut(journal);
    tell_failure(journal, error);
    return false;
}

void journal_hush(struct journal *journal)
{
    journal->told_failure = true;
}

double journal_sync_pause(double cost)
{
    return fmax(SYNC_EVERY, cost / JOURNAL_SYNC_SHARE);
}

/* Without the folder, the death of the machine may take away the name of a new journal, and so all records. */
static void sync_now(struct journal *journal)
{
    if (!journal->unsynced) return;
    if (fdatasync(journal->file) != 0) tell_failure(journal, errno);
    journal->unsynced = false;
    if (!journal->folder_synced) sync_folder_of(journal->path);
    journal->folder_synced = true;
}

void journal_tick(struct journal *journal, double now)
{
    if (now < journal->next_sync) return;
    double start = clock_wall();
    sync_now(journal);
    double cost = clock_wall() - start;
    journal->next_sync = now + cost + journal_sync_pause(cost);
}

/* ---- reading ---- */

/* Marks the bytes from the end of the good ones to `here`, which are of no use, as a gap, so that they are not
 * reported again. If that cannot be written, they are. */
static void close_gap(const struct journal *journal, uint64_t here)
{
    struct record_header gap = {.magic = GAP_MAGIC};
    if (here - journal->end < sizeof gap) return;
    gap.bytes = here - journal->end - sizeof gap;
    gap.checksum = record_checksum(journal->picture, journal->end, &gap, NULL);
    write_at(journal->file, &gap, sizeof gap, journal->end);
}

static void read_records(struct journal *journal, uint64_t size,
                         const struct journal_reader *reader)
{
    struct journal_record record;
    struct journal_found *found = &journal->found;
    struct journal_scan *scan =
        journal_scan_begin(journal->file, size, journal->picture, reader->largest);
    uint64_t at = journal->end, skipped;
    while (journal_scan_next(scan, &at, &skipped, &record)) {
        uint64_t next = at + journal_record_bytes(record.bytes);
        found->damaged_bytes += skipped;
        if (reader->take(reader->state, &record)) {
            close_gap(journal, at);
            journal->end = next;
            found->records++;
        } else {
            found->refused_bytes += next - at;
        }
        at = next;
    }
    found->damaged_bytes += skipped;
    journal_scan_end(scan);
}

/* ---- from open to end ---- */

static struct journal *create(const char *path, uint64_t picture, int file)
{
    struct journal *journal = allocate_zeroed(1, sizeof *journal);
    journal->path = copy_text(path);
    journal->file = file;
    journal->picture = picture;
    journal->next_sync = clock_wall() + SYNC_EVERY;
    return journal;
}

/* Closing releases the locks. */
static void destroy(struct journal *journal)
{
    close(journal->file);
    if (journal->original) close(journal->original_file);
    free(journal->original);
    free(journal->path);
    free(journal->buffer);
    free(journal);
}

/* Whether the file holds a record of this picture, which is enough to tell whose journal it is. Only the place
 * of the first few records is searched: a file that is no journal may be large. */
static bool holds_record(const struct journal *journal, uint64_t size, size_t largest)
{
    uint64_t at = sizeof(struct file_header), skipped;
    uint64_t few = at + 4 * journal_record_bytes(largest);
    struct journal_record record;
    struct journal_scan *scan =
        journal_scan_begin(journal->file, size < few ? size : few, journal->picture, largest);
    bool found = journal_scan_next(scan, &at, &skipped, &record);
    journal_scan_end(scan);
    return found;
}

/* Frees space that was reserved by a run that was killed: it belongs to the file until that is truncated at its
 * end. */
static void give_back_room(const struct journal *journal)
{
    struct stat status;
    if (fstat(journal->file, &status) == 0) (void)!ftruncate(journal->file, status.st_size);
}

enum content {
    CONTENT_OURS,
    CONTENT_NONE, /* it is empty, or a header alone */
    CONTENT_OTHER,
    CONTENT_UNREAD
};

/* Classifies the file and sets *size, its bytes. *whole: its header is not damaged; *why: for CONTENT_OTHER,
 * what it is instead. */
static enum content recognise(const struct journal *journal, size_t largest, uint64_t *size,
                              bool *whole, const char **why)
{
    struct file_header ours = make_header(journal->picture), found = {0};
    struct stat status;
    errno = EIO; /* for a file that has become shorter meanwhile */
    if (fstat(journal->file, &status) != 0) return CONTENT_UNREAD;
    *size = (uint64_t)status.st_size;
    size_t bytes = *size < sizeof found ? (size_t)*size : sizeof found;
    if (!read_at(journal->file, &found, bytes, 0)) return CONTENT_UNREAD;
    *whole = memcmp(&found, &ours, bytes) == 0;
    /* Nothing but a header, or its beginning: from a run that was killed before it wrote anything. */
    bool is_bare = *size <= sizeof found;
    if (*whole) return is_bare ? CONTENT_NONE : CONTENT_OURS;
    struct file_header sealed = make_header(found.picture);
    if (memcmp(&found, &sealed, sizeof found) == 0) {
        if (is_bare) return CONTENT_NONE;
        give_back_room(journal);
        *why = "the journal holds another picture or other settings";
        return CONTENT_OTHER;
    }
    *why = "this is no journal, or its first bytes are damaged";
    return holds_record(journal, *size, largest) ? CONTENT_OURS : CONTENT_OTHER;
}

/* Reports bytes that cannot be used, and are rendered again. */
static void tell_unused(const struct journal *journal)
{
    const struct journal_found *found = &journal->found;
    if (found->damaged_bytes)
        user_warning(journal->path, 0,
                     "%llu bytes of the journal are damaged, what they held is rendered again",
                     (unsigned long long)found->damaged_bytes);
    if (found->refused_bytes)
        user_warning(journal->path, 0,
                     "%llu bytes of the journal cannot be used%s, what they hold is rendered again",
                     (unsigned long long)found->refused_bytes,
                     found->damaged_bytes ? " without those" : "");
}

static bool resume(struct journal *journal, uint64_t size, bool whole,
                   const struct journal_reader *reader)
{
    if (!whole) {
        user_warning(journal->path, 0,
                     "the first bytes of the journal are damaged, what stands behind them is used");
        if (!write_header(journal)) return false;
    }
    journal->end = sizeof(struct file_header);
    read_records(journal, size, reader);
    tell_unused(journal);
    /* Also where nothing follows the good bytes: room may have been reserved, see give_back_room(). */
    journal->torn = true;
    return cut(journal) || journal_refuse(journal->path, "shortened", errno);
}

bool journal_has_room(const struct journal *journal, uint64_t bytes)
{
    struct statvfs file_system;
    if (fstatvfs(journal->file, &file_system) != 0) return true;
    uint64_t room = (uint64_t)file_system.f_bavail * file_system.f_frsize;
    if (bytes <= room) return true;
    user_error(journal->path, 0,
               "the journal takes up to %.1f MB, but the disk has only %.1f MB left: free some "
               "space, or choose another place with output.journal=FILE (empty: none)",
               1e-6 * (double)bytes, 1e-6 * (double)room);
    return false;
}

/* Makes the open file the journal; false: it cannot. *again: to be opened again, as the file was renamed, or
 * another one took its name. */
static bool take_over(struct journal *journal, const struct journal_reader *reader, bool *again)
{
    uint64_t size, held;
    bool whole;
    const char *why = NULL;
    struct file_header header = make_header(journal->picture);
    switch (recognise(journal, reader->largest, &size, &whole, &why)) {
    case CONTENT_OURS:
        return resume(journal, size, whole, reader);
    case CONTENT_NONE:
        *again = journal_take_back(journal->path, &header, sizeof header);
        if (*again) return false;
        give_back_room(journal);
        return write_header(journal);
    case CONTENT_OTHER:
        held = journal_aside_bytes(journal->path, &header, sizeof header);
        if (held < reader->room && !journal_has_room(journal, reader->room - held)) return false;
        *again = journal_set_aside(journal->path, why);
        return false;
    case CONTENT_UNREAD:
        break;
    }
    return journal_refuse(journal->path, "read", errno);
}

struct journal *journal_open(const char *path, uint64_t picture,
                             const struct journal_reader *reader)
{
    bool again;
    do {
        again = false;
        int file = open_locked(path);
        if (file < 0) return NULL;
        struct journal *journal = create(path, picture, file);
        if (take_over(journal, reader, &again)) return journal;
        destroy(journal);
    } while (again);
    return NULL;
}

struct journal_found journal_found(const struct journal *journal)
{
    return journal->found;
}

bool journal_was_empty(const struct journal *journal)
{
    const struct journal_found *found = &journal->found;
    return found->records == 0 && found->damaged_bytes == 0 && found->refused_bytes == 0;
}

bool journal_is_bare(const struct journal *journal)
{
    return journal->end == sizeof(struct file_header);
}

const char *journal_path(const struct journal *journal)
{
    return journal->path;
}

uint64_t journal_record_bytes(size_t payload)
{
    return sizeof(struct record_header) + payload;
}

void journal_reserve(struct journal *journal, uint64_t bytes)
{
    fallocate(journal->file, FALLOC_FL_KEEP_SIZE, (off_t)journal->end, (off_t)bytes);
}

bool journal_exists(const struct journal *journal)
{
    return journal_is_at(journal->path, journal->file);
}

static bool copy_file(int from, int to, uint64_t bytes)
{
    char piece[65536];
    for (uint64_t done = 0; done < bytes;) {
        size_t count = bytes - done < sizeof piece ? (size_t)(bytes - done) : sizeof piece;
        if (!read_at(from, piece, count, done) || !write_at(to, piece, count, done)) return false;
        done += count;
    }
    return fdatasync(to) == 0;
}

/* Reserves space in a new file where that is possible; false: there certainly is no room. */
static bool has_room_for(int file, uint64_t bytes)
{
    struct rlimit most;
    if (getrlimit(RLIMIT_FSIZE, &most) == 0 && bytes > most.rlim_cur) return false;
    return fallocate(file, FALLOC_FL_KEEP_SIZE, 0, (off_t)bytes) == 0 ||
           (errno != ENOSPC && errno != EDQUOT);
}

static void remove_own(const char *path, int file)
{
    if (journal_is_at(path, file)) (void)unlink(path);
}

/* Lets go of the file that has been copied. It stays if it is the original; else it is a copy of this run's. */
static void leave_file(struct journal *journal)
{
    if (!journal->original) {
        journal->original = journal->path;
        journal->original_file = journal->file;
        return;
    }
    remove_own(journal->path, journal->file);
    close(journal->file);
    free(journal->path);
}

bool journal_move(struct journal *journal, const char *path, uint64_t more)
{
    int file = open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file < 0) return false;
    (void)journal_lock(file); /* it is new: nobody else has it */
    if (!has_room_for(file, journal->end + more) || !copy_file(journal->file, file, journal->end)) {
        unlink(path);
        close(file);
        return false;
    }
    sync_folder_of(path);
    journal->folder_synced = true;
    leave_file(journal);
    journal->file = file;
    journal->path = copy_text(path);
    journal->torn = false;
    return true;
}

/* Whether a file is in memory, and so lost with the death of the machine. */
static bool is_in_memory(int file)
{
    struct statfs system;
    return fstatfs(file, &system) == 0 &&
           (system.f_type == TMPFS_MAGIC || system.f_type == RAMFS_MAGIC);
}

void journal_remove_original(struct journal *journal)
{
    if (!journal->original || !journal_exists(journal)) return;
    if (is_in_memory(journal->file) && !is_in_memory(journal->original_file)) return;
    if (fdatasync(journal->file) != 0) return;
    journal->unsynced = false;
    remove_own(journal->original, journal->original_file);
}

const char *journal_original(const struct journal *journal)
{
    bool there = journal->original && journal_is_at(journal->original, journal->original_file);
    return there ? journal->original : NULL;
}

/* By cutting the file where it ends. */
void journal_give_back(struct journal *journal)
{
    journal->torn = true;
    cut(journal);
}

void journal_close(struct journal *journal)
{
    journal_give_back(journal);
    sync_now(journal);
    destroy(journal);
}

void journal_remove(struct journal *journal)
{
    if (journal_exists(journal) && unlink(journal->path) != 0)
        user_warning(journal->path, 0,
                     "the journal is of no use any more but cannot be removed: %s",
                     strerror(errno));
    destroy(journal);
}
