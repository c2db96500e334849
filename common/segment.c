#include "common/segment.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <limits.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "common/cores.h"
#include "common/hash.h"
#include "common/message.h"

/* Where the C library keeps what shm_open() makes. */
#define SEGMENTS_FOLDER "/dev/shm"

/* The same memory file system on the same running kernel, and the same namespace of process ids: of containers on one
 * machine, some have these in common and some have not. Hosts have names of their own, wherever they are. */
uint64_t segment_reach(void)
{
    struct berth berth;
    struct stat folder, processes;
    char host[HOST_NAME_MAX + 1] = "";
    berth_find(&berth);
    if (berth.machine[0] == '\0' || gethostname(host, HOST_NAME_MAX) != 0 ||
        stat(SEGMENTS_FOLDER, &folder) != 0 || stat("/proc/self/ns/pid", &processes) != 0)
        return 0;
    const uint64_t spaces[] = {folder.st_dev, processes.st_ino};
    uint64_t reach = hash64(berth.machine, sizeof berth.machine, 0);
    return hash64(spaces, sizeof spaces, hash64(host, sizeof host, reach));
}

uint64_t segment_key(void)
{
    uint64_t key;
    if (getrandom(&key, sizeof key, 0) != sizeof key)
        fatal("no random number can be had: %s", strerror(errno));
    return key;
}

#define NAME_FORMAT "/farm-%016" PRIx64

struct segment_name {
    char text[sizeof "/farm-" + 16];
};

static struct segment_name name_of(uint64_t key)
{
    struct segment_name name;
    snprintf(name.text, sizeof name.text, NAME_FORMAT, key);
    return name;
}

/* The file of the segment that has a name. */
static struct {
    char path[sizeof SEGMENTS_FOLDER + sizeof(struct segment_name)];
    atomic_bool there;
} named;

/* Writing to a segment that does not fit is a bus error. */
static void check_room(size_t bytes)
{
    struct statvfs file_system;
    if (statvfs(SEGMENTS_FOLDER, &file_system) != 0) return;
    uint64_t room = (uint64_t)file_system.f_bavail * file_system.f_frsize;
    if (room < bytes)
        fatal("the scene needs %.1f MB of shared memory, but " SEGMENTS_FOLDER
              " has only %.1f MB left: enlarge it (containers: --shm-size)",
              1e-6 * (double)bytes, 1e-6 * (double)room);
}

/* Closes the descriptor, which a mapping does not need. */
static void *map(int file, size_t bytes)
{
    void *segment = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (segment == MAP_FAILED)
        fatal("cannot map %.1f MB of shared memory: %s", 1e-6 * (double)bytes, strerror(errno));
    close(file);
    return segment;
}

void *segment_create(uint64_t key, size_t bytes)
{
    check_room(bytes);
    struct segment_name name = name_of(key);
    int file = shm_open(name.text, O_RDWR | O_CREAT | O_EXCL, 0600);
    if (file >= 0) {
        snprintf(named.path, sizeof named.path, "%s%s", SEGMENTS_FOLDER, name.text);
        atomic_store(&named.there, true);
    }
    if (file < 0 || ftruncate(file, (off_t)bytes) != 0)
        fatal("cannot create %.1f MB of shared memory: %s", 1e-6 * (double)bytes, strerror(errno));
    return map(file, bytes);
}

void *segment_open(uint64_t key, size_t *bytes)
{
    struct stat status;
    int file = shm_open(name_of(key).text, O_RDWR, 0);
    if (file < 0 || fstat(file, &status) != 0)
        fatal("cannot open the memory that this machine's processes share: %s", strerror(errno));
    *bytes = (size_t)status.st_size;
    return map(file, *bytes);
}

/* shm_unlink() may not be called by a signal handler. */
void segment_forget(void)
{
    if (atomic_exchange(&named.there, false)) unlink(named.path);
}

void segment_close(void *segment, size_t bytes)
{
    munmap(segment, bytes);
}
