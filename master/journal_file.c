#include "master/journal_file.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>

#include "common/message.h"

bool journal_lock(int file)
{
    struct flock whole = {.l_type = F_WRLCK, .l_whence = SEEK_SET};
    return fcntl(file, F_OFD_SETLK, &whole) == 0 || (errno != EAGAIN && errno != EACCES);
}

bool journal_is_at(const char *path, int file)
{
    struct stat ours, there;
    return fstat(file, &ours) == 0 && lstat(path, &there) == 0 && ours.st_dev == there.st_dev &&
           ours.st_ino == there.st_ino;
}

bool journal_refuse(const char *path, const char *what, int error)
{
    user_error(path, 0,
               "the journal cannot be %s: %s, choose another place with output.journal=FILE", what,
               strerror(error));
    return false;
}
