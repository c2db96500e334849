#include "worker/segment.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/cores.h"
#include "common/hash.h"
#include "common/memory.h"
#include "common/message.h"

uint64_t segment_realm_hash(const struct segment_realm *realm)
{
    const uint64_t spaces[] = {realm->user, realm->ids, realm->users, realm->memory};
    uint64_t hash = hash64(spaces, sizeof spaces, hash64(realm->machine, sizeof realm->machine, 0));
    return hash ? hash : 1;
}

/* The inode number of a namespace; false if it is not known. */
static bool find_space(const char *path, uint64_t *space)
{
    struct stat status;
    if (stat(path, &status) != 0) return false;
    *space = status.st_ino;
    return true;
}

uint64_t segment_own_realm(void)
{
    struct affinity affinity;
    struct segment_realm realm = {.user = geteuid()};
    affinity_find(&affinity);
    _Static_assert(sizeof realm.machine == sizeof affinity.machine, "it is copied whole");
    memcpy(realm.machine, affinity.machine, sizeof realm.machine);
    if (realm.machine[0] == '\0' || prctl(PR_GET_DUMPABLE) != 1 ||
        !find_space("/proc/self/ns/pid", &realm.ids) ||
        !find_space("/proc/self/ns/user", &realm.users) ||
        !find_space("/proc/self/ns/ipc", &realm.memory))
        return 0;
    return segment_realm_hash(&realm);
}

/* The process id as others see it in /proc, which may belong to another pid namespace. */
static int32_t own_process(void)
{
    char text[16] = "";
    if (readlink("/proc/self", text, sizeof text - 1) < 0) return (int32_t)getpid();
    return (int32_t)strtol(text, NULL, 10);
}

struct segment_address segment_make(void)
{
    return (struct segment_address){own_process(), memfd_create("farm", MFD_CLOEXEC)};
}

static void *map(int file, size_t bytes)
{
    void *segment = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (segment == MAP_FAILED)
        fatal("cannot map %.1f MB of shared memory: %s", 1e-6 * (double)bytes, strerror(errno));
    return segment;
}

void *segment_extend(struct segment_address address, size_t bytes)
{
    if (!memory_holds(bytes)) fatal("out of memory: %zu bytes were needed", bytes);
    if (ftruncate(address.file, (off_t)bytes) != 0)
        fatal("cannot share %.1f MB of memory: %s", 1e-6 * (double)bytes, strerror(errno));
    return map(address.file, bytes);
}

static int open_file(struct segment_address address)
{
    char path[64];
    snprintf(path, sizeof path, "/proc/%d/fd/%d", address.process, address.file);
    return open(path, O_RDWR | O_CLOEXEC);
}

bool segment_opens(struct segment_address address)
{
    int file = open_file(address);
    if (file >= 0) close(file);
    return file >= 0;
}

void *segment_open(struct segment_address address, size_t *bytes)
{
    struct stat status;
    int file = open_file(address);
    if (file < 0 || fstat(file, &status) != 0)
        fatal("cannot open memory of process %d, its file %d: %s", address.process, address.file,
              strerror(errno));
    *bytes = (size_t)status.st_size;
    void *segment = map(file, *bytes);
    close(file);
    return segment;
}

void segment_release(struct segment_address address)
{
    if (address.file >= 0) close(address.file);
}

void segment_close(void *segment, size_t bytes)
{
    munmap(segment, bytes);
}
